//! Results in numbers: over training seeds, of each seed, and the paper's.

use minijinja::Value;
use serde::Serialize;

use crate::report::PaperValue;
use crate::report::chart::color_of;
use crate::report::chart::scale::{percent, thousands};
use crate::report::section::{Contents, Section};
use crate::report::suite_names::SuiteNames;
use crate::report::summary::{Aggregate, SuiteResult};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "results.html.j2",
    template: include_str!("results.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Results<'a> {
    rows: Vec<Row>,
    seeds: Vec<SeedRow>,
    paper: &'a [PaperValue],
}

fn fill<'a>(of: &Contents<'a>) -> Results<'a> {
    let report = of.report;
    Results {
        rows: rows(&report.aggregates, &of.names),
        seeds: report.results.iter().map(|row| seed_row(row, &of.names)).collect(),
        paper: &report.paper,
    }
}

/// A line of the table over training seeds.
#[derive(Serialize)]
struct Row {
    suite: String,
    variant: String,
    tasks: Option<String>,
    decoder: Option<String>,
    color: usize,
    mean: String,
    /// Share of a task's goals that hold in the end.
    goals_met: Option<String>,
    low: String,
    high: String,
    /// Lowest and highest of the seeds, and the interval of their mean, when there are several.
    spread: Option<Spread>,
    seeds: u64,
    episodes: String,
    paper: Option<String>,
    starts_suite: bool,
}

/// How much training seeds differ.
#[derive(Serialize)]
struct Spread {
    lowest: String,
    highest: String,
    low: String,
    high: String,
}

impl Spread {
    fn of(row: &Aggregate) -> Option<Self> {
        let (low, high) = row.seeds_low.zip(row.seeds_high)?;
        let (lowest, highest) = (percent(row.lowest_success_rate), percent(row.highest_success_rate));
        Some(Self { lowest, highest, low: percent(low), high: percent(high) })
    }
}

/// A line of the table of training seeds.
#[derive(Serialize)]
struct SeedRow {
    suite: String,
    variant: String,
    seed: i64,
    successes: String,
    episodes: String,
    rate: String,
    low: String,
    high: String,
    calls: String,
    sim_secs: String,
}

fn rows(aggregates: &[Aggregate], names: &SuiteNames) -> Vec<Row> {
    let starts_suite = |at: usize| at == 0 || !names.are_one(&aggregates[at - 1], &aggregates[at]);
    let row = |(at, row): (usize, &Aggregate)| Row {
        suite: names.of_row(row),
        variant: row.actor.model(),
        tasks: row.actor.train_tasks.map(|tasks| thousands(tasks.max(0) as u64)),
        decoder: row.actor.decoder.clone(),
        color: color_of(&row.actor),
        mean: percent(row.mean_success_rate),
        goals_met: row.goals_met.map(percent),
        low: percent(row.wilson_low),
        high: percent(row.wilson_high),
        spread: Spread::of(row),
        seeds: row.seeds,
        episodes: thousands(row.episodes),
        paper: row.paper_success_rate.map(percent),
        starts_suite: starts_suite(at),
    };
    aggregates.iter().enumerate().map(row).collect()
}

fn seed_row(row: &SuiteResult, names: &SuiteNames) -> SeedRow {
    SeedRow {
        suite: names.tell(&row.suite, &row.actor.experiment),
        variant: row.actor.words(),
        seed: row.seed,
        successes: thousands(row.successes),
        episodes: thousands(row.episodes),
        rate: percent(row.success_rate),
        low: percent(row.wilson_low),
        high: percent(row.wilson_high),
        calls: format!("{:.1}", row.mean_calls),
        sim_secs: format!("{:.1}", row.mean_sim_secs),
    }
}
