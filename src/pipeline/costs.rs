//! What units of stages took: `costs.json` at the root of a run directory, and `costs/UNIT/*.json` for what processes did
//! side by side.
//!
//! # Invariants
//!
//! They lie beside the stages' folders and are part of none: no plan, hash or manifest knows them, so clocks decide
//! nothing. Only the report and `ntp explain` read them. Work that was broken off and carried on is summed up; what a
//! killed process did since its last unit is lost. A unit of which a shard was not measured has no cost.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, Plan, read_json, write_json};
use crate::pipeline::{RunDir, Stage};
use crate::progress::Taken;

const VERSION: u32 = 1;
/// Where that lies which processes did side by side.
pub(super) const FOLDER: &str = "costs";

/// What a run took, by the names of its units.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Costs {
    folder: PathBuf,
    whole: CostsFile,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CostsFile {
    version: u32,
    units: BTreeMap<String, UnitCost>,
}

/// What a unit took, or shards of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UnitCost {
    /// Of which stage.
    pub(super) stage: String,
    /// Under which plan; the costs of another plan are forgotten.
    pub(super) plan_id: String,
    /// CPU-seconds of the process, all threads together.
    pub(super) cpu_secs: f64,
    /// Seconds on the clock.
    pub(super) wall_secs: f64,
    /// Of which commit the pipeline file was, where that is known.
    pub(super) commit: Option<String>,
    /// Which shards were done; all when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) shards: Option<BTreeSet<u32>>,
}

/// What a unit is measured under.
pub(super) struct Measured<'a> {
    pub(super) stage: Stage,
    pub(super) unit: &'a str,
    pub(super) plan: &'a Plan,
    pub(super) commit: Option<String>,
}

impl Measured<'_> {
    fn cost(&self, taken: Taken, shards: BTreeSet<u32>) -> UnitCost {
        UnitCost {
            stage: self.stage.name().to_owned(),
            plan_id: self.plan.id(),
            cpu_secs: taken.cpu_secs,
            wall_secs: taken.wall_secs,
            commit: self.commit.clone(),
            shards: Some(shards),
        }
    }

    /// Notes what shards have just taken that a process did beside others: in a file of their own, so that nobody waits.
    /// Where it is; `None` where no shard was done.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub(super) fn note(&self, run: &RunDir, taken: Taken, shards: BTreeSet<u32>) -> Result<Option<PathBuf>, IoError> {
        let Some(first) = shards.first() else { return Ok(None) };
        let path = folder(run, self.unit).join(format!("shard-{first:05}.json"));
        write_json(&path, &self.cost(taken, shards))?;
        Ok(Some(path))
    }
}

impl Costs {
    /// The costs of a run directory; none where nothing was measured.
    ///
    /// # Errors
    ///
    /// When the file is there but not readable.
    pub(super) fn read(run: &RunDir) -> Result<Self, IoError> {
        let whole = match read_json(&path(run)) {
            Err(IoError::System { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                CostsFile { version: VERSION, units: BTreeMap::new() }
            }
            read => read?,
        };
        Ok(Self { folder: run.root().to_owned(), whole })
    }

    /// What a unit took in all, if all of its shards were measured under this plan.
    #[cfg_attr(not(feature = "report"), expect(dead_code, reason = "the report alone asks for it"))]
    pub(super) fn of(&self, unit: &str, plan: &Plan) -> Option<UnitCost> {
        let plan_id = plan.id();
        let own = self.whole.units.get(unit).filter(|cost| cost.plan_id == plan_id).cloned();
        let noted = noted(&folder(&RunDir::new(&self.folder), unit)).filter(|cost| cost.plan_id == plan_id);
        let sum = own.into_iter().chain(noted).reduce(UnitCost::plus)?;
        let is_whole = |shards: &BTreeSet<u32>| (0..plan.shards).all(|shard| shards.contains(&shard));
        sum.shards.as_ref().is_none_or(is_whole).then_some(sum)
    }

    /// Adds what a unit has just taken, and writes. For a process that has the run directory alone.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub(super) fn add(mut self, measured: &Measured<'_>, taken: Taken, shards: BTreeSet<u32>) -> Result<(), IoError> {
        let cost = measured.cost(taken, shards);
        let before = self.whole.units.remove(measured.unit).filter(|before| before.plan_id == cost.plan_id);
        let commit = cost.commit.clone();
        let sum = before.into_iter().chain([cost]).reduce(UnitCost::plus).map(|sum| UnitCost { commit, ..sum });
        self.whole.units.extend(sum.map(|sum| (measured.unit.to_owned(), sum)));
        write_json(&path(&RunDir::new(&self.folder)), &self.whole)
    }
}

impl UnitCost {
    fn plus(self, other: Self) -> Self {
        Self {
            cpu_secs: self.cpu_secs + other.cpu_secs,
            wall_secs: self.wall_secs + other.wall_secs,
            commit: self.commit.or(other.commit),
            shards: self.shards.zip(other.shards).map(|(own, others)| own.into_iter().chain(others).collect()),
            ..other
        }
    }
}

/// What was noted of a unit's shards; what cannot be read was not measured.
fn noted(folder: &Path) -> impl Iterator<Item = UnitCost> + use<> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.sort();
    paths.into_iter().filter_map(|path| read_json(&path).ok())
}

fn folder(run: &RunDir, unit: &str) -> PathBuf {
    run.root().join(FOLDER).join(unit.replace(' ', "/"))
}

fn path(run: &RunDir) -> PathBuf {
    run.root().join("costs.json")
}
