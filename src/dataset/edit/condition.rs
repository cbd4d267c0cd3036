//! Which episodes are wanted.

use serde::Serialize;

use crate::dataset::edit::source::SourceEpisode;
use crate::task::{Family, Split};
use crate::trace::Cause;

/// How an episode must have ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// With success.
    Success,
    /// Without, whatever the cause.
    Failure,
    /// For this cause.
    Cause(Cause),
}

/// Which episodes are wanted: those for which all that is asked for holds. Of a list, one is enough.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Condition {
    /// Ids of tasks, or their texts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tasks: Vec<String>,
    /// Families of tasks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub families: Vec<Family>,
    /// Programs of which one is called, by their names.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub programs: Vec<String>,
    /// How it ended.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub outcomes: Vec<Ending>,
    /// Its split.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub split: Option<Split>,
    /// Least number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_frames: Option<u64>,
    /// Greatest number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_frames: Option<u64>,
}

impl std::str::FromStr for Ending {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let allowed = || format!("success, failure, {}", Cause::ALL.map(Cause::name).join(", "));
        match word {
            "success" => Ok(Self::Success),
            "failure" => Ok(Self::Failure),
            cause => Cause::from_name(cause)
                .map(Self::Cause)
                .ok_or_else(|| format!("unknown outcome {cause:?}; allowed: {}", allowed())),
        }
    }
}

impl Serialize for Ending {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match self {
            Self::Success => "success",
            Self::Failure => "failure",
            Self::Cause(cause) => cause.name(),
        })
    }
}

impl Ending {
    fn fits(self, cause: Option<&str>) -> bool {
        match self {
            Self::Success => cause.is_none(),
            Self::Failure => cause.is_some(),
            Self::Cause(wanted) => cause == Some(wanted.name()),
        }
    }
}

impl Condition {
    /// Whether an episode is wanted.
    pub(super) fn holds(&self, episode: &SourceEpisode) -> bool {
        let row = &episode.row;
        let n_frames = row.n_frames.unsigned_abs();
        let any = |is_empty: bool, found: bool| is_empty || found;
        any(self.tasks.is_empty(), self.tasks.iter().any(|task| *task == row.task_id || *task == row.task_text))
            && any(self.families.is_empty(), self.families.iter().any(|family| family.name() == row.family))
            && any(self.outcomes.is_empty(), self.outcomes.iter().any(|ending| ending.fits(row.cause.as_deref())))
            && self.split.is_none_or(|split| split.name() == row.split)
            && self.min_frames.is_none_or(|least| n_frames >= least)
            && self.max_frames.is_none_or(|most| n_frames <= most)
            && any(self.programs.is_empty(), self.programs.iter().any(|of| episode.calls_program(of)))
    }
}
