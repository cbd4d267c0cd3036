//! Draws the tasks of a family.

use crate::seed::Seed;
use crate::task::{Family, TaskSet};

/// Fewer tasks can be drawn than asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("placeholder")]
pub struct SampleError;

/// Draws tasks.
///
/// # Errors
///
/// When there are not as many distinct tasks.
pub fn sample(_family: Family, _train: u32, _unseen: u32, _seed: Seed) -> Result<TaskSet, SampleError> {
    Err(SampleError)
}
