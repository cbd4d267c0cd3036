//! Stage `report`: everything that was rolled out and trained, on one page.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::json;

use crate::artifact::{FileEntry, IoError, Plan, Receipt};
use crate::model;
use crate::pipeline::layout::model_name;
use crate::pipeline::runner::{Context, Part, Unit};
use crate::pipeline::{PipelineError, Stage, rollout, tasks};
use crate::report::{self, Fact, MetricsInput, ReportInputs, paper_values};
use crate::task::Split;
use crate::training::METRICS_FILE;

const FILES: [&str; 4] = ["report.json", "results.csv", "curves.csv", "index.html"];

pub(super) fn units(context: &Context<'_>) -> Result<Vec<Unit>, PipelineError> {
    let mut inputs = BTreeMap::new();
    for unit in rollout::units(context)? {
        inputs.insert(unit.name.clone(), unit.dir.version()?);
    }
    let title = title(context);
    let plan = Plan::new(Stage::Report.name(), 1, inputs, json!({ "title": title }));
    Ok(vec![Unit { name: "report".to_owned(), dir: context.dir.report(), plan, part: Part::Whole }])
}

fn title(context: &Context<'_>) -> String {
    let spec = &context.pipeline.spec;
    spec.report.title.clone().unwrap_or_else(|| spec.name.clone())
}

pub(super) fn work(context: &Context<'_>, unit: &Unit) -> Result<(), PipelineError> {
    let inputs = ReportInputs {
        title: title(context),
        rollouts: rollout_tables(context)?,
        metrics: metrics(context),
        facts: facts(context)?,
        paper: paper_values(),
    };
    unit.dir.begin(&unit.plan)?;
    report::make(&inputs, unit.dir.path())?;
    let entries: Result<Vec<FileEntry>, IoError> =
        FILES.iter().map(|file| FileEntry::of(unit.dir.path(), file)).collect();
    unit.dir.commit_shard(&Receipt { plan_id: unit.plan.id(), shard: 0, episodes: 0, failed: 0, files: entries? })?;
    unit.dir.commit(&unit.plan, &[])?;
    Ok(())
}

fn rollout_tables(context: &Context<'_>) -> Result<Vec<PathBuf>, PipelineError> {
    let units = rollout::units(context)?;
    Ok(units.into_iter().map(|unit| unit.dir.path().join(rollout::TABLE)).collect())
}

fn metrics(context: &Context<'_>) -> Vec<MetricsInput> {
    let models = context.pipeline.spec.models.iter();
    let of_model = |spec: &crate::pipeline::ModelSpec, seed: u64| MetricsInput {
        variant: spec.variant.name().to_owned(),
        seed: seed as i64,
        path: context.dir.model(&model_name(spec.variant, spec.train_tasks, seed)).path().join(METRICS_FILE),
    };
    models.flat_map(|spec| spec.seeds.iter().map(move |&seed| of_model(spec, seed))).collect()
}

/// What a reader wants to know of the run beside its results.
fn facts(context: &Context<'_>) -> Result<Vec<Fact>, PipelineError> {
    let spec = &context.pipeline.spec;
    let (task_set, _) = tasks::read(context)?;
    let recordings = context.dir.recordings().finished()?;
    let dataset = context.dir.dataset().finished()?;
    let fact = |name: &str, value: String| Fact { name: name.to_owned(), value };
    let mut facts = vec![
        fact("ntp", env!("CARGO_PKG_VERSION").to_owned()),
        fact("pipeline", spec.name.clone()),
        fact("run seed", spec.seed.to_string()),
        fact("task family", spec.tasks.family.name().to_owned()),
        fact("training tasks", task_set.of_split(Split::Seen).count().to_string()),
        fact("unseen tasks", task_set.of_split(Split::Unseen).count().to_string()),
        fact("expert demonstrations", format!("{}, {} failed", recordings.episodes, recordings.failed)),
        fact("episodes in the dataset", dataset.episodes.to_string()),
    ];
    for model in &spec.models {
        let name = model_name(model.variant, model.train_tasks, model.seeds[0]);
        let parameters = model::inspect(context.dir.model(&name).path())?.parameters;
        facts.push(fact(&format!("parameters of {}", model.variant.name()), parameters.to_string()));
    }
    Ok(facts)
}
