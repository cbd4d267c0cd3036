//! Stage `report`: everything that was rolled out and trained, on one page; of one experiment, or of all of a study.

use std::collections::BTreeMap;

use serde_json::json;

use crate::artifact::{FileEntry, IoError, Plan, Receipt};
use crate::model;
use crate::pipeline::costs::Costs;
use crate::pipeline::filmstrips::{self, Rollouts};
use crate::pipeline::runner::{Context, Options, Part, Unit};
use crate::pipeline::{Pipeline, PipelineError, RunDir, Stage, Study, detections, rollout, tasks, train};
use crate::render::{CameraConfig, Randomization};
use crate::report::{
    self, DetectionsInput, Fact, Filmstrip, MetricsInput, ModelParts, ModelSummary, ReportInputs, RolloutsInput,
    StageCost, paper_values,
};
use crate::rollout::ModelFacts;
use crate::task::Split;
use crate::training::METRICS_FILE;

/// What a report holds.
const FILES: [&str; 5] = ["report.json", "report.md", "results.csv", "curves.csv", "index.html"];
/// Version of what a report says, beside that of the program.
const VERSION: u32 = 4;

pub(super) fn units(context: &Context<'_>) -> Result<Vec<Unit>, PipelineError> {
    let mut inputs = BTreeMap::new();
    for unit in rollout::units(context)? {
        inputs.insert(unit.name.clone(), unit.dir.version()?);
    }
    Ok(vec![unit(title(context.pipeline), context.dir, inputs)])
}

pub(super) fn work(context: &Context<'_>, unit: &Unit) -> Result<(), PipelineError> {
    let mut inputs = ReportInputs { title: title(context.pipeline).to_owned(), ..ReportInputs::default() };
    gather(context, context.dir, &mut inputs)?;
    write(unit, inputs)
}

/// The one unit of a study's own report.
pub(super) fn study_units(study: &Study, dir: &RunDir, options: &Options) -> Result<Vec<Unit>, PipelineError> {
    let mut inputs = BTreeMap::new();
    for pipeline in &study.experiments {
        let context = Context { pipeline, dir: &dir.experiment(&pipeline.spec.name), options };
        for unit in rollout::units(&context)? {
            inputs.insert(format!("{}: {}", pipeline.spec.name, unit.name), unit.dir.version()?);
        }
    }
    Ok(vec![unit(study.title(), dir, inputs)])
}

pub(super) fn work_study(study: &Study, dir: &RunDir, options: &Options, unit: &Unit) -> Result<(), PipelineError> {
    let mut inputs = ReportInputs { title: study.title().to_owned(), ..ReportInputs::default() };
    for pipeline in &study.experiments {
        let own = dir.experiment(&pipeline.spec.name);
        gather(&Context { pipeline, dir: &own, options }, dir, &mut inputs)?;
    }
    write(unit, inputs)
}

fn title(pipeline: &Pipeline) -> &str {
    pipeline.spec.report.title.as_deref().unwrap_or(&pipeline.spec.name)
}

fn unit(title: &str, dir: &RunDir, inputs: BTreeMap<String, String>) -> Unit {
    let plan = Plan::new(Stage::Report.name(), 1, inputs, json!({ "title": title, "version": VERSION }));
    Unit { name: Stage::Report.name().to_owned(), dir: dir.report(), plan, part: Part::Whole }
}

fn write(unit: &Unit, mut inputs: ReportInputs) -> Result<(), PipelineError> {
    inputs.paper = paper_values();
    inputs.commits.sort();
    inputs.commits.dedup();
    unit.dir.begin(&unit.plan)?;
    report::make(&inputs, unit.dir.path())?;
    let entries: Result<Vec<FileEntry>, IoError> =
        FILES.iter().map(|file| FileEntry::of(unit.dir.path(), file)).collect();
    unit.dir.commit_shard(&Receipt { plan_id: unit.plan.id(), shard: 0, episodes: 0, failed: 0, files: entries? })?;
    unit.dir.commit(&unit.plan, &[])?;
    Ok(())
}

/// Adds all that is known of one experiment; `run` is the run directory of the report.
fn gather(context: &Context<'_>, run: &RunDir, inputs: &mut ReportInputs) -> Result<(), PipelineError> {
    let experiment = &context.pipeline.spec.name;
    let rollouts = rollout::units(context)?;
    inputs.rollouts.extend(rollouts.iter().map(|unit| RolloutsInput {
        experiment: experiment.clone(),
        tag: tag_of(context, unit),
        path: unit.dir.path().join(rollout::TABLE),
    }));
    for unit in &rollouts {
        if unit.dir.finished()?.files.iter().any(|file| file.path == detections::TABLE) {
            let path = unit.dir.path().join(detections::TABLE);
            inputs.detections.push(DetectionsInput { experiment: experiment.clone(), path });
        }
    }
    inputs.filmstrips.extend(filmstrips(context, run, &rollouts)?);
    let costs = Costs::read(context.dir)?;
    inputs.metrics.extend(trainings(context, &costs)?);
    inputs.facts.extend(facts(context)?);
    inputs.costs.extend(stage_costs(context, &costs, &mut inputs.commits)?);
    Ok(())
}

/// Strips of what models acted; of the oracle only where there is nothing else.
fn filmstrips(context: &Context<'_>, run: &RunDir, rollouts: &[Unit]) -> Result<Vec<Filmstrip>, PipelineError> {
    let (task_set, _) = tasks::read(context)?;
    let spec = &context.pipeline.spec;
    let of_unit = |unit: &Unit| {
        let Part::Suite { actor, suite } = unit.part else { return None };
        let place = unit.dir.path().strip_prefix(run.root()).unwrap_or(unit.dir.path()).display().to_string();
        let actor = rollout::actor_name(context, actor);
        Some(Rollouts { suite: spec.rollout.suites[suite].name.clone(), actor, dir: unit.dir.clone(), place })
    };
    let is_model = |unit: &&Unit| !matches!(unit.part, Part::Suite { actor: None, .. });
    let (models, oracle): (Vec<&Unit>, Vec<&Unit>) = rollouts.iter().partition(is_model);
    let shown = if models.is_empty() { oracle } else { models };
    let shown: Vec<Rollouts> = shown.into_iter().filter_map(of_unit).collect();
    filmstrips::of_experiment(&spec.name, &task_set, &shown)
}

/// The tag of the model that acts in a unit of the rollout stage.
fn tag_of(context: &Context<'_>, unit: &Unit) -> Option<String> {
    let Part::Suite { actor: Some(actor), .. } = unit.part else { return None };
    context.pipeline.spec.models[actor.model].tag.clone()
}

fn trainings(context: &Context<'_>, costs: &Costs) -> Result<Vec<MetricsInput>, PipelineError> {
    let (task_set, _) = tasks::read(context)?;
    let n_seen = task_set.of_split(Split::Seen).count() as u32;
    let mut trainings = Vec::new();
    for unit in train::units(context)? {
        let Part::Model { model, seed } = unit.part else { continue };
        let spec = &context.pipeline.spec.models[model];
        let model = ModelSummary {
            experiment: context.pipeline.spec.name.clone(),
            variant: spec.variant.name(),
            parts: parts(ModelFacts::from(spec.variant)),
            tag: spec.tag.clone(),
            train_tasks: i64::from(spec.train_tasks.map_or(n_seen, |n| n.min(n_seen))),
            specification: spec.specification().name().to_owned(),
            seed: seed as i64,
            parameters: model::inspect(unit.dir.path())?.parameters as u64,
            cpu_secs: costs.of(&unit.name, &unit.plan).map(|cost| cost.cpu_secs),
        };
        trainings.push(MetricsInput { model, path: unit.dir.path().join(METRICS_FILE) });
    }
    Ok(trainings)
}

fn parts(facts: ModelFacts) -> ModelParts {
    let ModelFacts { core, scoping, encoder } = facts;
    let [core, scoping, encoder] = [core, scoping, encoder].map(|name| Some(name.to_owned()));
    ModelParts { core, scoping, encoder }
}

/// What the stages before the report took, as far as it was measured under the plans that hold now.
fn stage_costs(
    context: &Context<'_>,
    costs: &Costs,
    commits: &mut Vec<String>,
) -> Result<Vec<StageCost>, PipelineError> {
    let mut told = Vec::new();
    for stage in Stage::ALL.into_iter().filter(|&stage| stage != Stage::Report) {
        let units = super::runner::units(context, stage)?;
        let known: Vec<_> = units.iter().filter_map(|unit| costs.of(&unit.name, &unit.plan)).collect();
        if known.is_empty() {
            continue;
        }
        commits.extend(known.iter().filter_map(|cost| cost.commit.clone()));
        told.push(StageCost {
            experiment: context.pipeline.spec.name.clone(),
            stage: stage.name().to_owned(),
            cpu_secs: known.iter().map(|cost| cost.cpu_secs).sum(),
            wall_secs: known.iter().map(|cost| cost.wall_secs).sum(),
        });
    }
    Ok(told)
}

/// What a reader wants to know of an experiment beside its results.
fn facts(context: &Context<'_>) -> Result<Vec<Fact>, PipelineError> {
    let spec = &context.pipeline.spec;
    let (task_set, _) = tasks::read(context)?;
    let recordings = context.dir.recordings().finished()?;
    let dataset = context.dir.dataset().finished()?;
    let fact = |name: &str, value: String| Fact { experiment: spec.name.clone(), name: name.to_owned(), value };
    let mut facts = vec![
        fact("run seed", spec.seed.to_string()),
        fact("task family", spec.tasks.family.name().to_owned()),
        fact("training tasks", task_set.of_split(Split::Seen).count().to_string()),
        fact("unseen tasks", task_set.of_split(Split::Unseen).count().to_string()),
        fact("expert demonstrations", format!("{}, {} failed", recordings.episodes, recordings.failed)),
        fact("episodes in the dataset", dataset.episodes.to_string()),
    ];
    facts.extend(spec.generate.cameras.iter().map(|camera| fact(&format!("camera {}", camera.name), seen(camera))));
    Ok(facts)
}

/// What a camera's pictures are, in words.
fn seen(camera: &CameraConfig) -> String {
    let CameraConfig { size_px: [width, height], randomize, .. } = camera;
    let Randomization { light, color, camera_m, camera_rad, one_color } = randomize;
    let mut words = format!("{width} x {height} pixels");
    let shares =
        [("light", light, ""), ("colours", color, ""), ("place", camera_m, " m"), ("angle", camera_rad, " rad")];
    for (what, most, unit) in shares.into_iter().filter(|(_, most, _)| **most > 0.0) {
        words.push_str(&format!(", {what} changed by up to {most}{unit}"));
    }
    if *one_color {
        words.push_str(", one colour for all that moves");
    }
    words
}
