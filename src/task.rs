//! Tasks: what is to be reached, in which order, and whether a learner may train on it.
//!
//! # Input and output
//!
//! Drawn from a seed or imported from the authors' task file; written as `tasks.json` (schemas/tasks.schema.json).
//! The split is decided here and nowhere else.

mod check;
mod family;
mod file;
mod goal;
mod import;
mod order;
mod sampler;
mod set;
mod trial;

pub use family::{Bodies, Family, FrontView, Room, SlotKind};
pub use file::TaskFileError;
pub use goal::{Condition, Goal, SubTask, condition_holds, rests_on};
pub use import::{ImportError, ImportProblem, import};
pub use sampler::{SampleError, TaskPool, sample};
pub use set::{TaskSet, TaskSetError};
pub use trial::{Layout, Trial, initial_state, initial_state_on, scene, scene_on};

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A name that is not of the set that is asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown {kind} {word:?}; allowed: {allowed}")]
pub struct UnknownName {
    kind: &'static str,
    word: String,
    allowed: String,
}

impl UnknownName {
    /// For a word that is none of those allowed.
    pub(crate) fn new(kind: &'static str, word: &str, allowed: &[&str]) -> Self {
        Self { kind, word: word.to_owned(), allowed: allowed.join(", ") }
    }
}

impl FromStr for Family {
    type Err = UnknownName;

    fn from_str(word: &str) -> Result<Self, UnknownName> {
        let unknown = || UnknownName::new("task family", word, &Self::ALL.map(Self::name));
        Self::ALL.into_iter().find(|family| family.name() == word).ok_or_else(unknown)
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
        let unknown = || UnknownName::new("split", word, &Self::ALL.map(Self::name));
        Self::ALL.into_iter().find(|split| split.name() == word).ok_or_else(unknown)
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
    /// Families of blocks: only the first so many are within reach, from 2; the others stand aside. `None`: all of them, and in
    /// families without blocks.
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

    /// Counts of a trial: how many bodies slots show, in the order of slots. Of a category, what `draw` gives; of what
    /// stands aside unless it is asked for, 1 or 0; of blocks, 1 for each within reach and 0 for the others, where there
    /// are others. What is always there is not counted.
    pub fn counts(&self, mut draw: impl FnMut() -> u16) -> Vec<u16> {
        let is_brought = |slot: usize| self.goals.iter().any(|goal| usize::from(goal.source.0) == slot);
        let mut counts = Vec::new();
        for (kind, slots) in self.family.kinds_with_slots() {
            for (number, slot) in slots.enumerate() {
                counts.extend(match kind.bodies {
                    Bodies::One => None,
                    Bodies::OneWithinReach => self.blocks.map(|blocks| u16::from(number < usize::from(blocks))),
                    Bodies::OneIfAsked => Some(u16::from(is_brought(slot))),
                    Bodies::Many { .. } => Some(draw()),
                });
            }
        }
        counts
    }

    /// How many bowls it asks for; 0 in families without.
    pub fn n_bowls(&self) -> u16 {
        let bodies = |slot| self.family.kind(slot).map(|kind| kind.bodies);
        let is_bowl = |goal: &&Goal| bodies(goal.source) == Some(Bodies::OneIfAsked);
        self.goals.iter().filter(is_bowl).count() as u16
    }

    /// Things of the tallest tower; 0 in families that build none.
    pub fn tallest(&self) -> u16 {
        let towers = if self.family.builds_towers() { order::towers(&self.goals) } else { Vec::new() };
        towers.iter().map(|tower| tower.len() as u16 + 1).max().unwrap_or(0)
    }

    /// The task in a sentence.
    pub fn text(&self) -> String {
        let name = |slot| self.family.slot_name(slot);
        let part = |goal: &Goal| goal.brings_about(self.family).in_words(name(goal.source), name(goal.target));
        self.goals.iter().map(part).collect::<Vec<_>>().join(", then ")
    }

    /// A task whose conditions are what its goals bring about.
    fn of_goals(id: String, family: Family, goals: Vec<Goal>, split: Split) -> Self {
        let conditions = goals.iter().map(|goal| goal.brings_about(family)).collect();
        Self { id, family, goals, conditions, split, blocks: None }
    }
}
