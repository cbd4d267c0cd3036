//! Why a dataset is not published.

use std::path::PathBuf;

use crate::artifact::{ContractError, IoError};
use crate::dataset::{DatasetError, Finding};
use crate::store::StoreError;
use crate::table::TableError;

/// A dataset that is not published.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// It has faults.
    #[error(
        "{} does not validate, and only what does is published: {} ({}); all of it: ntp validate {0}",
        dataset.display(), first.message, first.code
    )]
    Invalid {
        /// Which dataset.
        dataset: PathBuf,
        /// The first finding.
        first: Box<Finding>,
    },
    /// Something else lies at the destination.
    #[error("{} is no part of this publication; publish into a folder of its own", path.display())]
    Foreign {
        /// What lies there.
        path: PathBuf,
    },
    /// A file of another publication lies at the destination.
    #[error(
        "{} has other content than this publication gives it; nothing is overwritten: remove the folder or choose \
         another",
        path.display()
    )]
    Differs {
        /// The file.
        path: PathBuf,
    },
    /// A published folder would lie in the dataset, or the dataset in it.
    #[error("{} and {} lie in each other; publish into a folder beside the dataset", dataset.display(), to.display())]
    Nested {
        /// The dataset.
        dataset: PathBuf,
        /// Where it should be published.
        to: PathBuf,
    },
    /// The card or the metadata cannot be rendered.
    #[error("failed to render {document}: {problem}")]
    Render {
        /// Which document.
        document: &'static str,
        /// What the renderer said.
        problem: String,
    },
    /// Nothing is published there, or not all of it.
    #[error("{} is not there: nothing was published here, or not to its end", path.display())]
    Unpublished {
        /// The checksums that are missing.
        path: PathBuf,
    },
    /// The user pressed Ctrl-C; the same command goes on.
    #[error("interrupted; the same command carries on")]
    Interrupted,
    /// The destination refuses, or spoils what is written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The dataset is not as its manifest says.
    #[error(transparent)]
    Contract(#[from] ContractError),
    /// A file cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
}
