//! Stage `generate`: the expert demonstrates every training task, shard by shard.

use rayon::iter::{IntoParallelIterator as _, ParallelIterator as _};
use serde_json::json;

use crate::artifact::{FileEntry, Plan, Receipt};
use crate::expert;
use crate::pipeline::runner::{Context, Part, Unit};
use crate::pipeline::trials::trial;
use crate::pipeline::{PipelineError, RecordedFrames, Stage, tasks};
use crate::progress::Progress;
use crate::recording::ShardWriter;
use crate::seed::Seed;
use crate::sim::{AdversaryConfig, SimError, Simulation, SimulationConfig};
use crate::task::{self, Split, Task, Trial};
use crate::trace::{Actor, Episode, Provenance};

pub(super) fn units(context: &Context<'_>) -> Result<Vec<Unit>, PipelineError> {
    let spec = &context.pipeline.spec;
    let (task_set, inputs) = tasks::read(context)?;
    let n_tasks = task_set.tasks.iter().filter(|task| task.split == Split::Seen).count() as u32;
    let n_episodes = n_tasks * spec.generate.trials_per_task;
    let shards = n_episodes.div_ceil(spec.generate.episodes_per_shard);
    let config = json!({ "seed": spec.seed, "episodes": n_episodes, "generate": spec.generate });
    let plan = Plan::new(Stage::Generate.name(), shards, inputs, config);
    Ok(vec![Unit { name: "generate".to_owned(), dir: context.dir.recordings(), plan, part: Part::Whole }])
}

pub(super) fn work(context: &Context<'_>, unit: &Unit) -> Result<(), PipelineError> {
    let (task_set, _) = tasks::read(context)?;
    let seen: Vec<Task> = task_set.tasks.into_iter().filter(|task| task.split == Split::Seen).collect();
    unit.dir.begin(&unit.plan)?;
    let n_episodes = seen.len() as u64 * u64::from(context.pipeline.spec.generate.trials_per_task);
    let progress = context.progress(unit, n_episodes, "episodes");
    let shards = context.shards(unit)?;
    shards.into_par_iter().try_for_each(|shard| work_shard(context, unit, &seen, shard, &progress))?;
    if context.options.shard.is_none() {
        let manifest = unit.dir.commit(&unit.plan, &[])?;
        progress.finish(&format!("{} episodes, {} failed", manifest.episodes, manifest.failed));
    }
    Ok(())
}

/// Does one shard unless its receipt is there.
fn work_shard(
    context: &Context<'_>,
    unit: &Unit,
    seen: &[Task],
    shard: u32,
    progress: &Progress,
) -> Result<(), PipelineError> {
    let spec = &context.pipeline.spec.generate;
    let n_episodes = seen.len() as u64 * u64::from(spec.trials_per_task);
    let per_shard = u64::from(spec.episodes_per_shard);
    let range = u64::from(shard) * per_shard..n_episodes.min((u64::from(shard) + 1) * per_shard);
    if unit.dir.receipt(&unit.plan, shard)?.is_some() {
        progress.inc(range.end - range.start);
        return Ok(());
    }
    let name = format!("shard-{shard:05}-of-{:05}.mcap", unit.plan.shards);
    let plan_json = serde_json::to_string(&unit.plan).unwrap_or_default();
    let writer = ShardWriter::create(&unit.dir.path().join(&name), &plan_json)?;
    let mut writer = writer.with_cameras(&spec.cameras);
    let mut failed = 0;
    for index in range.clone() {
        context.go_on()?;
        let task = &seen[(index / u64::from(spec.trials_per_task)) as usize];
        let trial_index = (index % u64::from(spec.trials_per_task)) as u32;
        let trial = trial(context.pipeline.spec.seed, "demonstration", task, trial_index, spec.counts);
        let episode = demonstrate(task, &trial, index, &simulation_config(spec.frames, &spec.simulation))?;
        failed += u64::from(!episode.outcome.is_success());
        writer.write(&episode)?;
        progress.inc(1);
    }
    writer.finish()?;
    unit.dir.commit_shard(&Receipt {
        plan_id: unit.plan.id(),
        shard,
        episodes: range.end - range.start,
        failed,
        files: vec![FileEntry::of(unit.dir.path(), &name)?],
    })?;
    Ok(())
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
    let scene = task::scene(task.family, &trial.counts);
    let initial = task::initial_state(task.family, &scene, trial.seed);
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
