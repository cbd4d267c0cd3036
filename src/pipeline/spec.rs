//! A pipeline file as it is written: names, types, defaults. Nothing is checked here beyond what a type can say.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::dataset::ConvertConfig;
use crate::model::{CoreKind, Decoder, EncoderKind, ScopingKind, Variant};
use crate::perception::PerceptionConfig;
use crate::render::CameraConfig;
use crate::robot::RobotKind;
use crate::sim::{AdversaryConfig, SimulationConfig};
use crate::task::{Family, Layout, Split, TaskPool};
use crate::trace::{ObservationNoise, SpecificationForm};
use crate::training::{TrainConfig, Training};

/// One experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PipelineSpec {
    /// Names the run's folder: letters, digits, `_` and `-`.
    pub name: String,
    /// Everything random comes from it.
    #[serde(default)]
    pub seed: u64,
    /// Which tasks there are.
    pub tasks: TasksSpec,
    /// How the expert demonstrates them.
    #[serde(default)]
    pub generate: GenerateSpec,
    /// What of the recordings comes into the dataset.
    #[serde(default)]
    pub convert: ConvertConfig,
    /// What is trained.
    #[serde(default)]
    pub models: Vec<ModelSpec>,
    /// How the models are evaluated.
    #[serde(default)]
    pub rollout: RolloutSpec,
    /// How the results are shown.
    #[serde(default)]
    pub report: ReportSpec,
}

/// Which tasks there are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TasksSpec {
    /// The kind of task.
    pub family: Family,
    /// How many tasks may be trained on.
    pub train: u32,
    /// How many are held out. Left out with `import`: all the others.
    #[serde(default)]
    pub unseen: Option<u32>,
    /// Families of blocks: only the first so many, from 2, are within reach; the others stand aside. All when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocks: Option<u16>,
    /// A task file of the authors' format in place of drawn tasks, relative to the pipeline file.
    #[serde(default)]
    pub import: Option<String>,
}

impl TasksSpec {
    /// What tasks are drawn from.
    pub(super) fn pool(&self) -> TaskPool {
        let blocks = self.blocks.filter(|&blocks| Some(blocks) != self.family.max_blocks());
        TaskPool { family: self.family, blocks }
    }
}

/// Which frames a recording holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RecordedFrames {
    /// Boundaries, and ten frames a second between them.
    #[default]
    All,
    /// Boundaries of primitives alone: smaller and faster, but replays jump.
    Boundaries,
}

/// How many instances of each category stand on the table; drawn for each trial and category.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CountsSpec {
    /// At least; from 1.
    pub min: u16,
    /// At most: 20, and 10 of what is sorted before an arm.
    pub max: u16,
}

/// How the expert demonstrates the training tasks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct GenerateSpec {
    /// Demonstrations of each training task, each from other initial positions.
    pub trials_per_task: u32,
    /// Episodes in one file.
    pub episodes_per_shard: u32,
    /// What is recorded.
    pub frames: RecordedFrames,
    /// For families with categories; 1 to 3 of each when left out.
    pub counts: Option<CountsSpec>,
    /// The physics.
    pub simulation: SimulationConfig,
    /// What films the demonstrations: their pictures come into recordings and dataset.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<CameraConfig>,
}

impl Default for GenerateSpec {
    fn default() -> Self {
        Self {
            trials_per_task: 20,
            episodes_per_shard: 100,
            frames: RecordedFrames::default(),
            counts: None,
            simulation: SimulationConfig::default(),
            cameras: Vec::new(),
        }
    }
}

/// One model, trained once for each seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModelSpec {
    /// Which model: a variant's name, or its parts `{ core, scoping, encoder }`.
    pub variant: Variant,
    /// What tells it apart from other models of its variant that are trained otherwise: letters, digits, `_` and `-`.
    /// The report shows it beside the variant's name, and leaves tagged models out of the paper's figures and claims.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tag: Option<String>,
    /// One training run for each.
    #[serde(default = "one_seed")]
    pub seeds: Vec<u64>,
    /// For a model of a study: the experiments whose training tasks it learns from, all together. It acts the suites of
    /// every experiment whose root program it then knows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub experiments: Vec<String>,
    /// Train on the first so many training tasks (of each experiment); all when left out.
    #[serde(default)]
    pub train_tasks: Option<u32>,
    /// For a variant that sees: the names of the cameras that it looks with, in demonstrations and when it acts, 16 at most;
    /// the first of `generate.cameras` when left out. All have pictures of one size, as wide as high. A detector looks with
    /// one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cameras: Option<Vec<String>>,
    /// What it reads as task specification: trajectories, or for variant `ntp` also instructions.
    #[serde(default)]
    pub specification: SpecificationForm,
    /// How the chosen part of a demonstration is decoded; with several, each acts every suite. Trained once.
    #[serde(default = "mss")]
    pub decoders: Vec<Decoder>,
    /// The names of the suites that it acts; all when left out.
    #[serde(default)]
    pub suites: Option<Vec<String>>,
    /// How it is trained.
    #[serde(default)]
    pub training: TrainConfig,
}

impl ModelSpec {
    /// What its running programs decide from.
    pub fn core(&self) -> CoreKind {
        self.variant.core()
    }

    /// What its callees are given to see.
    pub fn scoping(&self) -> ScopingKind {
        self.variant.scoping()
    }

    /// How it reads observations and demonstrations.
    pub fn encoder(&self) -> EncoderKind {
        self.variant.encoder()
    }

    /// What it reads as task specification.
    pub fn specification(&self) -> SpecificationForm {
        self.variant.specification(self.specification)
    }

    /// What it looks with, of those that there are; nothing where it does not see.
    pub(super) fn looks_with<'s>(&self, generate: &'s GenerateSpec) -> Vec<&'s CameraConfig> {
        if !self.variant.sees() {
            return Vec::new();
        }
        let named = |name: &String| generate.cameras.iter().find(|camera| camera.name == *name);
        match &self.cameras {
            None => generate.cameras.first().into_iter().collect(),
            Some(names) => names.iter().filter_map(named).collect(),
        }
    }

    /// The same by name.
    pub(super) fn camera_names(&self, generate: &GenerateSpec) -> Vec<String> {
        self.looks_with(generate).into_iter().map(|camera| camera.name.clone()).collect()
    }

    /// One of its training runs.
    pub fn training(&self, seed: u64) -> Training {
        Training { variant: self.variant, specification: self.specification(), seed, config: self.training.clone() }
    }
}

fn one_seed() -> Vec<u64> {
    vec![0]
}

fn mss() -> Vec<Decoder> {
    vec![Decoder::Mss]
}

impl ModelSpec {
    /// Whether it acts a suite.
    pub(super) fn acts(&self, suite: &str) -> bool {
        self.suites.as_ref().is_none_or(|suites| suites.iter().any(|name| name == suite))
    }
}

/// How models are evaluated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RolloutSpec {
    /// Which tasks, and how many episodes.
    pub suites: Vec<SuiteSpec>,
    /// How many episodes of each suite are recorded for replay, and beside them its first failures; with 0 nothing is.
    pub record: u32,
    /// A rollout is given up after so many times the expert's decisions.
    pub decisions_factor: f32,
    /// Also lets the oracle, which repeats the expert, act every suite.
    pub oracle: bool,
}

impl Default for RolloutSpec {
    fn default() -> Self {
        Self { suites: Vec::new(), record: 10, decisions_factor: 3.0, oracle: false }
    }
}

/// A set of evaluation episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuiteSpec {
    /// Names its folder: letters, digits, `_` and `-`.
    pub name: String,
    /// Which tasks; of the seen ones those that the acting model was trained on.
    pub split: Split,
    /// How many episodes; tasks are taken in turn.
    pub episodes: u32,
    /// Instances of each category in the demonstration.
    #[serde(default)]
    pub demonstrated: Option<CountsSpec>,
    /// Instances of each category on the table; as demonstrated when left out.
    #[serde(default)]
    pub on_table: Option<CountsSpec>,
    /// Table Clean-up: only tasks with so many bowls; all when left out.
    #[serde(default)]
    pub bowls: Option<u16>,
    /// Families that build towers: only tasks whose tallest tower has so many things; all when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tallest: Option<u16>,
    /// In which order towers are demonstrated.
    #[serde(default)]
    pub order: OrderSpec,
    /// Knocks towers over after placements; none when left out. For families that build towers.
    #[serde(default)]
    pub adversary: Option<AdversaryConfig>,
    /// How far the positions that models are told are off, in the demonstration and now; exact when left out.
    #[serde(default, skip_serializing_if = "ObservationNoise::is_none")]
    pub noise: ObservationNoise,
    /// Which robot acts: `gripper` or `sawyer`; that of `generate.simulation` when left out. Demonstrations are of that
    /// one always.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotKind>,
    /// How things are laid out where the robot acts: `table` or `bench`; as its robot needs it when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layout: Option<Layout>,
    /// How far the gripper opens at most where it acts, in metres, 0.01 to 0.07; that of `generate.simulation` when left
    /// out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jaw_m: Option<f32>,
    /// A depth camera that tells robot and model where things are; they know it exactly when left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perception: Option<PerceptionConfig>,
}

impl SuiteSpec {
    /// The physics that it is acted in; demonstrations are acted in that of `generate`.
    pub fn simulation(&self, demonstrated: &SimulationConfig) -> SimulationConfig {
        let robot = self.robot.unwrap_or(demonstrated.robot);
        let layout = self.layout.or(if self.robot.is_none() { demonstrated.layout } else { None });
        let jaw_m = self.jaw_m.or(demonstrated.jaw_m);
        SimulationConfig { robot, layout, jaw_m, ..demonstrated.clone() }
    }
}

/// In which order the towers of a task are demonstrated. Within a tower it is always from below.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrderSpec {
    /// The task's own.
    #[default]
    Own,
    /// Another: the same end by another way. Tasks of a single tower, which have no other, are left out.
    Shuffled,
}

impl OrderSpec {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Shuffled => "shuffled",
        }
    }
}

/// How results are shown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSpec {
    /// The page's title; the pipeline's name when left out.
    pub title: Option<String>,
    /// Datasets that `ntp annotate --against` wrote, relative to the run directory: how well their labels agree with
    /// true ones is shown.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub annotations: Vec<String>,
}
