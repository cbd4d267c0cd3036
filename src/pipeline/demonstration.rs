//! The demonstration that a rollout is given. Seeds tell all of it, so it is not stored: it is acted again.

use crate::artifact::Plan;
use crate::pipeline::generate::{demonstrate, simulation_config};
use crate::pipeline::trials::trial;
use crate::pipeline::{OrderSpec, PipelineError, Recorded, RecordedFrames, SuiteSpec};
use crate::seed::Seed;
use crate::sim::SimulationConfig;
use crate::task::{Task, TaskSet};
use crate::trace::{Actor, Episode};

/// How often the expert may try to demonstrate a task for a suite, each time from other initial positions.
pub(super) const ATTEMPTS: u64 = 20;

/// What the demonstrations of a suite depend on.
pub(super) struct Demonstrations<'a> {
    /// The run's seed.
    pub(super) seed: u64,
    pub(super) suite: &'a SuiteSpec,
    pub(super) simulation: &'a SimulationConfig,
    /// What of them is kept.
    pub(super) frames: RecordedFrames,
}

impl Demonstrations<'_> {
    /// A task in the order of sub-tasks that the suite asks for; `None` when it has no such order.
    pub(super) fn ordered(&self, task: &Task) -> Option<Task> {
        let purpose = || format!("order/{}/{}", self.suite.name, task.id);
        match self.suite.order {
            OrderSpec::Own => Some(task.clone()),
            OrderSpec::Shuffled => task.with_towers_shuffled(Seed(self.seed).derive(&purpose(), &[])),
        }
    }

    /// The expert's demonstration of an ordered task, from initial positions that no training demonstration has;
    /// `None` when it fails at every attempt.
    pub(super) fn of(&self, task: &Task, episode: u32) -> Result<Option<Episode>, PipelineError> {
        let config = simulation_config(self.frames, self.simulation);
        for attempt in 0..ATTEMPTS {
            let purpose = format!("specification/{}/{attempt}", self.suite.name);
            let trial = trial(self.seed, &purpose, task, episode, Some(self.suite.demonstrated()));
            let demonstration = demonstrate(task, &trial, u64::from(episode), &config)?;
            if demonstration.outcome.is_success() {
                return Ok(Some(demonstration));
            }
        }
        Ok(None)
    }
}

/// The demonstration that a recorded rollout was given, acted again with all of its frames. `None` for an expert's
/// episode, and when plan or tasks are not those of the rollout.
///
/// # Errors
///
/// When the world cannot be made.
pub fn demonstration_of(plan: &Plan, tasks: &TaskSet, rollout: &Episode) -> Result<Option<Episode>, PipelineError> {
    let Some(Recorded { seed, suite: Some(suite), simulation, .. }) = Recorded::of(plan) else { return Ok(None) };
    let demonstrations = Demonstrations { seed, suite: &suite, simulation: &simulation, frames: RecordedFrames::All };
    let provenance = &rollout.provenance;
    let task = tasks.find(&provenance.task_id).and_then(|task| demonstrations.ordered(task));
    let (Some(task), Ok(episode)) = (task, u32::try_from(provenance.index)) else { return Ok(None) };
    if provenance.actor == Actor::Expert || provenance.task_text != task.text() {
        return Ok(None);
    }
    demonstrations.of(&task, episode)
}
