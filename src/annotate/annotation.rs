//! What is told of annotations beside them: `ntp/annotation.json`.

use serde::Serialize;

use crate::annotate::{Doubt, Measured};
use crate::dataset::RelabelSummary;
use crate::task::Family;

/// How a dataset was annotated, and how well.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Annotation {
    /// The models, in the order in which they were given.
    pub models: Vec<AnnotationModel>,
    /// The day, if it was told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub date: Option<String>,
    /// Whether key frames were the rows, or found among them.
    pub key_frames: &'static str,
    /// What was written.
    #[serde(flatten)]
    pub summary: RelabelSummary,
    /// Confidence below which a call makes its episode doubtful.
    pub doubt_below: f32,
    /// The episodes that a person should look at.
    pub doubtful: Vec<Doubtful>,
    /// How well the labels agree with true ones; nothing where there were none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measured: Option<Measured>,
}

/// A model that annotated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AnnotationModel {
    /// Its folder's name.
    pub name: String,
    /// The variant.
    pub variant: String,
    /// The family that it knows.
    pub family: Family,
    /// The hash of its manifest; nothing where it has none.
    pub version: Option<String>,
    /// Episodes whose labels are its.
    pub episodes: u64,
}

/// An episode that a person should look at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Doubtful {
    /// Its number.
    pub episode: u64,
    /// The least of its calls' confidences.
    pub confidence: f32,
    /// Why.
    pub doubts: Vec<Doubt>,
}
