//! What a dataset is, in a few lines.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Serialize;

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::info::NtpInfo;
use crate::dataset::files::layout;
use crate::dataset::tables::episodes::read::EpisodeRows;

/// What a dataset is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DatasetSummary {
    /// Version of the `LeRobot` format, e.g. `v3.0`.
    pub lerobot_version: String,
    /// Version of the program tables.
    pub ntp_schema_version: u32,
    /// Version of the program that wrote it.
    pub ntp_version: String,
    /// Which recorded frames are rows: `boundaries` or `all`.
    pub frames: String,
    /// Task families.
    pub families: Vec<String>,
    /// Names of the slots.
    pub slots: Vec<String>,
    /// Rows per second that `timestamp` claims.
    pub fps: u32,
    /// Episodes.
    pub total_episodes: u64,
    /// Rows of `data/`.
    pub total_frames: u64,
    /// Rows of `ntp/calls/`.
    pub total_calls: u64,
    /// Rows of `ntp/scopes/`.
    pub total_scopes: u64,
    /// Distinct tasks.
    pub total_tasks: u64,
    /// Episodes that failed when it was made, and were left out.
    pub failed_left_out: u64,
    /// Episodes by split.
    pub splits: BTreeMap<String, u64>,
    /// Episodes by who acted.
    pub actors: BTreeMap<String, u64>,
    /// Episodes by outcome.
    pub outcomes: BTreeMap<String, u64>,
    /// Least and most frames of an episode.
    pub episode_frames: [i64; 2],
}

/// Reads what a dataset is, from its JSON files and its rows per episode.
///
/// # Errors
///
/// When one of these cannot be read.
pub fn summarize(root: &Path) -> Result<DatasetSummary, DatasetError> {
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    let (info, rows) = EpisodeRows::open(root)?;
    let mut summary = DatasetSummary {
        lerobot_version: info.codebase_version,
        ntp_schema_version: ntp.schema_version,
        ntp_version: ntp.ntp_version,
        frames: ntp.frames,
        families: ntp.families,
        slots: ntp.slots,
        fps: info.fps,
        total_episodes: info.total_episodes,
        total_frames: info.total_frames,
        total_calls: ntp.total_calls,
        total_scopes: ntp.total_scopes,
        total_tasks: 0,
        failed_left_out: ntp.failed_left_out,
        splits: BTreeMap::new(),
        actors: BTreeMap::new(),
        outcomes: BTreeMap::new(),
        episode_frames: [i64::MAX, 0],
    };
    let mut tasks = BTreeSet::new();
    for row in rows {
        let row = row?;
        let [least, most] = summary.episode_frames;
        summary.episode_frames = [least.min(row.n_frames), most.max(row.n_frames)];
        *summary.splits.entry(row.split).or_default() += 1;
        *summary.actors.entry(row.actor).or_default() += 1;
        *summary.outcomes.entry(row.outcome).or_default() += 1;
        tasks.insert(row.task_id);
    }
    summary.total_tasks = tasks.len() as u64;
    Ok(summary)
}
