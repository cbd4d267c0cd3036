//! Stage `rollout`: every model acts every suite, shard by shard, in physics.

use std::collections::BTreeMap;
use std::path::PathBuf;

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};
use serde_json::json;

use crate::artifact::{FileEntry, Plan, Receipt};
use crate::model::{Decoder, ModelConfig, Variant, check_purpose, load_config};
use crate::pipeline::demonstration::{self, Demonstrations};
use crate::pipeline::eye::sight;
use crate::pipeline::filmstrips::MOST_FAILURES;
use crate::pipeline::generate::{disturbed, simulation_config, world};
use crate::pipeline::layout::model_name;
use crate::pipeline::runner::{Context, ModelActor, Part, Unit};
use crate::pipeline::trials::trial;
use crate::pipeline::{OrderSpec, PipelineError, RecordedFrames, Stage, SuiteSpec, detections, facts, tasks};
use crate::progress::Progress;
use crate::recording::ShardWriter;
use crate::robot::RobotApi as _;
use crate::rollout::{
    self, Acted, DetectionRows, Limits, ModelFacts, Oracle, Policy, RolloutEpisode, RolloutError, RolloutRows, Sight,
    Start, load_policy,
};
use crate::seed::Seed;
use crate::sim::Simulation;
use crate::task::{Split, Task, TaskSet};
use crate::trace::{Actor, Episode, Provenance, SpecificationForm};

/// Episodes that act side by side and are committed together.
const EPISODES_PER_SHARD: u32 = 25;
/// How the paths of a shard's tables begin.
const PART: &str = "parts/part-";
const DETECTIONS_PART: &str = "parts/detections-";
/// One row an episode, all shards together.
pub(super) const TABLE: &str = "rollouts.parquet";

pub(super) fn units(context: &Context<'_>) -> Result<Vec<Unit>, PipelineError> {
    let (_, task_inputs) = tasks::read(context)?;
    let spec = &context.pipeline.spec;
    let mut units = Vec::new();
    for actor in actors(context) {
        let inputs = match actor {
            Some(actor) => model_inputs(context, actor, &task_inputs)?,
            None => task_inputs.clone(),
        };
        let name = actor_name(context, actor);
        for (suite, suite_spec) in spec.rollout.suites.iter().enumerate() {
            if actor.is_some_and(|actor| !spec.models[actor.model].acts(&suite_spec.name)) {
                continue;
            }
            let mut config = json!({
                "seed": spec.seed,
                "suite": suite_spec,
                "decoder": actor.map(|actor| actor.decoder),
                "record": spec.rollout.record,
                "cameras": spec.generate.cameras,
                "decisions_factor": spec.rollout.decisions_factor,
                "simulation": spec.generate.simulation,
            });
            if let Some(tasks) = trained_on(context, actor, suite_spec) {
                config["trained_on"] = json!(tasks);
            }
            let shards = suite_spec.episodes.div_ceil(EPISODES_PER_SHARD);
            units.push(Unit {
                name: format!("rollout {name} {}", suite_spec.name),
                dir: context.dir.rollouts(&name, &suite_spec.name),
                plan: Plan::new(Stage::Rollout.name(), shards, inputs.clone(), config),
                part: Part::Suite { actor, suite },
            });
        }
    }
    Ok(units)
}

/// The oracle (`None`) where it is asked for, and every trained model with each of its decoders.
fn actors(context: &Context<'_>) -> Vec<Option<ModelActor>> {
    let spec = &context.pipeline.spec;
    let mut actors = if spec.rollout.oracle { vec![None] } else { Vec::new() };
    for (model, model_spec) in spec.models.iter().enumerate() {
        for &seed in &model_spec.seeds {
            actors.extend(model_spec.decoders.iter().map(|&decoder| Some(ModelActor { model, seed, decoder })));
        }
    }
    actors
}

/// The folder of an actor's rollouts.
pub(super) fn actor_name(context: &Context<'_>, actor: Option<ModelActor>) -> String {
    let Some(ModelActor { model, seed, decoder }) = actor else { return "oracle".to_owned() };
    let spec = &context.pipeline.spec.models[model];
    format!("{}-{}", model_name(spec, seed), decoder.name())
}

fn model_inputs(
    context: &Context<'_>,
    actor: ModelActor,
    task_inputs: &BTreeMap<String, String>,
) -> Result<BTreeMap<String, String>, PipelineError> {
    let spec = &context.pipeline.spec.models[actor.model];
    let version = context.dir.model(&model_name(spec, actor.seed)).version()?;
    let mut inputs = task_inputs.clone();
    inputs.insert(Stage::Train.name().to_owned(), version);
    Ok(inputs)
}

/// How many of a suite's tasks an actor may be asked for: of the seen ones those that its model was trained on. `None`
/// for all.
fn trained_on(context: &Context<'_>, actor: Option<ModelActor>, suite: &SuiteSpec) -> Option<usize> {
    let train_tasks = context.pipeline.spec.models[actor?.model].train_tasks?;
    (suite.split == Split::Seen).then_some(train_tasks as usize)
}

/// What a unit's shards share.
struct Suite<'a> {
    context: &'a Context<'a>,
    unit: &'a Unit,
    spec: &'a SuiteSpec,
    tasks: Vec<Task>,
    learned: Option<Learned>,
}

pub(super) fn work(context: &Context<'_>, unit: &Unit) -> Result<(), PipelineError> {
    let Part::Suite { actor, suite } = unit.part else { return Ok(()) };
    let (task_set, _) = tasks::read(context)?;
    let spec = &context.pipeline.spec.rollout.suites[suite];
    let learned = actor.map(|actor| learned(context, actor, &task_set));
    let tasks = suite_tasks(context, &task_set, spec, trained_on(context, actor, spec))?;
    let suite = Suite { context, unit, spec, tasks, learned };
    unit.dir.begin(&unit.plan)?;
    let progress = context.progress(unit, u64::from(spec.episodes), "episodes");
    let shards = context.shards(unit)?;
    shards.into_par_iter().try_for_each(|shard| suite.shard(shard, &progress))?;
    if context.options.shard.is_none() {
        finish(unit, &progress)?;
    }
    Ok(())
}

/// Where a trained model lies and how it decodes. Each shard loads its own: a policy keeps what it has read of
/// demonstrations.
struct Learned {
    folder: PathBuf,
    variant: Variant,
    specification: SpecificationForm,
    decoder: Decoder,
    /// Whether the decoder is the model's first.
    is_first: bool,
    acted: Acted,
}

fn learned(context: &Context<'_>, actor: ModelActor, task_set: &TaskSet) -> Learned {
    let ModelActor { model, seed, decoder } = actor;
    let spec = &context.pipeline.spec.models[model];
    let n_seen = task_set.of_split(Split::Seen).count() as u32;
    let acted = Acted {
        training_seed: seed,
        train_tasks: Some(spec.train_tasks.map_or(n_seen, |n| n.min(n_seen))),
        specification: Some(spec.specification().name()),
        decoder: Some(decoder.name()),
        model: Some(ModelFacts::from(spec.variant)),
    };
    let name = model_name(spec, seed);
    let folder = context.dir.model(&name).path().to_owned();
    let is_first = spec.decoders.first() == Some(&decoder);
    Learned { folder, variant: spec.variant, specification: spec.specification(), decoder, is_first, acted }
}

impl Learned {
    /// Refuses a model that was made for another family, another number of slots, pictures of another size, or as
    /// another variant.
    fn policy(&self, context: &Context<'_>) -> Result<Box<dyn Policy>, PipelineError> {
        let found = load_config(&self.folder)?;
        let family = context.pipeline.spec.tasks.family;
        let mut wanted =
            ModelConfig::new(self.variant, self.specification, family, family.n_slots(), found.training.clone());
        if let Some(camera) = context.pipeline.spec.generate.cameras.first() {
            wanted.network = wanted.network.for_pictures(camera.size_px[0] as usize, wanted.n_slots);
        }
        check_purpose(&found, &wanted, &self.folder)?;
        Ok(load_policy(&self.folder, self.decoder)?.1)
    }
}

/// What a suite's demonstrations depend on; policies read their boundaries.
fn demonstrations<'a>(context: &Context<'a>, suite: &'a SuiteSpec) -> Demonstrations<'a> {
    let spec = &context.pipeline.spec;
    Demonstrations { seed: spec.seed, suite, simulation: &spec.generate.simulation, frames: RecordedFrames::Boundaries }
}

/// The tasks that a suite asks for, in its order of sub-tasks; of the first `most` of its split.
fn suite_tasks(
    context: &Context<'_>,
    task_set: &TaskSet,
    spec: &SuiteSpec,
    most: Option<usize>,
) -> Result<Vec<Task>, PipelineError> {
    let demonstrations = demonstrations(context, spec);
    let ordered = |task: &Task| demonstrations.ordered(task);
    let is_asked_for = |task: &&Task| spec.bowls.is_none_or(|bowls| task.n_bowls() == bowls);
    let tasks: Vec<Task> = task_set
        .of_split(spec.split)
        .take(most.unwrap_or(usize::MAX))
        .filter(is_asked_for)
        .filter_map(ordered)
        .collect();
    if tasks.is_empty() {
        let (field, problem) = match (spec.order, spec.bowls) {
            (OrderSpec::Shuffled, _) => ("order", format!("is shuffled, but no {} task has two towers", spec.split)),
            (OrderSpec::Own, Some(bowls)) => ("bowls", format!("is {bowls}, but no {} task has as many", spec.split)),
            (OrderSpec::Own, None) => ("split", format!("is {}, but there is no such task", spec.split)),
        };
        return Err(PipelineError::Value {
            path: context.pipeline.path.clone(),
            key: format!("rollout.suites.{}.{field}", spec.name),
            problem,
        });
    }
    Ok(tasks)
}

/// Puts the shards' rows into one table and commits.
fn finish(unit: &Unit, progress: &Progress) -> Result<(), PipelineError> {
    let mut rows = RolloutRows::default();
    let mut detections: Option<DetectionRows> = None;
    for shard in 0..unit.plan.shards {
        if let Some(receipt) = unit.dir.receipt(&unit.plan, shard)? {
            for file in &receipt.files {
                let path = unit.dir.path().join(&file.path);
                if file.path.starts_with(PART) {
                    rows.append(RolloutRows::read(&path)?);
                } else if file.path.starts_with(DETECTIONS_PART) {
                    detections.get_or_insert_default().append(DetectionRows::read(&path)?);
                }
            }
        }
    }
    rows.write(&unit.dir.path().join(TABLE))?;
    let mut tables = vec![TABLE];
    if let Some(detections) = detections {
        detections.write(&unit.dir.path().join(detections::TABLE))?;
        tables.push(detections::TABLE);
    }
    let manifest = unit.dir.commit(&unit.plan, &tables)?;
    let succeeded = manifest.episodes - manifest.failed;
    progress.finish(&format!("{succeeded} of {} succeeded", manifest.episodes));
    Ok(())
}

impl Suite<'_> {
    /// Does one shard unless its receipt is there.
    fn shard(&self, shard: u32, progress: &Progress) -> Result<(), PipelineError> {
        let Self { context, unit, spec, .. } = self;
        let range = shard * EPISODES_PER_SHARD..spec.episodes.min((shard + 1) * EPISODES_PER_SHARD);
        if unit.dir.receipt(&unit.plan, shard)?.is_some() {
            progress.inc(u64::from(range.end - range.start));
            return Ok(());
        }
        context.go_on()?;
        let starts: Result<Vec<Start<'_>>, PipelineError> = range.clone().map(|episode| self.start(episode)).collect();
        let starts = starts?;
        let mut policy = self.policy(&starts)?;
        let by = self.learned.as_ref().map(|learned| learned.acted.clone()).unwrap_or_default();
        let detections = self.detections(policy.as_ref(), &by, &starts)?;
        let acted = self.act(policy.as_mut(), starts)?;
        let part = format!("{PART}{shard:05}.parquet");
        RolloutRows::of(&spec.name, &facts::of_suite(&context.pipeline.spec, spec), &by, &acted)
            .write(&unit.dir.path().join(&part))?;
        let mut files = vec![FileEntry::of(unit.dir.path(), &part)?];
        if let Some(detections) = detections {
            let part = format!("{DETECTIONS_PART}{shard:05}.parquet");
            detections.write(&unit.dir.path().join(&part))?;
            files.push(FileEntry::of(unit.dir.path(), &part)?);
        }
        files.extend(self.record(shard, &acted)?);
        unit.dir.commit_shard(&Receipt {
            plan_id: unit.plan.id(),
            shard,
            episodes: acted.len() as u64,
            failed: acted.iter().filter(|rollout| !rollout.episode.outcome.is_success()).count() as u64,
            files,
        })?;
        progress.inc(acted.len() as u64);
        Ok(())
    }

    fn start(&self, episode: u32) -> Result<Start<'_>, PipelineError> {
        let Self { context, spec, tasks, .. } = self;
        let task = &tasks[episode as usize % tasks.len()];
        let demonstration = self.demonstration(task, episode)?;
        let run_seed = context.pipeline.spec.seed;
        let mut own = trial(run_seed, &format!("rollout/{}", spec.name), task, episode, spec.on_table);
        if spec.on_table.is_none() {
            own.counts.clone_from(&demonstration.provenance.counts);
        }
        let recorded = if episode < context.pipeline.spec.rollout.record {
            RecordedFrames::All
        } else {
            RecordedFrames::Boundaries
        };
        let config = simulation_config(recorded, &context.pipeline.spec.generate.simulation);
        let provenance = Provenance::new(task, &own, Actor::Policy(String::new()), u64::from(episode));
        let world = disturbed(world(task, &own, &config)?, spec.adversary, own.seed)?;
        let sight = self.sight(&demonstration, &world, own.seed)?;
        Ok(Start { task, demonstration, world: Box::new(world), sight, provenance })
    }

    /// What a model that sees is given: the first camera's pictures, as in the dataset that it learned from.
    fn sight(&self, demonstration: &Episode, world: &Simulation, seed: Seed) -> Result<Option<Sight>, PipelineError> {
        let sees = self.learned.as_ref().is_some_and(|learned| learned.variant.sees());
        let camera = self.context.pipeline.spec.generate.cameras.first().filter(|_| sees);
        let look = |camera| {
            sight(camera, demonstration, world.scene(), seed).map_err(|source| PipelineError::Sight {
                suite: self.spec.name.clone(),
                episode: demonstration.provenance.index,
                task_id: demonstration.provenance.task_id.clone(),
                camera: camera.name.clone(),
                source: Box::new(source),
            })
        };
        camera.map(look).transpose()
    }

    fn demonstration(&self, task: &Task, episode: u32) -> Result<Episode, PipelineError> {
        let Self { context, spec, .. } = self;
        let found = demonstrations(context, spec).of(task, episode)?;
        found.ok_or_else(|| PipelineError::NoDemonstration {
            suite: spec.name.clone(),
            task_id: task.id.clone(),
            attempts: demonstration::ATTEMPTS,
        })
    }

    fn policy(&self, starts: &[Start<'_>]) -> Result<Box<dyn Policy>, PipelineError> {
        Ok(match &self.learned {
            Some(learned) => learned.policy(self.context)?,
            None => Box::new(Oracle::for_starts(starts)),
        })
    }

    /// The errors of a detector, which are the same whatever decodes what is behind it.
    fn detections(
        &self,
        policy: &dyn Policy,
        by: &Acted,
        starts: &[Start<'_>],
    ) -> Result<Option<DetectionRows>, PipelineError> {
        let detects = self.learned.as_ref().is_some_and(|learned| learned.variant.detects() && learned.is_first);
        let Some(camera) = self.context.pipeline.spec.generate.cameras.first().filter(|_| detects) else {
            return Ok(None);
        };
        detections::of_starts(policy, &self.spec.name, by, camera, starts).map_err(|error| self.failed(error.into()))
    }

    fn failed(&self, source: RolloutError) -> PipelineError {
        PipelineError::Rollout { unit: self.unit.name.clone(), source }
    }

    fn act(&self, policy: &mut dyn Policy, starts: Vec<Start<'_>>) -> Result<Vec<RolloutEpisode>, PipelineError> {
        let factor = self.context.pipeline.spec.rollout.decisions_factor;
        let limits = Limits { decisions_factor: factor, ..Limits::default() };
        rollout::run(policy, starts, limits).map_err(|source| self.failed(source))
    }

    /// Records the first episodes of the suite, and the shard's first failures, which are not seen otherwise.
    fn record(&self, shard: u32, acted: &[RolloutEpisode]) -> Result<Option<FileEntry>, PipelineError> {
        let recorded = self.recorded(shard, acted);
        if recorded.is_empty() {
            return Ok(None);
        }
        let name = format!("recordings/shard-{shard:05}-of-{:05}.mcap", self.unit.plan.shards);
        let plan_json = serde_json::to_string(&self.unit.plan).unwrap_or_default();
        let writer = ShardWriter::create(&self.unit.dir.path().join(&name), &plan_json)?;
        let mut writer = writer.with_cameras(&self.context.pipeline.spec.generate.cameras);
        for rollout in recorded {
            writer.write(&rollout.episode)?;
        }
        writer.finish()?;
        Ok(Some(FileEntry::of(self.unit.dir.path(), &name)?))
    }

    /// The episodes of a shard that are recorded, in order; none where nothing is to be recorded.
    fn recorded<'e>(&self, shard: u32, acted: &'e [RolloutEpisode]) -> Vec<&'e RolloutEpisode> {
        let record = self.context.pipeline.spec.rollout.record;
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
