//! Why a dataset is not published.

use std::path::PathBuf;

use crate::artifact::{ContractError, IoError};
use crate::dataset::{DatasetError, Finding};
use crate::feature::{Feature, NotBuiltIn};
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
    /// Nothing is published there, or not all of it.
    #[error("{} is not there: nothing was published here, or not to its end", path.display())]
    Unpublished {
        /// The checksums that are missing.
        path: PathBuf,
    },
    /// A bucket cannot be reached by this program.
    #[error("{url}: {}", NotBuiltIn(Feature::Cloud))]
    NoCloud {
        /// The bucket.
        url: String,
    },
    /// A bucket whose store passes over conditions: two publications could mix in it.
    #[error(
        "{url}: its store does not keep to conditional writes (If-None-Match), so that two publications could mix; \
         publish into a folder and copy that"
    )]
    NoConditionalWrites {
        /// The bucket.
        url: String,
    },
    /// A store refuses, or cannot be reached.
    #[error("failed to {action} {}: {source}", place.display())]
    Store {
        /// What was tried.
        action: &'static str,
        /// With which object.
        place: PathBuf,
        /// What the store said.
        source: Box<dyn std::error::Error + Send + Sync>,
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
