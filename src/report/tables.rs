//! The page's smaller tables: the adversary and its pushes, clean-up by bowls and forks, detectors, models, costs.

use serde::Serialize;

use crate::report::chart::scale::{percent, thousands};
use crate::report::chart::{color_of, distinct};
use crate::report::detections::{DetectionError, InSight};
use crate::report::figures::{Figure, Grid, Series};
use crate::report::page::name_of;
use crate::report::summary::{Aggregate, ModelSummary, StageCost, model_name};

/// Success without an adversary and with one that pushes after a quarter of the placements.
#[derive(Serialize)]
pub(super) struct AdversaryRow {
    variant: String,
    color: usize,
    without: String,
    with: String,
    loss: String,
    paper: Option<(String, String, String)>,
}

/// The paper's table "Adversarial Dynamics" from the figure of that name.
pub(super) fn adversary(figures: &[Figure]) -> Vec<AdversaryRow> {
    let figure = figures.iter().find(|figure| figure.id == "stacking_adversary");
    let series = figure.map(|figure| figure.series.as_slice()).unwrap_or_default();
    series.iter().filter_map(adversary_row).collect()
}

fn adversary_row(series: &Series) -> Option<AdversaryRow> {
    let ours = |x| series.ours.iter().find(|point| point.x == x).map(|point| point.success_rate);
    let paper = |x| series.paper.iter().find(|point| point.x == x).map(|point| point.success_rate);
    let (without, with) = (ours(0)?, ours(25)?);
    let told = |without: f64, with: f64| (percent(without), percent(with), loss(without, with));
    let (ours_without, ours_with, ours_loss) = told(without, with);
    Some(AdversaryRow {
        variant: series.variant.clone(),
        color: color_of(&series.variant),
        without: ours_without,
        with: ours_with,
        loss: ours_loss,
        paper: paper(0).zip(paper(25)).map(|(without, with)| told(without, with)),
    })
}

/// What an adversary did to one actor's rollouts in a suite.
#[derive(Serialize)]
pub(super) struct PushRow {
    suite: String,
    variant: String,
    color: usize,
    rollouts: String,
    success: String,
    pushes: String,
    pushes_a_rollout: String,
    toppled: String,
    toppled_a_push: String,
}

/// One row for each actor and suite with an adversary.
pub(super) fn pushes(aggregates: &[Aggregate]) -> Vec<PushRow> {
    aggregates.iter().filter_map(push_row).collect()
}

fn push_row(row: &Aggregate) -> Option<PushRow> {
    let (pushes, toppled) = row.pushes.zip(row.toppled)?;
    let share = |count: u64, of: u64| format!("{:.2}", count as f64 / of.max(1) as f64);
    Some(PushRow {
        suite: row.suite.clone(),
        variant: name_of(&row.actor),
        color: color_of(&row.actor.variant),
        rollouts: thousands(row.episodes),
        success: percent(row.mean_success_rate),
        pushes: thousands(pushes),
        pushes_a_rollout: share(pushes, row.episodes),
        toppled: thousands(toppled),
        toppled_a_push: share(toppled, pushes),
    })
}

/// A loss in percentage points, with a true minus sign.
fn loss(before: f64, after: f64) -> String {
    let points = 100.0 * (after - before);
    let sign = if points < 0.0 { "\u{2212}" } else { "+" };
    format!("{sign}{:.1}", points.abs())
}

/// Success by bowls (rows) and forks (columns).
#[derive(Serialize)]
pub(super) struct HeatGrid {
    variant: String,
    forks: Vec<i64>,
    rows: Vec<HeatRow>,
}

#[derive(Serialize)]
struct HeatRow {
    bowls: i64,
    cells: Vec<Option<HeatCell>>,
}

#[derive(Serialize)]
struct HeatCell {
    value: String,
    /// Percent of the colour.
    shade: u64,
    episodes: u64,
}

/// One table a variant.
pub(super) fn heat(grids: &[Grid]) -> Vec<HeatGrid> {
    grids.iter().map(heat_grid).collect()
}

fn heat_grid(grid: &Grid) -> HeatGrid {
    let sorted = |mut values: Vec<i64>| {
        values.sort_unstable();
        values.dedup();
        values
    };
    let forks = sorted(grid.cells.iter().map(|cell| cell.forks).collect());
    let bowls = sorted(grid.cells.iter().map(|cell| cell.bowls).collect());
    let cell = |bowls: i64, forks: i64| {
        let cell = grid.cells.iter().find(|cell| (cell.bowls, cell.forks) == (bowls, forks))?;
        let shade = (100.0 * cell.success_rate).round() as u64;
        Some(HeatCell { value: percent(cell.success_rate), shade, episodes: cell.episodes })
    };
    let row = |bowls: i64| HeatRow { bowls, cells: forks.iter().map(|&forks| cell(bowls, forks)).collect() };
    HeatGrid { variant: grid.variant.clone(), rows: bowls.into_iter().map(row).collect(), forks: forks.clone() }
}

/// The errors of a detector.
#[derive(Serialize)]
pub(super) struct DetectionRow {
    suite: String,
    variant: String,
    color: usize,
    tasks: String,
    seeds: u64,
    in_sight: &'static str,
    /// Whether it is of one part of the row above that tells of all.
    is_part: bool,
    detections: String,
    median: String,
    mean_absolute: [String; 3],
    deviation: String,
    percentiles: [String; 2],
    over: String,
}

/// One row a model, suite and how much is in sight.
pub(super) fn detections(errors: &[DetectionError]) -> Vec<DetectionRow> {
    let cm = |value: f64| format!("{value:.2}");
    let row = |error: &DetectionError| DetectionRow {
        suite: error.suite.clone(),
        variant: error.variant.clone(),
        color: color_of(&error.variant),
        tasks: thousands(error.train_tasks.max(0) as u64),
        seeds: error.seeds,
        in_sight: error.in_sight.words(),
        is_part: error.in_sight != InSight::All,
        detections: thousands(error.detections),
        median: cm(error.median_cm),
        mean_absolute: error.mean_absolute_cm.map(cm),
        deviation: cm(error.deviation_cm),
        percentiles: [error.percentile_95_cm, error.percentile_99_cm].map(cm),
        over: percent(error.over_2_cm),
    };
    errors.iter().map(row).collect()
}

/// The models of one variant and number of tasks.
#[derive(Serialize)]
pub(super) struct ModelRow {
    pub(super) experiment: String,
    pub(super) variant: String,
    color: usize,
    pub(super) tasks: String,
    pub(super) seeds: usize,
    pub(super) parameters: String,
    /// CPU-seconds of a training, on average.
    pub(super) cpu_secs: Option<String>,
}

/// One row for all seeds of a model. They stand together, as pipeline files list them.
pub(super) fn models(models: &[ModelSummary]) -> Vec<ModelRow> {
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
        color: color_of(&seeds[0].variant),
        tasks: thousands(seeds[0].train_tasks.max(0) as u64),
        seeds: seeds.len(),
        parameters: thousands(seeds[0].parameters),
        cpu_secs: (!known.is_empty()).then(|| format!("{mean:.0}")),
    }
}

/// What an experiment took.
#[derive(Serialize)]
pub(super) struct CostRow {
    experiment: String,
    /// CPU-seconds by stage.
    stages: Vec<String>,
    cpu_mins: String,
    wall_mins: String,
}

/// The stages that cost anything, and one row an experiment.
pub(super) fn costs(costs: &[StageCost]) -> (Vec<String>, Vec<CostRow>) {
    let stages = distinct(costs.iter().map(|cost| &cost.stage));
    let row = |own: &[StageCost]| {
        let of = |stage: &String| own.iter().find(|cost| cost.stage == *stage).map_or(0.0, |cost| cost.cpu_secs);
        let cpu_secs: f64 = own.iter().map(|cost| cost.cpu_secs).sum();
        let wall_secs: f64 = own.iter().map(|cost| cost.wall_secs).sum();
        CostRow {
            experiment: own[0].experiment.clone(),
            stages: stages.iter().map(|stage| format!("{:.0}", of(stage))).collect(),
            cpu_mins: format!("{:.1}", cpu_secs / 60.0),
            wall_mins: format!("{:.1}", wall_secs / 60.0),
        }
    };
    let rows = costs.chunk_by(|a, b| a.experiment == b.experiment).map(row).collect();
    (stages, rows)
}
