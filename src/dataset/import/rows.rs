//! The program tables of annotated episodes: a root, and a call for each label.

use std::collections::BTreeMap;
use std::path::Path;

use crate::artifact::sha256_bytes;
use crate::dataset::edit::EditError;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::files::rolling::Rolling;
use crate::dataset::import::ImportSummary;
use crate::dataset::plain::{LabelSpan, PlainSource};
use crate::dataset::schema::{CALLS, EPISODES, SCOPES};
use crate::dataset::tables::annotated::{AnnotatedCall, FAMILY};
use crate::dataset::tables::{calls, episodes};
use crate::table::{TableRows as _, TableSchema, TableWriter};
use crate::trace::Span;

const FILE_BYTES: usize = 100 << 20;
/// Rows of calls or episodes that are a row group.
const GROUP_ROWS: usize = 8192;

/// An episode, as its frames and labels tell it.
pub(super) struct Annotated<'a> {
    pub(super) episode_index: i64,
    pub(super) task_text: &'a str,
    pub(super) split: &'a str,
    pub(super) n_frames: i64,
    pub(super) data: FilePlace,
    /// SHA-256 of the file that it was read from.
    pub(super) source: &'a str,
    pub(super) calls: &'a [AnnotatedCall],
    /// Texts that calls count.
    pub(super) texts: &'a [String],
}

/// The tables being written.
pub(super) struct AnnotatedRows {
    fps: f64,
    calls: Rolling<TableWriter>,
    scopes: Rolling<TableWriter>,
    episodes: TableWriter,
    call_rows: calls::Rows,
    episode_rows: episodes::Rows,
    /// How many episodes of each task there were.
    trials: BTreeMap<String, i64>,
    summary: ImportSummary,
}

impl AnnotatedRows {
    pub(super) fn create(root: &Path, source: &PlainSource) -> Result<Self, EditError> {
        let rolling = |folder, schema: TableSchema| {
            Rolling::new(root, folder, FILE_BYTES, move |path| TableWriter::create(path, &schema, schema.options()))
        };
        Ok(Self {
            fps: source.info.fps,
            calls: rolling(layout::CALLS, CALLS),
            scopes: rolling(layout::SCOPES, SCOPES),
            episodes: TableWriter::create(&root.join(layout::EPISODES), &EPISODES, EPISODES.options())?,
            call_rows: calls::Rows::default(),
            episode_rows: episodes::Rows::default(),
            trials: BTreeMap::new(),
            summary: ImportSummary::default(),
        })
    }

    /// The root, and a call for each label, callers before callees.
    pub(super) fn calls(&self, spans: &[LabelSpan], n_frames: u64) -> Vec<AnnotatedCall> {
        let end = u32::try_from(n_frames).unwrap_or(u32::MAX);
        let root = AnnotatedCall { text: None, caller: None, depth: 0, frames: Span { begin: 0, end } };
        let mut calls = vec![root];
        let mut outer = 0;
        for span in spans {
            let [begin, end] = span.frames;
            let caller = if span.level == 1 { 0 } else { outer };
            if span.level == 1 {
                outer = calls.len() as u32;
            }
            let frames = Span { begin, end };
            calls.push(AnnotatedCall { text: Some(span.text), caller: Some(caller), depth: span.level, frames });
        }
        calls
    }

    /// Adds an episode, and writes the rows that are many enough for a row group.
    pub(super) fn append(&mut self, episode: &Annotated<'_>) -> Result<(), EditError> {
        self.append_episode(episode);
        self.call_rows.append_annotated(episode.calls, episode.texts, episode.episode_index, episode.n_frames);
        self.summary.episodes += 1;
        self.summary.frames += episode.n_frames as u64;
        self.summary.calls += episode.calls.len() as u64;
        if self.call_rows.n_rows() >= GROUP_ROWS {
            self.write()?;
        }
        Ok(())
    }

    fn append_episode(&mut self, episode: &Annotated<'_>) {
        let trial = self.trials.entry(episode.task_text.to_owned()).or_default();
        let (calls, n_frames) = (self.calls.place(), episode.n_frames);
        self.episode_rows.push(episodes::Row {
            episode_index: episode.episode_index,
            seed: "0".into(),
            task_id: task_id(episode.task_text).into(),
            task_text: episode.task_text.into(),
            family: FAMILY.into(),
            split: episode.split.into(),
            trial: *trial,
            counts: Vec::new(),
            actor: "demonstrator".into(),
            outcome: "success".into(),
            cause: None,
            success: true,
            recording: episode.data.relative(layout::DATA).into(),
            recording_sha256: episode.source.into(),
            recording_index: episode.episode_index,
            n_frames,
            n_recorded_frames: n_frames,
            sim_secs: (n_frames - 1).max(0) as f64 / self.fps,
            specification: "episode".into(),
            specification_frames: n_frames,
            slots: Vec::new(),
            n_calls: episode.calls.len() as i64,
            calls_chunk: i64::from(calls.chunk),
            calls_file: i64::from(calls.file),
            calls_from: self.summary.calls as i64,
            n_scopes: 0,
            scopes_chunk: 0,
            scopes_file: 0,
            scopes_from: 0,
        });
        *trial += 1;
    }

    /// Writes the rows that are held, a row group of each table: an episode's calls are in one file.
    fn write(&mut self) -> Result<(), EditError> {
        let (calls, episodes) = (std::mem::take(&mut self.call_rows), std::mem::take(&mut self.episode_rows));
        self.calls.write(|file| file.write_row_group(&calls.columns()))?;
        Ok(self.episodes.write_row_group(&episodes.columns())?)
    }

    pub(super) fn finish(mut self) -> Result<ImportSummary, EditError> {
        if self.episode_rows.n_rows() > 0 {
            self.write()?;
        }
        self.calls.finish()?;
        self.scopes.finish()?;
        self.episodes.commit()?;
        Ok(self.summary)
    }
}

/// Names a task by its text, so that it has one name in all datasets.
pub(in crate::dataset) fn task_id(text: &str) -> String {
    format!("task_{}", &sha256_bytes(text.as_bytes())[..12])
}
