//! What units of stages took: `costs.json` at the root of a run directory.
//!
//! # Invariants
//!
//! It lies beside the stages' folders and is part of none: no plan, hash or manifest knows it, so clocks decide nothing.
//! Only the report reads it. Work that was broken off and carried on is summed up; what a killed process did since its
//! last unit is lost, and shards that were done one by one are not counted.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, Plan, read_json, write_json};
use crate::pipeline::{RunDir, Stage};
use crate::progress::Taken;

const VERSION: u32 = 1;

/// What a run took, by the names of its units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Costs {
    version: u32,
    units: BTreeMap<String, UnitCost>,
}

/// What a unit took.
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
}

impl Costs {
    /// The costs of a run directory; none where nothing was measured.
    ///
    /// # Errors
    ///
    /// When the file is there but not readable.
    pub(super) fn read(dir: &RunDir) -> Result<Self, IoError> {
        match read_json(&path(dir)) {
            Err(IoError::System { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => {
                Ok(Self { version: VERSION, units: BTreeMap::new() })
            }
            read => read,
        }
    }

    /// What a unit took in all, if it was measured under this plan.
    pub(super) fn of(&self, unit: &str, plan: &Plan) -> Option<&UnitCost> {
        self.units.get(unit).filter(|cost| cost.plan_id == plan.id())
    }

    /// Adds what a unit has just taken, and writes.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub(super) fn add(
        mut self,
        dir: &RunDir,
        stage: Stage,
        unit: (&str, &Plan),
        taken: Taken,
        commit: Option<&str>,
    ) -> Result<(), IoError> {
        let (name, plan) = unit;
        let (cpu_before, wall_before) = self.of(name, plan).map_or((0.0, 0.0), |cost| (cost.cpu_secs, cost.wall_secs));
        let cost = UnitCost {
            stage: stage.name().to_owned(),
            plan_id: plan.id(),
            cpu_secs: cpu_before + taken.cpu_secs,
            wall_secs: wall_before + taken.wall_secs,
            commit: commit.map(str::to_owned),
        };
        self.units.insert(name.to_owned(), cost);
        write_json(&path(dir), &self)
    }
}

fn path(dir: &RunDir) -> PathBuf {
    dir.root().join("costs.json")
}
