//! Receipts and manifests, and what does not fit together in a stage's folder.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, sha256_file};
use crate::words::counted;

/// One file of a shard or stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// Relative to the stage's folder, with `/`.
    pub path: String,
    /// Size in bytes.
    pub bytes: u64,
    /// SHA-256 in hexadecimal.
    pub sha256: String,
}

impl FileEntry {
    /// Measures a file in a stage's folder.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub fn of(folder: &Path, relative: &str) -> Result<Self, IoError> {
        let path = folder.join(relative);
        let bytes = std::fs::metadata(&path).map_err(IoError::system("read", &path))?.len();
        Ok(Self { path: relative.to_owned(), bytes, sha256: sha256_file(&path)? })
    }
}

/// That one shard is done: the commit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Receipt {
    /// Of which plan.
    pub plan_id: String,
    /// Which shard.
    pub shard: u32,
    /// How many episodes it holds.
    pub episodes: u64,
    /// How many of them failed.
    pub failed: u64,
    /// Its files.
    pub files: Vec<FileEntry>,
}

/// That a stage is done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of plans, receipts and manifests.
    pub version: u32,
    /// The stage's name.
    pub stage: String,
    /// Of which plan.
    pub plan_id: String,
    /// Episodes in all shards.
    pub episodes: u64,
    /// How many of them failed.
    pub failed: u64,
    /// Every file, in order of shard and path.
    pub files: Vec<FileEntry>,
}

/// What does not fit together in a stage's folder.
#[derive(Debug, thiserror::Error)]
pub enum ContractError {
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The stage has not been run to its end.
    #[error("{stage} is not finished: no {}", path.display())]
    Unfinished {
        /// The stage.
        stage: String,
        /// The manifest that is missing.
        path: PathBuf,
    },
    /// Shards are missing.
    #[error("{stage}: {} of {total} have no receipt, the first is {}", missing.len(), missing.first().copied().unwrap_or(0), total = counted(*total, "shard"))]
    MissingShards {
        /// The stage.
        stage: String,
        /// Which.
        missing: Vec<u32>,
        /// Out of how many.
        total: u32,
    },
    /// The folder is of another plan.
    #[error("{} is of another plan: {difference}; nothing was changed", path.display())]
    OtherPlan {
        /// The stage's folder.
        path: PathBuf,
        /// In what the plans differ.
        difference: String,
    },
    /// A file that the manifest names is not as the manifest says.
    #[error("{}: {problem}", path.display())]
    FileDiffers {
        /// Which file.
        path: PathBuf,
        /// `missing`, or size or hash with found and expected.
        problem: String,
    },
}
