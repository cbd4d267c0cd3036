//! Someone else's labelled dataset as one of ours: its labels become a program tree.
//!
//! # Input and output
//!
//! [`import`] reads a `LeRobotDataset` v3.0 with labels in one of the forms of [`LabelsForm`]. It writes the same
//! dataset (columns, videos and statistics as they were) with `ntp.call_id` and `ntp.program` for each frame and the
//! tables under `ntp/`. The root program `task` runs through each episode; each label is a call of its text, those of the
//! second level below those of the first. Frames without a label are the root's own.
//!
//! Spans of such a dataset share no frame: a call has the frames that are annotated so. Demonstrations are taken for
//! successes, as nothing says otherwise. An episode's recording is the file of frames that it was read from, by name
//! and hash, and a task is named by its text: so imported datasets can be edited and compared as our own are.
//!
//! Scoping labels are not written: every call sees the whole episode, so that its span tells them, and rows for each
//! call and frame would grow with the product of both.
//!
//! # Errors
//!
//! [`EditError::Refused`] with `import.*` names what the dataset lacks. Memory holds some thousand rows, one episode's
//! calls, and an entry for each episode.

mod frames;
mod meta;
mod rows;

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;
use serde_json::{Value, json};

use crate::artifact::{self, IoError, StageDir, StagedDir, read, write_json};
use crate::dataset::DatasetError;
use crate::dataset::edit::EditError;
use crate::dataset::export::copy_folder;
use crate::dataset::files::annotation;
use crate::dataset::files::info::{LEROBOT_VERSION, NTP_VERSION, NtpInfo, counts_problem};
use crate::dataset::files::layout;
use crate::dataset::files::stated::{is_of_numbers, read_statistics};
use crate::dataset::plain::{DeclaredKind, LabelsForm, PlainInfo, PlainLabels, PlainSource, PlainTexts};
use crate::dataset::tables::annotated::vocabulary;
use crate::dataset::tables::texts::write::{write_subtasks, write_tasks};

use frames::write_frames;
use meta::write_meta;
use rows::AnnotatedRows;
pub(in crate::dataset) use rows::task_id;

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ImportSummary {
    /// Episodes.
    pub episodes: u64,
    /// Frames.
    pub frames: u64,
    /// Program calls, roots included.
    pub calls: u64,
    /// Scoping labels: none, since the spans of calls tell them.
    pub scopes: u64,
    /// Distinct texts of labels.
    pub subtasks: u64,
    /// Labels that shared frames with others of their level, or lay behind the end, and were cut.
    pub cut: u64,
}

/// Brings in a dataset, as a new folder. Where `form` is `None`, its labels tell theirs.
///
/// # Errors
///
/// When the dataset is not labelled, or cannot be read, or there is something at `to`.
pub fn import(root: &Path, form: Option<LabelsForm>, to: &Path) -> Result<ImportSummary, EditError> {
    let info = PlainInfo::read(root).map_err(|error| match error {
        DatasetError::Count { path, problem } => EditError::refused("import.rows", &path, problem),
        other => other.into(),
    })?;
    check_version(&info)?;
    let source = PlainSource::open(root)?;
    StageDir::new("convert", root).check_whole()?;
    check_videos(&source)?;
    let form = check(&source, form)?;
    let tasks = in_order(&root.join(layout::TASKS), &source.tasks)?;
    let known = source.subtasks.as_ref().filter(|_| form == LabelsForm::SubtaskIndex);
    let known = known.map(|known| in_order(&root.join(layout::SUBTASKS), known)).transpose()?;
    let staged = StagedDir::begin(to)?;
    let folder = staged.partial_path();
    let mut rows = AnnotatedRows::create(folder, &source)?;
    let mut labels = PlainLabels::open(form);
    // Numbers that frames have already stay as they are.
    known.iter().flatten().for_each(|text| labels.know(text));
    let places = write_frames(&source, &mut labels, folder, &mut rows)?;
    write_meta(&source, &places, folder)?;
    let (summary, texts) = (rows.finish()?, labels.texts().to_vec());
    let summary = ImportSummary { subtasks: texts.len() as u64, cut: labels.n_cut, ..summary };
    check_totals(&source, summary)?;
    write_tasks(folder, &tasks)?;
    // Numbers that frames have beside labels of another form count texts of their own.
    let others = source.subtasks.as_ref().filter(|_| form != LabelsForm::SubtaskIndex);
    match others.filter(|_| source.info.feature("subtask_index").is_some()) {
        Some(others) => write_subtasks(folder, &others.in_order())?,
        None => write_subtasks(folder, &texts)?,
    }
    let stats = root.join(layout::STATS);
    if stats.is_file() {
        copy_statistics(&stats, &folder.join(layout::STATS))?;
    }
    write_infos(&source, form, &texts, summary, folder)?;
    copy_folder(&root.join(layout::VIDEOS), &folder.join(layout::VIDEOS))?;
    annotation::copy(root, folder)?;
    staged.commit()?;
    Ok(summary)
}

/// Makes sure that every video file that an episode names is there, and is the file itself.
fn check_videos(source: &PlainSource) -> Result<(), EditError> {
    let mut seen = BTreeSet::new();
    for (at, feature) in source.info.videos().enumerate() {
        for span in source.episodes.iter().filter_map(|episode| episode.videos.get(at)?.as_ref()) {
            let path = source.info.video_file(&feature.name, span.file);
            if seen.insert(path.clone()) {
                artifact::open(&path)?;
            }
        }
    }
    Ok(())
}

/// Copies statistics as they are, or those of them that are numbers where others are not.
fn copy_statistics(path: &Path, to: &Path) -> Result<(), IoError> {
    let is_whole = serde_json::from_slice(&read(path)?).is_ok_and(|of: Value| is_of_numbers(&of));
    match is_whole {
        true => std::fs::copy(path, to).map(|_bytes| ()).map_err(IoError::system("copy", path)),
        false => write_json(to, &read_statistics(path)?),
    }
}

fn check_version(info: &PlainInfo) -> Result<(), EditError> {
    if info.version.name() == LEROBOT_VERSION {
        return Ok(());
    }
    let problem = format!(
        "codebase_version is {:?}, not v3.0; `ntp dataset merge THEIRS --to NEW` makes one of v3.0 of it",
        info.version.name()
    );
    Err(EditError::refused("import.version", &info.root().join(layout::INFO), problem))
}

/// The form of the labels, where the dataset can be brought in.
fn check(source: &PlainSource, form: Option<LabelsForm>) -> Result<LabelsForm, EditError> {
    let info = &source.info;
    let path = info.root().join(layout::INFO);
    let refused = |code, problem: String| Err(EditError::refused(code, &path, problem));
    if let Some(name) = ["ntp.call_id", "ntp.program"].iter().find(|name| info.feature(name).is_some()) {
        return refused("import.annotation", format!("it has the feature {name} already"));
    }
    let forms = source.label_forms();
    let Some(form) = form.or_else(|| LabelsForm::of(source)) else {
        let problem = "it has no labels: neither a feature subtask_index or language_persistent, nor SARM's columns, nor \
                       BEHAVIOR-1K's annotations";
        return refused("import.annotation", problem.to_owned());
    };
    if !forms.contains(&form.name()) {
        let there = if forms.is_empty() { "none".to_owned() } else { forms.join(", ") };
        return refused("import.annotation", format!("it has no labels of the form {}; it has {there}", form.name()));
    }
    let is_whole = |of: &crate::dataset::plain::Declared| matches!(of.kind, DeclaredKind::Numbers(_));
    if form == LabelsForm::SubtaskIndex && !info.feature("subtask_index").is_some_and(is_whole) {
        return refused("import.annotation", "no feature subtask_index of dtype int64 is declared".to_owned());
    }
    match info.problems.iter().find(|problem| problem.code == "info.features") {
        Some(of) => refused("import.features", format!("{}: {}", of.place, of.message)),
        None => Ok(form),
    }
}

/// Texts in the order of their numbers, which must be 0, 1 and so on.
fn in_order(path: &Path, texts: &PlainTexts) -> Result<Vec<String>, EditError> {
    let in_order = texts.in_order();
    if in_order.len() == texts.rows.len() {
        return Ok(in_order);
    }
    let problem = format!("its numbers are not 0 to {}: there is no {}", texts.rows.len() - 1, in_order.len());
    Err(EditError::refused("import.texts", path, problem))
}

fn check_totals(source: &PlainSource, summary: ImportSummary) -> Result<(), EditError> {
    let info = &source.info;
    let expected = (info.total("total_episodes"), info.total("total_frames"));
    let found = (summary.episodes, summary.frames);
    if expected.0.is_some_and(|n| n != found.0) || expected.1.is_some_and(|n| n != found.1) {
        let problem = counts_problem(expected.into(), found.into());
        return Err(EditError::refused("import.rows", &info.root().join(layout::INFO), problem));
    }
    Ok(())
}

fn write_infos(
    source: &PlainSource,
    form: LabelsForm,
    texts: &[String],
    summary: ImportSummary,
    to: &Path,
) -> Result<(), EditError> {
    let mut info: Value = source.info.json.clone();
    let number = json!({ "dtype": "int64", "shape": [1], "names": null });
    info["features"]["ntp.call_id"] = number.clone();
    info["features"]["ntp.program"] = json!({ "dtype": "string", "shape": [1], "names": null });
    if source.info.feature("subtask_index").is_none() {
        info["features"]["subtask_index"] = number;
    }
    if info["video_path"].is_null() {
        info["video_path"] = json!("videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4");
    }
    if info["robot_type"].is_null() {
        info["robot_type"] = json!("unknown");
    }
    // What others may leave out, and readers of ours take from there.
    let totals = [
        ("total_episodes", summary.episodes),
        ("total_frames", summary.frames),
        ("total_tasks", source.tasks.rows.len() as u64),
        ("chunks_size", 1000),
        ("data_files_size_in_mb", 100),
        ("video_files_size_in_mb", 200),
    ];
    for (key, usual) in totals {
        if info[key].is_null() {
            info[key] = json!(usual);
        }
    }
    info["data_path"] = json!("data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet");
    write_json(&to.join(layout::INFO), &info)?;
    let (vocabulary, vocabulary_hash) = vocabulary(texts);
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
        annotated_by: Some(form.name().to_owned()),
    };
    Ok(write_json(&to.join(layout::NTP_INFO), &ntp)?)
}
