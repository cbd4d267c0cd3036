//! What a report is made of: rollouts, metrics, costs, facts and pictures of each experiment.

use crate::model;
use crate::pipeline::costs::{Costs, UnitCost};
use crate::pipeline::filmstrips::{self, Rollouts};
use crate::pipeline::report::{Report, annotations};
use crate::pipeline::unit::{Job, Made, Unit, Worker};
use crate::pipeline::{Pipeline, PipelineError, RunDir, Stage, Study, detections, rollout, tasks, train, upstream};
use crate::render::{CameraConfig, Randomization};
use crate::report::{
    self, AnnotationsInput, DetectionsInput, Fact, Filmstrip, MetricsInput, ModelParts, ModelSummary, ReportInputs,
    RolloutsInput, StageCost, paper_values,
};
use crate::rollout::ModelFacts;
use crate::task::Split;
use crate::training::METRICS_FILE;

/// What a report holds.
const FILES: [&str; 5] = ["report.json", "report.md", "results.csv", "curves.csv", "index.html"];

/// Makes a report.
pub(super) struct Reporter<'j> {
    inputs: ReportInputs,
    job: &'j Job<'j>,
}

impl<'j> Reporter<'j> {
    /// Reads all that a report tells of.
    pub(super) fn new(report: &Report<'_>, job: &'j Job<'_>) -> Result<Self, PipelineError> {
        let mut inputs =
            ReportInputs { title: report.title.to_owned(), paper: paper_values(), ..ReportInputs::default() };
        for (pipeline, run) in report.runs(job.context.dir) {
            gather(pipeline, &run, report.acted(pipeline), &mut inputs)?;
            inputs.filmstrips.extend(filmstrips(pipeline, &run, report.acted(pipeline), job.context.dir)?);
        }
        if let Some(study) = report.study {
            gather_models(study, job.context.dir, &mut inputs)?;
        }
        inputs.commits.sort();
        inputs.commits.dedup();
        Ok(Self { inputs, job })
    }
}

impl Worker for Reporter<'_> {
    fn shard(&self, _shard: u32) -> Result<Option<Made>, PipelineError> {
        report::make(&self.inputs, self.job.dir.path())?;
        Ok(Some(Made::files(&self.job.dir, FILES)?))
    }
}

/// Adds all that is known of one experiment.
fn gather(
    pipeline: &Pipeline,
    run: &RunDir,
    acted: Vec<rollout::Suite<'_>>,
    inputs: &mut ReportInputs,
) -> Result<(), PipelineError> {
    let experiment = &pipeline.spec.name;
    for unit in acted {
        let dir = unit.dir(run);
        let tag = unit.actor.and_then(|actor| actor.model.spec.tag.clone());
        inputs.rollouts.push(RolloutsInput {
            experiment: experiment.clone(),
            tag: tag.clone(),
            noise: unit.spec.noise,
            path: dir.path().join(rollout::TABLE),
        });
        if dir.finished()?.files.iter().any(|file| file.path == detections::TABLE) {
            let path = dir.path().join(detections::TABLE);
            inputs.detections.push(DetectionsInput { experiment: experiment.clone(), tag, path });
        }
    }
    inputs.annotations.extend(annotations(pipeline, run).into_iter().map(|(name, path)| {
        let experiment = experiment.clone();
        AnnotationsInput { experiment, name, path }
    }));
    let costs = Costs::read(run)?;
    inputs.metrics.extend(trainings(experiment, train::units(pipeline), run, &costs)?);
    inputs.facts.extend(facts(pipeline, run)?);
    inputs.costs.extend(stage_costs(pipeline, run, &costs, &mut inputs.commits)?);
    Ok(())
}

/// Adds what a study's own models learned, and what that took.
fn gather_models(study: &Study, run: &RunDir, inputs: &mut ReportInputs) -> Result<(), PipelineError> {
    let models = train::units_of_study(study);
    if models.is_empty() {
        return Ok(());
    }
    let costs = Costs::read(run)?;
    let cost = stage_cost(&study.spec.name, Stage::Train, &upstream::boxed(models.clone()), run, &costs)?;
    inputs.commits.extend(cost.commits);
    inputs.costs.extend(cost.told.cpu_secs.is_some().then_some(cost.told));
    inputs.metrics.extend(trainings(&study.spec.name, models, run, &costs)?);
    Ok(())
}

/// Strips of what models acted; of the oracle only where there is nothing else. `whole` is the run directory of the
/// report.
fn filmstrips(
    pipeline: &Pipeline,
    run: &RunDir,
    acted: Vec<rollout::Suite<'_>>,
    whole: &RunDir,
) -> Result<Vec<Filmstrip>, PipelineError> {
    let of_unit = |unit: rollout::Suite<'_>| {
        let dir = unit.dir(run);
        let place = dir.path().strip_prefix(whole.root()).unwrap_or(dir.path()).display().to_string();
        Rollouts { suite: unit.spec.name.clone(), actor: unit.actor_name(), dir, place }
    };
    let (models, oracle): (Vec<_>, Vec<_>) = acted.into_iter().partition(|unit| unit.actor.is_some());
    let shown = if models.is_empty() { oracle } else { models };
    let shown: Vec<Rollouts> = shown.into_iter().map(of_unit).collect();
    filmstrips::of_experiment(&pipeline.spec.name, &tasks::read(run)?, &shown)
}

fn parts(facts: ModelFacts) -> ModelParts {
    let ModelFacts { core, scoping, encoder } = facts;
    let [core, scoping, encoder] = [core, scoping, encoder].map(|name| Some(name.to_owned()));
    ModelParts { core, scoping, encoder }
}

fn trainings(
    experiment: &str,
    models: Vec<train::Model<'_>>,
    run: &RunDir,
    costs: &Costs,
) -> Result<Vec<MetricsInput>, PipelineError> {
    let mut trainings = Vec::new();
    for unit in models {
        let (spec, dir) = (unit.spec, unit.dir(run));
        let plan = dir.plan()?;
        let model = ModelSummary {
            experiment: experiment.to_owned(),
            variant: spec.variant.name(),
            parts: parts(ModelFacts::from(spec.variant)),
            tag: spec.tag.clone(),
            train_tasks: i64::from(unit.train_tasks()),
            specification: spec.specification().name().to_owned(),
            seed: unit.seed as i64,
            parameters: model::inspect(dir.path())?.parameters as u64,
            cpu_secs: plan.and_then(|plan| costs.of(&unit.name(), &plan)).map(|cost| cost.cpu_secs),
        };
        trainings.push(MetricsInput { model, path: dir.path().join(METRICS_FILE) });
    }
    Ok(trainings)
}

/// What the stages before the report took; nothing of a stage of which a part was not measured.
fn stage_costs(
    pipeline: &Pipeline,
    run: &RunDir,
    costs: &Costs,
    commits: &mut Vec<String>,
) -> Result<Vec<StageCost>, PipelineError> {
    let mut told = Vec::new();
    for stage in Stage::ALL.into_iter().filter(|&stage| stage != Stage::Report) {
        let cost = stage_cost(&pipeline.spec.name, stage, &upstream::units(pipeline, stage), run, costs)?;
        commits.extend(cost.commits);
        told.push(cost.told);
    }
    let is_measured = told.iter().any(|cost| cost.cpu_secs.is_some());
    Ok(if is_measured { told } else { Vec::new() })
}

/// What a stage took, and of which commits its pipeline file was.
struct OfStage {
    told: StageCost,
    commits: Vec<String>,
}

fn stage_cost(
    experiment: &str,
    stage: Stage,
    units: &[Box<dyn Unit + '_>],
    run: &RunDir,
    costs: &Costs,
) -> Result<OfStage, PipelineError> {
    let mut known = Vec::new();
    for unit in units {
        let plan = unit.dir(run).plan()?;
        known.extend(plan.and_then(|plan| costs.of(&unit.name(), &plan)));
    }
    let is_known = known.len() == units.len();
    let sum = |of: fn(&UnitCost) -> f64| is_known.then(|| known.iter().map(of).sum());
    let told = StageCost {
        experiment: experiment.to_owned(),
        stage: stage.name().to_owned(),
        cpu_secs: sum(|cost| cost.cpu_secs),
        wall_secs: sum(|cost| cost.wall_secs),
    };
    Ok(OfStage { told, commits: known.iter().filter_map(|cost| cost.commit.clone()).collect() })
}

/// What a reader wants to know of an experiment beside its results.
fn facts(pipeline: &Pipeline, run: &RunDir) -> Result<Vec<Fact>, PipelineError> {
    let spec = &pipeline.spec;
    let task_set = tasks::read(run)?;
    let recordings = run.recordings().finished()?;
    let dataset = run.dataset().finished()?;
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
