//! What a dataset is made of: the settings of the convert stage.

use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};

/// Which recorded frames become rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrameChoice {
    /// Those that programs see: the first one, and one at the end of each primitive.
    #[default]
    Boundaries,
    /// Every one.
    All,
}

impl FrameChoice {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Boundaries => "boundaries",
            Self::All => "all",
        }
    }
}

/// What becomes of episodes that failed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailedEpisodes {
    /// They are counted and left out, so that no learner imitates them.
    #[default]
    LeaveOut,
    /// They are written like the others, marked by `success` and `cause`.
    Include,
}

/// What `action` tells a learner to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ActionChoice {
    /// How far the gripper moves to the next row, and whether it holds something then.
    #[default]
    Gripper,
    /// The angles of the arm's joints at the next row, and whether the gripper holds something then. For recordings of
    /// an arm.
    Joints,
}

impl ActionChoice {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// Settings of the convert stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConvertConfig {
    /// Which recorded frames become rows. Spans are then counted in these.
    pub frames: FrameChoice,
    /// What becomes of episodes that failed.
    pub failed: FailedEpisodes,
    /// What `action` tells a learner to do.
    #[serde(skip_serializing_if = "ActionChoice::is_default")]
    pub action: ActionChoice,
    /// Rows per second that `timestamp` claims: `LeRobot` wants it regular. True times are in `ntp.time_secs`.
    pub fps: NonZeroU32,
    /// Size at which the next data file begins, in megabytes.
    pub file_megabytes: NonZeroU32,
}

impl Default for ConvertConfig {
    fn default() -> Self {
        Self {
            frames: FrameChoice::default(),
            failed: FailedEpisodes::default(),
            action: ActionChoice::default(),
            fps: const { NonZeroU32::new(10).unwrap() },
            file_megabytes: const { NonZeroU32::new(100).unwrap() },
        }
    }
}
