//! A `LeRobotDataset` of anybody's features: opened as readers take it, or written frame by frame.
//!
//! # Input and output
//!
//! [`PlainSource`] opens a dataset in the formats v3.0, v2.1 and v2.0: what it declares, its texts, its episodes, the
//! files of its frames. It takes what `LeRobot`'s own reader takes, in the order in which that reads it.
//!
//! [`PlainWriter`] takes episodes: a task's text, then a row of `Cell`s for each frame, in the order of the declared
//! `PlainFeature`s. It writes `meta/`, `data/` and `videos/`, and no tables of programs.
//!
//! # Units
//!
//! Times are `frame_index / fps` in seconds. Pictures are encoded already, or rows of RGB bytes, which become PNG.
//!
//! # Errors
//!
//! [`PlainError`].
//!
//! # Invariants
//!
//! Each episode's frames are row groups of one file. Memory holds one episode's numbers and 12 MB of pictures
//! of each feature, and the video files that are being written. The same rows give the same bytes, with any number of
//! threads.

mod arrays;
mod column;
mod declared;
mod episode;
mod episode_statistics;
mod feature;
mod labels;
mod lines;
mod listing;
mod meta;
mod picture;
mod rows;
mod source;
mod template;
mod texts;
mod video;
mod writer;

pub(crate) use super::files::info::Dtype;
pub(crate) use arrays::{FlatNumbers, FlatProblem, list_at, numbers, texts, whole_numbers};
pub(crate) use declared::{Declared, DeclaredKind, PlainInfo, PlainVersion, REQUIRED};
pub(crate) use episode::{EPISODE_LINES, PlainEpisode, VideoSpan};
pub(crate) use episode_statistics::EpisodeStatistics;
pub use feature::PlainError;
pub(crate) use feature::{Cell, PlainFeature, PlainKind};
pub use labels::LabelsForm;
pub(crate) use labels::{LabelSpan, PlainLabels};
pub(crate) use listing::files_below;
pub(crate) use picture::Picture;
pub(crate) use rows::RowCursor;
pub(crate) use source::{PlainSource, ProgramTables, has_programs, program_tables};
pub(crate) use texts::PlainTexts;
pub(crate) use writer::{PlainWriter, ROW_FEATURES};
