//! The tables under `ntp/`: calls and scopes of the trees, and a row an episode.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde_json::Value;

use crate::artifact::sha256_file;
use crate::dataset::DatasetError;
use crate::dataset::edit::EditError;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::files::rolling::Rolling;
use crate::dataset::import::task_id;
use crate::dataset::relabel::EpisodeTree;
use crate::dataset::schema::{CALLS, EPISODES, SCOPES};
use crate::dataset::statistics::Statistics;
use crate::dataset::tables::view::CallSpans;
use crate::dataset::tables::{calls, episodes, scopes};
use crate::table::{
    Batch as _, Columns, TableReader, TableRows as _, TableWriter, TextRows, Values, WriteOptions, batch,
};
use crate::task::Family;

const FILE_BYTES: usize = 100 << 20;
/// Rows that make a row group, at least; of the table of episodes, and of the others.
const EPISODE_GROUP_ROWS: usize = 1 << 12;
const GROUP_ROWS: usize = 1 << 14;

/// The column behind those of calls, as a line of the schema's text.
const CONFIDENCE: &str = "  required float confidence;\n";

/// The file of frames that an episode is read from.
pub(super) struct EpisodeSource {
    pub(super) path: PathBuf,
    place: FilePlace,
    sha256: Arc<str>,
}

impl EpisodeSource {
    pub(super) fn of(path: &Path, place: FilePlace) -> Result<Self, EditError> {
        Ok(Self { path: path.to_owned(), place, sha256: sha256_file(path)?.into() })
    }
}

/// Task, split and outcome of an episode, as `meta/episodes` repeats them.
pub(super) struct EpisodeNames {
    pub(super) n_frames: i64,
    pub(super) task_id: String,
    pub(super) split: String,
    pub(super) success: bool,
}

/// What was written, and what is still to be told elsewhere.
pub(super) struct Written {
    pub(super) episodes: Vec<EpisodeNames>,
    pub(super) families: BTreeSet<Family>,
    pub(super) subtasks: Vec<String>,
    pub(super) statistics: Statistics,
    pub(super) n_frames: u64,
    pub(super) n_calls: u64,
    pub(super) n_scopes: u64,
}

/// The tables being written.
pub(super) struct Tables {
    slots: Vec<String>,
    fps: f64,
    /// The rows of episodes of a dataset of ours, batch by batch.
    known: Option<TableReader>,
    batch: std::vec::IntoIter<OwnRow>,
    calls: calls::Rows,
    confidences: Vec<f32>,
    scopes: scopes::Rows,
    episodes: episodes::Rows,
    call_files: Rolling<TableWriter>,
    scope_files: Rolling<TableWriter>,
    episode_file: TableWriter,
    trials: BTreeMap<String, i64>,
    names: Vec<EpisodeNames>,
    families: BTreeSet<Family>,
    n_frames: u64,
    n_calls: u64,
    n_scopes: u64,
}

/// What a dataset of ours tells of an episode.
struct OwnRow {
    seed: String,
    task_id: String,
    task_text: String,
    split: String,
    trial: i64,
    counts: Vec<i64>,
    actor: String,
    outcome: String,
    cause: Option<String>,
    success: bool,
    recording: String,
    recording_sha256: String,
    recording_index: i64,
    n_recorded_frames: i64,
    sim_secs: f64,
}

impl Tables {
    /// Begins them in the folder `to`.
    pub(super) fn create(root: &Path, to: &Path, slots: &[String], info: &Value) -> Result<Self, EditError> {
        let call_options = WriteOptions { further: vec![CONFIDENCE.to_owned()], ..CALLS.options() };
        let begin_calls = move |path: &Path| TableWriter::create(path, &CALLS, call_options.clone());
        let begin_scopes = |path: &Path| TableWriter::create(path, &SCOPES, SCOPES.options());
        Ok(Self {
            slots: slots.to_vec(),
            fps: info["fps"].as_f64().unwrap_or(1.0),
            known: own_rows(root)?,
            batch: Vec::new().into_iter(),
            calls: calls::Rows::default(),
            confidences: Vec::new(),
            scopes: scopes::Rows::default(),
            episodes: episodes::Rows::default(),
            call_files: Rolling::new(to, layout::CALLS, FILE_BYTES, begin_calls),
            scope_files: Rolling::new(to, layout::SCOPES, FILE_BYTES, begin_scopes),
            episode_file: TableWriter::create(&to.join(layout::EPISODES), &EPISODES, EPISODES.options())?,
            trials: BTreeMap::new(),
            names: Vec::new(),
            families: BTreeSet::new(),
            n_frames: 0,
            n_calls: 0,
            n_scopes: 0,
        })
    }

    pub(super) fn slots(&self) -> &[String] {
        &self.slots
    }

    /// Adds an episode, and writes the row groups that are full.
    pub(super) fn append(&mut self, tree: &EpisodeTree, source: &EpisodeSource) -> Result<(), EditError> {
        let episode_index = self.names.len() as i64;
        let spans = tree.calls.iter();
        let spans = spans.map(|call| CallSpans { input: call.input, output: call.output, frames: call.frames });
        let spans: Vec<CallSpans> = spans.collect();
        let n_scopes = self.scopes.append_tree(&tree.calls, &spans, episode_index);
        self.append_episode(tree, source, n_scopes as i64)?;
        let name = |slot: usize| self.slots.get(slot).map_or("", String::as_str);
        self.calls.append_tree(&tree.calls, &spans, name, episode_index);
        self.confidences.extend(&tree.confidences);
        self.families.insert(tree.family);
        self.n_calls += tree.calls.len() as u64;
        self.n_scopes += n_scopes as u64;
        if self.calls.n_rows() >= GROUP_ROWS {
            self.write_calls()?;
        }
        if self.scopes.n_rows() >= GROUP_ROWS {
            self.write_scopes()?;
        }
        if self.episodes.n_rows() >= EPISODE_GROUP_ROWS { self.write_episodes() } else { Ok(()) }
    }

    fn append_episode(&mut self, tree: &EpisodeTree, source: &EpisodeSource, n_scopes: i64) -> Result<(), EditError> {
        let n_frames = tree.calls.first().map_or(0, |root| i64::from(root.frames.end));
        let own = match self.next_known(source)? {
            Some(own) => own,
            None => self.new_row(tree, source, n_frames),
        };
        let (calls, scopes) = (self.call_files.place(), self.scope_files.place());
        let n_calls = tree.calls.len() as i64;
        self.names.push(EpisodeNames {
            n_frames,
            task_id: own.task_id.clone(),
            split: own.split.clone(),
            success: own.success,
        });
        self.episodes.push(episodes::Row {
            episode_index: self.names.len() as i64 - 1,
            seed: own.seed.into(),
            task_id: own.task_id.into(),
            task_text: own.task_text.into(),
            family: tree.family.name().into(),
            split: own.split.into(),
            trial: own.trial,
            counts: own.counts,
            actor: own.actor.into(),
            outcome: own.outcome.into(),
            cause: own.cause.map(Into::into),
            success: own.success,
            recording: own.recording.into(),
            recording_sha256: own.recording_sha256.into(),
            recording_index: own.recording_index,
            n_frames,
            n_recorded_frames: own.n_recorded_frames,
            sim_secs: own.sim_secs,
            specification: "episode".into(),
            specification_frames: n_frames,
            slots: self.slots.clone(),
            n_calls,
            calls_chunk: i64::from(calls.chunk),
            calls_file: i64::from(calls.file),
            calls_from: self.n_calls as i64,
            n_scopes,
            scopes_chunk: i64::from(scopes.chunk),
            scopes_file: i64::from(scopes.file),
            scopes_from: self.n_scopes as i64,
        });
        self.n_frames += n_frames.unsigned_abs();
        Ok(())
    }

    fn write_calls(&mut self) -> Result<(), EditError> {
        let mut columns = self.calls.columns();
        columns.push(("confidence", Values::Float32(&self.confidences)));
        self.call_files.write(|file| file.write_row_group(&columns))?;
        self.calls.clear();
        self.confidences.clear();
        Ok(())
    }

    fn write_scopes(&mut self) -> Result<(), EditError> {
        self.scope_files.write(|file| file.write_row_group(&self.scopes.columns()))?;
        self.scopes.clear();
        Ok(())
    }

    fn write_episodes(&mut self) -> Result<(), EditError> {
        self.episode_file.write_row_group(&self.episodes.columns())?;
        self.episodes.clear();
        Ok(())
    }

    /// What a dataset of ours tells of the next episode; nothing in another.
    fn next_known(&mut self, source: &EpisodeSource) -> Result<Option<OwnRow>, EditError> {
        let Some(reader) = &mut self.known else { return Ok(None) };
        if self.batch.as_slice().is_empty() {
            let Some(columns) = reader.next() else {
                let problem = format!("it has no row for an episode of {}", source.path.display());
                return Err(DatasetError::Count { path: reader.path().to_owned(), problem }.into());
            };
            self.batch = own_batch(columns?)?.into_iter();
        }
        Ok(self.batch.next())
    }

    /// What can be told of an episode of a dataset without provenance.
    fn new_row(&mut self, tree: &EpisodeTree, source: &EpisodeSource, n_frames: i64) -> OwnRow {
        let text = tree.task_text.clone();
        let trial = self.trials.entry(text.clone()).or_default();
        *trial += 1;
        OwnRow {
            seed: "0".to_owned(),
            task_id: task_id(&text),
            task_text: text,
            split: "seen".to_owned(),
            trial: *trial - 1,
            counts: Vec::new(),
            actor: "demonstrator".to_owned(),
            outcome: "success".to_owned(),
            cause: None,
            success: true,
            recording: source.place.relative(layout::DATA),
            recording_sha256: (*source.sha256).to_owned(),
            recording_index: self.names.len() as i64,
            n_recorded_frames: n_frames,
            sim_secs: (n_frames - 1).max(0) as f64 / self.fps,
        }
    }

    /// Ends the tables.
    pub(super) fn finish(mut self, subtasks: Vec<String>, statistics: Statistics) -> Result<Written, EditError> {
        self.write_calls()?;
        self.write_scopes()?;
        self.write_episodes()?;
        let Self { call_files, scope_files, episode_file, names, families, n_frames, n_calls, n_scopes, .. } = self;
        call_files.finish()?;
        scope_files.finish()?;
        episode_file.commit()?;
        Ok(Written { episodes: names, families, subtasks, statistics, n_frames, n_calls, n_scopes })
    }
}

/// The episodes of a dataset of ours.
fn own_rows(root: &Path) -> Result<Option<TableReader>, EditError> {
    let path = root.join(layout::EPISODES);
    let open = || TableReader::open_columns(&path, &OwnBatch::SCHEMA, OwnBatch::COLUMNS);
    Ok(path.is_file().then(open).transpose()?)
}

batch! {
    /// What a dataset of ours tells of episodes, but for their calls.
    struct OwnBatch of episodes {
        seed,
        task_id,
        task_text,
        split,
        trial,
        counts,
        actor,
        outcome,
        cause,
        success,
        recording,
        recording_sha256,
        recording_index,
        n_recorded_frames,
        sim_secs,
    }
}

impl OwnBatch {
    fn row(&self, at: usize) -> OwnRow {
        let text = |column: &TextRows| column.row(at).to_owned();
        OwnRow {
            seed: text(&self.seed),
            task_id: text(&self.task_id),
            task_text: text(&self.task_text),
            split: text(&self.split),
            trial: self.trial[at],
            counts: self.counts.row(at).to_vec(),
            actor: text(&self.actor),
            outcome: text(&self.outcome),
            cause: self.cause.get(at).map(ToOwned::to_owned),
            success: self.success.value(at),
            recording: text(&self.recording),
            recording_sha256: text(&self.recording_sha256),
            recording_index: self.recording_index[at],
            n_recorded_frames: self.n_recorded_frames[at],
            sim_secs: self.sim_secs[at],
        }
    }
}

fn own_batch(mut columns: Columns) -> Result<Vec<OwnRow>, EditError> {
    let n_rows = columns.n_rows();
    let batch = OwnBatch::take(&mut columns)?;
    Ok((0..n_rows).map(|at| batch.row(at)).collect())
}
