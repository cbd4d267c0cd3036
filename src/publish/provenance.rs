//! Where a dataset comes from, as far as the folders beside it tell.
//!
//! The plan of each stage names the hash of what it read. Where the recordings and tasks of a dataset still lie beside
//! it, their plans hold every setting that made it: enough to make it again.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::artifact::{ContractError, Manifest, Plan, StageDir};
use crate::pipeline::{RunDir, Stage};

/// The plans behind a dataset, from the first stage to the last.
#[derive(Clone, Debug, Default)]
pub(super) struct Provenance {
    /// The dataset's own plan; `None` for one without.
    pub(super) dataset: Option<Plan>,
    /// How its recordings were made.
    pub(super) recordings: Option<(Plan, Manifest)>,
    /// How its tasks were drawn.
    pub(super) tasks: Option<Plan>,
}

/// A dataset that another was made of, as the plan of that one tells.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SourceFacts {
    pub(super) name: String,
    pub(super) version: String,
    /// Which episodes are from it, half-open.
    pub(super) episodes: [u64; 2],
}

impl Provenance {
    /// Follows the hashes from a dataset to the folders beside it.
    pub(super) fn of(dataset: &Path) -> Result<Self, ContractError> {
        let plan = StageDir::new(Stage::Convert.name(), dataset).plan()?;
        let mut found = Self { dataset: plan, recordings: None, tasks: None };
        let (Some(plan), Some(run)) = (&found.dataset, dataset.parent()) else { return Ok(found) };
        let run = RunDir::new(run);
        let Some(recordings) = plan_of(&run.recordings(), plan, Stage::Generate)? else { return Ok(found) };
        found.tasks = plan_of(&run.tasks(), &recordings, Stage::Tasks)?;
        let manifest = run.recordings().finished()?;
        found.recordings = Some((recordings, manifest));
        Ok(found)
    }

    /// The pipeline file that makes the dataset again; `None` when a plan is not at hand.
    pub(super) fn pipeline(&self, name: &str) -> Option<String> {
        let (recordings, _) = self.recordings.as_ref()?;
        let (tasks, dataset) = (self.tasks.as_ref()?, self.dataset.as_ref()?);
        let spec = json!({
            "name": name,
            "seed": tasks.config.get("seed")?,
            "tasks": tasks.config.get("tasks")?,
            "generate": recordings.config.get("generate")?,
            "convert": dataset.config.get("convert")?,
        });
        toml::to_string(&toml::Value::try_from(without_nulls(spec)).ok()?).ok()
    }

    /// The command that made it; `None` when the plans do not tell.
    pub(super) fn command(&self) -> Option<String> {
        let sources = self.sources();
        let plan = self.dataset.as_ref()?;
        if self.recordings.is_some() && self.tasks.is_some() {
            return Some("ntp run pipeline.toml --out RUN --to convert".to_owned());
        }
        let names: Vec<&str> = sources.iter().map(|source| source.name.as_str()).collect();
        (!names.is_empty()).then(|| format!("ntp dataset {} {}", plan.stage, names.join(" ")))
    }

    /// The datasets that it was made of, where it was made of datasets.
    pub(super) fn sources(&self) -> Vec<SourceFacts> {
        let sources = self.dataset.as_ref().and_then(|plan| plan.config.get("sources"));
        sources.and_then(|sources| serde_json::from_value(sources.clone()).ok()).unwrap_or_default()
    }

    /// SHA-256 of the task file that tasks were imported from.
    pub(super) fn import_sha256(&self) -> Option<&str> {
        self.tasks.as_ref()?.inputs.get("import").map(String::as_str)
    }

    /// Episodes that the expert demonstrated, and how many of them failed.
    pub(super) fn demonstrated(&self) -> Option<(u64, u64)> {
        self.recordings.as_ref().map(|(_, manifest)| (manifest.episodes, manifest.failed))
    }
}

/// The plan of a stage, if the folder is the very one that `reader` read.
fn plan_of(dir: &StageDir, reader: &Plan, stage: Stage) -> Result<Option<Plan>, ContractError> {
    let Some(expected) = reader.inputs.get(stage.name()) else { return Ok(None) };
    if dir.manifest()?.is_none() || dir.version()? != *expected {
        return Ok(None);
    }
    Ok(dir.plan()?)
}

/// TOML has no null: what is not said is left out.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(map) => {
            let entries = map.into_iter().filter(|(_, value)| !value.is_null());
            Value::Object(entries.map(|(key, value)| (key, without_nulls(value))).collect::<Map<_, _>>())
        }
        Value::Array(items) => Value::Array(items.into_iter().map(without_nulls).collect()),
        other => other,
    }
}
