//! The program tables of annotated episodes: a root, and a call for each run of frames of one sub-task.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, BooleanArray, Int64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field};

use crate::artifact::sha256_bytes;
use crate::dataset::edit::EditError;
use crate::dataset::export::{copy_files, with_columns};
use crate::dataset::files::layout;
use crate::dataset::files::rolling::Rolling;
use crate::dataset::import::ImportSummary;
use crate::dataset::import::episode::Annotated;
use crate::dataset::schema::{CALLS, EPISODES, META_EPISODES, SCOPES};
use crate::dataset::tables::annotated::{AnnotatedCall, ROOT};
use crate::dataset::tables::{calls, episodes, scopes};
use crate::table::{TableRows as _, TableSchema, TableWriter, WriteOptions};
use crate::trace::Span;

const FILE_BYTES: usize = 100 << 20;

/// The tables being written.
pub(super) struct AnnotatedRows {
    tasks: Vec<String>,
    subtasks: Vec<String>,
    fps: f64,
    calls: Rolling<TableWriter>,
    scopes: Rolling<TableWriter>,
    episodes: TableWriter,
    /// How many episodes of each task there were.
    trials: BTreeMap<String, i64>,
    lengths: Vec<(i64, i64)>,
    summary: ImportSummary,
}

impl AnnotatedRows {
    pub(super) fn create(root: &Path, tasks: &[String], subtasks: &[String], fps: f64) -> Result<Self, EditError> {
        let rolling = |folder, schema: TableSchema| {
            Rolling::new(root, folder, FILE_BYTES, move |path| TableWriter::create(path, &schema, schema.options()))
        };
        Ok(Self {
            tasks: tasks.to_vec(),
            subtasks: subtasks.to_vec(),
            fps,
            calls: rolling(layout::CALLS, CALLS),
            scopes: rolling(layout::SCOPES, SCOPES),
            episodes: TableWriter::create(&root.join(layout::EPISODES), &EPISODES, EPISODES.options())?,
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
        let (index, n_frames) = (episode.episode_index, episode.n_frames);
        let (mut calls, mut scopes) = (calls::Rows::default(), scopes::Rows::default());
        let annotated = annotated_calls(episode, &self.subtasks);
        calls.append_annotated(&annotated, index, n_frames);
        scopes.append_annotated(&annotated, index, n_frames);
        let (n_calls, n_scopes) = (calls.n_rows(), scopes.n_rows());
        self.append_episode(episode, n_calls as i64)?;
        self.calls.write(|file| file.write_row_group(&calls.columns()))?;
        self.scopes.write(|file| file.write_row_group(&scopes.columns()))?;
        self.lengths.push((n_frames, episode.task_index));
        self.summary.episodes += 1;
        self.summary.frames += n_frames as u64;
        self.summary.calls += n_calls as u64;
        self.summary.scopes += n_scopes as u64;
        Ok(())
    }

    fn append_episode(&mut self, episode: &Annotated, n_calls: i64) -> Result<(), EditError> {
        let text = usize::try_from(episode.task_index).ok().and_then(|task| self.tasks.get(task));
        let Some(text) = text.cloned() else {
            let problem = format!("task_index is {}, but there are {}", episode.task_index, self.tasks.len());
            return Err(EditError::refused("import.rows", Path::new(layout::DATA), problem));
        };
        let trial = self.trials.entry(text.clone()).or_default();
        let (calls, scopes, n_frames) = (self.calls.place(), self.scopes.place(), episode.n_frames);
        let mut rows = episodes::Rows::default();
        rows.push(episodes::Row {
            episode_index: episode.episode_index,
            seed: "0".into(),
            task_id: task_id(&text).into(),
            task_text: text.into(),
            family: "annotated".into(),
            split: "seen".into(),
            trial: *trial,
            counts: Vec::new(),
            actor: "demonstrator".into(),
            outcome: "success".into(),
            cause: None,
            success: true,
            recording: episode.data.relative(layout::DATA).into(),
            recording_sha256: (*episode.source).into(),
            recording_index: episode.episode_index,
            n_frames,
            n_recorded_frames: n_frames,
            sim_secs: (n_frames - 1).max(0) as f64 / self.fps,
            specification: "episode".into(),
            specification_frames: n_frames,
            slots: Vec::new(),
            n_calls,
            calls_chunk: i64::from(calls.chunk),
            calls_file: i64::from(calls.file),
            calls_from: self.summary.calls as i64,
            n_scopes: n_calls * n_frames,
            scopes_chunk: i64::from(scopes.chunk),
            scopes_file: i64::from(scopes.file),
            scopes_from: self.summary.scopes as i64,
        });
        *trial += 1;
        Ok(self.episodes.write_row_group(&rows.columns())?)
    }

    pub(super) fn finish(self) -> Result<ImportSummary, EditError> {
        self.calls.finish()?;
        self.scopes.finish()?;
        self.episodes.commit()?;
        Ok(self.summary)
    }
}

/// The root, and a call for each run of frames.
fn annotated_calls<'t>(episode: &Annotated, subtasks: &'t [String]) -> Vec<AnnotatedCall<'t>> {
    let span = |begin: i64, end: i64| Span {
        begin: u32::try_from(begin).unwrap_or(u32::MAX),
        end: u32::try_from(end).unwrap_or(u32::MAX),
    };
    let root = AnnotatedCall { program: ROOT, frames: span(0, episode.n_frames) };
    let call = |&(subtask, begin, end): &(usize, i64, i64)| AnnotatedCall {
        program: &subtasks[subtask],
        frames: span(begin, end),
    };
    std::iter::once(root).chain(episode.runs.iter().map(call)).collect()
}

/// Names a task by its text, so that it has one name in all datasets.
pub(in crate::dataset) fn task_id(text: &str) -> String {
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
