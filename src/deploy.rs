//! A policy acts on a robot that is not ours: trial after trial, recorded and judged as rollouts in simulation are.
//!
//! # Input and output
//!
//! A demonstration, a policy and a robot behind a [`Session`] give [`RolloutEpisode`]s, and a folder of them: a
//! recording of each and one table, with plan and manifest.
//!
//! # Invariants
//!
//! What is to be reached is what the demonstration shows. One episode is acted at a time. With a robot that is lost the
//! episode ends, and what was seen until then is recorded.

mod record;
mod shown;

pub use record::{Record, Recorded};
pub use shown::shown_task;

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::artifact::{ContractError, IoError, StageDir, StagingError};
use crate::model::{self, ComputeDevice, Decoder, DeviceError, ModelConfig, ModelError};
use crate::recording::RecordingError;
use crate::remote::{Echo, InProcess, RemoteError, RemoteRobot, Session, SimulatedRobot};
use crate::robot::RobotApi as _;
use crate::rollout::{Limits, Oracle, Policy, RolloutEpisode, RolloutError, Start, load_policy_on, run};
use crate::seed::Seed;
use crate::sim::SimulationConfig;
use crate::table::TableError;
use crate::task::{Family, Task, Trial, initial_state_on};
use crate::trace::{Actor, Episode, Provenance};
use crate::words::counted;

/// Why a policy cannot act.
#[expect(missing_docs, reason = "the messages say what each field is")]
#[derive(Debug, thiserror::Error)]
pub enum DeployError {
    #[error(transparent)]
    Remote(#[from] RemoteError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Device(#[from] DeviceError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    Table(#[from] TableError),
    #[error(transparent)]
    Staging(#[from] StagingError),
    #[error(transparent)]
    Contract(#[from] ContractError),
    #[error(transparent)]
    Io(#[from] IoError),
    #[error(transparent)]
    Rollout(#[from] RolloutError),
    #[error("{}: is for {}, but the demonstration is of {}", path.display(), found.name(), expected.name())]
    Family { path: PathBuf, found: Family, expected: Family },
    #[error("{}: {variant} looks at pictures, but a robot reports positions alone", path.display())]
    Sees { path: PathBuf, variant: String },
    #[error("{}: is for {found}, but the scene has {expected}", path.display(), found = counted(*found, "slot"))]
    Slots { path: PathBuf, found: usize, expected: usize },
    #[error("the episode of {task_id} shows nothing to be done: it is no whole demonstration of an expert")]
    NoTask { task_id: String },
    #[error("interrupted")]
    Interrupted,
}

/// Who decides.
pub enum Driver {
    /// Does what the demonstration shows.
    Oracle,
    /// A trained model.
    Model {
        /// Its configuration.
        config: Box<ModelConfig>,
        /// Its network.
        policy: Box<dyn Policy + Send>,
    },
}

impl Driver {
    /// A trained model from its folder, if it is one for the demonstration.
    ///
    /// # Errors
    ///
    /// When it cannot be loaded, is not as its manifest says, is for another family or number of slots, or looks at pictures.
    pub fn load(folder: &Path, device: ComputeDevice, demonstration: &Episode) -> Result<Self, DeployError> {
        let config = model::load_config(folder)?;
        let path = folder.to_owned();
        let (found, expected) = (config.family, demonstration.provenance.family);
        if !config.acts(expected) {
            return Err(DeployError::Family { path, found, expected });
        }
        if config.network.pixels().is_some() {
            return Err(DeployError::Sees { path, variant: config.variant.to_string() });
        }
        let (found, expected) = (config.n_slots, demonstration.scene.slots.len());
        if !config.reads_slots(expected) {
            return Err(DeployError::Slots { path, found, expected });
        }
        StageDir::new("train", folder).check_whole()?;
        let (config, policy) = load_policy_on(&device.open()?, folder, Decoder::default())?;
        Ok(Self::Model { config: Box::new(config), policy })
    }

    /// `oracle`, or the model's variant.
    pub fn name(&self) -> String {
        match self {
            Self::Oracle => "oracle".to_owned(),
            Self::Model { config, .. } => config.variant.to_string(),
        }
    }

    fn run(&mut self, start: Start<'_>) -> Result<RolloutEpisode, RolloutError> {
        let starts = vec![start];
        let mut acted = match self {
            Self::Oracle => run(&mut Oracle::for_starts(&starts), starts, Limits::default()),
            Self::Model { policy, .. } => run(policy.as_mut(), starts, Limits::default()),
        }?;
        // There is an episode for each start.
        Ok(acted.swap_remove(0))
    }
}

/// What is acted again and again.
#[derive(Clone, Debug)]
pub struct Trials<'d> {
    /// What is to be reached: what the demonstration shows.
    pub task: Task,
    /// The expert's episode.
    pub demonstration: &'d Episode,
    /// Bodies of each slot that may have several.
    pub counts: Vec<u16>,
    /// Where things start, if the robot puts them there.
    pub seed: u64,
}

impl Trials<'_> {
    /// Acts one trial on a table that is set, or that the robot sets first when it `resets`. A robot that is lost on
    /// the way is an outcome.
    ///
    /// # Errors
    ///
    /// When the robot is lost before the episode began.
    pub fn act(
        &self,
        driver: &mut Driver,
        session: &Session,
        index: u32,
        resets: bool,
    ) -> Result<RolloutEpisode, DeployError> {
        let trial = self.trial(index);
        let world = match resets {
            true => {
                let (family, scene) = (self.task.family, session.scene());
                let initial = initial_state_on(family.layout_of(&scene), family, &scene, trial.seed);
                RemoteRobot::reset(session, &initial)?
            }
            false => RemoteRobot::observe(session)?,
        };
        let start = Start {
            task: &self.task,
            demonstration: self.demonstration.clone(),
            world: Box::new(world),
            sight: None,
            provenance: Provenance::new(&self.task, &trial, Actor::Policy(String::new()), u64::from(index)),
        };
        Ok(driver.run(start)?)
    }

    /// Where things start in one of them.
    pub fn trial(&self, index: u32) -> Trial {
        let seed = Seed(self.seed).derive(&format!("deploy/{}", self.task.id), &[u64::from(index)]);
        Trial { index, counts: self.counts.clone(), seed }
    }
}

/// The same robot in our simulation, its table set as the robot's own is now; what is sent to it is told.
///
/// # Errors
///
/// When the robot is lost, or its table cannot be simulated.
pub fn rehearse(
    session: &Session,
    family: Family,
    tell: impl FnMut(&str) + Send + 'static,
) -> Result<Session, DeployError> {
    let now = RemoteRobot::observe(session)?.state();
    let robot = SimulatedRobot::new(family, SimulationConfig::default(), Seed(0)).standing(now);
    let wire = Echo::new(InProcess::new(robot), tell);
    let deadline = Duration::from_secs(1);
    Ok(Session::begin(Box::new(wire), "rehearsal", family, session.scene(), deadline)?)
}
