//! Which episodes are wanted.

use serde::Serialize;

use crate::dataset::edit::words::EpisodeWords;
use crate::task::Family;
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
    /// The name of its split.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub split: Option<String>,
    /// Numbers of episodes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub episodes: Vec<EpisodeRange>,
    /// Least number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min_frames: Option<u64>,
    /// Greatest number of frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_frames: Option<u64>,
}

/// Episodes from one number to another, both included: `0-9`, or `12` alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EpisodeRange {
    first: u64,
    last: u64,
}

impl EpisodeRange {
    /// The numbers of the episodes.
    pub fn numbers(self) -> std::ops::RangeInclusive<u64> {
        self.first..=self.last
    }
}

impl From<u64> for EpisodeRange {
    fn from(episode: u64) -> Self {
        Self { first: episode, last: episode }
    }
}

impl std::str::FromStr for EpisodeRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<u64>().ok();
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        let range = number(first).zip(number(last)).filter(|(first, last)| first <= last);
        let (first, last) = range.ok_or_else(|| format!("{text:?} is no range of episodes such as 0-9, or 12"))?;
        Ok(Self { first, last })
    }
}

impl std::fmt::Display for EpisodeRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { first, last } = self;
        if first == last { write!(f, "{first}") } else { write!(f, "{first}-{last}") }
    }
}

impl Serialize for EpisodeRange {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
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
    pub(super) fn holds(&self, of: &EpisodeWords<'_>, calls_program: impl Fn(&str) -> bool) -> bool {
        let any = |is_empty: bool, found: bool| is_empty || found;
        let is_task = |task: &String| *task == of.task_id || of.tasks.contains(&task.as_str());
        any(self.tasks.is_empty(), self.tasks.iter().any(is_task))
            && any(self.families.is_empty(), self.families.iter().any(|family| family.name() == of.family))
            && any(self.outcomes.is_empty(), self.outcomes.iter().any(|ending| ending.fits(of.cause)))
            && any(self.episodes.is_empty(), self.episodes.iter().any(|range| range.numbers().contains(&of.index)))
            && self.split.as_ref().is_none_or(|split| split == of.split)
            && self.min_frames.is_none_or(|least| of.n_frames >= least)
            && self.max_frames.is_none_or(|most| of.n_frames <= most)
            && any(self.programs.is_empty(), self.programs.iter().any(|program| calls_program(program)))
    }

    /// The greatest number of an episode that is asked for.
    pub(super) fn last_episode(&self) -> Option<u64> {
        self.episodes.iter().map(|range| range.last).max()
    }
}
