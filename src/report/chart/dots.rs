//! Success by suite and variant: a dot for the mean, a bar for its interval, a tick for each training seed, a diamond
//! for the paper.

use serde::Serialize;

use crate::report::chart::scale::{percent, place, short};
use crate::report::chart::{Tick, color_of};
use crate::report::suite_names::SuiteNames;
use crate::report::summary::{Aggregate, SuiteResult};

/// Where the axis may begin, and the distance of its marks then.
const STARTS: [(f64, f64); 5] = [(0.9, 0.02), (0.75, 0.05), (0.5, 0.1), (0.25, 0.25), (0.0, 0.25)];

/// The whole plot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct DotPlot {
    pub(in crate::report) ticks: Vec<Tick>,
    pub(in crate::report) suites: Vec<DotSuite>,
    /// Where the axis begins, in percent, when not at 0.
    pub(in crate::report) cut_at: Option<String>,
    pub(in crate::report) has_paper: bool,
    pub(in crate::report) has_seeds: bool,
}

/// The rows of one suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct DotSuite {
    pub(in crate::report) title: String,
    /// What it asks for, in words.
    pub(in crate::report) facts: String,
    pub(in crate::report) rows: Vec<DotRow>,
}

/// One variant in one suite; places in percent of the width.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct DotRow {
    pub(in crate::report) name: String,
    pub(in crate::report) color: usize,
    pub(in crate::report) hollow: bool,
    pub(in crate::report) mean_at: String,
    pub(in crate::report) low_at: String,
    pub(in crate::report) high_at: String,
    pub(in crate::report) seeds_at: Vec<String>,
    pub(in crate::report) paper_at: Option<String>,
    pub(in crate::report) mean: String,
    pub(in crate::report) low: String,
    pub(in crate::report) high: String,
    pub(in crate::report) paper: Option<String>,
    pub(in crate::report) episodes: u64,
    pub(in crate::report) successes: u64,
}

/// Nothing without results.
pub(in crate::report) fn plot(
    aggregates: &[Aggregate],
    results: &[SuiteResult],
    names: &SuiteNames,
) -> Option<DotPlot> {
    let lowest = |row: &Aggregate| {
        let paper = row.paper_success_rate.unwrap_or(1.0);
        row.wilson_low.min(row.lowest_success_rate).min(paper)
    };
    let lowest = aggregates.iter().map(lowest).reduce(f64::min)?;
    let (start, step) = STARTS.into_iter().find(|(start, _)| *start <= lowest).unwrap_or((0.0, 0.25));
    let at = |value: f64| place(value, start, 1.0);
    let row = |row: &Aggregate| {
        let is_same = |seed: &&SuiteResult| seed.actor == row.actor && seed.suite == row.suite;
        let seeds = results.iter().filter(is_same).map(|seed| at(seed.success_rate));
        DotRow {
            name: row.actor.words(),
            color: color_of(&row.actor),
            hollow: row.actor.parts.has_papers_encoder(),
            mean_at: at(row.mean_success_rate),
            low_at: at(row.wilson_low),
            high_at: at(row.wilson_high),
            seeds_at: if row.seeds > 1 { seeds.collect() } else { Vec::new() },
            paper_at: row.paper_success_rate.map(at),
            mean: percent(row.mean_success_rate),
            low: percent(row.wilson_low),
            high: percent(row.wilson_high),
            paper: row.paper_success_rate.map(percent),
            episodes: row.episodes,
            successes: row.successes,
        }
    };
    let suite = |rows: &[Aggregate]| DotSuite {
        title: names.of_row(&rows[0]),
        facts: rows[0].facts.words(),
        rows: rows.iter().map(row).collect(),
    };
    let n_steps = ((1.0 - start) / step).round() as usize;
    let tick = |mark: usize| {
        let value = start + mark as f64 * step;
        Tick { at: at(value), label: short(100.0 * value) }
    };
    Some(DotPlot {
        ticks: (0..=n_steps).map(tick).collect(),
        suites: aggregates.chunk_by(|a, b| names.are_one(a, b)).map(suite).collect(),
        cut_at: (start > 0.0).then(|| short(100.0 * start)),
        has_paper: aggregates.iter().any(|row| row.paper_success_rate.is_some()),
        has_seeds: aggregates.iter().any(|row| row.seeds > 1),
    })
}
