//! Stage `rollout`: every model acts every suite, shard by shard, in physics.

mod actor;

use std::collections::BTreeMap;
use std::ops::Range;

use serde_json::{Value, json};

use crate::artifact::{FileEntry, Manifest, Receipt, StageDir};
use crate::pipeline::demonstration::{self, Demonstrations};
use crate::pipeline::eye::sight;
use crate::pipeline::generate::{disturbed, perceiving, simulation_config, world};
use crate::pipeline::recorded::RolloutSettings;
use crate::pipeline::rollout::actor::{Learned, ModelActor, decoding};
use crate::pipeline::train;
use crate::pipeline::trials::trial;
use crate::pipeline::unit::{Amount, Job, Made, Unit, Worker};
use crate::pipeline::{
    OrderSpec, Pipeline, PipelineError, RecordedFrames, RunDir, Stage, Study, SuiteSpec, detections, facts, tasks,
};
use crate::recording::ShardWriter;
use crate::render::CameraConfig;
use crate::robot::RobotApi as _;
use crate::rollout::{
    self, Acted, DetectionRows, Limits, Noisy, Oracle, Policy, RolloutEpisode, RolloutError, RolloutRows, Sight, Start,
};
use crate::seed::Seed;
use crate::sim::Simulation;
use crate::task::{Split, Task, TaskSet};
use crate::trace::{Actor, Episode, Provenance};

/// Raised when the same settings act otherwise, or tell more of it.
const VERSION: u32 = 3;
/// Episodes that act side by side and are committed together.
const EPISODES_PER_SHARD: u32 = 25;
/// Failures of a suite that a report shows; so many of each shard are recorded, wherever they are.
pub(super) const MOST_FAILURES: usize = 3;
/// How the paths of a shard's tables begin.
const PART: &str = "parts/part-";
const DETECTIONS_PART: &str = "parts/detections-";
/// One row an episode, all shards together.
pub(super) const TABLE: &str = "rollouts.parquet";

/// A suite acted by a model, or by the oracle.
pub(super) struct Suite<'p> {
    pipeline: &'p Pipeline,
    /// `None` for the oracle.
    pub(super) actor: Option<ModelActor<'p>>,
    pub(super) spec: &'p SuiteSpec,
}

/// Every suite of the oracle, where it is asked for, then of every model with each of its seeds and decoders.
pub(super) fn units(pipeline: &Pipeline) -> Vec<Suite<'_>> {
    let oracle = pipeline.spec.rollout.oracle.then_some(None);
    let actors = train::units(pipeline).into_iter().flat_map(decoding).map(Some);
    oracle.into_iter().chain(actors).flat_map(|actor| acted(pipeline, actor)).collect()
}

/// Every suite of an experiment that the study's own models act, with each of their seeds and decoders.
pub(super) fn units_of_study<'p>(study: &'p Study, pipeline: &'p Pipeline) -> Vec<Suite<'p>> {
    let models = train::units_of_study(study).into_iter().filter(|model| study.can_act(model.spec, pipeline));
    let suites = models.flat_map(decoding).flat_map(|actor| acted(pipeline, Some(actor)));
    let is_fair = |suite: &Suite<'_>| {
        let learned = |actor: ModelActor<'_>| study.learned_by(actor.model.spec).any(|own| own.path == pipeline.path);
        suite.spec.split == Split::Unseen || suite.actor.is_some_and(learned)
    };
    suites.filter(is_fair).collect()
}

/// The suites that an actor acts.
fn acted<'p>(pipeline: &'p Pipeline, actor: Option<ModelActor<'p>>) -> impl Iterator<Item = Suite<'p>> {
    let acts = move |suite: &&SuiteSpec| actor.is_none_or(|actor| actor.model.spec.acts(&suite.name));
    pipeline.spec.rollout.suites.iter().filter(acts).map(move |spec| Suite { pipeline, actor, spec })
}

impl Suite<'_> {
    /// The folder of the actor's rollouts.
    pub(super) fn actor_name(&self) -> String {
        let Some(ModelActor { model, decoder }) = self.actor else { return "oracle".to_owned() };
        format!("{}-{}", model.folder_name(), decoder.name())
    }

    /// How many of the suite's tasks the actor may be asked for: of the seen ones those that its model was trained on.
    /// `None` for all.
    fn trained_on(&self) -> Option<usize> {
        let train_tasks = self.actor?.model.spec.train_tasks?;
        (self.spec.split == Split::Seen).then_some(train_tasks as usize)
    }

    /// The episodes of a shard.
    fn episodes(&self, shard: u32) -> Range<u32> {
        let end = shard.saturating_add(1).saturating_mul(EPISODES_PER_SHARD);
        shard.saturating_mul(EPISODES_PER_SHARD).min(self.spec.episodes)..end.min(self.spec.episodes)
    }
}

impl Unit for Suite<'_> {
    fn stage(&self) -> Stage {
        Stage::Rollout
    }

    fn stage_version(&self) -> u32 {
        VERSION
    }

    fn name(&self) -> String {
        format!("rollout {} {}", self.actor_name(), self.spec.name)
    }

    fn dir(&self, run: &RunDir) -> StageDir {
        run.rollouts(&self.actor_name(), &self.spec.name)
    }

    fn shards(&self) -> u32 {
        self.spec.episodes.div_ceil(EPISODES_PER_SHARD)
    }

    fn amount(&self, shard: u32) -> Amount {
        Amount { count: self.episodes(shard).len() as u64, of: "episode" }
    }

    fn reads(&self, run: &RunDir) -> Vec<StageDir> {
        let model = self.actor.map(|actor| actor.model.dir(run));
        std::iter::once(run.tasks()).chain(model).collect()
    }

    fn inputs(&self, run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
        let mut inputs = tasks::version(run)?;
        if let Some(actor) = self.actor {
            inputs.insert(Stage::Train.name().to_owned(), actor.model.dir(run).version()?);
        }
        Ok(inputs)
    }

    fn settings(&self) -> Value {
        let spec = &self.pipeline.spec;
        json!(RolloutSettings {
            seed: spec.seed,
            suite: self.spec.clone(),
            decoder: self.actor.map(|actor| actor.decoder),
            record: spec.rollout.record,
            cameras: spec.generate.cameras.clone(),
            looks_with: self.actor.map(|actor| actor.model.spec.camera_names(&spec.generate)).unwrap_or_default(),
            decisions_factor: spec.rollout.decisions_factor,
            simulation: spec.generate.simulation.clone(),
            trained_on: self.trained_on(),
        })
    }

    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        let task_set = tasks::read(job.context.dir)?;
        let tasks = suite_tasks(self.pipeline, &task_set, self.spec, self.trained_on())?;
        let learned = self.actor.map(|actor| Learned::of(job.context.dir, actor));
        Ok(Box::new(Acting { pipeline: self.pipeline, unit: self, spec: self.spec, job, tasks, learned }))
    }

    /// Puts the shards' rows into one table.
    fn gather(&self, job: &Job<'_>, receipts: &[Receipt]) -> Result<Vec<&'static str>, PipelineError> {
        let mut rows = RolloutRows::default();
        let mut detections: Option<DetectionRows> = None;
        for file in receipts.iter().flat_map(|receipt| &receipt.files) {
            let path = job.dir.path().join(&file.path);
            if file.path.starts_with(PART) {
                rows.append(RolloutRows::read(&path)?);
            } else if file.path.starts_with(DETECTIONS_PART) {
                detections.get_or_insert_default().append(DetectionRows::read(&path)?);
            }
        }
        rows.write(&job.dir.path().join(TABLE))?;
        let mut tables = vec![TABLE];
        if let Some(detections) = detections {
            detections.write(&job.dir.path().join(detections::TABLE))?;
            tables.push(detections::TABLE);
        }
        Ok(tables)
    }

    fn gathers(&self, file: &str) -> bool {
        file.starts_with(PART) || file.starts_with(DETECTIONS_PART)
    }

    fn told(&self, manifest: &Manifest) -> String {
        format!("{} of {} succeeded", manifest.episodes - manifest.failed, manifest.episodes)
    }
}

/// Acts the shards of a suite.
struct Acting<'j> {
    pipeline: &'j Pipeline,
    unit: &'j Suite<'j>,
    spec: &'j SuiteSpec,
    job: &'j Job<'j>,
    tasks: Vec<Task>,
    learned: Option<Learned>,
}

/// What a suite's demonstrations depend on; policies read their boundaries.
fn demonstrations<'a>(pipeline: &'a Pipeline, suite: &'a SuiteSpec) -> Demonstrations<'a> {
    let spec = &pipeline.spec;
    Demonstrations { seed: spec.seed, suite, simulation: &spec.generate.simulation, frames: RecordedFrames::Boundaries }
}

/// The tasks that a suite asks for, in its order of sub-tasks; of the first `most` of its split.
fn suite_tasks(
    pipeline: &Pipeline,
    task_set: &TaskSet,
    spec: &SuiteSpec,
    most: Option<usize>,
) -> Result<Vec<Task>, PipelineError> {
    let demonstrations = demonstrations(pipeline, spec);
    let ordered = |task: &Task| demonstrations.ordered(task);
    let is_asked_for = |task: &&Task| {
        spec.bowls.is_none_or(|bowls| task.n_bowls() == bowls)
            && spec.tallest.is_none_or(|tallest| task.tallest() == tallest)
    };
    let tasks: Vec<Task> = task_set
        .of_split(spec.split)
        .take(most.unwrap_or(usize::MAX))
        .filter(is_asked_for)
        .filter_map(ordered)
        .collect();
    if tasks.is_empty() {
        let (field, problem) = match (spec.order, spec.bowls) {
            _ if spec.tallest.is_some() => {
                let tallest = spec.tallest.unwrap_or_default();
                ("tallest", format!("is {tallest}, but no {} task's tallest tower is as high", spec.split))
            }
            (OrderSpec::Shuffled, _) => ("order", format!("is shuffled, but no {} task has two towers", spec.split)),
            (OrderSpec::Own, Some(bowls)) => ("bowls", format!("is {bowls}, but no {} task has as many", spec.split)),
            (OrderSpec::Own, None) => ("split", format!("is {}, but there is no such task", spec.split)),
        };
        return Err(PipelineError::Value {
            path: pipeline.path.clone(),
            key: format!("rollout.suites.{}.{field}", spec.name),
            problem,
        });
    }
    Ok(tasks)
}

impl Worker for Acting<'_> {
    fn shard(&self, shard: u32) -> Result<Option<Made>, PipelineError> {
        let Self { unit, spec, job, .. } = self;
        let folder = job.dir.path();
        let starts: Result<Vec<Start<'_>>, PipelineError> =
            unit.episodes(shard).map(|episode| self.start(episode)).collect();
        let starts = starts?;
        let mut policy = self.policy(&starts)?;
        let by = self.learned.as_ref().map(|learned| learned.acted.clone()).unwrap_or_default();
        let detections = self.detections(policy.as_ref(), &by, &starts)?;
        let acted = self.act(policy.as_mut(), starts)?;
        if job.is_done(shard)? {
            return Ok(None);
        }
        let part = format!("{PART}{shard:05}.parquet");
        let suite = facts::of_suite(&self.pipeline.spec, spec);
        RolloutRows::of(&spec.name, &suite, &by, &acted).write(&folder.join(&part))?;
        let mut files = vec![FileEntry::of(folder, &part)?];
        if let Some(detections) = detections {
            let part = format!("{DETECTIONS_PART}{shard:05}.parquet");
            detections.write(&folder.join(&part))?;
            files.push(FileEntry::of(folder, &part)?);
        }
        files.extend(self.record(shard, &acted)?);
        let failed = acted.iter().filter(|rollout| !rollout.episode.outcome.is_success()).count() as u64;
        job.progress.inc(acted.len() as u64);
        Ok(Some(Made { episodes: acted.len() as u64, failed, files, told: None }))
    }
}

impl Acting<'_> {
    fn start(&self, episode: u32) -> Result<Start<'_>, PipelineError> {
        let Self { pipeline, spec, job, tasks, .. } = self;
        job.context.go_on()?;
        let task = &tasks[episode as usize % tasks.len()];
        let demonstration = self.demonstration(task, episode)?;
        let run_seed = pipeline.spec.seed;
        let mut own = trial(run_seed, &format!("rollout/{}", spec.name), task, episode, spec.on_table);
        if spec.on_table.is_none() {
            own.counts.clone_from(&demonstration.provenance.counts);
        }
        let recorded =
            if episode < pipeline.spec.rollout.record { RecordedFrames::All } else { RecordedFrames::Boundaries };
        let config = simulation_config(recorded, &spec.simulation(&pipeline.spec.generate.simulation));
        let provenance = Provenance::new(task, &own, Actor::Policy(String::new()), u64::from(episode));
        let world = disturbed(world(task, &own, &config)?, spec.adversary, own.seed)?;
        let world = perceiving(world, spec.perception.as_ref(), task.family, own.seed)?;
        let sight = self.sight(&demonstration, &world, own.seed)?;
        Ok(Start { task, demonstration, world: Box::new(world), sight, provenance })
    }

    /// What the model looks with; nothing where it does not see.
    fn cameras(&self) -> Vec<&CameraConfig> {
        let of = |learned: &Learned| learned.spec.looks_with(&self.pipeline.spec.generate);
        self.learned.as_ref().map(of).unwrap_or_default()
    }

    /// What a model that sees is given: its cameras' pictures, as in the dataset that it learned from.
    fn sight(&self, demonstration: &Episode, world: &Simulation, seed: Seed) -> Result<Option<Sight>, PipelineError> {
        let cameras = self.cameras();
        if cameras.is_empty() {
            return Ok(None);
        }
        let failed = |(camera, source)| PipelineError::Sight {
            suite: self.spec.name.clone(),
            episode: demonstration.provenance.index,
            task_id: demonstration.provenance.task_id.clone(),
            camera,
            source: Box::new(source),
        };
        sight(&cameras, demonstration, world.scene(), seed).map(Some).map_err(failed)
    }

    fn demonstration(&self, task: &Task, episode: u32) -> Result<Episode, PipelineError> {
        let Self { pipeline, spec, .. } = self;
        let found = demonstrations(pipeline, spec).of(task, episode)?;
        found.ok_or_else(|| PipelineError::NoDemonstration {
            suite: spec.name.clone(),
            task_id: task.id.clone(),
            attempts: demonstration::ATTEMPTS,
        })
    }

    fn policy(&self, starts: &[Start<'_>]) -> Result<Box<dyn Policy>, PipelineError> {
        let policy = match &self.learned {
            Some(learned) => learned.policy(self.pipeline, self.job.context.options.device)?,
            None => Box::new(Oracle::for_starts(starts)),
        };
        let noise = self.spec.noise;
        if noise.is_none() {
            return Ok(policy);
        }
        let seeds = starts.iter().map(|start| Seed(start.provenance.seed)).collect();
        Ok(Box::new(Noisy::new(policy, noise, seeds)))
    }

    /// The errors of a detector, which are the same whatever decodes what is behind it.
    fn detections(
        &self,
        policy: &dyn Policy,
        by: &Acted,
        starts: &[Start<'_>],
    ) -> Result<Option<DetectionRows>, PipelineError> {
        let detects = self.learned.as_ref().is_some_and(|learned| learned.spec.variant.detects() && learned.is_first);
        let cameras = self.cameras();
        let Some(camera) = cameras.first().filter(|_| detects) else { return Ok(None) };
        detections::of_starts(policy, &self.spec.name, by, camera, starts).map_err(|error| self.failed(error.into()))
    }

    fn failed(&self, source: RolloutError) -> PipelineError {
        PipelineError::Rollout { unit: self.unit.name(), source }
    }

    fn act(&self, policy: &mut dyn Policy, starts: Vec<Start<'_>>) -> Result<Vec<RolloutEpisode>, PipelineError> {
        let factor = self.pipeline.spec.rollout.decisions_factor;
        let limits = Limits { decisions_factor: factor, ..Limits::default() };
        rollout::run(policy, starts, limits).map_err(|source| self.failed(source))
    }

    /// Records the first episodes of the suite, and the shard's first failures, which are not seen otherwise.
    fn record(&self, shard: u32, acted: &[RolloutEpisode]) -> Result<Option<FileEntry>, PipelineError> {
        let recorded = self.recorded(shard, acted);
        if recorded.is_empty() {
            return Ok(None);
        }
        let (folder, plan) = (self.job.dir.path(), &self.job.plan);
        let name = format!("recordings/shard-{shard:05}-of-{:05}.mcap", plan.shards);
        let writer = ShardWriter::create(&folder.join(&name), &self.job.plan_json())?;
        let mut writer = writer.with_cameras(&self.pipeline.spec.generate.cameras);
        for rollout in recorded {
            writer.write(&rollout.episode)?;
        }
        writer.finish()?;
        Ok(Some(FileEntry::of(folder, &name)?))
    }

    /// The episodes of a shard that are recorded, in order; none where nothing is to be recorded.
    fn recorded<'e>(&self, shard: u32, acted: &'e [RolloutEpisode]) -> Vec<&'e RolloutEpisode> {
        let record = self.pipeline.spec.rollout.record;
        let n_first = record.saturating_sub(shard * EPISODES_PER_SHARD) as usize;
        let mut n_failures = if record == 0 { 0 } else { MOST_FAILURES };
        let mut is_recorded = |(at, rollout): &(usize, &RolloutEpisode)| {
            let is_failure = n_failures > 0 && !rollout.episode.outcome.is_success();
            n_failures -= usize::from(is_failure);
            is_failure || *at < n_first
        };
        let recorded = acted.iter().enumerate().filter(|found| is_recorded(found));
        recorded.map(|(_, rollout)| rollout).collect()
    }
}
