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
}

impl Program {
    /// Every program, in the order of the program memory.
    pub const ALL: [Self; 12] = [
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
    ];

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

    /// How many slots it is about: what is moved and where to, where a call has to name them both.
    pub fn n_slots(self) -> usize {
        match self {
            Self::None
            | Self::BlockStacking
            | Self::ObjectSorting
            | Self::TableCleanup
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

/// Hash of names and order: a model runs only on the vocabulary it was trained with.
pub fn vocabulary_hash() -> String {
    let names = Program::ALL.map(Program::name).join("\n");
    let digest = Sha256::digest(names.as_bytes());
    digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect()
}
