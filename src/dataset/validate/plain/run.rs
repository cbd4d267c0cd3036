//! Rows of a batch that are of one episode.

use std::ops::Range;

/// Some rows of a batch that are of one episode.
pub(super) struct Run {
    pub(super) rows: Range<usize>,
    /// Position of the episode.
    pub(super) episode: usize,
    /// Number in the episode of the first row.
    pub(super) first_frame: u64,
    /// Whether the last row is the episode's last.
    pub(super) is_last: bool,
}
