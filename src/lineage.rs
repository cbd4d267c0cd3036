//! Where something comes from: frame → calls → recording → settings → version and commit.
//!
//! # Input and output
//!
//! [`explain_episode`] and [`explain_model`] follow names and hashes upstream: from a dataset's rows to its recording,
//! from each stage's plan to the stages that it read. A folder upstream counts as found only when its hash is the one
//! that was read.
//!
//! # Errors
//!
//! [`LineageError`] when the thing itself cannot be read. What is missing upstream is no error: it is told as not
//! found.

mod stage;

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::artifact::{IoError, Plan, sha256_file};
use crate::dataset::{DatasetError, EpisodeFacts, FrameFacts, look_up, predicted_by};
use crate::recording::ShardReader;

pub use stage::{StageLineage, stage_of};

/// The lineage of something that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum LineageError {
    /// The dataset could not be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A file could not be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The folder does not say what made it.
    #[error("no plan.json in {}, so nothing says what made it", path.display())]
    NoPlan {
        /// The folder.
        path: PathBuf,
    },
}

/// Where an episode or a frame comes from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EpisodeLineage {
    /// The frame that was asked for.
    pub frame: Option<FrameFacts>,
    /// Its episode.
    pub episode: EpisodeFacts,
    /// The episode's recording.
    pub recording: RecordingLineage,
    /// The models that made its labels; nothing where no model did.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub labels_predicted_by: Option<String>,
    /// What made the dataset, and what it was made of; `None` when the dataset does not say.
    pub dataset: Option<StageLineage>,
}

/// A recording, as a dataset names it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingLineage {
    /// Its name.
    pub file: String,
    /// Its SHA-256, as the dataset has it.
    pub sha256: String,
    /// Where a file of this name and hash is.
    pub path: Option<PathBuf>,
    /// Files of this name with another hash.
    pub other_files: Vec<PathBuf>,
    /// What made it, from the plan that is kept in it, where it was found.
    pub stage: Option<StageLineage>,
}

/// Says where an episode of a dataset comes from. Recordings are looked for in the given folders, and beside the
/// dataset.
///
/// # Errors
///
/// When there is no such episode or frame, or the dataset cannot be read.
pub fn explain_episode(
    dataset: &Path,
    episode: u64,
    frame: Option<u64>,
    recordings: &[PathBuf],
) -> Result<EpisodeLineage, LineageError> {
    let (episode, frame) = look_up(dataset, episode, frame)?;
    let recording = find_recording(dataset, &episode, recordings)?;
    let labels_predicted_by = predicted_by(dataset)?;
    Ok(EpisodeLineage { frame, recording, labels_predicted_by, dataset: stage_of(dataset)?, episode })
}

/// Says where a trained model comes from.
///
/// # Errors
///
/// When its folder has no plan.
pub fn explain_model(model: &Path) -> Result<StageLineage, LineageError> {
    stage_of(model)?.ok_or_else(|| LineageError::NoPlan { path: model.to_owned() })
}

fn find_recording(
    dataset: &Path,
    episode: &EpisodeFacts,
    folders: &[PathBuf],
) -> Result<RecordingLineage, LineageError> {
    let mut lineage = RecordingLineage {
        file: episode.recording.clone(),
        sha256: episode.recording_sha256.clone(),
        path: None,
        other_files: Vec::new(),
        stage: None,
    };
    let beside = [dataset.join("../recordings"), dataset.join("recordings")];
    let files = folders.iter().chain(&beside).map(|folder| folder.join(&episode.recording));
    for file in files.filter(|file| file.is_file()) {
        if sha256_file(&file)? != lineage.sha256 {
            lineage.other_files.push(file);
            continue;
        }
        lineage.stage = stage_in_recording(&file)?;
        lineage.path = Some(file);
        break;
    }
    Ok(lineage)
}

/// What made a recording, from the plan that it holds.
fn stage_in_recording(file: &Path) -> Result<Option<StageLineage>, LineageError> {
    let plan = ShardReader::open(file).ok().and_then(|reader| serde_json::from_str::<Plan>(reader.plan_json()).ok());
    let Some(plan) = plan else { return Ok(None) };
    let folder = file.parent().unwrap_or(Path::new("."));
    Ok(Some(stage::with_upstream(folder, plan, None)?))
}
