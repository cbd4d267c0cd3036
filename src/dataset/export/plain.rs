//! A dataset without what is ours: a `LeRobotDataset` with `subtask_index`, as before language columns.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use arrow::array::RecordBatch;
use arrow::datatypes::Schema;
use arrow::error::ArrowError;
use serde_json::Value;

use crate::artifact::{IoError, create_dir, read_json, write_json};
use crate::dataset::DatasetError;
use crate::dataset::edit::EditError;
use crate::dataset::export::ExportSummary;
use crate::dataset::files::annotation;
use crate::dataset::files::info::{FeatureInfo, Info, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::files::stated::read_statistics;
use crate::dataset::plain::{ProgramTables, program_tables};
use crate::dataset::schema::{FRAMES, META_EPISODES};
use crate::dataset::tables::frames::feature::action_of;
use crate::dataset::tables::frames::write::FrameRows;
use crate::table::{BatchReader, BatchWriter, WriteOptions};

/// Rows that are read and written at a time.
const BATCH_ROWS: usize = 8192;

/// Writes the dataset.
pub(super) fn write(root: &Path, to: &Path) -> Result<ExportSummary, EditError> {
    let (info, labels) = write_frames(root, to, Vec::new(), Ok)?;
    copy_files(root, to, (layout::META_EPISODES, META_EPISODES.name()), &META_EPISODES.options(), Ok)?;
    Ok(ExportSummary { episodes: info.total_episodes, labels })
}

/// Writes all but the rows of episodes: frames as `change` gives them, with further features. Each frame has a label.
pub(super) fn write_frames(
    root: &Path,
    to: &Path,
    further: Vec<(String, FeatureInfo)>,
    change: impl FnMut(RecordBatch) -> Result<RecordBatch, EditError>,
) -> Result<(Info, u64), EditError> {
    let info: Info = read_json(&root.join(layout::INFO))?;
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    copy_files(root, to, (layout::DATA, FRAMES.name()), &FrameRows::options(ntp.n_slots, action_of(&info)), change)?;
    copy_folder(&root.join(layout::VIDEOS), &to.join(layout::VIDEOS))?;
    write_info(root, to, &info, further)?;
    let statistics = root.join(layout::STATS);
    if statistics.is_file() {
        let mut stats: BTreeMap<String, Value> = read_statistics(&statistics)?.into_iter().collect();
        stats.retain(|name, _| !is_ours(name));
        write_json(&to.join(layout::STATS), &stats)?;
    }
    for file in [layout::TASKS, layout::SUBTASKS] {
        std::fs::copy(root.join(file), to.join(file)).map_err(IoError::system("copy", root.join(file)))?;
    }
    annotation::copy(root, to)?;
    let labels = info.total_frames;
    Ok((info, labels))
}

/// Writes what is declared: of an imported dataset all that others have declared, which is more than is known here.
fn write_info(root: &Path, to: &Path, info: &Info, further: Vec<(String, FeatureInfo)>) -> Result<(), EditError> {
    let path = to.join(layout::INFO);
    if program_tables(root) == ProgramTables::Own {
        let mut info = info.clone();
        info.features.0.retain(|(name, _)| !is_ours(name) && further.iter().all(|(other, _)| other != name));
        info.features.0.extend(further);
        return Ok(write_json(&path, &info)?);
    }
    let mut theirs: Value = read_json(&root.join(layout::INFO))?;
    if let Some(features) = theirs["features"].as_object_mut() {
        features.retain(|name, _| !is_ours(name));
        for (name, feature) in further {
            features.insert(name, serde_json::to_value(feature).unwrap_or_default());
        }
    }
    Ok(write_json(&path, &theirs)?)
}

/// Copies a folder with all that is in it, where it is there.
pub(in crate::dataset) fn copy_folder(from: &Path, to: &Path) -> Result<(), EditError> {
    if !from.is_dir() {
        return Ok(());
    }
    create_dir(to)?;
    for entry in std::fs::read_dir(from).map_err(IoError::system("list", from))? {
        let path = entry.map_err(IoError::system("list", from))?.path();
        let Some(name) = path.file_name() else { continue };
        if path.is_dir() {
            copy_folder(&path, &to.join(name))?;
        } else {
            std::fs::copy(&path, to.join(name)).map_err(IoError::system("copy", &path))?;
        }
    }
    Ok(())
}

/// Columns that only this project knows.
pub(super) fn is_ours(name: &str) -> bool {
    name.starts_with("ntp.") || name.starts_with("ntp/")
}

/// Writes each file of a folder again, without columns of ours and changed by `change`.
pub(super) fn copy_files(
    root: &Path,
    to: &Path,
    (folder, name): (&str, &str),
    options: &WriteOptions,
    mut change: impl FnMut(RecordBatch) -> Result<RecordBatch, EditError>,
) -> Result<(), EditError> {
    create_dir(&to.join(folder))?;
    let mut place = FilePlace::default();
    while place == FilePlace::default() || place.is_there(root, folder)? {
        let path = place.in_dataset(root, folder);
        let mut reader = BatchReader::open(&path, BATCH_ROWS)?;
        let mut writer: Option<BatchWriter> = None;
        while let Some(rows) = reader.next_batch()? {
            let rows = change(without_ours(&rows).map_err(EditError::rows(&path))?)?;
            let mut open = match writer.take() {
                Some(open) => open,
                None => BatchWriter::create(&place.in_dataset(to, folder), name, rows.schema_ref(), options.clone())?,
            };
            open.write(&rows)?;
            writer = Some(open);
        }
        match writer {
            Some(writer) => writer.commit()?,
            None => return Err(DatasetError::Count { path, problem: "it has no rows".to_owned() }.into()),
        }
        place = place.next();
    }
    Ok(())
}

fn without_ours(rows: &RecordBatch) -> Result<RecordBatch, ArrowError> {
    let schema = rows.schema();
    let kept: Vec<usize> = (0..schema.fields().len()).filter(|&at| !is_ours(schema.field(at).name())).collect();
    rows.project(&kept)
}

/// The rows with further columns.
pub(in crate::dataset) fn with_columns(
    rows: &RecordBatch,
    columns: Vec<(arrow::datatypes::Field, arrow::array::ArrayRef)>,
) -> Result<RecordBatch, ArrowError> {
    let (fields, arrays): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
    let schema = rows.schema();
    let fields: Vec<_> = schema.fields().iter().cloned().chain(fields.into_iter().map(Arc::new)).collect();
    let arrays = rows.columns().iter().cloned().chain(arrays).collect();
    RecordBatch::try_new(Arc::new(Schema::new(fields).with_metadata(schema.metadata().clone())), arrays)
}
