//! Stage `generate`: the expert demonstrates every training task, shard by shard.

use std::collections::BTreeMap;
use std::ops::Range;

use serde_json::{Value, json};

use crate::artifact::{FileEntry, Manifest, StageDir};
use crate::expert;
use crate::perception::{Perception, PerceptionConfig};
use crate::pipeline::recorded::GenerateSettings;
use crate::pipeline::trials::trial;
use crate::pipeline::unit::{Amount, Job, Made, Unit, Worker};
use crate::pipeline::{Pipeline, PipelineError, RecordedFrames, RunDir, Stage, tasks};
use crate::recording::ShardWriter;
use crate::robot::RobotApi as _;
use crate::seed::Seed;
use crate::sim::{AdversaryConfig, SimError, Simulation, SimulationConfig};
use crate::task::{self, Family, Task, Trial};
use crate::trace::{Actor, Episode, Provenance};
use crate::words::counted;

/// Raised when the same settings make other recordings.
const VERSION: u32 = 1;

/// The demonstrations of an experiment.
pub(super) struct Demonstrated<'p>(&'p Pipeline);

pub(super) fn units(pipeline: &Pipeline) -> Vec<Demonstrated<'_>> {
    vec![Demonstrated(pipeline)]
}

impl Demonstrated<'_> {
    fn n_episodes(&self) -> u32 {
        self.0.spec.tasks.train * self.0.spec.generate.trials_per_task
    }

    /// The episodes of a shard.
    fn episodes(&self, shard: u32) -> Range<u32> {
        let per_shard = self.0.spec.generate.episodes_per_shard;
        let end = shard.saturating_add(1).saturating_mul(per_shard);
        shard.saturating_mul(per_shard).min(self.n_episodes())..end.min(self.n_episodes())
    }
}

impl Unit for Demonstrated<'_> {
    fn stage(&self) -> Stage {
        Stage::Generate
    }

    fn stage_version(&self) -> u32 {
        VERSION
    }

    fn name(&self) -> String {
        Stage::Generate.name().to_owned()
    }

    fn dir(&self, run: &RunDir) -> StageDir {
        run.recordings()
    }

    fn shards(&self) -> u32 {
        self.n_episodes().div_ceil(self.0.spec.generate.episodes_per_shard)
    }

    fn amount(&self, shard: u32) -> Amount {
        Amount { count: self.episodes(shard).len() as u64, of: "episode" }
    }

    fn reads(&self, run: &RunDir) -> Vec<StageDir> {
        vec![run.tasks()]
    }

    fn inputs(&self, run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
        tasks::version(run)
    }

    fn settings(&self) -> Value {
        let spec = &self.0.spec;
        json!(GenerateSettings { seed: spec.seed, episodes: self.n_episodes(), generate: spec.generate.clone() })
    }

    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        let tasks = tasks::training(self.0, job.context.dir)?;
        Ok(Box::new(Demonstrator { unit: self, job, tasks }))
    }

    fn told(&self, manifest: &Manifest) -> String {
        format!("{}, {} failed", counted(manifest.episodes, "episode"), manifest.failed)
    }
}

/// Demonstrates shards.
struct Demonstrator<'j> {
    unit: &'j Demonstrated<'j>,
    job: &'j Job<'j>,
    tasks: Vec<Task>,
}

impl Worker for Demonstrator<'_> {
    fn shard(&self, shard: u32) -> Result<Option<Made>, PipelineError> {
        let Self { unit, job, .. } = self;
        let spec = &unit.0.spec.generate;
        let name = format!("shard-{shard:05}-of-{:05}.mcap", job.plan.shards);
        let writer = ShardWriter::create(&job.dir.path().join(&name), &job.plan_json())?;
        let mut writer = writer.with_cameras(&spec.cameras);
        let range = unit.episodes(shard);
        let mut failed = 0;
        for index in range.clone() {
            job.context.go_on()?;
            let episode = self.episode(index)?;
            failed += u64::from(!episode.outcome.is_success());
            writer.write(&episode)?;
            job.progress.inc(1);
        }
        if job.is_done(shard)? {
            return Ok(None);
        }
        writer.finish()?;
        let files = vec![FileEntry::of(job.dir.path(), &name)?];
        Ok(Some(Made { episodes: range.len() as u64, failed, files, told: None }))
    }
}

impl Demonstrator<'_> {
    fn episode(&self, index: u32) -> Result<Episode, PipelineError> {
        let spec = &self.unit.0.spec;
        let trials_per_task = spec.generate.trials_per_task;
        let task = &self.tasks[(index / trials_per_task) as usize];
        let trial = trial(spec.seed, "demonstration", task, index % trials_per_task, spec.generate.counts);
        let config = simulation_config(spec.generate.frames, &spec.generate.simulation);
        demonstrate(task, &trial, u64::from(index), &config)
    }
}

/// The physics' settings with what a recording shall hold.
pub(super) fn simulation_config(frames: RecordedFrames, config: &SimulationConfig) -> SimulationConfig {
    match frames {
        RecordedFrames::All => config.clone(),
        RecordedFrames::Boundaries => SimulationConfig { frame_hz: 0, ..config.clone() },
    }
}

/// The expert's episode of a trial, in physics.
pub(super) fn demonstrate(
    task: &Task,
    trial: &Trial,
    index: u64,
    config: &SimulationConfig,
) -> Result<Episode, PipelineError> {
    let mut world = world(task, trial, config)?;
    let provenance = Provenance::new(task, trial, Actor::Expert, index);
    expert::demonstrate(task, &mut world, provenance).map_err(|source| PipelineError::Trace {
        task_id: task.id.clone(),
        trial: trial.index,
        source,
    })
}

/// The world of a trial before anything has moved.
pub(super) fn world(task: &Task, trial: &Trial, config: &SimulationConfig) -> Result<Simulation, PipelineError> {
    let layout = config.layout();
    let scene = task::scene_on(layout, task.family, &trial.counts);
    let initial = task::initial_state_on(layout, task.family, &scene, trial.seed);
    Ok(Simulation::new(scene, &initial, config)?)
}

/// The same world with an adversary in it, if there is to be one: its pushes depend on the trial's seed.
pub(super) fn disturbed(
    world: Simulation,
    adversary: Option<AdversaryConfig>,
    trial: Seed,
) -> Result<Simulation, SimError> {
    match adversary {
        Some(config) => world.with_adversary(config, trial.derive("adversary", &[])),
        None => Ok(world),
    }
}

/// The same world with a robot that sees, if there is to be one: what is off depends on the trial's seed.
pub(super) fn perceiving(
    world: Simulation,
    perception: Option<&PerceptionConfig>,
    family: Family,
    trial: Seed,
) -> Result<Simulation, SimError> {
    let Some(config) = perception else { return Ok(world) };
    let perception = Perception::new(config, family, world.scene(), trial)?;
    Ok(world.with_perception(perception))
}
