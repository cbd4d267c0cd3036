//! Labels in the shapes that others read.
//!
//! # Input and output
//!
//! [`export`] reads a dataset of ours and writes one of the forms of [`LabelForm`]. Programs become two levels of
//! labels: **sub-tasks**, the root's callees (`pick_and_place block_D block_B`), and **skills**, the calls that call
//! primitives, in words (`pick block_D`). A label holds from its call to the next one: it has the frames from which its
//! call goes on, and the episode's last frame belongs to the last label.
//!
//! # Invariants
//!
//! Memory holds one episode, or some thousand rows. What is written appears whole or not at all.

mod behavior;
mod events;
pub(crate) mod labels;
pub(crate) mod language;
mod plain;
mod sarm;

use std::path::Path;

use serde::Serialize;

use crate::artifact::{StageDir, StagedDir};
use crate::dataset::edit::EditError;

pub(in crate::dataset) use plain::{copy_folder, with_columns};

/// What labels are written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LabelForm {
    /// A `LeRobotDataset` with the column `subtask_index` and `meta/subtasks.parquet`, and nothing of ours but
    /// `ntp/annotation.json` where a model made the labels.
    SubtaskIndex,
    /// The same with `LeRobot`'s language columns: what goes on at each moment, in words.
    Language,
    /// The same as `SubtaskIndex` with SARM's columns in `meta/episodes` and `meta/temporal_proportions_{sparse,dense}.json`.
    Sarm,
    /// BEHAVIOR-1K's `annotations/task-XXXX/episode_XXXXXXXX.json`.
    Behavior,
    /// `foxglove.Event` messages, one a call, in an MCAP file.
    Foxglove,
}

impl std::str::FromStr for LabelForm {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "subtask_index" => Ok(Self::SubtaskIndex),
            "language" => Ok(Self::Language),
            "sarm" => Ok(Self::Sarm),
            "behavior" => Ok(Self::Behavior),
            "foxglove" => Ok(Self::Foxglove),
            _ => Err(format!("unknown form {word:?}; allowed: subtask_index, language, sarm, behavior, foxglove")),
        }
    }
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ExportSummary {
    /// Episodes.
    pub episodes: u64,
    /// Labels of all levels.
    pub labels: u64,
}

/// Writes the labels of a dataset to a new folder, or to a file when they are `foxglove`'s.
///
/// # Errors
///
/// When there is something at `to`, or the dataset cannot be read or is not as it was made.
pub fn export(root: &Path, form: LabelForm, to: &Path) -> Result<ExportSummary, EditError> {
    // No label is made of a file that is not, by its hash, as it was made.
    StageDir::new("convert", root).check_whole()?;
    if form == LabelForm::Foxglove {
        if to.extension().is_none_or(|extension| extension != "mcap") {
            return Err(EditError::refused(
                "edit.destination",
                to,
                "it is to be an MCAP file: a name that ends in .mcap",
            ));
        }
        if to.exists() {
            return Err(EditError::refused(
                "edit.destination",
                to,
                "only a new file is written, but this one is there",
            ));
        }
        return events::write(root, to);
    }
    let staged = StagedDir::begin(to)?;
    let summary = match form {
        LabelForm::SubtaskIndex => plain::write(root, staged.partial_path())?,
        LabelForm::Language => language::write(root, staged.partial_path())?,
        LabelForm::Sarm => sarm::write(root, staged.partial_path())?,
        LabelForm::Behavior | LabelForm::Foxglove => behavior::write(root, staged.partial_path())?,
    };
    staged.commit()?;
    Ok(summary)
}
