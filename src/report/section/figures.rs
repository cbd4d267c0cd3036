//! The paper's figures: lines, the adversary and its pushes, clean-up by bowls and forks.

use minijinja::Value;
use serde::Serialize;

use crate::report::chart::lines::{self, LinePlot};
use crate::report::chart::scale::{percent, points, thousands};
use crate::report::chart::{Key, PANEL, Panel, color_of, once_each};
use crate::report::figures::{Figure, Grid, Series};
use crate::report::order;
use crate::report::section::{Contents, Section};
use crate::report::suite_names::SuiteNames;
use crate::report::summary::Aggregate;

/// The section.
pub(super) const SECTION: Section = Section {
    name: "figures.html.j2",
    template: include_str!("figures.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Figures {
    figures: Vec<LinePlot>,
    figure_keys: Vec<Key>,
    has_paper_encoder: bool,
    adversary: Vec<AdversaryRow>,
    pushes: Vec<PushRow>,
    heat: Vec<HeatGrid>,
    panel: Panel,
    is_study: bool,
}

fn fill(of: &Contents<'_>) -> Figures {
    let report = of.report;
    let series = || report.figures.iter().flat_map(|figure| &figure.series);
    Figures {
        figures: report.figures.iter().map(lines::plot).collect(),
        figure_keys: figure_keys(series()),
        has_paper_encoder: series().any(|series| series.parts.has_papers_encoder()),
        adversary: adversary(&report.figures),
        pushes: report.aggregates.iter().filter_map(|row| push_row(row, &of.names)).collect(),
        heat: report.grids.iter().map(heat_grid).collect(),
        panel: PANEL,
        is_study: of.is_study,
    }
}

/// A line for each colour, named by the first model that has it: one without the paper's encoder, if there is any.
fn figure_keys<'a>(series: impl Iterator<Item = &'a Series>) -> Vec<Key> {
    let mut series: Vec<&Series> = series.filter(|one| !one.is_tagged).collect();
    series.sort_by_cached_key(|one| order::model(&one.variant, &one.parts, false));
    let keys = series.into_iter().map(|one| Key { hollow: false, ..Key::of_model(&one.variant, &one.parts) });
    once_each(keys, |a, b| a.color == b.color)
}

/// Success without an adversary and with one that pushes after a quarter of the placements.
#[derive(Serialize)]
struct AdversaryRow {
    variant: String,
    color: usize,
    without: String,
    with: String,
    loss: String,
    paper: Option<(String, String, String)>,
}

/// The paper's table "Adversarial Dynamics" from the figure of that name.
fn adversary(figures: &[Figure]) -> Vec<AdversaryRow> {
    let figures = figures.iter().filter(|figure| figure.id == "stacking_adversary");
    figures.flat_map(|figure| &figure.series).filter_map(adversary_row).collect()
}

fn adversary_row(series: &Series) -> Option<AdversaryRow> {
    let ours = |x| series.ours.iter().find(|point| point.x == x).map(|point| point.success_rate);
    let paper = |x| series.paper.iter().find(|point| point.x == x).map(|point| point.success_rate);
    let (without, with) = (ours(0)?, ours(25)?);
    let told = |without: f64, with: f64| (percent(without), percent(with), points(with - without));
    let (ours_without, ours_with, ours_loss) = told(without, with);
    Some(AdversaryRow {
        variant: series.variant.clone(),
        color: series.parts.color(false),
        without: ours_without,
        with: ours_with,
        loss: ours_loss,
        paper: paper(0).zip(paper(25)).map(|(without, with)| told(without, with)),
    })
}

/// What an adversary did to one actor's rollouts in a suite.
#[derive(Serialize)]
struct PushRow {
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

fn push_row(row: &Aggregate, names: &SuiteNames) -> Option<PushRow> {
    let (pushes, toppled) = row.pushes.zip(row.toppled)?;
    let share = |count: u64, of: u64| format!("{:.2}", count as f64 / of.max(1) as f64);
    Some(PushRow {
        suite: names.of_row(row),
        variant: row.actor.words(),
        color: color_of(&row.actor),
        rollouts: thousands(row.episodes),
        success: percent(row.mean_success_rate),
        pushes: thousands(pushes),
        pushes_a_rollout: share(pushes, row.episodes),
        toppled: thousands(toppled),
        toppled_a_push: share(toppled, pushes),
    })
}

/// Success by bowls (rows) and forks (columns).
#[derive(Serialize)]
struct HeatGrid {
    experiment: String,
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
    HeatGrid {
        experiment: grid.experiment.clone(),
        variant: grid.variant.clone(),
        rows: bowls.into_iter().map(row).collect(),
        forks: forks.clone(),
    }
}
