//! In which form a task specification is given.

use std::fmt;

use serde::{Deserialize, Serialize};

/// In which form a task specification is given.
///
/// # Source
///
/// Paper, section III: "a task specification may be a demonstration of the task, or a list of language instructions".
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum SpecificationForm {
    /// The objects' positions relative to the gripper in each boundary frame of a demonstration.
    #[default]
    Trajectories,
    /// A sentence for each part of the task, such as `pick block_D`, `place on block_E`.
    Instructions,
    /// A picture of each boundary frame of a demonstration.
    Video,
}

impl SpecificationForm {
    /// Every form.
    pub const ALL: [Self; 3] = [Self::Trajectories, Self::Instructions, Self::Video];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trajectories => "trajectories",
            Self::Instructions => "instructions",
            Self::Video => "video",
        }
    }
}

impl fmt::Display for SpecificationForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
