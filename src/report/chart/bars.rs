//! Causes of failure: for each suite and variant a bar whose parts are the shares of all rollouts that failed so.

use serde::Serialize;

use crate::report::chart::scale::{percent, place, short};
use crate::report::chart::{Key, N_COLORS, Tick};
use crate::report::suite_names::SuiteNames;
use crate::report::summary::Aggregate;
use crate::trace::Cause;
use crate::words::counted;

/// Where the axis may end.
const ENDS: [f64; 9] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.25, 0.5, 0.75, 1.0];
const N_STEPS: usize = 5;

/// The whole plot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct BarPlot {
    pub(in crate::report) ticks: Vec<Tick>,
    pub(in crate::report) keys: Vec<Key>,
    pub(in crate::report) suites: Vec<BarSuite>,
}

/// The rows of one suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct BarSuite {
    pub(in crate::report) title: String,
    pub(in crate::report) rows: Vec<BarRow>,
}

/// One variant in one suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct BarRow {
    pub(in crate::report) name: String,
    /// Failed rollouts in percent of all.
    pub(in crate::report) failed: String,
    /// Share of a task's goals that hold in the end, on average, in percent.
    pub(in crate::report) goals_met: Option<String>,
    pub(in crate::report) parts: Vec<BarPart>,
}

/// One cause; places in percent of the width.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct BarPart {
    pub(in crate::report) color: usize,
    pub(in crate::report) at: String,
    pub(in crate::report) width: String,
    pub(in crate::report) tip: String,
}

/// Nothing without failures.
pub(in crate::report) fn plot(aggregates: &[Aggregate], names: &SuiteNames) -> Option<BarPlot> {
    let share = |row: &Aggregate| (row.episodes - row.successes) as f64 / row.episodes.max(1) as f64;
    let highest = aggregates.iter().map(share).reduce(f64::max).filter(|&highest| highest > 0.0)?;
    let end = ENDS.into_iter().find(|&end| end >= highest).unwrap_or(1.0);
    let causes = causes(aggregates);
    let row = |row: &Aggregate| BarRow {
        name: row.actor.words(),
        failed: percent(share(row)),
        goals_met: row.goals_met.map(percent),
        parts: parts(row, &causes, end),
    };
    let suite = |rows: &[Aggregate]| BarSuite { title: names.of_row(&rows[0]), rows: rows.iter().map(row).collect() };
    let tick = |mark: usize| {
        let value = end * mark as f64 / N_STEPS as f64;
        Tick { at: place(value, 0.0, end), label: short(100.0 * value) }
    };
    Some(BarPlot {
        ticks: (0..=N_STEPS).map(tick).collect(),
        keys: causes
            .iter()
            .map(|cause| Key { label: cause.replace('_', " "), color: color(cause), hollow: false })
            .collect(),
        suites: aggregates.chunk_by(|a, b| names.are_one(a, b)).map(suite).collect(),
    })
}

/// Causes that occur: known ones in their own order, so that bars of two reports can be compared, others behind.
fn causes(aggregates: &[Aggregate]) -> Vec<String> {
    let mut causes: Vec<String> = aggregates.iter().flat_map(|row| row.causes.keys().cloned()).collect();
    causes.sort_by_cached_key(|cause| (rank(cause), cause.clone()));
    causes.dedup();
    causes
}

fn rank(cause: &str) -> usize {
    Cause::ALL.iter().position(|known| known.name() == cause).unwrap_or(Cause::ALL.len())
}

fn color(cause: &str) -> usize {
    rank(cause) % N_COLORS
}

fn parts(row: &Aggregate, causes: &[String], end: f64) -> Vec<BarPart> {
    let mut before = 0;
    let mut parts = Vec::new();
    for cause in causes {
        let Some(&count) = row.causes.get(cause) else { continue };
        let share = |count: u64| count as f64 / row.episodes.max(1) as f64;
        parts.push(BarPart {
            color: color(cause),
            at: place(share(before), 0.0, end),
            width: place(share(count), 0.0, end),
            tip: format!(
                "{}: {count} of {}, {} %",
                cause.replace('_', " "),
                counted(row.episodes, "rollout"),
                percent(share(count))
            ),
        });
        before += count;
    }
    parts
}
