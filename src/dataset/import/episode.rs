//! An annotated episode, as its frames tell it.

use std::sync::Arc;

use crate::dataset::files::layout::FilePlace;

/// An episode, as its frames tell it.
#[derive(Clone, Debug, Default)]
pub(super) struct Annotated {
    pub(super) episode_index: i64,
    pub(super) task_index: i64,
    pub(super) n_frames: i64,
    pub(super) data: FilePlace,
    /// SHA-256 of the file that it was read from.
    pub(super) source: Arc<str>,
    /// Runs of frames of one sub-task: which, and the frames, half-open.
    pub(super) runs: Vec<(usize, i64, i64)>,
}
