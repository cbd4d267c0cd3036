//! What stands under `meta/`, and `ntp/info.json`: as it was, with what the labels change.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, BooleanArray, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field, Int64Type};
use arrow::error::ArrowError;
use serde_json::{Map, Value, json};

use crate::artifact::{IoError, read_json, write_json};
use crate::dataset::edit::EditError;
use crate::dataset::export::language;
use crate::dataset::files::info::{BY_MODEL, Dtype, Info, LEROBOT_VERSION, NTP_VERSION, NtpInfo, counts_problem};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::files::stated::read_statistics;
use crate::dataset::relabel::RelabelSummary;
use crate::dataset::relabel::columns::with_columns;
use crate::dataset::relabel::tables::{EpisodeNames, Written};
use crate::dataset::schema::META_EPISODES;
use crate::dataset::statistics::Statistics;
use crate::dataset::statistics::batches::lists;
use crate::dataset::tables::frames::feature::FEATURES;
use crate::dataset::tables::texts::write::write_subtasks;
use crate::program::KnownPrograms;
use crate::table::{BatchReader, BatchWriter, Values, WriteOptions};
use crate::words::counted;

/// Rows that are read at a time.
const BATCH_ROWS: usize = 4096;

/// Columns of frames that are written here, whether they were there or not.
const OURS: [&str; 6] =
    ["subtask_index", "ntp.boundary", "ntp.call_id", "ntp.program", "ntp.time_secs", "ntp.recording_frame"];

/// Reads what a dataset declares.
pub(super) fn read_info(root: &Path) -> Result<Value, EditError> {
    let path = root.join(layout::INFO);
    let info: Value = read_json(&path)?;
    if info["codebase_version"] != LEROBOT_VERSION {
        let problem = format!("codebase_version is {}, not {LEROBOT_VERSION}", info["codebase_version"]);
        return Err(EditError::refused("import.version", &path, problem));
    }
    Ok(info)
}

/// Writes all of it.
pub(super) fn write(
    root: &Path,
    to: &Path,
    info: &Value,
    slots: &[String],
    written: Written,
) -> Result<RelabelSummary, EditError> {
    let summary = RelabelSummary {
        episodes: written.episodes.len() as u64,
        frames: written.n_frames,
        calls: written.n_calls,
        scopes: written.n_scopes,
        subtasks: written.subtasks.len() as u64,
    };
    let expected = (info["total_episodes"].as_u64(), info["total_frames"].as_u64());
    if expected != (Some(summary.episodes), Some(summary.frames)) {
        let found = (summary.episodes, summary.frames);
        let problem = counts_problem(expected.into(), found.into());
        return Err(EditError::refused("import.rows", &root.join(layout::INFO), problem));
    }
    write_episodes(root, to, &written.episodes, &written.statistics)?;
    write_subtasks(to, &written.subtasks)?;
    let tasks = root.join(layout::TASKS);
    let mut reader = BatchReader::open(&tasks, BATCH_ROWS)?;
    while reader.next_batch()?.is_some() {}
    std::fs::copy(&tasks, to.join(layout::TASKS)).map_err(IoError::system("copy", &tasks))?;
    write_ntp_info(root, to, slots, &written, summary)?;
    write_statistics(root, to, written.statistics)?;
    write_info(root, to, info.clone())?;
    Ok(summary)
}

/// Writes the rows of episodes again, with the columns that tell of labels.
fn write_episodes(root: &Path, to: &Path, episodes: &[EpisodeNames], statistics: &Statistics) -> Result<(), EditError> {
    let mut begin = 0;
    let mut place = FilePlace::default();
    while place == FilePlace::default() || place.is_there(root, layout::META_EPISODES)? {
        let path = place.in_dataset(root, layout::META_EPISODES);
        let mut reader = BatchReader::open(&path, BATCH_ROWS)?;
        let mut writer: Option<BatchWriter> = None;
        while let Some(rows) = reader.next_batch()? {
            let end = begin + rows.num_rows();
            let Some(names) = episodes.get(begin..end) else {
                let problem = format!("it has more rows than there are episodes, {}", episodes.len());
                return Err(EditError::refused("import.rows", &path, problem));
            };
            check_lengths(&path, &rows, names)?;
            let rows = with_labels(&rows, names, statistics, begin..end).map_err(EditError::rows(&path))?;
            let mut open = match writer.take() {
                Some(open) => open,
                None => {
                    let target = place.in_dataset(to, layout::META_EPISODES);
                    let options = WriteOptions::default();
                    BatchWriter::create(&target, META_EPISODES.name(), rows.schema_ref(), options)?
                }
            };
            open.write(&rows)?;
            writer = Some(open);
            begin = end;
        }
        writer.map_or(Ok(()), BatchWriter::commit)?;
        place = place.next();
    }
    if begin < episodes.len() {
        let problem = format!(
            "it has {begin}, but there are {}",
            counted(episodes.len(), "episode"),
            begin = counted(begin, "row")
        );
        return Err(EditError::refused("import.rows", &root.join(layout::META_EPISODES), problem));
    }
    Ok(())
}

fn check_lengths(path: &Path, rows: &RecordBatch, episodes: &[EpisodeNames]) -> Result<(), EditError> {
    let lengths = rows.column_by_name("length").and_then(|column| column.as_primitive_opt::<Int64Type>());
    let lengths = lengths.map_or(&[][..], |lengths| lengths.values());
    if lengths.iter().eq(episodes.iter().map(|episode| &episode.n_frames)) {
        return Ok(());
    }
    Err(EditError::refused("import.rows", path, "the lengths of its episodes are not those of the frames"))
}

/// The rows with task, split, outcome and the statistics of labels in place of those that they have, or behind all.
fn with_labels(
    rows: &RecordBatch,
    names: &[EpisodeNames],
    statistics: &Statistics,
    range: std::ops::Range<usize>,
) -> Result<RecordBatch, ArrowError> {
    let texts = |text: fn(&EpisodeNames) -> &str| -> ArrayRef {
        Arc::new(StringArray::from_iter_values(names.iter().map(text)))
    };
    let success: BooleanArray = names.iter().map(|of| Some(of.success)).collect();
    let mut columns: Vec<(Field, ArrayRef)> = vec![
        (Field::new("ntp/task_id", DataType::Utf8, false), texts(|of| &of.task_id)),
        (Field::new("ntp/split", DataType::Utf8, false), texts(|of| &of.split)),
        (Field::new("ntp/success", DataType::Boolean, false), Arc::new(success)),
    ];
    for (name, values) in statistics.columns() {
        let field = rows.schema().field_with_name(name).map_or_else(|_none| list_field(name, values), Field::clone);
        let list = lists(&field, some(values, &range))?;
        columns.push((field, list));
    }
    with_columns(rows, columns)
}

/// Some rows of lists.
fn some<'v>(values: Values<'v>, rows: &std::ops::Range<usize>) -> Values<'v> {
    match values {
        Values::Float64Vector(all, width) => Values::Float64Vector(&all[rows.start * width..rows.end * width], width),
        Values::Int64Vector(all, width) => Values::Int64Vector(&all[rows.start * width..rows.end * width], width),
        other => other,
    }
}

fn list_field(name: &str, values: Values<'_>) -> Field {
    let item = if matches!(values, Values::Int64Vector(..)) { DataType::Int64 } else { DataType::Float64 };
    Field::new(name, DataType::List(Arc::new(Field::new("element", item, false))), false)
}

fn write_statistics(root: &Path, to: &Path, statistics: Statistics) -> Result<(), EditError> {
    let path = root.join(layout::STATS);
    let mut all: Map<String, Value> = if path.is_file() { read_statistics(&path)? } else { Map::new() };
    for (name, statistics) in statistics.finish()? {
        all.insert(name, json!(statistics));
    }
    Ok(write_json(&to.join(layout::STATS), &all)?)
}

fn write_info(root: &Path, to: &Path, mut info: Value) -> Result<(), EditError> {
    if info["robot_type"].is_null() {
        info["robot_type"] = json!("unknown");
    }
    if info["video_path"].is_null() {
        info["video_path"] = json!("videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4");
    }
    for feature in FEATURES.iter().filter(|feature| OURS.contains(&feature.name)) {
        info["features"][feature.name] = json!({ "dtype": feature.dtype, "shape": [1], "names": null });
    }
    for name in [language::PERSISTENT, language::EVENTS] {
        info["features"][name] = json!({ "dtype": Dtype::Language, "shape": [1], "names": null });
    }
    if let Err(error) = serde_json::from_value::<Info>(info.clone()) {
        return Err(EditError::refused("import.features", &root.join(layout::INFO), error.to_string()));
    }
    Ok(write_json(&to.join(layout::INFO), &info)?)
}

fn write_ntp_info(
    root: &Path,
    to: &Path,
    slots: &[String],
    written: &Written,
    summary: RelabelSummary,
) -> Result<(), EditError> {
    let path = root.join(layout::NTP_INFO);
    let before: Option<NtpInfo> = path.is_file().then(|| read_json(&path)).transpose()?;
    let known = written.families.iter().map(|family| family.programs()).max().unwrap_or(KnownPrograms::FIRST);
    let ntp = NtpInfo {
        schema_version: NTP_VERSION,
        ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
        frames: before.as_ref().map_or_else(|| "all".to_owned(), |before| before.frames.clone()),
        families: written.families.iter().map(|family| family.name().to_owned()).collect(),
        n_slots: slots.len(),
        slots: slots.to_vec(),
        vocabulary: known.names().map(ToOwned::to_owned).collect(),
        vocabulary_hash: known.hash(),
        total_calls: summary.calls,
        total_scopes: summary.scopes,
        failed_left_out: before.map_or(0, |before| before.failed_left_out),
        annotated_by: Some(BY_MODEL.to_owned()),
    };
    Ok(write_json(&to.join(layout::NTP_INFO), &ntp)?)
}
