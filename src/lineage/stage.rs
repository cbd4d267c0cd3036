//! What made a folder, and what it was made of, stage by stage upstream.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use crate::artifact::{IoError, Plan, StageDir, read_json, sha256_file};

/// Folders of a run directory by the stage that makes them.
const FOLDERS: [(&str, &str); 3] = [("tasks", "tasks"), ("generate", "recordings"), ("convert", "dataset")];

/// Stages upstream that are followed at most.
const MAX_DEPTH: usize = 8;

/// A stage as its plan tells.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageLineage {
    /// Its name, e.g. `convert` or `merge`.
    pub stage: String,
    /// The folder that it made, where that is known.
    pub path: Option<PathBuf>,
    /// Hash of the folder's manifest: the version of what it made.
    pub version: Option<String>,
    /// Version of the program that planned it.
    pub ntp_version: String,
    /// Commit of the pipeline file's repository, where the run noted it.
    pub commit: Option<String>,
    /// Hash of the plan.
    pub plan_id: String,
    /// Its settings, resolved.
    pub config: Value,
    /// What it read, by the stage's or dataset's name: the hash, and the stage when it was found.
    pub inputs: BTreeMap<String, InputLineage>,
}

/// What a stage read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputLineage {
    /// Hash of what was read.
    pub version: String,
    /// What made it; `None` when no folder with this hash lies where it is looked for.
    pub stage: Option<Box<StageLineage>>,
}

/// What made a folder; `None` when it has no plan.
///
/// # Errors
///
/// When plan or manifest is there but not readable.
pub fn stage_of(folder: &Path) -> Result<Option<StageLineage>, IoError> {
    of_folder(folder, MAX_DEPTH)
}

/// A stage of a known plan whose folder is given.
pub(super) fn with_upstream(folder: &Path, plan: Plan, version: Option<String>) -> Result<StageLineage, IoError> {
    lineage(folder, plan, version, MAX_DEPTH)
}

fn of_folder(folder: &Path, depth: usize) -> Result<Option<StageLineage>, IoError> {
    let dir = StageDir::new("", folder);
    let Some(plan) = dir.plan()? else { return Ok(None) };
    let manifest = folder.join("manifest.json");
    let version = manifest.is_file().then(|| sha256_file(&manifest)).transpose()?;
    lineage(folder, plan, version, depth).map(Some)
}

fn lineage(folder: &Path, plan: Plan, version: Option<String>, depth: usize) -> Result<StageLineage, IoError> {
    let plan_id = plan.id();
    let mut inputs = BTreeMap::new();
    for (name, version) in &plan.inputs {
        let stage = match depth.checked_sub(1) {
            Some(depth) => upstream(folder, &plan, name, version, depth)?,
            None => None,
        };
        inputs.insert(name.clone(), InputLineage { version: version.clone(), stage: stage.map(Box::new) });
    }
    Ok(StageLineage {
        path: Some(folder.to_owned()),
        version,
        commit: commit(folder, &plan_id),
        stage: plan.stage,
        ntp_version: plan.ntp_version,
        plan_id,
        config: plan.config,
        inputs,
    })
}

/// The stage that made an input: in the run directory, or as the plan of an edited dataset tells of its sources.
fn upstream(
    folder: &Path,
    plan: &Plan,
    name: &str,
    version: &str,
    depth: usize,
) -> Result<Option<StageLineage>, IoError> {
    if let Some(source) = told_source(plan, version) {
        let mut stage = lineage(folder, source, None, depth)?;
        (stage.path, stage.commit) = (None, None);
        return Ok(Some(stage));
    }
    let Some((_, made)) = FOLDERS.iter().find(|(stage, _)| *stage == name) else { return Ok(None) };
    for run in run_directories(folder) {
        let candidate = run.join(made);
        let manifest = candidate.join("manifest.json");
        if manifest.is_file() && sha256_file(&manifest)? == version {
            return of_folder(&candidate, depth);
        }
    }
    Ok(None)
}

/// The plan of a source with this version, which an edited dataset keeps.
fn told_source(plan: &Plan, version: &str) -> Option<Plan> {
    let sources = plan.config.get("sources")?.as_array()?;
    let source = sources.iter().find(|source| source.get("version").and_then(Value::as_str) == Some(version))?;
    serde_json::from_value(source.get("plan")?.clone()).ok()
}

/// Folders that may be the run directory of a folder: recordings and datasets lie in it, models and rollouts deeper.
fn run_directories(folder: &Path) -> Vec<PathBuf> {
    let full = folder.canonicalize().unwrap_or_else(|_gone| folder.to_owned());
    full.ancestors().skip(1).take(3).map(Path::to_owned).collect()
}

/// The commit that a run noted for a plan, in the costs at its root: of a whole unit, or of shards.
fn commit(folder: &Path, plan_id: &str) -> Option<String> {
    let is_of_plan = |cost: &&Value| cost.get("plan_id").and_then(Value::as_str) == Some(plan_id);
    let commit = |cost: &Value| Some(cost.get("commit")?.as_str()?.to_owned());
    run_directories(folder).into_iter().find_map(|run| {
        let whole = read_json::<Value>(&run.join("costs.json")).ok();
        let units = whole.as_ref().and_then(|costs| costs.get("units")?.as_object());
        let of_unit = units.and_then(|units| units.values().find(is_of_plan)).and_then(commit);
        of_unit.or_else(|| noted_costs(&run.join("costs")).iter().find(is_of_plan).and_then(commit))
    })
}

/// What processes that worked side by side noted.
fn noted_costs(folder: &Path) -> Vec<Value> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths
        .iter()
        .flat_map(|path| if path.is_dir() { noted_costs(path) } else { read_json(path).into_iter().collect() })
        .collect()
}
