//! The stages in their one order.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// A stage. The order is the order of the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Draws or imports tasks.
    Tasks,
    /// Lets the expert demonstrate, and records.
    Generate,
    /// Turns recordings into a dataset.
    Convert,
    /// Trains models.
    Train,
    /// Evaluates models.
    Rollout,
    /// Shows results.
    Report,
}

impl Stage {
    /// Every stage in order.
    pub const ALL: [Self; 6] = [Self::Tasks, Self::Generate, Self::Convert, Self::Train, Self::Rollout, Self::Report];

    /// Whether its units have shards.
    pub fn has_shards(self) -> bool {
        matches!(self, Self::Generate | Self::Rollout)
    }

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tasks => "tasks",
            Self::Generate => "generate",
            Self::Convert => "convert",
            Self::Train => "train",
            Self::Rollout => "rollout",
            Self::Report => "report",
        }
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is no stage.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown stage {word:?}; stages are {}", Stage::ALL.map(Stage::name).join(", "))]
pub struct UnknownStage {
    /// The word as typed.
    pub word: String,
}

impl FromStr for Stage {
    type Err = UnknownStage;

    fn from_str(word: &str) -> Result<Self, UnknownStage> {
        Self::ALL.into_iter().find(|stage| stage.name() == word).ok_or_else(|| UnknownStage { word: word.to_owned() })
    }
}
