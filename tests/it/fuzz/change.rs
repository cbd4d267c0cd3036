//! Random damage to a file: bits, bytes, pieces, numbers.

use proptest::collection::vec;
use proptest::prelude::{Just, Strategy, any, prop_oneof};

/// Numbers at which readers tend to break.
const NUMBERS: [&str; 14] = [
    "0",
    "-1",
    "1",
    "255",
    "256",
    "65536",
    "2147483648",
    "4294967296",
    "1099511627776",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1e308",
    "0.5",
];

/// One piece of damage. Places are shares of the file's length, so that one damage fits every file.
#[derive(Clone, Debug)]
pub(crate) enum Change {
    Flip { at: u32, bit: u8 },
    Put { at: u32, byte: u8 },
    Cut { at: u32 },
    Insert { at: u32, bytes: Vec<u8> },
    Remove { at: u32, length: u8 },
    Repeat { at: u32, length: u8 },
    Blank { at: u32, length: u8 },
    Number { at: u32, choice: usize },
}

/// One to three pieces of damage.
pub(crate) fn changes() -> impl Strategy<Value = Vec<Change>> {
    let at = any::<u32>;
    let change = prop_oneof![
        3 => (at(), 0..8_u8).prop_map(|(at, bit)| Change::Flip { at, bit }),
        2 => (at(), any::<u8>()).prop_map(|(at, byte)| Change::Put { at, byte }),
        1 => at().prop_map(|at| Change::Cut { at }),
        1 => (at(), vec(any::<u8>(), 1..9)).prop_map(|(at, bytes)| Change::Insert { at, bytes }),
        1 => (at(), 1..65_u8).prop_map(|(at, length)| Change::Remove { at, length }),
        1 => (at(), 1..65_u8).prop_map(|(at, length)| Change::Repeat { at, length }),
        1 => (at(), 1..65_u8).prop_map(|(at, length)| Change::Blank { at, length }),
        2 => (at(), 0..NUMBERS.len()).prop_map(|(at, choice)| Change::Number { at, choice }),
    ];
    vec(change, 1..4)
}

/// Damage to a file of text: mostly to its numbers and lines.
pub(crate) fn changes_of_text() -> impl Strategy<Value = Vec<Change>> {
    let number = || (any::<u32>(), 0..NUMBERS.len()).prop_map(|(at, choice)| Change::Number { at, choice });
    prop_oneof![changes(), vec(number(), 1..3), Just(Vec::new())]
}

/// The file after the damage.
pub(crate) fn changed(original: &[u8], changes: &[Change]) -> Vec<u8> {
    let mut bytes = original.to_vec();
    changes.iter().for_each(|change| apply(&mut bytes, change));
    bytes
}

fn apply(bytes: &mut Vec<u8>, change: &Change) {
    if bytes.is_empty() {
        return;
    }
    let place = |at: u32| ((u64::from(at) * bytes.len() as u64) >> 32) as usize;
    let piece = |at: u32, length: u8| place(at)..(place(at) + usize::from(length)).min(bytes.len());
    match change {
        Change::Flip { at, bit } => {
            let at = place(*at);
            bytes[at] ^= 1 << bit;
        }
        Change::Put { at, byte } => {
            let at = place(*at);
            bytes[at] = *byte;
        }
        Change::Cut { at } => bytes.truncate(place(*at)),
        Change::Insert { at, bytes: new } => {
            let at = place(*at);
            bytes.splice(at..at, new.iter().copied());
        }
        Change::Remove { at, length } => drop(bytes.drain(piece(*at, *length))),
        Change::Repeat { at, length } => {
            let piece = piece(*at, *length);
            let again = bytes[piece.clone()].to_vec();
            bytes.splice(piece.end..piece.end, again);
        }
        Change::Blank { at, length } => {
            let piece = piece(*at, *length);
            bytes[piece].fill(0);
        }
        Change::Number { at, choice } => put_number(bytes, place(*at), NUMBERS[*choice]),
    }
}

/// Puts a number in the place of the next one that is written in digits.
fn put_number(bytes: &mut Vec<u8>, from: usize, number: &str) {
    let Some(begin) = bytes[from..].iter().position(u8::is_ascii_digit).map(|at| from + at) else { return };
    let length = bytes[begin..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    bytes.splice(begin..begin + length, number.bytes());
}
