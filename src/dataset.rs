//! Recordings to a `LeRobotDataset` v3.0 with program tables beside it, and back into memory.
//!
//! # Input and output
//!
//! [`convert`] reads episodes of recordings (demonstrations or rollouts) and writes a directory:
//!
//! ```text
//! videos/FEATURE/chunk-000/file-000.mp4      what cameras saw, if it was recorded as a video
//! meta/info.json, stats.json, tasks.parquet, subtasks.parquet, episodes/chunk-000/file-000.parquet
//! data/chunk-000/file-000.parquet            one row per frame
//! ntp/info.json, episodes.parquet            provenance, one row per episode
//! ntp/calls/chunk-000/file-000.parquet       one row per program call
//! ntp/scopes/chunk-000/file-000.parquet      one row per call and frame of its caller's window
//! ```
//!
//! Every table is a room of `tables`, where its columns are declared, filled, read and checked. [`read_trials`] reads
//! what a learner needs, [`validate`] checks every cross-reference, [`summarize`] says what a dataset is, [`play_back`]
//! reads what can be shown of an episode.
//!
//! # Invariants
//!
//! Labels are columns `ntp.*`: a robot learner takes `observation.*` and `action` alone as its inputs and outputs.
//! Memory does not grow with the number of episodes, but for the distinct task texts. The same episodes give the same
//! bytes.

mod config;
pub mod edit;
pub mod export;
mod files;
pub mod import;
mod labelled;
mod pictures;
pub(crate) mod plain;
mod read;
mod relabel;
pub mod schema;
mod statistics;
mod tables;
mod validate;
mod write;

pub use config::{ActionChoice, ConvertConfig, FailedEpisodes, FrameChoice};
pub(crate) use files::annotation::Told as AnnotationTold;
pub use files::error::{ConvertError, DatasetError};
pub use files::finding::{Finding, Severity, Validation};
pub(crate) use files::info::BY_MODEL;
pub(crate) use files::layout::ANNOTATION;
pub use labelled::{FrameLabel, LabelledEpisode, LabelledEpisodes};
pub use pictures::{EpisodePictures, EpisodeRows, PictureLoader, Wanted};
pub use plain::{LabelsForm, PlainError};
pub(crate) use read::lookup::check_has_programs;
pub use read::lookup::{EpisodeFacts, FrameFacts, look_up};
pub use read::observed::{ObservedEpisode, ObservedEpisodes};
pub use read::playback::{CameraTrack, NumberTrack, Playback, TrackPictures, play_back};
pub(crate) use read::summary::predicted_by;
pub use read::summary::{DatasetSummary, DeclaredSummary, summarize};
pub use read::table_files::{TableFiles, table_files};
pub use read::trial_data::{DatasetTrials, TrialData};
pub use read::trial_spool::TrialSpool;
pub use read::trials::{LearnedTrials, read_learned_trials, read_trials};
pub use relabel::{EpisodeTree, RelabelSummary, relabel};
pub use tables::calls::facts::CallFacts;
pub use validate::validate;
pub use write::convert::{RecordedEpisode, RecordingEpisodes, convert};
pub use write::summary::ConvertSummary;
pub use write::writer::DatasetWriter;
