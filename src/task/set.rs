//! A set of tasks with its split, and its file.

use crate::task::{Family, Task};

/// A family's tasks.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskSet {
    /// Their family.
    pub family: Family,
    /// All tasks, training tasks first.
    pub tasks: Vec<Task>,
}

/// A task set that breaks a rule.
#[derive(Debug, thiserror::Error)]
#[error("placeholder")]
pub struct TaskSetError;
