//! The map: which topics and fields become which features, when, and in which episodes.

use std::collections::BTreeSet;
use std::path::Path;

use serde::{Deserialize, Deserializer, de};

use super::error::IngestError;
use super::observe::{GRIPPER, ObservationsMap};
use super::path::FieldPath;
use crate::artifact::read;
use crate::dataset::plain::ROW_FEATURES;

/// A map from recordings to a dataset, as its TOML file has it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Rows a second.
    #[serde(deserialize_with = "whole_rate")]
    pub(super) fps: u32,
    /// The robot's name.
    #[serde(default = "unknown")]
    pub(super) robot_type: String,
    /// What the episodes are of: a text, or the topic that says it.
    pub(super) task: Task,
    /// By which times messages are matched.
    #[serde(default)]
    pub(super) clock: Clock,
    /// How much later than a younger one a message may stand in the file.
    #[serde(default = "half")]
    pub(super) slack_secs: f64,
    /// Size at which a file of the dataset is ended.
    #[serde(default = "hundred")]
    pub(super) file_megabytes: u32,
    /// Where episodes begin and end.
    #[serde(default)]
    pub(super) episodes: Episodes,
    /// Poses that become our observations.
    #[serde(default)]
    pub(super) observations: Option<ObservationsMap>,
    /// The features, in the order of the dataset; first the numbers that observations are made of, if there are any.
    #[serde(rename = "feature", default)]
    pub(super) features: Vec<FeatureMap>,
}

/// A task's text.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Task {
    Text(String),
    Topic { topic: String, field: FieldPath },
}

/// A time of a message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Clock {
    /// When it was recorded.
    #[default]
    Log,
    /// When it was published.
    Publish,
    /// The stamp in it; when it was recorded, if it has none.
    Header,
}

/// Where episodes begin and end.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(tag = "by", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Episodes {
    /// Each file is one.
    #[default]
    File,
    /// Where a topic says so. Without `end`, the next start ends an episode.
    Marker { topic: String, field: FieldPath, start: Mark, end: Option<Mark> },
    /// Where a topic is silent for longer than this.
    Gap { topic: String, secs: f64 },
}

/// A value that marks a bound.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Mark {
    Flag(bool),
    Whole(i64),
    Number(f64),
    Text(String),
}

/// A feature of the dataset.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FeatureMap {
    pub(super) name: String,
    #[serde(default)]
    pub(super) dtype: NumberType,
    /// Which message a row takes.
    #[serde(default, rename = "match")]
    pub(super) matching: Matching,
    /// How far in time it may be from the row.
    #[serde(default = "usual_age")]
    pub(super) max_age_secs: f64,
    /// How pictures are stored.
    #[serde(default)]
    pub(super) store: Store,
    /// Names of the numbers; otherwise their fields'.
    #[serde(default)]
    pub(super) names: Option<Vec<String>>,
    /// Where its values are from, one behind the other.
    pub(super) from: Vec<SourceMap>,
}

/// A field of a topic.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SourceMap {
    pub(super) topic: String,
    #[serde(default)]
    pub(super) field: FieldPath,
    /// Which elements of the field, by the names that the message has beside it.
    #[serde(default)]
    pub(super) joints: Vec<String>,
    /// The list of these names.
    #[serde(default = "name")]
    pub(super) joint_names: FieldPath,
}

/// The type of a feature's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum NumberType {
    #[default]
    Float32,
    Float64,
    Int64,
    Bool,
}

/// Which message a row takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Matching {
    /// The last one that is not younger.
    #[default]
    Last,
    /// The nearest, of two the older.
    Nearest,
    /// Of numbers: on the line between the one before and the one behind.
    Linear,
}

/// How pictures are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Store {
    /// PNG, JPEG and H.264 as they are; others as PNG.
    #[default]
    AsIs,
    /// As PNG.
    Png,
    /// As H.264, encoded here.
    H264,
}

fn unknown() -> String {
    "unknown".to_owned()
}

fn half() -> f64 {
    0.5
}

/// A rate; of others their words say what is taken.
fn whole_rate<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    let found = toml::Value::deserialize(deserializer)?;
    let whole = found.as_integer().and_then(|fps| u32::try_from(fps).ok());
    whole.ok_or_else(|| de::Error::custom(format!("fps is {found}; it is a whole number from 1 to 1000")))
}

/// How far a message may be from its row unless the map says otherwise.
pub(super) const USUAL_AGE_SECS: f64 = 1.0;

fn usual_age() -> f64 {
    USUAL_AGE_SECS
}

fn hundred() -> u32 {
    100
}

fn name() -> FieldPath {
    FieldPath::try_from("name".to_owned()).unwrap_or_default()
}

/// The longest slack or age: what is held grows with it.
const MAX_SECS: f64 = 60.0;

impl Map {
    /// Reads a map.
    ///
    /// # Errors
    ///
    /// When the file is no map, with the place.
    pub fn read(path: &Path) -> Result<Self, IngestError> {
        let wrong = |problem: String| IngestError::Map { path: path.to_owned(), problem };
        let bytes = read(path)?;
        let text = std::str::from_utf8(&bytes).map_err(|error| wrong(error.to_string()))?;
        let mut map: Self = toml::from_str(text).map_err(|error| wrong(error.to_string()))?;
        if let Some(observations) = &map.observations {
            let taken = |feature: &FeatureMap| feature.name == GRIPPER;
            if map.features.iter().any(taken) {
                return Err(wrong(format!("feature {GRIPPER:?} is what observations give")));
            }
            map.features.insert(0, observations.feature().map_err(wrong)?);
        }
        map.check().map_err(wrong)?;
        Ok(map)
    }

    fn check(&self) -> Result<(), String> {
        let Self { fps, file_megabytes, slack_secs, features, .. } = self;
        if !(1..=1000).contains(fps) {
            return Err(format!("fps is {fps}; it is 1 to 1000"));
        }
        if !(1..=1000).contains(file_megabytes) {
            return Err(format!("file_megabytes is {file_megabytes}; it is 1 to 1000"));
        }
        check_secs("slack_secs", *slack_secs)?;
        if let Episodes::Gap { secs, .. } = self.episodes
            && (!secs.is_finite() || secs <= 0.0)
        {
            return Err(format!("episodes.secs is {secs}; it is above 0"));
        }
        if matches!(&self.task, Task::Text(text) if text.trim().is_empty()) {
            return Err("task is empty; it says what the episodes are of".to_owned());
        }
        if features.is_empty() {
            return Err("no [[feature]] and no [observations]".to_owned());
        }
        let mut names = BTreeSet::new();
        for feature in features {
            feature.check().map_err(|problem| format!("feature {:?}: {problem}", feature.name))?;
            if !names.insert(&feature.name) {
                return Err(format!("feature {:?} stands twice", feature.name));
            }
        }
        Ok(())
    }
}

impl FeatureMap {
    fn check(&self) -> Result<(), String> {
        if self.name.is_empty() || self.name.contains('/') || ROW_FEATURES.contains(&self.name.as_str()) {
            return Err(format!("a name is not empty, has no /, and is none of {}", ROW_FEATURES.join(", ")));
        }
        check_secs("max_age_secs", self.max_age_secs)?;
        if self.from.is_empty() {
            return Err("from names no topic".to_owned());
        }
        if self.matching == Matching::Linear && matches!(self.dtype, NumberType::Int64 | NumberType::Bool) {
            return Err(
                "match is \"linear\", between whole numbers there is no line; allowed: last, nearest".to_owned()
            );
        }
        Ok(())
    }
}

fn check_secs(name: &str, secs: f64) -> Result<(), String> {
    if (0.0..=MAX_SECS).contains(&secs) { Ok(()) } else { Err(format!("{name} is {secs}; it is 0 to {MAX_SECS}")) }
}

/// Seconds as nanoseconds.
pub(super) fn nanos(secs: f64) -> i64 {
    (secs * 1e9).round() as i64
}

impl Mark {
    /// Whether a value of a message is this one.
    pub(super) fn is(&self, value: &super::value::Value) -> bool {
        match self {
            Self::Flag(flag) => value.number() == Some(f64::from(u8::from(*flag))),
            Self::Whole(whole) => value.number() == Some(*whole as f64),
            Self::Number(number) => value.number() == Some(*number),
            Self::Text(text) => value.text() == Some(text),
        }
    }
}
