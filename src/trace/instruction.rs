//! Instructions: a task specification in words, one templated sentence for each call that calls primitives.
//!
//! # Source
//!
//! Paper, section III: a task specification may be "a list of language instructions". The templates are ours.

use crate::program::Program;
use crate::scene::Slot;
use crate::trace::{CallId, ProgramCall, Span};

/// The most words of a sentence.
pub const MAX_WORDS: usize = 3;

/// What the sentences begin with, by program.
const VERBS: [(Program, &[&str]); 3] =
    [(Program::Pick, &["pick"]), (Program::Place, &["place", "on"]), (Program::Drop, &["drop", "into"])];

/// A sentence as numbers of words in a [`Vocabulary`], from 1; 0 behind its end.
pub type Words = [u16; MAX_WORDS];

/// One sentence of a specification, and the call that it stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// The call.
    pub call: CallId,
    /// The sentence.
    pub words: Words,
}

/// The words that instructions are made of: the templates' own and the names of slots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vocabulary(Vec<String>);

/// A sentence that is not made of the vocabulary's words.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem} in the instruction {sentence:?}; allowed are at most {MAX_WORDS} words of: {}", allowed.join(", "))]
pub struct InstructionError {
    sentence: String,
    problem: String,
    allowed: Vec<String>,
}

impl Vocabulary {
    /// The vocabulary for slots of these names.
    pub fn new<'n>(slots: impl IntoIterator<Item = &'n str>) -> Self {
        let verbs = VERBS.iter().flat_map(|(_, words)| *words).copied();
        Self(verbs.chain(slots).map(str::to_owned).collect())
    }

    /// How many words a vocabulary for so many slots has, the empty word counted in.
    pub fn size(n_slots: usize) -> usize {
        1 + VERBS.iter().map(|(_, words)| words.len()).sum::<usize>() + n_slots
    }

    /// A sentence as numbers.
    ///
    /// # Errors
    ///
    /// [`InstructionError`] for a word that is not of the vocabulary, for none and for too many.
    pub fn words(&self, sentence: &str) -> Result<Words, InstructionError> {
        let refuse =
            |problem: String| InstructionError { sentence: sentence.to_owned(), problem, allowed: self.0.clone() };
        let mut words = Words::default();
        let mut n_words = 0;
        for word in sentence.split_whitespace() {
            let known = self.0.iter().position(|known| known == word);
            let known = known.ok_or_else(|| refuse(format!("unknown word {word:?}")))?;
            *words.get_mut(n_words).ok_or_else(|| refuse("too many words".to_owned()))? = known as u16 + 1;
            n_words += 1;
        }
        if n_words == 0 { Err(refuse("no word".to_owned())) } else { Ok(words) }
    }
}

/// The sentence for a call of `calls` that calls a `move_to` itself; nothing for any other. `name` names its argument.
pub fn sentence<'n>(calls: &[ProgramCall], position: usize, name: impl Fn(usize) -> &'n str) -> Option<String> {
    let (verb, slot) = words_of(calls, position)?;
    Some(format!("{} {}", verb.join(" "), name(slot)))
}

/// Whether `said` is the [`sentence`] for a call, without making one.
pub(crate) fn is_sentence<'n>(
    said: Option<&str>,
    calls: &[ProgramCall],
    position: usize,
    name: impl Fn(usize) -> &'n str,
) -> bool {
    match (said, words_of(calls, position)) {
        (None, None) => true,
        (Some(said), Some((verb, slot))) => {
            let rest = verb.iter().try_fold(said, |rest, word| rest.strip_prefix(word)?.strip_prefix(' '));
            rest == Some(name(slot))
        }
        _ => false,
    }
}

/// The words for what a call does, and the slot that it does it to.
fn words_of(calls: &[ProgramCall], position: usize) -> Option<(&'static [&'static str], usize)> {
    let call = calls.get(position)?;
    let (_, verb) = VERBS.iter().find(|(program, _)| *program == call.program)?;
    let below = calls[position + 1..].iter().take_while(|other| other.depth > call.depth);
    let slot = below.filter(|other| other.caller == Some(call.id)).find_map(|other| other.argument)?;
    Some((verb, usize::from(slot.0)))
}

/// What an episode's calls say in words.
pub fn instructions(calls: &[ProgramCall], slots: &[Slot]) -> Vec<Instruction> {
    let vocabulary = Vocabulary::new(slots.iter().map(|slot| slot.name.as_str()));
    let name = |slot: usize| slots.get(slot).map_or("", |slot| &slot.name);
    let instruction = |(position, call): (usize, &ProgramCall)| {
        let words = vocabulary.words(&sentence(calls, position, name)?).ok()?;
        Some(Instruction { call: call.id, words })
    };
    calls.iter().enumerate().filter_map(instruction).collect()
}

/// For each call the instructions of what it calls, itself included, as a span of the list of instructions. Nothing
/// for calls below those that have one.
pub fn instruction_spans(calls: &[ProgramCall], instructions: &[Instruction]) -> Vec<Option<Span>> {
    let span = |(position, call): (usize, &ProgramCall)| {
        let below = calls[position + 1..].iter().take_while(|other| other.depth > call.depth).count();
        let until = |end: usize| instructions.partition_point(|instruction| (instruction.call.0 as usize) < end) as u32;
        Span::new(until(position), until(position + below + 1))
    };
    calls.iter().enumerate().map(span).collect()
}
