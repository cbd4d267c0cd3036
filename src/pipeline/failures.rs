//! Items that failed, with what was said: `failed/STAGE-ITEM.json` in a run directory.
//!
//! They lie beside the stages' folders and are part of none. An item that is done later forgets its failure.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, read_json, write_json};
use crate::pipeline::{RunDir, Stage};

/// Where they lie.
pub(super) const FOLDER: &str = "failed";

/// How an item failed the last time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Its number in its stage.
    pub item: u64,
    /// What it is a part of.
    pub unit: String,
    /// Which part.
    pub shard: u32,
    /// What was said.
    pub message: String,
    /// How often it has failed.
    pub attempts: u32,
    /// On which machine, where that is known.
    pub node: Option<String>,
}

impl Failure {
    /// The failure of an item, if it has failed and was not done since.
    pub(super) fn of(run: &RunDir, stage: Stage, item: u64) -> Option<Self> {
        read_json(&path(run, stage, item)).ok()
    }

    /// Notes it, counted after those before.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub(super) fn note(self, run: &RunDir, stage: Stage) -> Result<(), IoError> {
        let before = Self::of(run, stage, self.item).map_or(0, |before| before.attempts);
        write_json(&path(run, stage, self.item), &Self { attempts: before + 1, node: node(), ..self })
    }

    /// Forgets the failure of an item.
    pub(super) fn forget(run: &RunDir, stage: Stage, item: u64) {
        // Where there was none there is nothing to forget.
        let _none = std::fs::remove_file(path(run, stage, item));
    }
}

/// Where the failure of an item lies.
pub(super) fn path(run: &RunDir, stage: Stage, item: u64) -> PathBuf {
    run.root().join(FOLDER).join(format!("{stage}-{item}.json"))
}

fn node() -> Option<String> {
    let name = std::fs::read_to_string("/proc/sys/kernel/hostname").ok()?;
    Some(name.trim().to_owned())
}
