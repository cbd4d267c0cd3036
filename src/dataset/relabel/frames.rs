//! The frames: carried over with new columns of labels.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{
    Array as _, ArrayRef, AsArray as _, BooleanArray, Float64Array, Int64Array, RecordBatch, StringArray,
};
use arrow::datatypes::{DataType, Field, Float32Type, Int64Type};
use arrow::error::ArrowError;
use serde_json::Value;

use crate::dataset::edit::EditError;
use crate::dataset::export::language;
use crate::dataset::files::info::Dtype;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::relabel::EpisodeTree;
use crate::dataset::relabel::columns::{LabelColumns, LabelTexts, with_columns};
use crate::dataset::relabel::tables::{EpisodeSource, Tables, Written};
use crate::dataset::schema::FRAMES;
use crate::dataset::statistics::{NumericFeature, Statistics};
use crate::table::{BatchReader, BatchWriter, Values, WriteOptions};

/// Rows that are read at a time: they may hold pictures.
const BATCH_ROWS: usize = 1024;

/// The columns of numbers that frames are understood by.
const NUMBERS: [&str; 4] = ["episode_index", "frame_index", "index", "task_index"];

/// The numeric columns of labels, whose statistics are made anew.
pub(super) const LABELS: [(&str, Dtype); 3] =
    [("subtask_index", Dtype::Int64), ("ntp.boundary", Dtype::Bool), ("ntp.call_id", Dtype::Int64)];

/// Writes the files of frames again, and with them the tables of the trees.
pub(super) fn write<E: From<EditError>>(
    root: &Path,
    to: &Path,
    info: &Value,
    tables: Tables,
    trees: impl Iterator<Item = Result<EpisodeTree, E>>,
) -> Result<Written, E> {
    let of = |&(name, dtype): &(&str, Dtype)| {
        let is_of_episodes = !name.starts_with("ntp.");
        NumericFeature { name: name.to_owned(), dtype, width: 1, is_of_episodes }
    };
    let statistics = Statistics::new(to, LABELS.iter().map(of).collect());
    let fps = info["fps"].as_f64().unwrap_or(1.0).round().max(1.0) as u32;
    let texts = LabelTexts::default();
    let mut walk = Walk { tables, trees, texts, statistics, fps, open: None, n_episodes: 0, n_frames: 0 };
    let mut place = FilePlace::default();
    while place == FilePlace::default() || place.is_there(root, layout::DATA).map_err(EditError::from)? {
        walk.file(root, to, place)?;
        place = place.next();
    }
    walk.finish(root)
}

/// An episode whose frames are being passed.
struct Open {
    columns: LabelColumns,
    task_index: i64,
    n_passed: usize,
}

struct Walk<T> {
    tables: Tables,
    trees: T,
    texts: LabelTexts,
    statistics: Statistics,
    fps: u32,
    open: Option<Open>,
    n_episodes: i64,
    n_frames: i64,
}

impl<E: From<EditError>, T: Iterator<Item = Result<EpisodeTree, E>>> Walk<T> {
    fn file(&mut self, root: &Path, to: &Path, place: FilePlace) -> Result<(), E> {
        let path = place.in_dataset(root, layout::DATA);
        let source = EpisodeSource::of(&path, place)?;
        let mut reader = BatchReader::open(&path, BATCH_ROWS).map_err(EditError::from)?;
        let mut writer: Option<BatchWriter> = None;
        while let Some(batch) = reader.next_batch().map_err(EditError::from)? {
            let batch = self.batch(&path, &source, &batch)?;
            let mut open = match writer.take() {
                Some(open) => open,
                None => {
                    let target = place.in_dataset(to, layout::DATA);
                    BatchWriter::create(&target, FRAMES.name(), batch.schema_ref(), WriteOptions::default())
                        .map_err(EditError::from)?
                }
            };
            open.write(&batch).map_err(EditError::from)?;
            writer = Some(open);
        }
        Ok(writer.map_or(Ok(()), BatchWriter::commit).map_err(EditError::from)?)
    }

    /// The rows with their labels.
    fn batch(&mut self, path: &Path, source: &EpisodeSource, batch: &RecordBatch) -> Result<RecordBatch, E> {
        let refused = |problem: String| EditError::refused("import.rows", path, problem);
        let column = |name: &str| {
            let column = batch.column_by_name(name).and_then(|column| column.as_primitive_opt::<Int64Type>());
            let column = column.filter(|column| column.null_count() == 0);
            column.ok_or_else(|| refused(format!("it has no column {name} of int64 without nulls")))
        };
        let [episodes, frames, indices, tasks] = NUMBERS.map(column);
        let (episodes, frames, indices, tasks) = (episodes?, frames?, indices?, tasks?);
        let mut labels = BatchLabels::default();
        for row in 0..batch.num_rows() {
            let numbers = [episodes, frames, indices, tasks].map(|column| column.value(row));
            if self.open.as_ref().is_none_or(|open| open.n_passed == open.columns.call_ids.len()) {
                self.begin(source, tasks.value(row))?;
            }
            self.pass(numbers, &mut labels).map_err(&refused)?;
        }
        Ok(labels.add_to(batch).map_err(EditError::rows(path))?)
    }

    /// Takes the tree of the next episode.
    fn begin(&mut self, source: &EpisodeSource, task_index: i64) -> Result<(), E> {
        let tree = self.trees.next().transpose()?;
        let missing = || EditError::refused("import.rows", &source.path, "it has more rows than there are episodes");
        let tree = tree.ok_or_else(missing)?;
        let n_frames = tree.calls.first().map_or(0, |root| root.frames.end);
        let columns = self.texts.columns(&tree, self.tables.slots(), n_frames, self.fps);
        let values = [
            ("subtask_index", Values::Int64(&columns.subtasks)),
            ("ntp.boundary", Values::Boolean(&columns.boundaries)),
            ("ntp.call_id", Values::Int64(&columns.call_ids)),
        ];
        self.statistics.append(&values, &(0..n_frames as usize));
        self.statistics.keep(&values, n_frames as usize).map_err(EditError::from)?;
        self.tables.append(&tree, source)?;
        self.open = Some(Open { columns, task_index, n_passed: 0 });
        self.n_episodes += 1;
        Ok(())
    }

    /// Passes a frame, whose labels go to the batch's.
    fn pass(&mut self, found: [i64; 4], labels: &mut BatchLabels) -> Result<(), String> {
        let Some(open) = &mut self.open else { return Ok(()) };
        let at = open.n_passed;
        let expected = [self.n_episodes - 1, at as i64, self.n_frames, open.task_index];
        if found != expected || at >= open.columns.call_ids.len() {
            return Err(format!("({}) are {found:?}, but should be {expected:?}", NUMBERS.join(", ")));
        }
        labels.push(&open.columns, at);
        open.n_passed += 1;
        self.n_frames += 1;
        Ok(())
    }

    fn finish(mut self, root: &Path) -> Result<Written, E> {
        let is_whole = self.open.is_none_or(|open| open.n_passed == open.columns.call_ids.len());
        if !is_whole || self.trees.next().transpose()?.is_some() {
            let problem = "it has fewer rows than its episodes have frames";
            return Err(EditError::refused("import.rows", &root.join(layout::DATA), problem).into());
        }
        Ok(self.tables.finish(self.texts.subtasks.texts().to_vec(), self.statistics)?)
    }
}

/// The labels of the rows of a batch.
#[derive(Default)]
struct BatchLabels {
    call_ids: Vec<i64>,
    programs: Vec<String>,
    subtasks: Vec<i64>,
    boundaries: Vec<bool>,
    entries: Vec<language::Entry>,
    /// Of the entries that the last frame has.
    open: std::ops::Range<u32>,
    positions: Vec<u32>,
    lengths: Vec<usize>,
}

impl BatchLabels {
    fn push(&mut self, columns: &LabelColumns, at: usize) {
        if at == 0 || self.call_ids.is_empty() {
            let begin = self.entries.len() as u32;
            self.entries.extend_from_slice(&columns.entries);
            self.open = begin..self.entries.len() as u32;
        }
        self.call_ids.push(columns.call_ids[at]);
        self.programs.push(columns.programs[at].clone());
        self.subtasks.push(columns.subtasks[at]);
        self.boundaries.push(columns.boundaries[at]);
        self.positions.extend(self.open.clone());
        self.lengths.push(self.open.len());
    }

    /// The rows with these labels, in place of those that they have.
    fn add_to(self, rows: &RecordBatch) -> Result<RecordBatch, ArrowError> {
        let required = |name: &str, kind: DataType| Field::new(name, kind, false);
        let mut columns: Vec<(Field, ArrayRef)> = vec![
            (required("subtask_index", DataType::Int64), Arc::new(Int64Array::from(self.subtasks))),
            (required("ntp.boundary", DataType::Boolean), Arc::new(BooleanArray::from(self.boundaries))),
            (required("ntp.call_id", DataType::Int64), Arc::new(Int64Array::from(self.call_ids))),
            (required("ntp.program", DataType::Utf8), Arc::new(StringArray::from(self.programs))),
        ];
        columns.extend(times(rows)?);
        columns.extend(language::columns(&self.entries, self.positions, &self.lengths)?);
        with_columns(rows, columns)
    }
}

/// The times of rows, and their numbers in a recording, where the rows do not tell them.
fn times(rows: &RecordBatch) -> Result<Vec<(Field, ArrayRef)>, ArrowError> {
    let missing = |name: &str| ArrowError::SchemaError(format!("there is no column {name}"));
    let mut columns: Vec<(Field, ArrayRef)> = Vec::new();
    if rows.column_by_name("ntp.time_secs").is_none() {
        let secs = rows.column_by_name("timestamp").and_then(|column| column.as_primitive_opt::<Float32Type>());
        let secs = secs.ok_or_else(|| missing("timestamp of float32"))?;
        // To the microsecond, which is more than its four bytes tell.
        let secs = Float64Array::from_iter_values(secs.values().iter().map(|&secs| micros(secs)));
        columns.push((Field::new("ntp.time_secs", DataType::Float64, false), Arc::new(secs)));
    }
    if rows.column_by_name("ntp.recording_frame").is_none() {
        let frames = rows.column_by_name("frame_index").ok_or_else(|| missing("frame_index"))?;
        columns.push((Field::new("ntp.recording_frame", DataType::Int64, false), Arc::clone(frames)));
    }
    Ok(columns)
}

fn micros(secs: f32) -> f64 {
    (f64::from(secs) * 1e6).round() / 1e6
}
