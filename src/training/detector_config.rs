//! The settings of a detector's training, as they stand in a pipeline file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::model::{Variant, VggDetectorConfig};
use crate::training::TrainError;

/// How a detector is trained: apart, before the network behind it, which then learns on what it detects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DetectorTraining {
    /// Steps of the optimizer; by default 3000.
    pub steps: Option<u32>,
    /// Pictures of a step; by default 192 on colour slots and 32 with VGG16's shape.
    pub pictures: Option<u32>,
    /// Highest learning rate; by default 0.002 on colour slots and 0.0005 with VGG16's shape.
    pub learning_rate: Option<f32>,
    /// `ntp_vid_detector_paper`: what the widths of VGG16 are divided by, 1 (full width, 138 million parameters at 224
    /// pixels) to 64; by default 8.
    pub narrowed: Option<u32>,
    /// `ntp_vid_detector_paper`: heat maps above the convolutions, which look for a slot's object everywhere alike, in place
    /// of the paper's dense layers. Off by default.
    #[serde(skip_serializing_if = "is_off")]
    pub heat_maps: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_off(setting: &bool) -> bool {
    !setting
}

impl DetectorTraining {
    pub(super) fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Steps of the optimizer; none where none are set or filled in.
    pub fn n_steps(&self) -> u32 {
        self.steps.unwrap_or_default()
    }

    /// Pictures of a step.
    pub(super) fn n_pictures(&self) -> usize {
        self.pictures.unwrap_or_default() as usize
    }

    /// With every default filled in for a variant that has a detector.
    pub(super) fn resolved(self, variant: Variant) -> Self {
        let Some(defaults) = variant.encoder().detector() else { return self };
        Self {
            steps: self.steps.or(Some(defaults.steps)),
            pictures: self.pictures.or(Some(defaults.pictures)),
            learning_rate: self.learning_rate.or(Some(defaults.learning_rate)),
            narrowed: self.narrowed.or(defaults.narrowed),
            heat_maps: self.heat_maps,
        }
    }

    /// Whether the settings make sense.
    pub(super) fn check(&self) -> Result<(), TrainError> {
        let refuse = |key, found: String, allowed| Err(TrainError::Config { key, found, allowed });
        for (key, value) in [("detector.steps", self.steps), ("detector.pictures", self.pictures)] {
            if value == Some(0) {
                return refuse(key, "0".to_owned(), "at least 1");
            }
        }
        if let Some(rate) = self.learning_rate.filter(|rate| !(rate.is_finite() && *rate > 0.0)) {
            return refuse("detector.learning_rate", rate.to_string(), "greater than 0");
        }
        let narrowest = VggDetectorConfig::MOST_NARROWED as u32;
        match self.narrowed.filter(|narrowed| !(1..=narrowest).contains(narrowed)) {
            Some(narrowed) => refuse("detector.narrowed", narrowed.to_string(), "1 (full width) to 64"),
            None => Ok(()),
        }
    }
}
