//! The frames: carried over with the call that each belongs to.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Int64Array, RecordBatch, StringArray};
use arrow::compute::concat_batches;
use arrow::datatypes::{DataType, Field};

use crate::artifact::sha256_file;
use crate::dataset::edit::EditError;
use crate::dataset::export::with_columns;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::import::rows::{Annotated, AnnotatedRows};
use crate::dataset::plain::{DeclaredKind, PlainLabels, PlainSource, RowCursor, whole_numbers};
use crate::dataset::schema::FRAMES;
use crate::dataset::tables::annotated::{AnnotatedCall, ROOT};
use crate::table::{BatchWriter, WriteOptions};

/// Rows of an episode become a row group at its end, or when they are this large.
const GROUP_BYTES: usize = 24 << 20;

/// Writes the frames, file by file as they were, and gives each episode to `rows`. Gives the file and the task of each
/// episode.
pub(super) fn write_frames(
    source: &PlainSource,
    labels: &mut PlainLabels,
    to: &Path,
    rows: &mut AnnotatedRows,
) -> Result<Vec<(FilePlace, i64)>, EditError> {
    let has_pictures = source.info.features.iter().any(|feature| feature.kind == DeclaredKind::Image);
    let mut cursor = RowCursor::new(has_pictures);
    let mut open: Option<OpenFile> = None;
    let mut places = Vec::new();
    let has_numbers = source.info.feature("subtask_index").is_some();
    for position in 0..source.episodes.len() {
        let episode = &source.episodes[position];
        let (path, first) = source.rows_of(episode)?;
        if open.as_ref().is_none_or(|open| open.path != path) {
            open = Some(OpenFile::after(open, &path)?);
        }
        let Some(file) = &mut open else { continue };
        let spans = labels.of_episode(source, position)?;
        let calls = rows.calls(&spans, episode.length);
        let mut walk =
            Walk { source, position, calls: &calls, texts: labels, has_numbers, frame: 0, next: 1, task: None };
        let mut held: Vec<RecordBatch> = Vec::new();
        let mut n_bytes = 0;
        cursor.each(&path, first, episode.length as usize, |batch| {
            let batch = walk.annotate(&path, &batch)?;
            n_bytes += batch.get_array_memory_size();
            held.push(batch);
            if n_bytes >= GROUP_BYTES {
                n_bytes = 0;
                file.write(to, &mut held)?;
            }
            Ok::<_, EditError>(())
        })?;
        // The first of several.
        let first = episode.tasks.first().and_then(|task| source.tasks.number(task));
        let task_index = first.or(walk.task).unwrap_or(0);
        file.write(to, &mut held)?;
        places.push((file.place, task_index));
        let text = source.tasks.get(task_index).unwrap_or_default();
        rows.append(&Annotated {
            episode_index: episode.index,
            task_text: text,
            split: source.info.split_of(position as u64).unwrap_or("none"),
            n_frames: episode.length as i64,
            data: file.place,
            source: &file.sha256,
            calls: &calls,
            texts: labels.texts(),
        })?;
    }
    if let Some(open) = open {
        open.finish()?;
    }
    Ok(places)
}

/// A file of frames that is being written.
struct OpenFile {
    path: std::path::PathBuf,
    /// SHA-256 of the file that it is read from.
    sha256: String,
    place: FilePlace,
    writer: Option<BatchWriter>,
}

impl OpenFile {
    /// The file behind another one, of what is in `path`.
    fn after(before: Option<Self>, path: &Path) -> Result<Self, EditError> {
        let place = match before {
            Some(before) => {
                let place = before.place.next();
                before.finish()?;
                place
            }
            None => FilePlace::default(),
        };
        Ok(Self { path: path.to_owned(), sha256: sha256_file(path)?, place, writer: None })
    }

    /// Writes rows as a row group.
    fn write(&mut self, to: &Path, held: &mut Vec<RecordBatch>) -> Result<(), EditError> {
        let held = std::mem::take(held);
        let Some(first) = held.first() else { return Ok(()) };
        let rows = concat_batches(&first.schema(), &held).map_err(EditError::rows(&self.path))?;
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => {
                let target = self.place.in_dataset(to, layout::DATA);
                BatchWriter::create(&target, FRAMES.name(), rows.schema_ref(), WriteOptions::default())?
            }
        };
        writer.write(&rows)?;
        self.writer = Some(writer);
        Ok(())
    }

    fn finish(self) -> Result<(), EditError> {
        Ok(self.writer.map_or(Ok(()), BatchWriter::commit)?)
    }
}

/// A place among the frames of an episode.
struct Walk<'w> {
    source: &'w PlainSource,
    position: usize,
    calls: &'w [AnnotatedCall],
    texts: &'w PlainLabels,
    /// Whether frames have `subtask_index` already.
    has_numbers: bool,
    frame: u32,
    /// The first call that has not begun.
    next: usize,
    /// Of the first frame.
    task: Option<i64>,
}

impl Walk<'_> {
    /// The rows with the call of each.
    fn annotate(&mut self, path: &Path, batch: &RecordBatch) -> Result<RecordBatch, EditError> {
        self.check(path, batch)?;
        let n_rows = batch.num_rows();
        let (mut ids, mut programs, mut numbers) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..n_rows {
            while self.calls.get(self.next).is_some_and(|call| call.frames.begin <= self.frame) {
                self.next += 1;
            }
            let running = self.running();
            ids.push(running as i64);
            programs.push(self.path_of(running));
            numbers.push(self.number_of(running));
            self.frame += 1;
        }
        let mut columns: Vec<(Field, ArrayRef)> = vec![
            (Field::new("ntp.call_id", DataType::Int64, false), Arc::new(Int64Array::from(ids))),
            (Field::new("ntp.program", DataType::Utf8, false), Arc::new(StringArray::from(programs))),
        ];
        if !self.has_numbers {
            let field = Field::new("subtask_index", DataType::Int64, false);
            columns.push((field, Arc::new(Int64Array::from(numbers))));
        }
        with_columns(batch, columns).map_err(EditError::rows(path))
    }

    /// The deepest call that runs: callers come before what they call, so that it is among those that have begun.
    fn running(&self) -> usize {
        let last = self.next.saturating_sub(1);
        let callers = std::iter::successors(Some(last), |&at| self.calls[at].caller.map(|caller| caller as usize));
        callers.into_iter().find(|&at| self.frame < self.calls[at].frames.end).unwrap_or(0)
    }

    fn path_of(&self, call: usize) -> String {
        let callers = std::iter::successors(Some(call), |&at| self.calls[at].caller.map(|caller| caller as usize));
        let mut names: Vec<&str> = callers.map(|at| self.name_of(at)).collect();
        names.reverse();
        names.join("/")
    }

    fn name_of(&self, call: usize) -> &str {
        match self.calls[call].text {
            Some(text) => self.texts.texts().get(text as usize).map_or("", String::as_str),
            None => ROOT,
        }
    }

    /// The number of the first level's text; -1 for none.
    fn number_of(&self, call: usize) -> i64 {
        let callers = std::iter::successors(Some(call), |&at| self.calls[at].caller.map(|caller| caller as usize));
        let first = callers.into_iter().find(|&at| self.calls[at].depth == 1);
        first.and_then(|at| self.calls[at].text).map_or(-1, i64::from)
    }

    /// Rows are where the episode's row says.
    fn check(&mut self, path: &Path, batch: &RecordBatch) -> Result<(), EditError> {
        let refused = |problem: String| EditError::refused("import.rows", path, problem);
        let column = |name: &str| {
            whole_numbers(batch, name).ok_or_else(|| refused(format!("it has no column {name} of int64 without nulls")))
        };
        let [episodes, frames] = [column("episode_index")?, column("frame_index")?];
        let [indices, tasks] = [column("index")?, column("task_index")?];
        let episode = &self.source.episodes[self.position];
        for row in 0..batch.num_rows() {
            let frame = i64::from(self.frame) + row as i64;
            let found = (episodes[row], frames[row], indices[row]);
            let wanted = (self.position as i64, frame, episode.rows[0] + frame);
            if found != wanted {
                let names = "(episode_index, frame_index, index)";
                return Err(refused(format!("{names} are {found:?}, but should be {wanted:?}")));
            }
            if self.source.tasks.get(tasks[row]).is_none() {
                let n_tasks = self.source.tasks.rows.len();
                return Err(refused(format!("task_index is {}, but there are {n_tasks}", tasks[row])));
            }
        }
        self.task = self.task.or(tasks.first().copied());
        Ok(())
    }
}
