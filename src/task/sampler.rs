//! Draws the tasks of a family.
//!
//! # Invariants
//!
//! A task depends on the seed and on its place in its split alone. So the first 20 of 1000 training tasks are the 20
//! training tasks of a smaller experiment, and every experiment of one seed is measured on the same unseen tasks.

use crate::seed::Seed;
use crate::task::{Family, Split, TaskSet};

/// Fewer tasks can be drawn than asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{} has at most {limit} {split} tasks to draw, {asked} were asked for", family.name())]
pub struct SampleError {
    /// Of which family.
    pub family: Family,
    /// In which split.
    pub split: Split,
    /// How many were asked for.
    pub asked: u32,
    /// How many there are.
    pub limit: u32,
}

/// What tasks are drawn from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TaskPool {
    /// Their family.
    pub family: Family,
    /// See [`Task::blocks`].
    pub blocks: Option<u16>,
}

impl From<Family> for TaskPool {
    fn from(family: Family) -> Self {
        Self { family, blocks: None }
    }
}

impl TaskPool {
    /// How many training tasks there are at most, and how many unseen ones beside `train` of them. Where the two
    /// splits are fixed, `train` makes no difference.
    pub fn limits(self, train: u32) -> (u32, u32) {
        (self.family.spec().sampler.limits)(self, train)
    }
}

/// Draws tasks with distinct end configurations: `train` of them to train on, then `unseen` held-out ones.
///
/// # Errors
///
/// When there are not as many.
pub fn sample(pool: impl Into<TaskPool>, train: u32, unseen: u32, seed: Seed) -> Result<TaskSet, SampleError> {
    let pool: TaskPool = pool.into();
    let family = pool.family;
    let (train_limit, unseen_limit) = pool.limits(train);
    for (split, asked, limit) in [(Split::Seen, train, train_limit), (Split::Unseen, unseen, unseen_limit)] {
        if asked > limit {
            return Err(SampleError { family, split, asked, limit });
        }
    }
    let tasks = (family.spec().sampler.sample)(pool, train as usize, unseen as usize, seed);
    Ok(TaskSet { family, tasks })
}
