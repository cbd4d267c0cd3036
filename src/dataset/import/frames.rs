//! The frames: carried over with the call that each belongs to.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{Array as _, ArrayRef, AsArray as _, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field, Int64Type};

use crate::artifact::sha256_file;
use crate::dataset::edit::EditError;
use crate::dataset::export::with_columns;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::import::episode::Annotated;
use crate::dataset::import::rows::AnnotatedRows;
use crate::dataset::schema::FRAMES;
use crate::dataset::tables::annotated::ROOT;
use crate::table::{BatchReader, BatchWriter, WriteOptions};

/// Rows that are read at a time: they may hold pictures.
const BATCH_ROWS: usize = 1024;

/// The columns of numbers that frames are understood by.
const NUMBERS: [&str; 5] = ["episode_index", "frame_index", "index", "task_index", "subtask_index"];

/// Writes the files of frames again, and gives each episode to `rows`.
pub(super) fn write_frames(
    root: &Path,
    to: &Path,
    subtasks: &[String],
    rows: &mut AnnotatedRows,
) -> Result<(), EditError> {
    let mut walk = Walk { subtasks, rows, source: Arc::default(), open: None, n_episodes: 0, n_frames: 0 };
    let mut place = FilePlace::default();
    while place == FilePlace::default() || place.is_there(root, layout::DATA)? {
        let path = place.in_dataset(root, layout::DATA);
        walk.source = sha256_file(&path)?.into();
        let mut reader = BatchReader::open(&path, BATCH_ROWS)?;
        let mut writer: Option<BatchWriter> = None;
        while let Some(batch) = reader.next_batch()? {
            let batch = walk.annotate(&path, place, &batch)?;
            let mut open = match writer.take() {
                Some(open) => open,
                None => {
                    let target = place.in_dataset(to, layout::DATA);
                    BatchWriter::create(&target, FRAMES.name(), batch.schema_ref(), WriteOptions::default())?
                }
            };
            open.write(&batch)?;
            writer = Some(open);
        }
        writer.map_or(Ok(()), BatchWriter::commit)?;
        place = place.next();
    }
    walk.end()
}

struct Walk<'w> {
    subtasks: &'w [String],
    rows: &'w mut AnnotatedRows,
    /// Hash of the file that is being read.
    source: Arc<str>,
    open: Option<Annotated>,
    n_episodes: i64,
    n_frames: i64,
}

impl Walk<'_> {
    /// The rows with the call of each.
    fn annotate(&mut self, path: &Path, place: FilePlace, batch: &RecordBatch) -> Result<RecordBatch, EditError> {
        let refused = |problem: String| EditError::refused("import.rows", path, problem);
        let column = |name: &str| {
            let column = batch.column_by_name(name).and_then(|column| column.as_primitive_opt::<Int64Type>());
            let column = column.filter(|column| column.null_count() == 0);
            column.ok_or_else(|| refused(format!("it has no column {name} of int64 without nulls")))
        };
        let [episodes, frames, indices, tasks, subtasks] = NUMBERS.map(column);
        let (episodes, frames, indices, tasks, subtasks) = (episodes?, frames?, indices?, tasks?, subtasks?);
        let (mut call_ids, mut programs) = (Vec::new(), Vec::new());
        for row in 0..batch.num_rows() {
            let numbers = [episodes, frames, indices, tasks, subtasks].map(|column| column.value(row));
            let subtask = self.step(place, numbers).map_err(&refused)?;
            let n_runs = self.open.as_ref().map_or(0, |open| open.runs.len());
            call_ids.push(if subtask.is_some() { n_runs as i64 } else { 0 });
            programs.push(subtask.map_or(ROOT.to_owned(), |subtask| format!("{ROOT}/{}", self.subtasks[subtask])));
        }
        let columns: Vec<(Field, ArrayRef)> = vec![
            (Field::new("ntp.call_id", DataType::Int64, false), Arc::new(Int64Array::from(call_ids))),
            (Field::new("ntp.program", DataType::Utf8, false), Arc::new(StringArray::from(programs))),
        ];
        with_columns(batch, columns).map_err(EditError::rows(path))
    }

    /// Takes a frame down; gives its sub-task.
    fn step(
        &mut self,
        place: FilePlace,
        [episode, frame, index, task, subtask]: [i64; 5],
    ) -> Result<Option<usize>, String> {
        if self.open.as_ref().is_none_or(|open| open.episode_index != episode) {
            self.close().map_err(|error| error.to_string())?;
            let source = Arc::clone(&self.source);
            let begun =
                Annotated { episode_index: episode, task_index: task, data: place, source, ..Annotated::default() };
            self.open = Some(begun);
            self.n_episodes += 1;
        }
        let (expected, n_subtasks) = (self.n_frames, self.subtasks.len());
        let Some(open) = &mut self.open else { return Ok(None) };
        let found = (episode, frame, index, task, open.data);
        let wanted = (self.n_episodes - 1, open.n_frames, expected, open.task_index, place);
        if found != wanted {
            return Err(format!(
                "(episode_index, frame_index, index, task_index, file) are {found:?}, but should be {wanted:?}"
            ));
        }
        open.n_frames += 1;
        self.n_frames += 1;
        let Ok(subtask) = usize::try_from(subtask) else { return Ok(None) };
        if subtask >= n_subtasks {
            return Err(format!("row {expected}: subtask_index is {subtask}, but there are {n_subtasks}"));
        }
        match open.runs.last_mut() {
            Some((last, _, end)) if *last == subtask && *end == frame => *end = frame + 1,
            _ => open.runs.push((subtask, frame, frame + 1)),
        }
        Ok(Some(subtask))
    }

    fn close(&mut self) -> Result<(), EditError> {
        self.open.take().map_or(Ok(()), |open| self.rows.append(&open))
    }

    fn end(mut self) -> Result<(), EditError> {
        self.close()
    }
}
