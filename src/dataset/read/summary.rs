//! What a dataset is, in a few lines.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Serialize;

use crate::artifact::{IoError, read_json};
use crate::dataset::DatasetError;
use crate::dataset::files::annotation::Told;
use crate::dataset::files::info::{NtpInfo, as_whole_where_it_is};
use crate::dataset::files::layout;
use crate::dataset::plain::{Declared, DeclaredKind, PlainSource, has_programs};
use crate::dataset::tables::episodes::read::EpisodeRows;

/// What a dataset is made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DatasetSummary {
    /// Version of the `LeRobot` format, e.g. `v3.0`.
    pub lerobot_version: String,
    /// Version of the program tables; `None` for a dataset without.
    pub ntp_schema_version: Option<u32>,
    /// Version of the program that wrote it; `None` for one that was written elsewhere.
    pub ntp_version: Option<String>,
    /// Which recorded frames are rows: `boundaries` or `all`.
    pub frames: String,
    /// Task families.
    pub families: Vec<String>,
    /// Names of the slots.
    pub slots: Vec<String>,
    /// Rows per second that `timestamp` claims.
    #[serde(serialize_with = "as_whole_where_it_is")]
    pub fps: f64,
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
    /// The models that made its labels; nothing where no model did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels_predicted_by: Option<String>,
    /// What a dataset without program tables declares.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub declared: Option<DeclaredSummary>,
}

/// What a dataset declares.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeclaredSummary {
    /// The robot.
    pub robot_type: Option<String>,
    /// Features: type and shape, and of videos the codec.
    pub features: BTreeMap<String, String>,
    /// Forms of labels that it has, by the names that `ntp dataset import --labels` takes.
    pub labels: Vec<&'static str>,
    /// Distinct texts of tasks, the first ten.
    pub tasks: Vec<String>,
}

/// Reads what a dataset is, from its JSON files and its rows per episode.
///
/// # Errors
///
/// When one of these cannot be read.
pub fn summarize(root: &Path) -> Result<DatasetSummary, DatasetError> {
    if !has_programs(root) {
        return summarize_plain(&PlainSource::open(root)?);
    }
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    let (info, rows) = EpisodeRows::open(root)?;
    let mut summary = DatasetSummary {
        lerobot_version: info.codebase_version,
        ntp_schema_version: Some(ntp.schema_version),
        ntp_version: Some(ntp.ntp_version),
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
        labels_predicted_by: predicted_by(root)?,
        declared: None,
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

/// The models that made the labels of a dataset, in words.
pub(crate) fn predicted_by(root: &Path) -> Result<Option<String>, IoError> {
    Ok(Told::of(root)?.map(|told| told.models_in_words()))
}

/// The same of a dataset without program tables: of its declarations and its rows per episode.
fn summarize_plain(source: &PlainSource) -> Result<DatasetSummary, DatasetError> {
    let info = &source.info;
    let lengths = || source.episodes.iter().map(|episode| episode.length as i64);
    let mut splits: BTreeMap<String, u64> = BTreeMap::new();
    for at in 0..source.episodes.len() as u64 {
        *splits.entry(info.split_of(at).unwrap_or("none").to_owned()).or_default() += 1;
    }
    let tasks = source.tasks.rows.iter().map(|(_, text)| text.clone());
    let declared = DeclaredSummary {
        robot_type: info.json["robot_type"].as_str().map(ToOwned::to_owned),
        features: info.features.iter().map(|feature| (feature.name.clone(), words(feature))).collect(),
        labels: source.label_forms(),
        tasks: tasks.take(10).collect(),
    };
    Ok(DatasetSummary {
        lerobot_version: info.version.name().to_owned(),
        ntp_schema_version: None,
        ntp_version: None,
        frames: "all".to_owned(),
        families: Vec::new(),
        slots: Vec::new(),
        fps: info.fps,
        total_episodes: source.episodes.len() as u64,
        total_frames: source.episodes.iter().map(|episode| episode.length).sum(),
        total_calls: 0,
        total_scopes: 0,
        total_tasks: source.tasks.rows.len() as u64,
        failed_left_out: 0,
        splits,
        actors: BTreeMap::new(),
        outcomes: BTreeMap::new(),
        episode_frames: [lengths().min().unwrap_or(0), lengths().max().unwrap_or(0)],
        labels_predicted_by: predicted_by(info.root())?,
        declared: Some(declared),
    })
}

/// `float32 [7]`, or `video [480, 640, 3] in av1`.
fn words(feature: &Declared) -> String {
    let words = format!("{} {:?}", feature.dtype, feature.shape);
    let codec = feature.video("video.codec").and_then(|codec| codec.as_str());
    match codec.filter(|_| feature.kind == DeclaredKind::Video) {
        Some(codec) => format!("{words} in {codec}"),
        None => words,
    }
}
