//! What `ntp/annotation.json` tells of labels that models made.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// What `ntp/annotation.json` tells: what changes by name, the rest as it is.
#[derive(Clone, Deserialize, Serialize)]
pub(in crate::dataset) struct Told {
    pub(in crate::dataset) models: Vec<Model>,
    /// Nothing where they were not listed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::dataset) doubtful: Option<Vec<Doubt>>,
    #[serde(flatten)]
    pub(in crate::dataset) others: Map<String, Value>,
}

#[derive(Clone, Deserialize, Serialize)]
pub(in crate::dataset) struct Model {
    /// How many episodes are its; nothing where it is not known.
    pub(in crate::dataset) episodes: Option<u64>,
    /// What tells it apart.
    #[serde(flatten)]
    pub(in crate::dataset) identity: Map<String, Value>,
}

#[derive(Clone, Deserialize, Serialize)]
pub(in crate::dataset) struct Doubt {
    pub(in crate::dataset) episode: u64,
    #[serde(flatten)]
    pub(in crate::dataset) others: Map<String, Value>,
}

impl Told {
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
