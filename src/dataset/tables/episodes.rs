//! The rows of `ntp/episodes.parquet`: where each episode comes from, how it ended, where its rows lie.

pub(crate) mod check;
pub(crate) mod read;

use crate::dataset::tables::view::{EpisodePlaces, EpisodeView, Source, is_own_specification};
use crate::table::{TableRows as _, table};

table! {
    /// `ntp/episodes.parquet`: a row an episode, in order: where it comes from, how it ended, and where its rows lie.
    ///
    /// > Why beside LeRobot's own table of episodes? LeRobot's tools rewrite theirs; provenance must not depend on that.
    episodes {
        /// which episode
        episode_index: Int64,
        /// the trial's seed: 64 bits without a sign, as text because not every reader has such numbers
        seed: Text,
        /// which task
        task_id: Text,
        /// the task in words
        task_text: Text,
        /// the kind of task, e.g. `block_stacking`
        family: Text,
        /// `seen` or `unseen`; one for all episodes of a task
        split: Text,
        /// which demonstration of the task
        trial: Int64,
        /// instances of each category on the table; of a block or bowl 1, or 0 when it stands aside; empty for eight blocks
        counts: Int64List,
        /// `expert`, or the model that acted
        actor: Text,
        /// `success`, or the cause of failure
        outcome: Text,
        /// the first cause of failure that was noticed; null for a success
        cause: OptionalText,
        /// whether the actor ended by itself and the goal held at rest
        success: Boolean,
        /// the recording's file, relative to the folder of recordings
        recording: Text,
        /// its hash
        recording_sha256: Text,
        /// the episode's number over all recordings: `ntp replay --episode`
        recording_index: Int64,
        /// rows in `frames`
        n_frames: Int64,
        /// frames in the recording
        n_recorded_frames: Int64,
        /// simulated time of the episode
        sim_secs: Float64,
        /// `episode` when the episode is its own specification, `demonstration` when a policy was given another
        specification: Text,
        /// frames of the specification
        specification_frames: Int64,
        /// names of the slots, in the order of observations
        slots: TextList,
        /// rows in `calls`
        n_calls: Int64,
        /// folder of the file in which they begin
        calls_chunk("calls/chunk_index"): Int64,
        /// that file
        calls_file("calls/file_index"): Int64,
        /// number of the first of them over all files
        calls_from("calls_from_index"): Int64,
        /// rows in `scopes`
        n_scopes: Int64,
        /// folder of the file in which they begin
        scopes_chunk("scopes/chunk_index"): Int64,
        /// that file
        scopes_file("scopes/file_index"): Int64,
        /// number of the first of them over all files
        scopes_from("scopes_from_index"): Int64,
    }
}

impl Rows {
    /// Adds an episode.
    pub(crate) fn append_episode(&mut self, view: &EpisodeView<'_>, source: Source<'_>, places: EpisodePlaces) {
        let (episode, provenance) = (view.episode, &view.episode.provenance);
        let specification = if is_own_specification(episode) { "episode" } else { "demonstration" };
        self.push(Row {
            episode_index: places.episode_index,
            seed: provenance.seed.to_string().into(),
            task_id: provenance.task_id.as_str().into(),
            task_text: provenance.task_text.as_str().into(),
            family: provenance.family.name().into(),
            split: provenance.split.name().into(),
            trial: i64::from(provenance.trial),
            counts: provenance.counts.iter().copied().map(i64::from).collect(),
            actor: provenance.actor.name().into(),
            outcome: episode.outcome.to_string().into(),
            cause: episode.outcome.cause().map(|cause| cause.name().into()),
            success: episode.outcome.is_success(),
            recording: source.file.into(),
            recording_sha256: source.sha256.into(),
            recording_index: provenance.index as i64,
            n_frames: view.n_rows() as i64,
            n_recorded_frames: i64::from(view.n_recorded),
            sim_secs: view.end_nanos as f64 / 1e9,
            specification: specification.into(),
            specification_frames: view.specification_frames(),
            slots: episode.scene.slots.iter().map(|slot| slot.name.clone()).collect(),
            n_calls: episode.calls.len() as i64,
            calls_chunk: i64::from(places.calls.chunk),
            calls_file: i64::from(places.calls.file),
            calls_from: places.first_call,
            n_scopes: places.n_scopes,
            scopes_chunk: i64::from(places.scopes.chunk),
            scopes_file: i64::from(places.scopes.file),
            scopes_from: places.first_scope,
        });
    }
}
