//! The rows per episode: `ntp/episodes.parquet` (provenance) and `meta/episodes/` (what `LeRobot` reads).

pub(crate) mod check;
pub(crate) mod read;

use crate::dataset::tables::view::{EpisodeView, is_own_specification};
use crate::dataset::files::layout::FilePlace;
use crate::table::{Values, WriteOptions};

/// Where the rows of an episode are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EpisodePlaces {
    pub(crate) episode_index: i64,
    pub(crate) data: FilePlace,
    pub(crate) first_index: i64,
    pub(crate) calls: FilePlace,
    pub(crate) first_call: i64,
    pub(crate) scopes: FilePlace,
    pub(crate) first_scope: i64,
    pub(crate) n_scopes: i64,
}

/// The recording that an episode comes from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Source<'s> {
    pub(crate) file: &'s str,
    pub(crate) sha256: &'s str,
}

macro_rules! column_rows {
    ($(#[$doc:meta])* $rows:ident { $($field:ident: $name:literal $kind:ident $value:ty;)* }) => {
        $(#[$doc])*
        #[derive(Default)]
        pub(crate) struct $rows {
            $($field: Vec<$value>,)*
        }

        impl $rows {
            /// The columns of all rows.
            pub(crate) fn columns(&self) -> Vec<(&'static str, Values<'_>)> {
                vec![$(($name, Values::$kind(&self.$field)),)*]
            }

            /// Forgets all rows.
            pub(crate) fn clear(&mut self) {
                *self = Self::default();
            }
        }
    };
}

column_rows! {
    /// Rows of `ntp/episodes.parquet` that are not yet written.
    ProvenanceRows {
        episode_index: "episode_index" Int64 i64;
        seed: "seed" Text String;
        task_id: "task_id" Text String;
        task_text: "task_text" Text String;
        family: "family" Text String;
        split: "split" Text String;
        trial: "trial" Int64 i64;
        counts: "counts" Int64List Vec<i64>;
        actor: "actor" Text String;
        outcome: "outcome" Text String;
        cause: "cause" OptionalText Option<String>;
        success: "success" Boolean bool;
        recording: "recording" Text String;
        recording_sha256: "recording_sha256" Text String;
        recording_index: "recording_index" Int64 i64;
        n_frames: "n_frames" Int64 i64;
        n_recorded_frames: "n_recorded_frames" Int64 i64;
        sim_secs: "sim_secs" Float64 f64;
        specification: "specification" Text String;
        specification_frames: "specification_frames" Int64 i64;
        slots: "slots" TextList Vec<String>;
        n_calls: "n_calls" Int64 i64;
        calls_chunk: "calls/chunk_index" Int64 i64;
        calls_file: "calls/file_index" Int64 i64;
        calls_from: "calls_from_index" Int64 i64;
        n_scopes: "n_scopes" Int64 i64;
        scopes_chunk: "scopes/chunk_index" Int64 i64;
        scopes_file: "scopes/file_index" Int64 i64;
        scopes_from: "scopes_from_index" Int64 i64;
    }
}

impl ProvenanceRows {
    pub(crate) fn n_rows(&self) -> usize {
        self.episode_index.len()
    }

    /// Adds an episode.
    pub(crate) fn append(&mut self, view: &EpisodeView<'_>, source: Source<'_>, places: EpisodePlaces) {
        let (episode, provenance) = (view.episode, &view.episode.provenance);
        self.episode_index.push(places.episode_index);
        self.seed.push(provenance.seed.to_string());
        self.task_id.push(provenance.task_id.clone());
        self.task_text.push(provenance.task_text.clone());
        self.family.push(provenance.family.name().to_owned());
        self.split.push(provenance.split.name().to_owned());
        self.trial.push(i64::from(provenance.trial));
        self.counts.push(provenance.counts.iter().copied().map(i64::from).collect());
        self.actor.push(provenance.actor.name().to_owned());
        self.outcome.push(episode.outcome.to_string());
        self.cause.push(episode.outcome.cause().map(|cause| cause.name().to_owned()));
        self.success.push(episode.outcome.is_success());
        self.recording.push(source.file.to_owned());
        self.recording_sha256.push(source.sha256.to_owned());
        self.recording_index.push(provenance.index as i64);
        self.n_frames.push(view.n_rows() as i64);
        self.n_recorded_frames.push(i64::from(view.n_recorded));
        self.sim_secs.push(view.end_nanos as f64 / 1e9);
        let specification = if is_own_specification(episode) { "episode" } else { "demonstration" };
        self.specification.push(specification.to_owned());
        self.specification_frames.push(view.specification_frames());
        self.slots.push(episode.scene.slots.iter().map(|slot| slot.name.clone()).collect());
        self.append_places(places, episode.calls.len() as i64);
    }

    fn append_places(&mut self, places: EpisodePlaces, n_calls: i64) {
        self.n_calls.push(n_calls);
        self.calls_chunk.push(i64::from(places.calls.chunk));
        self.calls_file.push(i64::from(places.calls.file));
        self.calls_from.push(places.first_call);
        self.n_scopes.push(places.n_scopes);
        self.scopes_chunk.push(i64::from(places.scopes.chunk));
        self.scopes_file.push(i64::from(places.scopes.file));
        self.scopes_from.push(places.first_scope);
    }
}

/// Rows of `meta/episodes/` that are not yet written, but for the statistics.
#[derive(Default)]
pub(crate) struct MetaRows {
    episode_index: Vec<i64>,
    tasks: Vec<Vec<String>>,
    length: Vec<i64>,
    data_chunk: Vec<i64>,
    data_file: Vec<i64>,
    from_index: Vec<i64>,
    to_index: Vec<i64>,
    own_chunk: Vec<i64>,
    own_file: Vec<i64>,
    task_id: Vec<String>,
    split: Vec<String>,
    success: Vec<bool>,
}

impl MetaRows {
    /// What the schema text cannot say of this table.
    pub(crate) fn options() -> WriteOptions {
        WriteOptions { sorted_by: vec!["episode_index"], ..WriteOptions::default() }
    }

    pub(crate) fn n_rows(&self) -> usize {
        self.episode_index.len()
    }

    /// Adds an episode, whose row goes to the file `own`.
    pub(crate) fn append(&mut self, view: &EpisodeView<'_>, places: EpisodePlaces, own: FilePlace) {
        let provenance = &view.episode.provenance;
        self.episode_index.push(places.episode_index);
        self.tasks.push(vec![provenance.task_text.clone()]);
        self.length.push(view.n_rows() as i64);
        self.data_chunk.push(i64::from(places.data.chunk));
        self.data_file.push(i64::from(places.data.file));
        self.from_index.push(places.first_index);
        self.to_index.push(places.first_index + view.n_rows() as i64);
        self.own_chunk.push(i64::from(own.chunk));
        self.own_file.push(i64::from(own.file));
        self.task_id.push(provenance.task_id.clone());
        self.split.push(provenance.split.name().to_owned());
        self.success.push(view.episode.outcome.is_success());
    }

    /// The columns of all rows.
    pub(crate) fn columns(&self) -> [(&'static str, Values<'_>); 12] {
        [
            ("episode_index", Values::Int64(&self.episode_index)),
            ("tasks", Values::TextList(&self.tasks)),
            ("length", Values::Int64(&self.length)),
            ("data/chunk_index", Values::Int64(&self.data_chunk)),
            ("data/file_index", Values::Int64(&self.data_file)),
            ("dataset_from_index", Values::Int64(&self.from_index)),
            ("dataset_to_index", Values::Int64(&self.to_index)),
            ("meta/episodes/chunk_index", Values::Int64(&self.own_chunk)),
            ("meta/episodes/file_index", Values::Int64(&self.own_file)),
            ("ntp/task_id", Values::Text(&self.task_id)),
            ("ntp/split", Values::Text(&self.split)),
            ("ntp/success", Values::Boolean(&self.success)),
        ]
    }

    /// Forgets all rows.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}
