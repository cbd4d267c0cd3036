//! What `ntp/annotation.json` tells of labels that models made.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::artifact::{IoError, create_dir, read_json};
use crate::dataset::files::layout::ANNOTATION;

/// What `ntp/annotation.json` tells: what changes by name, the rest as it is.
#[derive(Clone, Deserialize, Serialize)]
pub(crate) struct Told {
    pub(crate) models: Vec<Model>,
    /// Nothing where they were not listed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) doubtful: Option<Vec<Doubt>>,
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
        let measured = self.others.get("measured")?;
        let (calls, right) = (&measured["calls"], &measured["calls_with_span"]);
        match calls.as_u64().zip(right.as_u64()) {
            Some((calls, right)) if right <= calls => None,
            _ => Some(format!(
                "measured: calls_with_span is {right} and calls {calls}; expected are whole numbers, the first no larger"
            )),
        }
    }
}
