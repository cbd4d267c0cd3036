//! Labels for demonstrations that have none: the trained interpreter takes them apart.
//!
//! # Input and output
//!
//! [`annotate`] reads what was observed in a dataset's episodes, and models. A model's programs run over each episode
//! with the episode's own frames as states: where a program hands a part of the demonstration to another, that part is
//! what the other did. So a tree of calls comes of it, with arguments, spans, and how sure each call is. The dataset is
//! written again with these trees as its labels, and `ntp/annotation.json` tells by which models, which episodes are
//! doubtful and why, and what was measured. [`measure`] holds such labels against true ones.
//!
//! # Shapes
//!
//! Programs see ends of primitives alone, the *key frames*. A dataset that holds those is taken row by row; in any other
//! they are found in how gripper and objects move.
//!
//! # Invariants
//!
//! Labels that a dataset has are never read to make new ones. An episode's labels depend on it and on the models alone,
//! not on other episodes nor on the number of threads.
//!
//! # Errors
//!
//! [`AnnotateError`] names the dataset or model. Nothing is under the final name unless all of it is.

mod annotation;
mod confidence;
mod doubt;
mod error;
mod gripper_changes;
mod key_frames;
mod measure;
mod model;
mod parse;
mod trees;

use std::path::Path;

use crate::artifact::{StageDir, StagedDir, write_json};
use crate::dataset::{ObservedEpisodes, predicted_by, relabel};

pub use annotation::{Annotation, AnnotationModel, Doubtful};
pub use doubt::Doubt;
pub use error::AnnotateError;
pub use key_frames::{KeyFrame, KeyFrames, key_frames};
pub use measure::{LevelMeasured, Measured, measure};
pub use model::Model;
pub use parse::{Parsed, parse};
use trees::Trees;

/// Where the tables of annotations tell how they were made, relative to a dataset.
pub const ANNOTATION: &str = crate::dataset::ANNOTATION;

/// How demonstrations are annotated.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotateConfig {
    /// Episodes with a call that is less sure than this are doubtful, 0 to 1.
    pub doubt_below: f32,
    /// Which rows are key frames.
    pub key_frames: KeyFrames,
    /// The day, for the card.
    pub date: Option<String>,
}

/// Writes a dataset with labels that models made, as a new folder; `against` is a dataset with true labels of the same
/// episodes.
///
/// # Errors
///
/// When no model fits the dataset, or it cannot be read, or there is something at `to`.
pub fn annotate(
    root: &Path,
    models: &mut [Model],
    to: &Path,
    config: &AnnotateConfig,
    against: Option<&Path>,
) -> Result<Annotation, AnnotateError> {
    StageDir::new("convert", root).check_whole()?;
    if let Some(truth) = against
        && let Some(models) = predicted_by(truth)?
    {
        let problem = format!(
            "its labels are predictions of the model {models}, and none that others are measured against; `ntp dataset \
             diff` compares them"
        );
        return Err(AnnotateError::Truth { path: truth.to_owned(), problem });
    }
    let episodes = ObservedEpisodes::open(root)?;
    let slots = episodes.slots().to_vec();
    let staged = StagedDir::begin(to)?;
    let mut trees = Trees::new(root, episodes, models, config)?;
    let summary = relabel(root, staged.partial_path(), &slots, &mut trees)?;
    let mut annotation = trees.finish(summary);
    annotation.measured = against.map(|truth| measure(truth, staged.partial_path())).transpose()?;
    write_json(&staged.partial_path().join(ANNOTATION), &annotation)?;
    staged.commit()?;
    Ok(annotation)
}
