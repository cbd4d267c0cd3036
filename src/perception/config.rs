//! Settings of a camera that localises.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::{Pose, Vec3};
use crate::render::looking_at;
use crate::task::{Family, FrontView, Layout};

/// Where a camera stands. Distances are to the middle of what a family's programs reach.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Stand {
    /// Before the table, on the side of the family's front camera: 0.95 m away and 0.95 m above.
    #[default]
    Front,
    /// At the side that an arm looks to: 0.75 m away and 1.05 m above.
    Right,
    /// Above the table: 1.25 m above, 0.15 m aside.
    Above,
}

/// What a camera's depths are like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sensor {
    /// Those of a Kinect v2: noise along the ray and aside, pixels between two surfaces, holes.
    #[default]
    Kinect,
    /// Those of the surface in the middle of each pixel.
    Exact,
}

/// A camera that tells a robot, and the policy that acts it, where things are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PerceptionConfig {
    /// Where it stands: `front`, `right` or `above`.
    pub camera: Stand,
    /// What its depths are like: `kinect`, or `exact`.
    pub sensor: Sensor,
    /// Standard deviation of the turn, about each of its axes, by which it is not as the robot takes it to be, in
    /// degrees; 0 to 10. Drawn once a trial.
    pub calibration_deg: f32,
    /// Standard deviation of its displacement along each axis, in millimetres; 0 to 100. Drawn once a trial.
    pub calibration_mm: f32,
    /// Standard deviation of what is added to all of its depths, in millimetres; 0 to 100. Drawn once a trial.
    pub depth_mm: f32,
}

impl Default for PerceptionConfig {
    fn default() -> Self {
        Self { camera: Stand::Front, sensor: Sensor::Kinect, calibration_deg: 0.1, calibration_mm: 1.5, depth_mm: 2.0 }
    }
}

/// A setting that is not allowed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {found}; allowed: from 0 to {most}")]
pub struct PerceptionError {
    /// Its key.
    pub key: &'static str,
    /// As found.
    pub found: f32,
    /// The most that is allowed.
    pub most: f32,
}

impl PerceptionConfig {
    /// Checks every setting.
    ///
    /// # Errors
    ///
    /// [`PerceptionError`] for the first that is not allowed.
    pub fn check(&self) -> Result<(), PerceptionError> {
        let Self { camera: _, sensor: _, calibration_deg, calibration_mm, depth_mm } = *self;
        let limits = [
            ("calibration_deg", calibration_deg, 10.0),
            ("calibration_mm", calibration_mm, 100.0),
            ("depth_mm", depth_mm, 100.0),
        ];
        let wrong = limits.into_iter().find(|(_, found, most)| !(0.0..=*most).contains(found));
        wrong.map_or(Ok(()), |(key, found, most)| Err(PerceptionError { key, found, most }))
    }
}

impl Stand {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Right => "right",
            Self::Above => "above",
        }
    }

    /// Where it stands before a family's table, looking at what programs reach there.
    pub(super) fn in_world(self, family: Family, layout: Layout) -> Pose {
        let FrontView { eye_m, target_m } = family.front_view(layout);
        let target = Vec3::new(target_m[0], target_m[1], 0.03);
        let side = if eye_m[1] > target_m[1] { 1.0 } else { -1.0 };
        let from_target = match self {
            Self::Front => Vec3::new(0.0, 0.95 * side, 0.95),
            Self::Right => Vec3::new(0.75, 0.0, 1.05),
            Self::Above => Vec3::new(0.0, 0.15 * side, 1.25),
        };
        looking_at(&(target + from_target), &target)
    }
}

impl Sensor {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kinect => "kinect",
            Self::Exact => "exact",
        }
    }
}
