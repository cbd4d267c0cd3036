//! A set of tasks with its split, and the rules it keeps.
//!
//! # Errors
//!
//! Every broken rule has a name and a place, as `tasks[12].goals[3]`, counted from 0.

use crate::scene::SlotIndex;
use crate::task::check::check;
use crate::task::{Family, Split, Task};

/// A family's tasks.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskSet {
    /// Their family.
    pub family: Family,
    /// All tasks, training tasks first.
    pub tasks: Vec<Task>,
}

impl TaskSet {
    /// The tasks of one split, in order.
    pub fn of_split(&self, split: Split) -> impl Iterator<Item = &Task> {
        self.tasks.iter().filter(move |task| task.split == split)
    }

    /// The task of an id.
    pub fn find(&self, id: &str) -> Option<&Task> {
        self.tasks.iter().find(|task| task.id == id)
    }

    /// Checks every rule: ids are unique, slots exist, are of the right kind and within reach, nothing is brought to itself or
    /// brought twice, towers grow from below, every condition is what a goal brings about, training tasks come first,
    /// and no unseen task asks for what a training task asks for.
    ///
    /// # Errors
    ///
    /// The first broken rule, with its place.
    pub fn validate(&self) -> Result<(), TaskSetError> {
        check(self)
    }
}

/// A task set that breaks a rule.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TaskSetError {
    /// Two tasks have one id.
    #[error("tasks[{second}].id: {id:?} is already the id of tasks[{first}]")]
    DuplicateId {
        /// The id.
        id: String,
        /// The earlier task.
        first: usize,
        /// The later task.
        second: usize,
    },
    /// A task is of another family than its set.
    #[error("tasks[{task}]: is of family {}, the set is of {}", found.name(), expected.name())]
    OtherFamily {
        /// Which task.
        task: usize,
        /// Its family.
        found: Family,
        /// The set's family.
        expected: Family,
    },
    /// A task has no goals or no conditions, so it is reached before it begins.
    #[error("tasks[{task}]: has no {what}")]
    Empty {
        /// Which task.
        task: usize,
        /// `goals` or `conditions`.
        what: &'static str,
    },
    /// A slot that the scene does not have.
    #[error("{place}: slot {} does not exist, the scene has {n_slots}", slot.0)]
    SlotOutOfRange {
        /// Where it is named.
        place: String,
        /// Its number.
        slot: SlotIndex,
        /// How many there are.
        n_slots: usize,
    },
    /// A slot that cannot play this part.
    #[error("{place}: {slot} is not a {expected}")]
    WrongKind {
        /// Where it is named.
        place: String,
        /// The slot's name.
        slot: String,
        /// What is allowed.
        expected: String,
    },
    /// A number of blocks that cannot be within reach.
    #[error(
        "tasks[{task}].blocks: is {blocks}; allowed in {} is {}",
        family.name(),
        family.max_blocks().map_or("none".to_owned(), |most| format!("2 to {}, or none for all {most}", most - 1))
    )]
    Blocks {
        /// Which task.
        task: usize,
        /// The number.
        blocks: u16,
        /// The task's family.
        family: Family,
    },
    /// A block that stands aside is to be moved, or built on.
    #[error("{place}: {slot} stands aside, only the first {blocks} blocks are within reach")]
    Aside {
        /// Which goal.
        place: String,
        /// The slot's name.
        slot: String,
        /// How many blocks are within reach.
        blocks: u16,
    },
    /// Something is to be brought to itself.
    #[error("{place}: {slot} is its own target")]
    OwnTarget {
        /// Which goal.
        place: String,
        /// The slot's name.
        slot: String,
    },
    /// Something is brought twice.
    #[error("{place}: {slot} is already moved by goals[{first}]")]
    MovedTwice {
        /// The later goal.
        place: String,
        /// The slot's name.
        slot: String,
        /// The earlier goal.
        first: usize,
    },
    /// Two things are put on one.
    #[error("{place}: goals[{first}] already puts something on {slot}")]
    TargetTaken {
        /// The later goal.
        place: String,
        /// What is below.
        slot: String,
        /// The earlier goal.
        first: usize,
    },
    /// Things stand on each other in a ring.
    #[error("tasks[{task}]: {} stand on each other in a ring", slots.join(", "))]
    Cycle {
        /// Which task.
        task: usize,
        /// The ring, from the top down.
        slots: Vec<String>,
    },
    /// Something is built on before it is in its place.
    #[error("{place}: {slot} is built on, but goals[{later}] moves it afterwards; towers grow from below")]
    TargetMovedLater {
        /// The goal that builds on it.
        place: String,
        /// What is below.
        slot: String,
        /// The goal that moves it.
        later: usize,
    },
    /// A condition that no goal brings about.
    #[error("{place}: no goal brings this about")]
    ConditionWithoutGoal {
        /// Which condition.
        place: String,
    },
    /// A training task stands behind an unseen one.
    #[error("tasks[{task}]: is a training task behind an unseen one; training tasks come first")]
    SeenAfterUnseen {
        /// Which task.
        task: usize,
    },
    /// An unseen task is not unseen.
    #[error("tasks[{unseen}]: {unseen_id} is unseen but asks for the same as training task {seen_id}, tasks[{seen}]")]
    SplitLeak {
        /// The unseen task.
        unseen: usize,
        /// Its id.
        unseen_id: String,
        /// The training task.
        seen: usize,
        /// Its id.
        seen_id: String,
    },
}
