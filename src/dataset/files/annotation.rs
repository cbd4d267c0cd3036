//! What `ntp/annotation.json` tells of labels that models made.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::artifact::{IoError, create_dir, read_json};
use crate::dataset::files::layout::ANNOTATION;
use crate::date::Date;

/// What `ntp/annotation.json` tells: what changes by name, the rest as it is.
#[derive(Clone, Deserialize, Serialize)]
pub(crate) struct Told {
    pub(crate) models: Vec<Model>,
    /// Nothing where they were not listed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) doubtful: Option<Vec<Doubt>>,
    /// Episodes whose labels are not theirs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) episodes_of_others: Vec<u64>,
    #[serde(flatten)]
    pub(crate) others: Map<String, Value>,
}

#[derive(Clone, Deserialize, Serialize)]
pub(crate) struct Model {
    /// How many episodes are its; nothing where it is not known.
    pub(crate) episodes: Option<u64>,
    /// What tells it apart.
    #[serde(flatten)]
    pub(crate) identity: Map<String, Value>,
}

#[derive(Clone, Deserialize, Serialize)]
pub(crate) struct Doubt {
    pub(in crate::dataset) episode: u64,
    #[serde(flatten)]
    pub(in crate::dataset) others: Map<String, Value>,
}

impl Model {
    fn in_words(&self) -> String {
        let word = |key: &str| self.identity.get(key).and_then(Value::as_str);
        let version = word("version").map(|version| format!(", version `{}`", version.get(..12).unwrap_or(version)));
        let (name, variant) = (word("name").unwrap_or("?"), word("variant").unwrap_or("?"));
        format!("`{name}` (variant {variant}{})", version.unwrap_or_default())
    }
}

/// Copies the file, where it is there, to what holds the same labels of the same episodes.
pub(in crate::dataset) fn copy(root: &Path, to: &Path) -> Result<(), IoError> {
    let (from, to) = (root.join(ANNOTATION), to.join(ANNOTATION));
    if !from.is_file() {
        return Ok(());
    }
    to.parent().map_or(Ok(()), create_dir)?;
    std::fs::copy(&from, &to).map(|_bytes| ()).map_err(IoError::system("copy", &from))
}

impl Told {
    /// What is told of a dataset; nothing where the file is not there.
    pub(crate) fn of(root: &Path) -> Result<Option<Self>, IoError> {
        let path = root.join(ANNOTATION);
        path.is_file().then(|| read_json(&path)).transpose()
    }

    /// The models in words, but for those that have no episode.
    pub(crate) fn models_in_words(&self) -> String {
        let models = self.models.iter().filter(|model| model.episodes != Some(0));
        models.map(Model::in_words).collect::<Vec<_>>().join(" and ")
    }

    /// What cannot be true of a dataset of so many episodes.
    pub(in crate::dataset) fn problem(&self, n_episodes: u64) -> Option<String> {
        let unknown = self.doubtful.iter().flatten().find(|doubt| doubt.episode >= n_episodes);
        if let Some(Doubt { episode, .. }) = unknown {
            return Some(format!("doubtful: there is no episode {episode}; there are {n_episodes}"));
        }
        if self.models.is_empty() {
            return Some("models: there is none; expected are those whose labels these are".to_owned());
        }
        let word = |model: &Model, key: &str| model.identity.get(key).and_then(Value::as_str).map(ToOwned::to_owned);
        let is_name =
            |name: Option<String>| name.is_some_and(|name| !name.is_empty() && !name.contains(char::is_control));
        if let Some(model) = self.models.iter().find(|of| !(is_name(word(of, "name")) && is_name(word(of, "variant"))))
        {
            return Some(format!("models: {} lacks name or variant", json!(model)));
        }
        if self.episodes_of_others.last().is_some_and(|last| *last >= n_episodes) {
            return Some(format!("episodes_of_others: there are {n_episodes} episodes"));
        }
        let day = self.others.get("date").filter(|day| !day.is_null());
        if let Some(day) = day.filter(|day| day.as_str().is_none_or(|day| day.parse::<Date>().is_err())) {
            return Some(format!("date: it is {day}, expected a day such as \"2026-11-24\""));
        }
        let measured = self.others.get("measured")?;
        let (calls, right) = (&measured["calls"], &measured["calls_with_span"]);
        match calls.as_u64().zip(right.as_u64()) {
            Some((calls, right)) if right <= calls => {}
            _ => {
                return Some(format!(
                    "measured: calls_with_span is {right} and calls {calls}; expected are whole numbers, the first no \
                     larger"
                ));
            }
        }
        if !measured["truth"].is_string() {
            return Some(format!("measured: truth is {}, expected the name of a folder", measured["truth"]));
        }
        if let Some((level, share)) = wrong_share(measured) {
            return Some(format!("measured: a figure of {level} is {share}, but a share is between 0 and 1"));
        }
        None
    }
}

/// A level of what was measured with a figure that is no share, and the figure.
fn wrong_share(measured: &Value) -> Option<(&String, &Value)> {
    let levels = measured["levels"].as_object()?;
    levels.iter().find_map(|(name, level)| Some((name, wrong_figure(level)?)))
}

fn wrong_figure(figures: &Value) -> Option<&Value> {
    match figures {
        Value::Object(several) => several.values().find_map(wrong_figure),
        figure => (!figure.as_f64().is_some_and(|share| (0.0..=1.0).contains(&share))).then_some(figure),
    }
}
