//! What a new dataset holds, as it is told.

use serde::{Deserialize, Serialize};

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConvertSummary {
    /// Episodes in the dataset.
    pub episodes: u64,
    /// Rows of `data/`.
    pub frames: u64,
    /// Rows of `ntp/calls/`.
    pub calls: u64,
    /// Rows of `ntp/scopes/`.
    pub scopes: u64,
    /// Distinct task texts.
    pub tasks: u64,
    /// Episodes that failed and were left out.
    pub failed_left_out: u64,
    /// Episodes that failed and are in the dataset.
    pub failed_included: u64,
    /// Every file, relative to the dataset with `/`, in order of their names.
    pub files: Vec<String>,
}
