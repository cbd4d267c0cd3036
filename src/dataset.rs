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
//! Every table's schema is in schemas/parquet. [`read_trials`] reads what a learner needs, [`validate`] checks every
//! cross-reference, [`summarize`] says what a dataset is, [`play_back`] reads what can be shown of an episode.
//!
//! # Invariants
//!
//! Labels are columns `ntp.*`: a robot learner takes `observation.*` and `action` alone as its inputs and outputs.
//! Memory does not grow with the number of episodes, but for the distinct task texts. The same episodes give the same
//! bytes.

mod call_facts;
mod call_rows;
mod calls;
mod config;
mod convert;
mod cursor;
pub mod edit;
mod episode_rows;
mod episode_view;
mod episodes;
mod error;
pub mod export;
mod feature;
mod finding;
mod frame_map;
mod frame_rows;
mod frames;
pub mod import;
mod info;
mod layout;
mod lookup;
mod pictures;
mod playback;
mod program_paths;
mod read;
mod rolling;
pub mod schema;
mod statistics;
mod summary;
mod table_files;
mod tables;
mod text;
mod text_files;
mod trial_data;
mod validate;
mod writer;

pub use call_facts::CallFacts;
pub use config::{ConvertConfig, FailedEpisodes, FrameChoice};
pub use convert::{RecordedEpisode, RecordingEpisodes, convert};
pub use error::{ConvertError, DatasetError};
pub use finding::{Finding, Severity, Validation};
pub use lookup::{EpisodeFacts, FrameFacts, look_up};
pub use pictures::{EpisodePictures, EpisodeRows, PictureLoader, Wanted};
pub use playback::{CameraTrack, NumberTrack, Playback, TrackPictures, play_back};
pub use read::read_trials;
pub use summary::{DatasetSummary, summarize};
pub use table_files::table_files;
pub use trial_data::{DatasetTrials, TrialData};
pub use validate::validate;
pub use writer::{ConvertSummary, DatasetWriter};
