//! The vocabulary of programs: what the hierarchy's nodes are called and which of them move the robot.
//!
//! # Source
//!
//! Paper, section III ("Scaling up NTP with APIs") and figure 3. `none` is ours: it lets a program end without a last
//! call, which Algorithm 1 as printed cannot.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

/// A node of the program hierarchy. The order is the order of the program memory's rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Program {
    /// No call: the step only ends its program.
    None,
    /// Root of Block Stacking.
    BlockStacking,
    /// Root of Object Sorting.
    ObjectSorting,
    /// Puts one thing on another.
    PickAndPlace,
    /// Puts one object into a container.
    PickAndDrop,
    /// Moves to an object and grips it.
    Pick,
    /// Moves above an object and sets down on it what is held.
    Place,
    /// Moves above a container and drops into it what is held.
    Drop,
    /// Primitive: moves the gripper to hover above an object.
    MoveTo,
    /// Primitive: goes down and closes the fingers.
    Grip,
    /// Primitive: sets down or drops what is held and opens the fingers.
    Release,
    /// Root of Table Clean-up.
    TableCleanup,
    /// Root of Kitting.
    Kitting,
}

impl Program {
    /// Every program, in the order of the program memory.
    pub const ALL: [Self; 13] = [
        Self::None,
        Self::BlockStacking,
        Self::ObjectSorting,
        Self::PickAndPlace,
        Self::PickAndDrop,
        Self::Pick,
        Self::Place,
        Self::Drop,
        Self::MoveTo,
        Self::Grip,
        Self::Release,
        Self::TableCleanup,
        Self::Kitting,
    ];

    /// The root that stands for all where the roots of all families are one program.
    pub const ANY_ROOT: Self = Self::BlockStacking;

    /// The name in files and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::BlockStacking => "block_stacking",
            Self::ObjectSorting => "object_sorting",
            Self::PickAndPlace => "pick_and_place",
            Self::PickAndDrop => "pick_and_drop",
            Self::Pick => "pick",
            Self::Place => "place",
            Self::Drop => "drop",
            Self::MoveTo => "move_to",
            Self::Grip => "grip",
            Self::Release => "release",
            Self::TableCleanup => "table_cleanup",
            Self::Kitting => "kitting",
        }
    }

    /// The colour in which viewers and pictures show its calls.
    pub fn color(self) -> [u8; 3] {
        match self {
            Self::None => [120, 120, 120],
            Self::PickAndPlace | Self::PickAndDrop => [126, 87, 194],
            Self::Pick => [38, 150, 140],
            Self::Place | Self::Drop => [205, 133, 63],
            Self::MoveTo => [79, 165, 235],
            Self::Grip => [92, 170, 96],
            Self::Release => [214, 84, 120],
            _root => [84, 110, 168],
        }
    }

    /// Row in the program memory.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The program of a memory row, if there is one.
    pub fn from_index(index: usize) -> Option<Self> {
        Self::ALL.get(index).copied()
    }

    /// Whether it moves the robot (the paper's API).
    pub fn is_primitive(self) -> bool {
        matches!(self, Self::MoveTo | Self::Grip | Self::Release)
    }

    /// Whether it calls other programs.
    pub fn is_composite(self) -> bool {
        !self.is_primitive() && self != Self::None
    }

    /// Whether it is the root of a family's call trees.
    pub fn is_root(self) -> bool {
        self.is_composite() && self.n_slots() == 0
    }

    /// How many slots it is about: what is moved and where to, where a call has to name them both.
    pub fn n_slots(self) -> usize {
        match self {
            Self::None
            | Self::BlockStacking
            | Self::ObjectSorting
            | Self::TableCleanup
            | Self::Kitting
            | Self::Grip
            | Self::Release => 0,
            Self::Pick | Self::Place | Self::Drop | Self::MoveTo => 1,
            Self::PickAndPlace | Self::PickAndDrop => 2,
        }
    }

    /// Whether a call takes a slot as its argument.
    pub fn takes_argument(self) -> bool {
        self == Self::MoveTo
    }
}

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is no program.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown program {word:?}; programs are {}", Program::ALL.map(Program::name).join(", "))]
pub struct UnknownProgram {
    /// The word as read.
    pub word: String,
}

impl FromStr for Program {
    type Err = UnknownProgram;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        Self::ALL
            .into_iter()
            .find(|program| program.name() == word)
            .ok_or_else(|| UnknownProgram { word: word.to_owned() })
    }
}

/// The programs that a file or a model knows: the first so many of [`Program::ALL`].
///
/// # Invariants
///
/// [`Program::ALL`] only ever grows at its end. So what was written before a program was there is read as ever, and a
/// family whose programs were there is written as ever.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct KnownPrograms {
    n: usize,
}

impl KnownPrograms {
    /// Those of the first files.
    pub const FIRST: Self = Self { n: 12 };
    /// All that there are.
    pub const ALL: Self = Self { n: Program::ALL.len() };

    /// The fewest that hold a program.
    pub fn up_to(program: Program) -> Self {
        Self { n: program.index() + 1 }.max(Self::FIRST)
    }

    /// Those of a hash that a file tells; nothing for programs of which this version knows nothing.
    pub fn of_hash(hash: &str) -> Option<Self> {
        (Self::FIRST.n..=Self::ALL.n).map(|n| Self { n }).find(|known| known.hash() == hash)
    }

    /// The programs, in the order of the program memory.
    pub fn programs(self) -> &'static [Program] {
        const ALL: &[Program] = &Program::ALL;
        &ALL[..self.n]
    }

    /// Their names, in order.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        self.programs().iter().map(|program| program.name())
    }

    /// How many there are.
    pub fn count(self) -> usize {
        self.n
    }

    /// Hash of names and order.
    pub fn hash(self) -> String {
        let names = self.names().collect::<Vec<_>>().join("\n");
        let digest = Sha256::digest(names.as_bytes());
        digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Files and models tell this hash: the programs before it must stay as they are, in this order.
    #[test]
    fn programs_are_only_added_at_the_end() {
        assert_eq!(KnownPrograms::FIRST.hash(), "bdf60fa5c571ee0a");
    }

    #[test]
    fn what_knows_fewer_programs_is_known_by_its_hash() {
        for known in [KnownPrograms::FIRST, KnownPrograms::ALL] {
            assert_eq!(KnownPrograms::of_hash(&known.hash()), Some(known));
        }
        assert_eq!(KnownPrograms::of_hash("0123456789abcdef"), None);
        assert_eq!(KnownPrograms::up_to(Program::BlockStacking), KnownPrograms::FIRST);
        assert_eq!(KnownPrograms::up_to(Program::ALL[Program::ALL.len() - 1]), KnownPrograms::ALL);
    }
}
