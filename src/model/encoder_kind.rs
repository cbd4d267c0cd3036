//! How observations and demonstrations are read: with core and scoping it makes a variant.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::model::colour_slots::ColourSlots;
use crate::model::detector::{DetectorDefaults, PointDetector, VggDetector};
use crate::model::encoder::TrainingDefaults;
use crate::model::keypoints::Keypoints;
use crate::model::object_centric::ObjectCentric;
use crate::model::vectors::{Convolved, Positions};

/// The kind of encoder.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum EncoderKind {
    /// Positions, slot by slot.
    #[default]
    ObjectCentric,
    /// Positions, as one vector: the paper's.
    Flattened,
    /// Pictures, in which things are told apart by colour.
    ColourSlots,
    /// Pictures, each as one vector: the paper's.
    Convolved,
    /// Pictures, in which learned convolutions find each slot's object.
    Keypoints,
    /// Positions slot by slot, as a detector on colour slots finds them in pictures.
    Detected,
    /// Positions as one vector, as a detector of VGG16's shape finds them in pictures: the paper's.
    DetectedFlattened,
}

impl EncoderKind {
    /// Every kind.
    pub const ALL: [Self; 7] = [
        Self::ObjectCentric,
        Self::Flattened,
        Self::ColourSlots,
        Self::Convolved,
        Self::Keypoints,
        Self::Detected,
        Self::DetectedFlattened,
    ];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::ObjectCentric => "object_centric",
            Self::Flattened => "flattened",
            Self::ColourSlots => "colour_slots",
            Self::Convolved => "convolved",
            Self::Keypoints => "keypoints",
            Self::Detected => "detected",
            Self::DetectedFlattened => "detected_flattened",
        }
    }

    /// Whether it is given pictures in place of positions.
    pub fn sees(self) -> bool {
        !matches!(self, Self::ObjectCentric | Self::Flattened)
    }

    /// Whether a detector is before it, which is trained first.
    pub fn detects(self) -> bool {
        self.detector().is_some()
    }

    /// Whether pictures teach it by the losses of programs alone.
    pub fn is_end_to_end(self) -> bool {
        self.sees() && !self.detects()
    }

    /// Whether it tells things apart by a number of colours.
    pub fn has_colours(self) -> bool {
        matches!(self, Self::ColourSlots | Self::Detected)
    }

    /// How a network with it is trained unless a pipeline file says otherwise.
    pub fn training(self) -> TrainingDefaults {
        match self {
            Self::ObjectCentric => ObjectCentric::TRAINING,
            Self::Flattened => Positions::TRAINING,
            Self::ColourSlots => ColourSlots::TRAINING,
            Self::Convolved => Convolved::TRAINING,
            Self::Keypoints => Keypoints::TRAINING,
            Self::Detected => PointDetector::TRAINING.behind,
            Self::DetectedFlattened => VggDetector::TRAINING.behind,
        }
    }

    /// How its detector is trained unless a pipeline file says otherwise; nothing where there is none.
    pub fn detector(self) -> Option<DetectorDefaults> {
        match self {
            Self::Detected => Some(PointDetector::TRAINING),
            Self::DetectedFlattened => Some(VggDetector::TRAINING),
            Self::ObjectCentric | Self::Flattened | Self::ColourSlots | Self::Convolved | Self::Keypoints => None,
        }
    }
}

impl fmt::Display for EncoderKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
