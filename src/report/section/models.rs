//! Models, and what stages took.

use minijinja::Value;
use serde::Serialize;

use crate::report::actor::model_name;
use crate::report::chart::distinct;
use crate::report::chart::scale::thousands;
use crate::report::section::{Contents, Section};
use crate::report::summary::{ModelSummary, StageCost};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "models.html.j2",
    template: include_str!("models.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Models {
    models: Vec<ModelRow>,
    cost_stages: Vec<String>,
    costs: Vec<CostRow>,
    total_cpu_mins: String,
}

fn fill(of: &Contents<'_>) -> Models {
    let (cost_stages, costs) = costs(&of.report.costs);
    Models {
        models: models(&of.report.models),
        cost_stages,
        costs,
        total_cpu_mins: minutes(of.report.costs.iter().map(|cost| cost.cpu_secs)),
    }
}

/// The models of one variant and number of tasks.
#[derive(Serialize)]
pub(in crate::report) struct ModelRow {
    pub(in crate::report) experiment: String,
    pub(in crate::report) variant: String,
    color: usize,
    pub(in crate::report) tasks: String,
    pub(in crate::report) seeds: usize,
    pub(in crate::report) parameters: String,
    /// CPU-seconds of a training, on average.
    pub(in crate::report) cpu_secs: Option<String>,
}

/// One row for all seeds of a model. They stand together, as pipeline files list them.
pub(in crate::report) fn models(models: &[ModelSummary]) -> Vec<ModelRow> {
    let same = |a: &ModelSummary, b: &ModelSummary| {
        (&a.experiment, &a.variant, &a.tag, &a.specification, a.train_tasks)
            == (&b.experiment, &b.variant, &b.tag, &b.specification, b.train_tasks)
    };
    models.chunk_by(same).map(model_row).collect()
}

fn model_row(seeds: &[ModelSummary]) -> ModelRow {
    let known: Vec<f64> = seeds.iter().filter_map(|model| model.cpu_secs).collect();
    let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
    ModelRow {
        experiment: seeds[0].experiment.clone(),
        variant: model_name(&seeds[0].variant, &seeds[0].specification, seeds[0].tag.as_deref()),
        color: seeds[0].parts.color(false),
        tasks: thousands(seeds[0].train_tasks.max(0) as u64),
        seeds: seeds.len(),
        parameters: thousands(seeds[0].parameters),
        cpu_secs: (!known.is_empty()).then(|| format!("{mean:.0}")),
    }
}

/// What an experiment took.
#[derive(Serialize)]
struct CostRow {
    experiment: String,
    /// CPU-seconds by stage.
    stages: Vec<String>,
    cpu_mins: String,
    wall_mins: String,
}

/// The stages of which something is known, and one row an experiment; what was not measured is `-`.
fn costs(costs: &[StageCost]) -> (Vec<String>, Vec<CostRow>) {
    let stages = distinct(costs.iter().map(|cost| &cost.stage));
    let row = |own: &[StageCost]| {
        let of = |stage: &String| own.iter().find(|cost| cost.stage == *stage).and_then(|cost| cost.cpu_secs);
        CostRow {
            experiment: own[0].experiment.clone(),
            stages: stages.iter().map(|stage| of(stage).map_or_else(unknown, |secs| format!("{secs:.0}"))).collect(),
            cpu_mins: minutes(own.iter().map(|cost| cost.cpu_secs)),
            wall_mins: minutes(own.iter().map(|cost| cost.wall_secs)),
        }
    };
    let rows = costs.chunk_by(|a, b| a.experiment == b.experiment).map(row).collect();
    (stages, rows)
}

/// Seconds in all as minutes, if all are known.
fn minutes(secs: impl Iterator<Item = Option<f64>>) -> String {
    secs.sum::<Option<f64>>().map_or_else(unknown, |secs| format!("{:.1}", secs / 60.0))
}

fn unknown() -> String {
    "-".to_owned()
}
