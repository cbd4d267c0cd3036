//! Someone else's annotated dataset as one of ours: `subtask_index` becomes a program tree of two levels.
//!
//! # Input and output
//!
//! [`import`] reads a `LeRobotDataset` v3.0 with the column `subtask_index` and `meta/subtasks.parquet`. It writes the
//! same dataset (columns, videos and statistics as they were) with `ntp.call_id` and `ntp.program` for each frame and
//! the tables under `ntp/`. The root program `task` runs through each episode; each run of frames of one sub-task is a
//! call of the sub-task's text. Frames with a negative `subtask_index` are the root's own.
//!
//! Spans of such a dataset share no frame: a call has the frames that are annotated so. Demonstrations are taken for
//! successes, as nothing says otherwise. An episode's recording is the file of frames that it was read from, by name
//! and hash, and a task is named by its text: so imported datasets can be edited and compared as our own are.
//!
//! # Errors
//!
//! [`EditError::Refused`] with `import.*` names what the dataset lacks. Memory holds some thousand rows and one
//! episode's calls.

mod episode;
mod frames;
mod rows;
mod texts;

use std::path::Path;

use serde::Serialize;
use serde_json::{Value, json};

use crate::artifact::{IoError, StagedDir, read_json, write_json};
use crate::dataset::edit::EditError;
use crate::dataset::export::copy_folder;
use crate::dataset::files::info::{Info, LEROBOT_VERSION, NTP_VERSION, NtpInfo};
use crate::dataset::files::layout;
use crate::dataset::tables::annotated::{ANNOTATED_BY, vocabulary};
use crate::dataset::tables::texts::write::{write_subtasks, write_tasks};

use frames::write_frames;
pub(in crate::dataset) use rows::task_id;
use rows::{AnnotatedRows, write_meta};
use texts::{read_subtasks, read_tasks};

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ImportSummary {
    /// Episodes.
    pub episodes: u64,
    /// Frames.
    pub frames: u64,
    /// Program calls, roots included.
    pub calls: u64,
    /// Scoping labels.
    pub scopes: u64,
    /// Sub-tasks that `subtask_index` counts.
    pub subtasks: u64,
}

/// Brings in a dataset, as a new folder.
///
/// # Errors
///
/// When the dataset is not annotated, or cannot be read, or there is something at `to`.
pub fn import(root: &Path, to: &Path) -> Result<ImportSummary, EditError> {
    let info = read_info(root)?;
    let (tasks, subtasks) = (read_tasks(root)?, read_subtasks(root)?);
    let staged = StagedDir::begin(to)?;
    let folder = staged.partial_path();
    let fps = info["fps"].as_f64().filter(|fps| *fps > 0.0);
    let fps =
        fps.ok_or_else(|| EditError::refused("import.rows", &root.join(layout::INFO), "fps is no number above 0"))?;
    let mut rows = AnnotatedRows::create(folder, &tasks, &subtasks, fps)?;
    write_frames(root, folder, &subtasks, &mut rows)?;
    write_meta(root, folder, &tasks, rows.lengths())?;
    let summary = rows.finish()?;
    let expected = (info["total_episodes"].as_u64(), info["total_frames"].as_u64());
    if expected != (Some(summary.episodes), Some(summary.frames)) {
        let found = (summary.episodes, summary.frames);
        let problem = format!("it counts {expected:?} episodes and frames, but there are {found:?}");
        return Err(EditError::refused("import.rows", &root.join(layout::INFO), problem));
    }
    write_texts(root, folder, &tasks, &subtasks)?;
    write_infos(root, folder, info, &subtasks, summary)?;
    copy_folder(&root.join(layout::VIDEOS), &folder.join(layout::VIDEOS))?;
    staged.commit()?;
    Ok(summary)
}

fn read_info(root: &Path) -> Result<Value, EditError> {
    let path = root.join(layout::INFO);
    let info: Value = read_json(&path)?;
    let refused = |code, problem: String| Err(EditError::refused(code, &path, problem));
    if info["codebase_version"] != LEROBOT_VERSION {
        return refused("import.version", format!("codebase_version is {}, not v3.0", info["codebase_version"]));
    }
    if info["features"]["subtask_index"]["dtype"] != "int64" {
        return refused("import.annotation", "no feature subtask_index of dtype int64 is declared".to_owned());
    }
    let is_taken = |name: &&str| !info["features"][*name].is_null();
    if let Some(name) = ["ntp.call_id", "ntp.program"].iter().find(|name| is_taken(name)) {
        return refused("import.annotation", format!("it has the feature {name} already"));
    }
    Ok(info)
}

fn write_texts(root: &Path, to: &Path, tasks: &[String], subtasks: &[String]) -> Result<(), EditError> {
    write_tasks(to, tasks)?;
    write_subtasks(to, subtasks)?;
    let stats = root.join(layout::STATS);
    if stats.is_file() {
        std::fs::copy(&stats, to.join(layout::STATS)).map_err(IoError::system("copy", &stats))?;
    }
    Ok(())
}

fn write_infos(
    root: &Path,
    to: &Path,
    mut info: Value,
    subtasks: &[String],
    summary: ImportSummary,
) -> Result<(), EditError> {
    if info["robot_type"].is_null() {
        info["robot_type"] = json!("unknown");
    }
    if info["video_path"].is_null() {
        info["video_path"] = json!("videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4");
    }
    info["features"]["ntp.call_id"] = json!({ "dtype": "int64", "shape": [1], "names": null });
    info["features"]["ntp.program"] = json!({ "dtype": "string", "shape": [1], "names": null });
    if let Err(error) = serde_json::from_value::<Info>(info.clone()) {
        return Err(EditError::refused("import.features", &root.join(layout::INFO), error.to_string()));
    }
    write_json(&to.join(layout::INFO), &info)?;
    let (vocabulary, vocabulary_hash) = vocabulary(subtasks);
    let ntp = NtpInfo {
        schema_version: NTP_VERSION,
        ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
        frames: "all".to_owned(),
        families: Vec::new(),
        n_slots: 0,
        slots: Vec::new(),
        vocabulary_hash,
        vocabulary,
        total_calls: summary.calls,
        total_scopes: summary.scopes,
        failed_left_out: 0,
        annotated_by: Some(ANNOTATED_BY.to_owned()),
    };
    Ok(write_json(&to.join(layout::NTP_INFO), &ntp)?)
}
