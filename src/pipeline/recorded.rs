//! The settings of recorded episodes: what the plans of demonstrations and rollouts hold, as they are written and read.

use serde::{Deserialize, Serialize};

use crate::artifact::Plan;
use crate::model::Decoder;
use crate::perception::PerceptionConfig;
use crate::pipeline::{GenerateSpec, Stage, SuiteSpec};
use crate::render::CameraConfig;
use crate::sim::{AdversaryConfig, SimulationConfig};

/// Settings of stage `generate`.
#[derive(Serialize, Deserialize)]
pub(super) struct GenerateSettings {
    pub(super) seed: u64,
    pub(super) episodes: u32,
    pub(super) generate: GenerateSpec,
}

/// Settings of a unit of stage `rollout`.
#[derive(Serialize, Deserialize)]
pub(super) struct RolloutSettings {
    pub(super) seed: u64,
    pub(super) suite: SuiteSpec,
    /// `None` for the oracle.
    pub(super) decoder: Option<Decoder>,
    pub(super) record: u32,
    #[serde(default)]
    pub(super) cameras: Vec<CameraConfig>,
    /// The names of those that the model looks with.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) looks_with: Vec<String>,
    pub(super) decisions_factor: f32,
    pub(super) simulation: SimulationConfig,
    /// How many of a seen suite's tasks the model was trained on; left out for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) trained_on: Option<usize>,
}

/// How recorded episodes were made.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// The run's seed.
    pub seed: u64,
    /// Which suite was acted; `None` for demonstrations.
    pub suite: Option<SuiteSpec>,
    /// The physics of the demonstrations.
    pub simulation: SimulationConfig,
    /// What filmed them.
    pub cameras: Vec<CameraConfig>,
}

impl Recorded {
    /// As the plan that a recording holds tells; `None` for a plan of another kind.
    pub fn of(plan: &Plan) -> Option<Self> {
        if plan.stage == Stage::Generate.name() {
            let GenerateSettings { seed, generate, .. } = plan.setting(&[])?;
            let GenerateSpec { simulation, cameras, .. } = generate;
            return Some(Self { seed, suite: None, simulation, cameras });
        }
        let RolloutSettings { seed, suite, simulation, cameras, .. } = plan.setting(&[])?;
        Some(Self { seed, suite: Some(suite), simulation, cameras })
    }

    /// The physics in which they were acted: a suite may name another robot than the demonstrations'.
    pub fn acted_in(&self) -> SimulationConfig {
        self.suite.as_ref().map_or_else(|| self.simulation.clone(), |suite| suite.simulation(&self.simulation))
    }

    /// The camera that told the robot where things are, if there was one.
    pub fn perception(&self) -> Option<&PerceptionConfig> {
        self.suite.as_ref()?.perception.as_ref()
    }

    /// The suite's adversary, if it had one.
    pub fn adversary(&self) -> Option<AdversaryConfig> {
        self.suite.as_ref()?.adversary
    }
}
