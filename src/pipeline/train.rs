//! Stage `train`: one model for each variant and seed, from the dataset alone.

use std::collections::BTreeMap;

use serde_json::json;

use crate::artifact::{FileEntry, IoError, Plan, Receipt};
use crate::dataset::{self, DatasetTrials};
use crate::model::{CONFIG_FILE, WEIGHTS_FILE};
use crate::pipeline::layout::model_name;
use crate::pipeline::runner::{Context, Part, Unit};
use crate::pipeline::{ModelSpec, PipelineError, Stage, gallery, tasks};
use crate::task::Split;
use crate::training::{self, DETECTOR_METRICS_FILE, Gallery, Hooks, METRICS_FILE};

/// What a finished training leaves; checkpoints are not part of it.
fn result_files(spec: &ModelSpec) -> impl Iterator<Item = &'static str> {
    let of_detector = spec.variant.detects().then_some(DETECTOR_METRICS_FILE);
    [WEIGHTS_FILE, CONFIG_FILE, METRICS_FILE].into_iter().chain(of_detector)
}

pub(super) fn units(context: &Context<'_>) -> Result<Vec<Unit>, PipelineError> {
    let version = context.dir.dataset().version()?;
    let inputs = BTreeMap::from([(Stage::Convert.name().to_owned(), version)]);
    let models = context.pipeline.spec.models.iter().enumerate();
    let unit = |(model, spec): (usize, &ModelSpec), seed: u64| {
        let name = model_name(spec, seed);
        let mut config = json!({
            "variant": spec.variant,
            "seed": seed,
            "train_tasks": spec.train_tasks,
            "training": spec.training,
        });
        if spec.variant.detects() {
            config["detector_given"] = json!("gripper");
        }
        Unit {
            dir: context.dir.model(&name),
            name: format!("train {name}"),
            plan: Plan::new(Stage::Train.name(), 1, inputs.clone(), config),
            part: Part::Model { model, seed },
        }
    };
    Ok(models
        .flat_map(|(idx, spec)| spec.seeds.iter().map(move |&seed| ((idx, spec), seed)))
        .map(|(m, s)| unit(m, s))
        .collect())
}

pub(super) fn work(context: &Context<'_>, unit: &Unit) -> Result<(), PipelineError> {
    let Part::Model { model, seed } = unit.part else { return Ok(()) };
    let spec = &context.pipeline.spec.models[model];
    let trials = training_trials(context, spec)?;
    let gallery = spec.variant.sees().then(|| gallery::open(context, &trials)).transpose()?;
    unit.dir.begin(&unit.plan)?;
    let training = spec.training(seed).resolved();
    let progress = context.progress(unit, u64::from(training.config.n_steps_in_all()), "steps");
    let mut shown = None;
    let mut on_progress = |now: training::Progress| {
        let before = shown.replace(now.step).unwrap_or_else(|| {
            progress.carry_on_after(u64::from(now.step - 1));
            now.step - 1
        });
        progress.inc(u64::from(now.step - before));
        progress.message(&format!("loss {:.3}", now.loss));
    };
    let mut hooks = Hooks { on_progress: &mut on_progress, should_stop: &|| context.go_on().is_err() };
    let gallery = gallery.as_ref().map(|gallery| gallery as &dyn Gallery);
    let summary = training::train_on_pictures(&training, &trials, gallery, unit.dir.path(), &mut hooks);
    context.go_on()?;
    let summary = summary?;
    let files: Result<Vec<FileEntry>, IoError> =
        result_files(spec).map(|file| FileEntry::of(unit.dir.path(), file)).collect();
    unit.dir.commit_shard(&Receipt {
        plan_id: unit.plan.id(),
        shard: 0,
        episodes: trials.trials.len() as u64,
        failed: 0,
        files: files?,
    })?;
    unit.dir.commit(&unit.plan, &[])?;
    let dropped = match summary.dropped_gradients {
        0 => String::new(),
        n => format!(", {n} gradients that were no numbers left out"),
    };
    progress.finish(&format!("{} steps, {} examples{dropped}", summary.steps, summary.examples));
    Ok(())
}

/// The trials a model may train on: successful ones of the first training tasks.
fn training_trials(context: &Context<'_>, spec: &ModelSpec) -> Result<DatasetTrials, PipelineError> {
    let mut trials = dataset::read_trials(context.dir.dataset().path())?;
    let (task_set, _) = tasks::read(context)?;
    let seen: Vec<String> =
        task_set.tasks.into_iter().filter(|task| task.split == Split::Seen).map(|task| task.id).collect();
    let n_tasks = spec.train_tasks.map_or(seen.len(), |n| n as usize).min(seen.len());
    let allowed = &seen[..n_tasks];
    trials.trials.retain(|trial| trial.split == Split::Seen && allowed.contains(&trial.task_id));
    Ok(trials)
}
