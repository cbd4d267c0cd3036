//! What conditions and parts go by: an episode in words, of whatever tables it is known.

use crate::dataset::plain::{PlainEpisode, PlainInfo};
use crate::dataset::tables::episodes::read::EpisodeRow;

/// An episode in words; what its dataset does not tell is empty.
pub(super) struct EpisodeWords<'e> {
    /// Its number.
    pub(super) index: u64,
    pub(super) task_id: &'e str,
    /// Its tasks in words: one, or several of others.
    pub(super) tasks: Vec<&'e str>,
    pub(super) family: &'e str,
    pub(super) split: &'e str,
    pub(super) outcome: &'e str,
    /// Why it failed.
    pub(super) cause: Option<&'e str>,
    pub(super) n_frames: u64,
}

impl<'e> EpisodeWords<'e> {
    /// Of a dataset with program tables.
    pub(super) fn of_row(row: &'e EpisodeRow) -> Self {
        Self {
            index: row.episode_index.unsigned_abs(),
            task_id: &row.task_id,
            tasks: vec![&row.task_text],
            family: &row.family,
            split: &row.split,
            outcome: &row.outcome,
            cause: row.cause.as_deref(),
            n_frames: row.n_frames.unsigned_abs(),
        }
    }

    /// Of one without.
    pub(super) fn of_plain(episode: &'e PlainEpisode, info: &'e PlainInfo) -> Self {
        let index = episode.index.unsigned_abs();
        Self {
            index,
            task_id: episode.tasks.first().map_or("", String::as_str),
            tasks: episode.tasks.iter().map(String::as_str).collect(),
            family: "",
            split: info.split_of(index).unwrap_or_default(),
            outcome: "",
            cause: None,
            n_frames: episode.length,
        }
    }
}
