//! The authors' released task file.

use std::path::Path;

use crate::task::TaskSet;

/// A task file that cannot be taken.
#[derive(Debug, thiserror::Error)]
#[error("placeholder")]
pub struct ImportError;

/// Reads the authors' task file.
///
/// # Errors
///
/// When it is not one.
pub fn import(_path: &Path, _train: u32) -> Result<TaskSet, ImportError> {
    Err(ImportError)
}
