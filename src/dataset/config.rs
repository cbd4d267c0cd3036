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

/// Settings of the convert stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConvertConfig {
    /// Which recorded frames become rows. Spans are then counted in these.
    pub frames: FrameChoice,
    /// What becomes of episodes that failed.
    pub failed: FailedEpisodes,
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
            fps: const { NonZeroU32::new(10).unwrap() },
            file_megabytes: const { NonZeroU32::new(100).unwrap() },
        }
    }
}
