//! Why a dataset could not be edited.

use std::path::{Path, PathBuf};

use arrow::error::ArrowError;

use crate::artifact::{ContractError, IoError, StagingError};
use crate::dataset::DatasetError;
use crate::recording::RecordingError;
use crate::table::TableError;
use crate::video::VideoError;

/// A dataset could not be edited.
#[derive(Debug, thiserror::Error)]
pub enum EditError {
    /// A source could not be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A table could not be read or written.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The manifest could not be written.
    #[error(transparent)]
    Contract(#[from] ContractError),
    /// The folder could not be made.
    #[error(transparent)]
    Staging(#[from] StagingError),
    /// A video could not be written.
    #[error(transparent)]
    Video(#[from] VideoError),
    /// A recording could not be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Rows could not be put together.
    #[error("{}: {source}", path.display())]
    Rows {
        /// The table.
        path: PathBuf,
        /// What Arrow said.
        source: ArrowError,
    },
    /// What is asked for would make no whole dataset.
    #[error("{code}: {}: {problem}", path.display())]
    Refused {
        /// Which rule, as schemas/findings.md names it.
        code: &'static str,
        /// The dataset or file.
        path: PathBuf,
        /// What was found, and what is allowed.
        problem: String,
    },
}

impl EditError {
    pub(in crate::dataset) fn refused(code: &'static str, path: &Path, problem: impl Into<String>) -> Self {
        Self::Refused { code, path: path.to_owned(), problem: problem.into() }
    }

    pub(in crate::dataset) fn rows(path: impl Into<PathBuf>) -> impl FnOnce(ArrowError) -> Self {
        let path = path.into();
        move |source| Self::Rows { path, source }
    }
}
