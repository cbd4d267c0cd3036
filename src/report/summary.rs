//! `report.json`: the edge types.
//!
//! # Input and output
//!
//! schemas/report.schema.json, generated from these types. Shares are from 0 to 1; intervals are Wilson's at 95 %.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use crate::annotate::Measured;
use crate::report::PaperValue;
use crate::report::actor::{Actor, ModelParts};
use crate::report::claims::{Claim, Note};
use crate::report::detections::DetectionError;
use crate::report::facts::SuiteFacts;
use crate::report::figures::{Figure, Grid};
use crate::report::filmstrip::Filmstrip;
use crate::report::robot_table::RobotRow;

/// Version of the file.
pub(super) const SCHEMA_VERSION: u32 = 2;

/// Everything the report says in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Report {
    /// Version of this form: 2.
    pub schema_version: u32,
    /// Version of the program that wrote it.
    pub ntp_version: String,
    /// What the run is called.
    pub title: String,
    /// One for each actor, suite and training seed.
    pub results: Vec<SuiteResult>,
    /// One for each actor and suite, over training seeds.
    pub aggregates: Vec<Aggregate>,
    /// What the paper claims, judged by these results.
    pub claims: Vec<Claim>,
    /// What is to be said of variants that see beside their figures.
    pub notes: Vec<Note>,
    /// The paper's figures from these results.
    pub figures: Vec<Figure>,
    /// Table Clean-up by bowls and forks.
    pub grids: Vec<Grid>,
    /// The paper's table of a real robot from these results; absent where no robot has to see.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robot_table: Vec<RobotRow>,
    /// Where rollouts first decided otherwise than the expert.
    pub divergences: Vec<Divergence>,
    /// What failed rollouts did wrong first.
    pub errors: Vec<FirstError>,
    /// Episodes in pictures, which are on the page alone.
    pub filmstrips: Vec<Filmstrip>,
    /// Errors of detectors in the demonstrations that models behind them were given.
    pub detections: Vec<DetectionError>,
    /// Labels that models made, held against true ones; absent where the pipeline names none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub annotations: Vec<AnnotationResult>,
    /// The end of each training curve; the whole curves are in curves.csv.
    pub training: Vec<TrainingEnd>,
    /// The trained models.
    pub models: Vec<ModelSummary>,
    /// What each stage took, where it was measured: the only figures that differ between equal runs.
    pub costs: Vec<StageCost>,
    /// Of which commits the pipeline files were when the stages ran, where that is known.
    pub commits: Vec<String>,
    /// The paper's figures.
    pub paper: Vec<PaperValue>,
    /// What else there is to say of the run.
    pub facts: Vec<Fact>,
    /// What was read.
    pub inputs: Vec<InputFile>,
}

/// How well the labels of an annotated dataset agree with true ones.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct AnnotationResult {
    /// Of which experiment.
    pub experiment: String,
    /// The annotated dataset's folder, as the pipeline names it.
    pub name: String,
    /// What was measured.
    pub measured: Measured,
}

/// The rollouts of one trained model in one suite.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SuiteResult {
    /// Who acted.
    #[serde(flatten)]
    pub actor: Actor,
    /// The set of evaluation tasks.
    pub suite: String,
    /// What it asks for.
    pub facts: SuiteFacts,
    /// The seed of its training.
    pub seed: i64,
    /// How many rollouts.
    pub episodes: u64,
    /// How many of them succeeded.
    pub successes: u64,
    /// Share of successes.
    pub success_rate: f64,
    /// Lower end of its interval.
    pub wilson_low: f64,
    /// Upper end of its interval.
    pub wilson_high: f64,
    /// Share of a task's goals that hold in the end, on average: the paper's "proportion of task completed"; null where
    /// it was not measured.
    pub goals_met: Option<f64>,
    /// Failures by cause.
    pub causes: BTreeMap<String, u64>,
    /// Failures by what they are due to: `ntp`, `localisation`, `manipulation`. Absent where that was not told.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub failures: BTreeMap<String, u64>,
    /// Level distance of what the model was told from true places, the mean over rollouts, in millimetres; absent where
    /// it was told true ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub localisation_mm: Option<f64>,
    /// Program calls a rollout, on average.
    pub mean_calls: f64,
    /// Simulated seconds a rollout, on average.
    pub mean_sim_secs: f64,
    /// An adversary's pushes in all rollouts; null in a suite without one.
    pub pushes: Option<u64>,
    /// The bodies that they toppled.
    pub toppled: Option<u64>,
}

/// One actor in one suite, over training seeds.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Aggregate {
    /// Who acted.
    #[serde(flatten)]
    pub actor: Actor,
    /// The set of evaluation tasks.
    pub suite: String,
    /// What it asks for.
    pub facts: SuiteFacts,
    /// How many training seeds.
    pub seeds: u64,
    /// Rollouts of all seeds.
    pub episodes: u64,
    /// How many of them succeeded.
    pub successes: u64,
    /// Mean over seeds of their shares of successes.
    pub mean_success_rate: f64,
    /// The lowest share of a seed.
    pub lowest_success_rate: f64,
    /// The highest share of a seed.
    pub highest_success_rate: f64,
    /// Lower end of the interval of the mean over training seeds, by Student's t at 95 %, cut off at 0; null with one
    /// seed. Where all seeds have the same share it has no width: see the other interval then.
    pub seeds_low: Option<f64>,
    /// Upper end of that interval, cut off at 1; null with one seed.
    pub seeds_high: Option<f64>,
    /// Lower end of the interval of all seeds' rollouts taken together.
    pub wilson_low: f64,
    /// Upper end of the interval of all seeds' rollouts taken together.
    pub wilson_high: f64,
    /// Share of a task's goals that hold in the end, the mean over seeds; null where it was not measured.
    pub goals_met: Option<f64>,
    /// Failures by cause.
    pub causes: BTreeMap<String, u64>,
    /// Failures by what they are due to: `ntp`, `localisation`, `manipulation`. Absent where that was not told.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub failures: BTreeMap<String, u64>,
    /// Level distance of what the model was told from true places, the mean over rollouts, in millimetres; absent where
    /// it was told true ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub localisation_mm: Option<f64>,
    /// An adversary's pushes in all rollouts; null in a suite without one.
    pub pushes: Option<u64>,
    /// The bodies that they toppled.
    pub toppled: Option<u64>,
    /// The paper's share of successes, where it gives one under these conditions.
    pub paper_success_rate: Option<f64>,
}

/// Rollouts of a variant in a suite whose first departure from the expert is of one kind, at one decision.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct Divergence {
    /// Of which experiment.
    pub experiment: String,
    /// The model's variant.
    pub variant: String,
    /// The set of evaluation tasks.
    pub suite: String,
    /// `success` or `failure`: how these rollouts ended all the same.
    pub ended: String,
    /// Index of the decision, from 0.
    pub decision: i64,
    /// What differed: `program`, `argument`, `scope`, `early_end` or `late_end`.
    pub kind: String,
    /// The program that decided.
    pub program: String,
    /// How many rollouts.
    pub episodes: u64,
}

/// Failed rollouts of an actor in a suite that went wrong first in the same way.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
pub struct FirstError {
    /// Who acted.
    #[serde(flatten)]
    pub actor: Actor,
    /// The set of evaluation tasks.
    pub suite: String,
    /// The program that decided wrongly: the level of the error. Null when physics went wrong first.
    pub program: Option<String>,
    /// What was wrong: `program`, `argument`, `scope`, `early_end`, `late_end`, or `physics` when no decision was.
    pub error: String,
    /// How many rollouts.
    pub episodes: u64,
}

/// One trained model.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ModelSummary {
    /// Of which experiment.
    pub experiment: String,
    /// Its variant: its name.
    pub variant: String,
    /// Its parts.
    #[serde(flatten)]
    pub parts: ModelParts,
    /// What tells it apart from other models of its variant; null for most.
    pub tag: Option<String>,
    /// How many tasks it was trained on.
    pub train_tasks: i64,
    /// What it reads as task specification.
    pub specification: String,
    /// The seed of its training.
    pub seed: i64,
    /// How many parameters it has.
    pub parameters: u64,
    /// CPU-seconds of its training, where they were measured.
    pub cpu_secs: Option<f64>,
}

/// What a stage of an experiment took.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct StageCost {
    /// Of which experiment.
    pub experiment: String,
    /// Which stage.
    pub stage: String,
    /// CPU-seconds of the process, all threads together; none where a part of it was not measured.
    pub cpu_secs: Option<f64>,
    /// Seconds on the clock, likewise; those of processes side by side are added up.
    pub wall_secs: Option<f64>,
}

/// The losses of one program level at the end of a training.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct TrainingEnd {
    /// Of which experiment.
    pub experiment: String,
    /// The model's variant.
    pub variant: String,
    /// What tells it apart from other models of its variant; null for most.
    pub tag: Option<String>,
    /// How many tasks it was trained on.
    pub train_tasks: i64,
    /// What it reads as task specification.
    pub specification: String,
    /// The seed of its training.
    pub seed: i64,
    /// The program level.
    pub level: String,
    /// The last step.
    pub step: i64,
    /// Mean total loss about it; `None` where none was recorded.
    pub loss_total: Option<f64>,
}

/// A line of the run's facts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Fact {
    /// Of which experiment.
    pub experiment: String,
    /// What is told.
    pub name: String,
    /// Its value, with its unit.
    pub value: String,
}

/// A table that was read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct InputFile {
    /// Relative to the run directory where it lies in it.
    pub path: String,
    /// SHA-256 in hexadecimal.
    pub sha256: String,
}
