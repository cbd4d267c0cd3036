//! Why a place cannot be used.

use std::path::PathBuf;

use crate::artifact::IoError;
use crate::feature::{Feature, NotBuiltIn};

/// Why a place cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// A bucket cannot be reached by this program.
    #[error("{url}: {}", NotBuiltIn(Feature::Cloud))]
    NoCloud {
        /// The bucket.
        url: String,
    },
    /// A bucket whose store passes over conditions: what two processes write could mix in it.
    #[error(
        "{url}: its store does not keep to conditional writes (If-None-Match), so that what two processes write could \
         mix; allowed are stores that do, and folders"
    )]
    NoConditionalWrites {
        /// The bucket.
        url: String,
    },
    /// A store refuses, or cannot be reached.
    #[error("failed to {action} {}: {source}", place.display())]
    Refused {
        /// What was tried.
        action: &'static str,
        /// With which object.
        place: PathBuf,
        /// What the store said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A file is not what it should be.
    #[error("{}: sha256 is {found}, but should be {expected}", place.display())]
    Spoiled {
        /// The file.
        place: PathBuf,
        /// Its hash.
        found: String,
        /// What it should be.
        expected: String,
    },
    /// A file of this machine cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
}

impl StoreError {
    /// Whether the command is at fault, and nothing was written.
    pub fn is_usage(&self) -> bool {
        matches!(self, Self::NoCloud { .. })
    }
}
