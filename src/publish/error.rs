//! Why a dataset is not published.

use std::path::PathBuf;

use crate::artifact::{ContractError, IoError};
use crate::dataset::{DatasetError, Finding};
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
    /// Something else lies in the folder.
    #[error("{} is no part of this publication; publish into a folder of its own", path.display())]
    Foreign {
        /// What lies there.
        path: PathBuf,
    },
    /// A file of another publication lies in the folder.
    #[error(
        "{} has other content than this publication gives it; nothing is overwritten: remove the folder or choose \
         another",
        path.display()
    )]
    Differs {
        /// The file.
        path: PathBuf,
    },
    /// What was written is not what was read.
    #[error("{}: sha256 is {found} after copying, but should be {expected}", path.display())]
    Copied {
        /// The copy.
        path: PathBuf,
        /// Its hash.
        found: String,
        /// That of the original.
        expected: String,
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
    /// The user pressed Ctrl-C; the same command goes on.
    #[error("interrupted; the same command carries on")]
    Interrupted,
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
