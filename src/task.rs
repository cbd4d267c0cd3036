//! Tasks: what is to be reached, in which order, and whether a learner may train on it.
//!
//! # Input and output
//!
//! Drawn from a seed or imported from the authors' task file; written as `tasks.json` (schemas/tasks.schema.json).
//! The split is decided here and nowhere else.

mod check;
mod file;
mod goal;
mod import;
mod layout;
mod order;
mod sampler;
mod set;

pub use file::TaskFileError;
pub use goal::{Condition, Goal, condition_holds, rests_on};
pub use import::{ImportError, ImportProblem, import};
pub use layout::{CONTAINER_HALF_M, Trial, initial_state, scene};
pub use sampler::{SampleError, TaskPool, sample};
pub use set::{TaskSet, TaskSetError};

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::program::{KnownPrograms, Program};
use crate::scene::SlotIndex;

/// A kind of task: its objects, its programs, its goal conditions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    /// Eight lettered blocks are stacked into towers.
    BlockStacking,
    /// Objects of four categories are put into four containers.
    ObjectSorting,
    /// Bowls are stacked on a tray and forks put into the topmost; the tray is carried away.
    TableCleanup,
}

impl Family {
    /// Every family.
    pub const ALL: [Self; 3] = [Self::BlockStacking, Self::ObjectSorting, Self::TableCleanup];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::BlockStacking => "block_stacking",
            Self::ObjectSorting => "object_sorting",
            Self::TableCleanup => "table_cleanup",
        }
    }

    /// The start of suite names: `stacking_unseen`, `sorting_unseen`, `cleanup_unseen`.
    pub fn short_name(self) -> &'static str {
        match self {
            Self::BlockStacking => "stacking",
            Self::ObjectSorting => "sorting",
            Self::TableCleanup => "cleanup",
        }
    }

    /// The program at the root of its call trees.
    pub fn root_program(self) -> Program {
        match self {
            Self::BlockStacking => Program::BlockStacking,
            Self::ObjectSorting => Program::ObjectSorting,
            Self::TableCleanup => Program::TableCleanup,
        }
    }

    /// The programs that its recordings, datasets and models know.
    pub fn programs(self) -> KnownPrograms {
        KnownPrograms::up_to(self.root_program())
    }

    /// How many slots its scenes have.
    pub fn n_slots(self) -> usize {
        match self {
            Self::BlockStacking | Self::ObjectSorting => 8,
            Self::TableCleanup => 6,
        }
    }

    /// The most instances of one category that the table holds; nothing for a family without categories.
    pub fn max_instances(self) -> Option<u16> {
        match self {
            Self::BlockStacking => None,
            Self::ObjectSorting => Some(layout::MAX_INSTANCES),
            Self::TableCleanup => Some(layout::cleanup::MAX_FORKS),
        }
    }

    /// The most blocks that a task can have within reach; nothing for a family without blocks.
    pub fn max_blocks(self) -> Option<u16> {
        (self == Self::BlockStacking).then_some(layout::stacking::N_BLOCKS)
    }

    /// The most bowls that a task can ask for; nothing for a family without bowls.
    pub fn max_bowls(self) -> Option<u16> {
        (self == Self::TableCleanup).then_some(layout::cleanup::N_BOWLS)
    }

    /// The slot of what is carried away in the end, if anything is.
    pub fn tray(self) -> Option<SlotIndex> {
        (self == Self::TableCleanup).then_some(layout::cleanup::TRAY)
    }
}

/// A name that is not of the set that is asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown {kind} {word:?}; allowed: {allowed}")]
pub struct UnknownName {
    kind: &'static str,
    word: String,
    allowed: String,
}

impl FromStr for Family {
    type Err = UnknownName;

    fn from_str(word: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|family| family.name() == word).ok_or_else(|| UnknownName {
            kind: "task family",
            word: word.to_owned(),
            allowed: Self::ALL.map(Self::name).join(", "),
        })
    }
}

/// Whether a task may be trained on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Split {
    /// A training task.
    Seen,
    /// Held out: its end configuration occurs in no training task.
    Unseen,
}

impl Split {
    /// Every split.
    pub const ALL: [Self; 2] = [Self::Seen, Self::Unseen];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Seen => "seen",
            Self::Unseen => "unseen",
        }
    }
}

impl fmt::Display for Split {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Split {
    type Err = UnknownName;

    fn from_str(word: &str) -> Result<Self, UnknownName> {
        Self::ALL.into_iter().find(|split| split.name() == word).ok_or_else(|| UnknownName {
            kind: "split",
            word: word.to_owned(),
            allowed: Self::ALL.map(Self::name).join(", "),
        })
    }
}

/// What is to be reached and in which order.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Unique in its set, e.g. `stack_0012`.
    pub id: String,
    /// Its kind.
    pub family: Family,
    /// The sub-tasks in the order of the demonstration.
    pub goals: Vec<Goal>,
    /// What must hold in the end.
    pub conditions: Vec<Condition>,
    /// Whether it may be trained on.
    pub split: Split,
    /// Block Stacking: only the first so many blocks are within reach, 2 to 7; the others stand aside. `None`: all of
    /// them, and in families without blocks.
    pub blocks: Option<u16>,
}

impl Task {
    /// The end configuration in a form that does not depend on order: equal for two tasks exactly when they ask for
    /// the same. The split is checked on it.
    pub fn canonical_goal(&self) -> Vec<Condition> {
        let mut conditions = self.conditions.clone();
        conditions.sort_unstable();
        conditions.dedup();
        conditions
    }

    /// Counts of a trial, with what `draw` gives for each category; empty for a family without. Of Table Clean-up 1 for
    /// each bowl that is asked for and 0 for the others, then the forks; of Block Stacking 1 for each block within reach
    /// and 0 for the others, where there are others.
    pub fn counts(&self, mut draw: impl FnMut() -> u16) -> Vec<u16> {
        let is_asked_for = |bowl: u16| u16::from(self.goals.iter().any(|goal| goal.source == SlotIndex(bowl)));
        match self.family {
            Family::BlockStacking => self.blocks.map_or_else(Vec::new, layout::stacking::counts),
            Family::ObjectSorting => (0..check::N_CATEGORIES).map(|_| draw()).collect(),
            Family::TableCleanup => (0..layout::cleanup::N_BOWLS).map(is_asked_for).chain([draw()]).collect(),
        }
    }

    /// How many bowls it asks for; 0 in families without.
    pub fn n_bowls(&self) -> u16 {
        let is_bowl = |goal: &&Goal| goal.source.0 < self.family.max_bowls().unwrap_or(0);
        self.goals.iter().filter(is_bowl).count() as u16
    }

    /// The task in a sentence.
    pub fn text(&self) -> String {
        let slot = |index: SlotIndex| layout::slot_name(self.family, index);
        let part = |goal: &Goal| match goal.brings_about(self.family) {
            Condition::OnTop { upper, lower } => format!("put {} on {}", slot(upper), slot(lower)),
            Condition::Inside { category, container } => {
                format!("put every {} into {}", slot(category), slot(container))
            }
        };
        self.goals.iter().map(part).collect::<Vec<_>>().join(", then ")
    }
}
