//! Success at a glance: a table for each experiment, models down, suites across.

use crate::report::actor::Actor;
use crate::report::chart::distinct;
use crate::report::markdown::{Column, none, table};
use crate::report::order;
use crate::report::suite_names::SuiteNames;
use crate::report::summary::{Aggregate, Report};

/// Of each experiment with more than one suite. Beside ours stands the paper's figure.
pub(super) fn glances(report: &Report, names: &SuiteNames) -> Vec<String> {
    let experiments = distinct(report.aggregates.iter().map(|row| &row.actor.experiment));
    let of_experiment = |name: &String| {
        let rows = report.aggregates.iter().filter(|row| row.actor.experiment == *name);
        glance(&rows.collect::<Vec<_>>(), names)
    };
    experiments.iter().filter_map(of_experiment).collect()
}

fn glance(rows: &[&Aggregate], names: &SuiteNames) -> Option<String> {
    let suites = distinct(rows.iter().map(|row| names.of_row(row)).collect::<Vec<_>>().iter());
    let mut actors: Vec<&Actor> = rows.iter().map(|row| &row.actor).collect();
    actors.sort_by_cached_key(|actor| order::actor(actor));
    // Of a model's decoders the one that stands for it comes first.
    actors.dedup_by(|later, actor| (later.model(), later.train_tasks) == (actor.model(), actor.train_tasks));
    let cells = |actor: &&Actor| {
        let of_suite = |suite: &String| rows.iter().find(|row| names.of_row(row) == *suite && row.actor == **actor);
        let tasks = actor.train_tasks.map_or_else(none, |tasks| tasks.to_string());
        let rates = suites.iter().map(|suite| of_suite(suite).map_or_else(none, |row| rate(row)));
        [actor.model(), tasks].into_iter().chain(rates).collect()
    };
    let columns = suites.iter().map(|suite| (suite.as_str(), true));
    let columns: Vec<Column<'_>> = [("model", false), ("tasks", true)].into_iter().chain(columns).collect();
    (suites.len() > 1).then(|| table(&columns, actors.iter().map(cells).collect()))
}

fn rate(row: &Aggregate) -> String {
    let papers = row.paper_success_rate.map(|rate| format!(" ({rate})")).unwrap_or_default();
    format!("{:.3}{papers}", row.mean_success_rate)
}
