//! A dataset with labels of somebody else: frames as they are, trees of program calls given from outside.
//!
//! # Input and output
//!
//! [`relabel`] reads a `LeRobotDataset` v3.0, ours or another's, and a tree for each of its episodes. It writes the same
//! dataset (columns, videos and statistics as they were) with the columns of labels, `subtask_index`, `LeRobot`'s
//! language columns, and the tables under `ntp/` made of the trees. Labels that were there are left out. What is known
//! of the episodes of a dataset of ours (task, seed, actor, outcome) is kept; of other datasets demonstrations are taken
//! for successes, as nothing says otherwise. The table of calls has one column more, `confidence`.
//!
//! # Errors
//!
//! [`EditError::Refused`] with `import.*` where rows are not in order. Memory holds some thousand rows and one episode.

mod columns;
mod frames;
mod meta;
mod tables;

use std::path::Path;

use serde::Serialize;

use crate::dataset::edit::EditError;
use crate::dataset::export::copy_folder;
use crate::dataset::files::layout;
use crate::task::Family;
use crate::trace::ProgramCall;

/// What is said of one episode.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeTree {
    /// The family of its task.
    pub family: Family,
    /// Its task in words, for a dataset that tells no more of it.
    pub task_text: String,
    /// Every call, callers before callees. Spans count the episode's frames, which are their own specification.
    pub calls: Vec<ProgramCall>,
    /// How sure each call is, 0 to 1.
    pub confidences: Vec<f32>,
    /// The frames at which a primitive ends, and the first.
    pub boundaries: Vec<u32>,
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RelabelSummary {
    /// Episodes.
    pub episodes: u64,
    /// Frames.
    pub frames: u64,
    /// Program calls, roots included.
    pub calls: u64,
    /// Scoping labels.
    pub scopes: u64,
    /// Sub-tasks that `subtask_index` counts.
    pub subtasks: u64,
}

/// Writes a dataset with other labels into an empty folder. `slots` are the names of its slots.
///
/// # Errors
///
/// When a tree cannot be made, or the dataset cannot be read or written.
pub fn relabel<E: From<EditError>>(
    root: &Path,
    to: &Path,
    slots: &[String],
    trees: impl Iterator<Item = Result<EpisodeTree, E>>,
) -> Result<RelabelSummary, E> {
    let info = meta::read_info(root)?;
    let tables = tables::Tables::create(root, to, slots, &info)?;
    let written = frames::write(root, to, &info, tables, trees)?;
    let summary = meta::write(root, to, &info, slots, written)?;
    copy_folder(&root.join(layout::VIDEOS), &to.join(layout::VIDEOS))?;
    Ok(summary)
}
