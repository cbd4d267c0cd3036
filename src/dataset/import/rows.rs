//! The program tables of annotated episodes: a root, and a call for each run of frames of one sub-task.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, BooleanArray, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field};

use crate::artifact::sha256_bytes;
use crate::dataset::tables::calls::{CallRows, ScopeRows};
use crate::dataset::edit::EditError;
use crate::dataset::export::{copy_files, with_columns};
use crate::dataset::import::frames::Annotated;
use crate::dataset::import::{ImportSummary, ROOT};
use crate::dataset::files::layout;
use crate::dataset::files::rolling::RollingTable;
use crate::dataset::schema::{CALLS, EPISODES, META_EPISODES, SCOPES};
use crate::table::{Column, TableWriter, Values, WriteOptions};
use crate::trace::Span;

const FILE_BYTES: usize = 100 << 20;

/// The tables being written.
pub(super) struct AnnotatedRows {
    tasks: Vec<String>,
    subtasks: Vec<String>,
    fps: f64,
    calls: RollingTable,
    scopes: RollingTable,
    episodes: TableWriter,
    /// How many episodes of each task there were.
    trials: BTreeMap<String, i64>,
    lengths: Vec<(i64, i64)>,
    summary: ImportSummary,
}

impl AnnotatedRows {
    pub(super) fn create(root: &Path, tasks: &[String], subtasks: &[String], fps: f64) -> Result<Self, EditError> {
        let rolling = |folder, schema, options| RollingTable::new(root, folder, schema, options, FILE_BYTES);
        Ok(Self {
            tasks: tasks.to_vec(),
            subtasks: subtasks.to_vec(),
            fps,
            calls: rolling(layout::CALLS, CALLS, CallRows::options()),
            scopes: rolling(layout::SCOPES, SCOPES, ScopeRows::options()),
            episodes: TableWriter::create(&root.join(layout::EPISODES), &EPISODES, WriteOptions::default())?,
            trials: BTreeMap::new(),
            lengths: Vec::new(),
            summary: ImportSummary { subtasks: subtasks.len() as u64, ..ImportSummary::default() },
        })
    }

    /// Frames and task of each episode.
    pub(super) fn lengths(&self) -> &[(i64, i64)] {
        &self.lengths
    }

    /// Adds an episode: a row group of each table.
    pub(super) fn append(&mut self, episode: &Annotated) -> Result<(), EditError> {
        let calls = calls(episode);
        self.append_episode(episode, &calls)?;
        self.append_calls(episode, &calls)?;
        let n_scopes = self.append_scopes(episode, &calls)?;
        self.lengths.push((episode.n_frames, episode.task_index));
        self.summary.episodes += 1;
        self.summary.frames += episode.n_frames as u64;
        self.summary.calls += calls.len() as u64;
        self.summary.scopes += n_scopes;
        Ok(())
    }

    fn append_calls(&mut self, episode: &Annotated, calls: &[Call]) -> Result<(), EditError> {
        let n_calls = calls.len();
        let number = |of: &dyn Fn(usize) -> i64| Column::Int64((0..n_calls).map(of).collect());
        let optional = |of: &dyn Fn(usize) -> i64| Column::OptionalInt64((0..n_calls).map(|at| Some(of(at))).collect());
        let name = |call: &Call| call.subtask.map_or(ROOT.to_owned(), |subtask| self.subtasks[subtask].clone());
        let (begin, end) = (|at: usize| i64::from(calls[at].frames.begin), |at: usize| i64::from(calls[at].frames.end));
        let columns = [
            ("episode_index", number(&|_| episode.episode_index)),
            ("call_id", number(&|at| at as i64)),
            ("caller_id", Column::OptionalInt64((0..n_calls).map(|at| (at > 0).then_some(0)).collect())),
            ("depth", number(&|at| i64::from(at > 0))),
            ("step", number(&|at| at.saturating_sub(1) as i64)),
            ("program", Column::Text(calls.iter().map(name).collect())),
            ("argument_slot", Column::OptionalInt64(vec![None; n_calls])),
            ("argument", Column::OptionalText(vec![None; n_calls])),
            ("input_begin", number(&|_| 0)),
            ("input_end", number(&|_| episode.n_frames)),
            ("output_begin", optional(&begin)),
            ("output_end", optional(&end)),
            ("frame_begin", number(&begin)),
            ("frame_end", number(&end)),
            ("end_of_program", Column::Boolean((0..n_calls).map(|at| at > 0 && at + 1 == n_calls).collect())),
            ("instruction", Column::OptionalText(vec![None; n_calls])),
        ];
        Ok(self.calls.write_row_group(&columns.each_ref().map(|(name, column)| (*name, Values::of(column))))?)
    }

    fn append_scopes(&mut self, episode: &Annotated, calls: &[Call]) -> Result<u64, EditError> {
        let window = 0..u32::try_from(episode.n_frames).unwrap_or(u32::MAX);
        let mut columns: [Vec<i64>; 4] = Default::default();
        let mut flags: [Vec<bool>; 2] = Default::default();
        for (call, Call { frames, .. }) in calls.iter().enumerate() {
            for frame in window.clone() {
                let numbers = [episode.episode_index, call as i64, i64::from(frame), frames.label(frame) as i64];
                columns.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
                flags[0].push(frame == frames.begin);
                flags[1].push(frame == frames.last());
            }
        }
        let [episodes, ids, frames, labels] = &columns;
        let [starts, ends] = &flags;
        self.scopes.write_row_group(&[
            ("episode_index", Values::Int64(episodes)),
            ("call_id", Values::Int64(ids)),
            ("specification_frame", Values::Int64(frames)),
            ("label", Values::Int64(labels)),
            ("is_start", Values::Boolean(starts)),
            ("is_end", Values::Boolean(ends)),
        ])?;
        Ok(ids.len() as u64)
    }

    fn append_episode(&mut self, episode: &Annotated, calls: &[Call]) -> Result<(), EditError> {
        let text = usize::try_from(episode.task_index).ok().and_then(|task| self.tasks.get(task));
        let Some(text) = text.cloned() else {
            let problem = format!("task_index is {}, but there are {}", episode.task_index, self.tasks.len());
            return Err(EditError::refused("import.rows", Path::new(layout::DATA), problem));
        };
        let trial = self.trials.entry(text.clone()).or_default();
        let (call_place, scope_place) = (self.calls.place(), self.scopes.place());
        let number = |number: i64| Column::Int64(vec![number]);
        let word = |word: &str| Column::Text(vec![word.to_owned()]);
        let n_frames = episode.n_frames;
        let columns = [
            ("episode_index", number(episode.episode_index)),
            ("seed", word("0")),
            ("task_id", word(&task_id(&text))),
            ("task_text", word(&text)),
            ("family", word("annotated")),
            ("split", word("seen")),
            ("trial", number(*trial)),
            ("counts", Column::Int64List(vec![Vec::new()])),
            ("actor", word("demonstrator")),
            ("outcome", word("success")),
            ("cause", Column::OptionalText(vec![None])),
            ("success", Column::Boolean(vec![true])),
            ("recording", word(&episode.data.relative(layout::DATA))),
            ("recording_sha256", word(&episode.source)),
            ("recording_index", number(episode.episode_index)),
            ("n_frames", number(n_frames)),
            ("n_recorded_frames", number(n_frames)),
            ("sim_secs", Column::Float64(vec![(n_frames - 1).max(0) as f64 / self.fps])),
            ("specification", word("episode")),
            ("specification_frames", number(n_frames)),
            ("slots", Column::TextList(vec![Vec::new()])),
            ("n_calls", number(calls.len() as i64)),
            ("calls/chunk_index", number(i64::from(call_place.chunk))),
            ("calls/file_index", number(i64::from(call_place.file))),
            ("calls_from_index", number(self.summary.calls as i64)),
            ("n_scopes", number(calls.len() as i64 * n_frames)),
            ("scopes/chunk_index", number(i64::from(scope_place.chunk))),
            ("scopes/file_index", number(i64::from(scope_place.file))),
            ("scopes_from_index", number(self.summary.scopes as i64)),
        ];
        *trial += 1;
        Ok(self.episodes.write_row_group(&columns.each_ref().map(|(name, column)| (*name, Values::of(column))))?)
    }

    pub(super) fn finish(self) -> Result<ImportSummary, EditError> {
        self.calls.finish()?;
        self.scopes.finish()?;
        self.episodes.commit()?;
        Ok(self.summary)
    }
}

/// A call: the root's, or that of a sub-task.
struct Call {
    subtask: Option<usize>,
    frames: Span,
}

fn calls(episode: &Annotated) -> Vec<Call> {
    let span = |begin: i64, end: i64| Span {
        begin: u32::try_from(begin).unwrap_or(u32::MAX),
        end: u32::try_from(end).unwrap_or(u32::MAX),
    };
    let root = Call { subtask: None, frames: span(0, episode.n_frames) };
    let runs = episode.runs.iter();
    std::iter::once(root)
        .chain(runs.map(|&(subtask, begin, end)| Call { subtask: Some(subtask), frames: span(begin, end) }))
        .collect()
}

/// Names a task by its text, so that it has one name in all datasets.
fn task_id(text: &str) -> String {
    format!("task_{}", &sha256_bytes(text.as_bytes())[..12])
}

/// Writes the rows of episodes again, with the columns that name task, split and outcome.
pub(super) fn write_meta(root: &Path, to: &Path, tasks: &[String], episodes: &[(i64, i64)]) -> Result<(), EditError> {
    let id = |task: i64| Some(task_id(tasks.get(usize::try_from(task).ok()?)?));
    let files = (layout::META_EPISODES, META_EPISODES.name());
    let mut left = episodes.iter();
    copy_files(root, to, files, &WriteOptions::default(), |rows| {
        let of_rows: Vec<(i64, i64)> = left.by_ref().take(rows.num_rows()).copied().collect();
        check_lengths(root, &rows, &of_rows)?;
        let ids: StringArray = of_rows.iter().map(|(_, task)| Some(id(*task).unwrap_or_default())).collect();
        let n_rows = of_rows.len();
        let columns: Vec<(Field, ArrayRef)> = vec![
            (Field::new("ntp/task_id", DataType::Utf8, false), Arc::new(ids)),
            (Field::new("ntp/split", DataType::Utf8, false), Arc::new(StringArray::from(vec!["seen"; n_rows]))),
            (Field::new("ntp/success", DataType::Boolean, false), Arc::new(BooleanArray::from(vec![true; n_rows]))),
        ];
        with_columns(&rows, columns).map_err(EditError::rows(layout::META_EPISODES))
    })?;
    if left.next().is_some() {
        let problem = format!("it has fewer rows than there are episodes, {}", episodes.len());
        return Err(EditError::refused("import.rows", &root.join(layout::META_EPISODES), problem));
    }
    Ok(())
}

/// The lengths must be those of the frames.
fn check_lengths(root: &Path, rows: &RecordBatch, found: &[(i64, i64)]) -> Result<(), EditError> {
    let lengths =
        rows.column_by_name("length").and_then(|column| column.as_primitive_opt::<arrow::datatypes::Int64Type>());
    let lengths: &[i64] = lengths.map_or(&[], |lengths: &Int64Array| lengths.values());
    if !lengths.iter().eq(found.iter().map(|(length, _)| length)) {
        let problem = "the lengths of its episodes are not those of the frames, or there are too many rows";
        return Err(EditError::refused("import.rows", &root.join(layout::META_EPISODES), problem));
    }
    Ok(())
}
