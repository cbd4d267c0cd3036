//! A `LeRobotDataset` v3.0 of anybody's features, written frame by frame.
//!
//! # Input and output
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
//! Each episode's frames are row groups of one file. Memory holds one episode's numbers and 24 MB of pictures
//! of each feature, and the video files that are being written. The same rows give the same bytes, with any number of
//! threads.

mod column;
mod feature;
mod meta;
mod picture;
mod video;
mod writer;

pub(crate) use super::files::info::Dtype;
pub use feature::PlainError;
pub(crate) use feature::{Cell, PlainFeature, PlainKind};
pub(crate) use picture::Picture;
pub(crate) use writer::{PlainWriter, ROW_FEATURES};
