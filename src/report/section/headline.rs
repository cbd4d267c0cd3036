//! The first model's suites: it is the one the run is about.

use minijinja::Value;
use serde::Serialize;

use crate::report::actor::Actor;
use crate::report::chart::scale::{many, percent, points};
use crate::report::order;
use crate::report::section::{Contents, Section};
use crate::report::suite_names::SuiteNames;
use crate::report::summary::Aggregate;

/// The section.
pub(super) const SECTION: Section = Section {
    name: "headline.html.j2",
    template: include_str!("headline.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

/// Most headline figures.
const N_TILES: usize = 4;

#[derive(Serialize)]
struct Headline {
    tiles: Vec<Tile>,
}

/// A headline figure.
#[derive(Serialize)]
struct Tile {
    suite: String,
    /// What it asks for, in words.
    facts: String,
    variant: String,
    value: String,
    low: String,
    high: String,
    rollouts: String,
    paper: Option<String>,
    /// Percentage points above the paper's, with sign.
    lead: Option<String>,
}

fn fill(of: &Contents<'_>) -> Headline {
    Headline { tiles: tiles(&of.leading, &of.names) }
}

fn tiles(aggregates: &[Aggregate], names: &SuiteNames) -> Vec<Tile> {
    let rank = |row: &&Aggregate| {
        let Actor { variant, parts, .. } = &row.actor;
        (order::model(variant, parts, row.actor.is_oracle()), !row.actor.is_demonstrated())
    };
    let lead = aggregates.iter().min_by_key(rank).map(|row| row.actor.model());
    let own = aggregates.iter().filter(|row| Some(row.actor.model()) == lead);
    let tile = |row: &Aggregate| Tile {
        suite: names.of_row(row),
        facts: row.facts.words(),
        variant: row.actor.words(),
        value: percent(row.mean_success_rate),
        low: percent(row.wilson_low),
        high: percent(row.wilson_high),
        rollouts: many(row.episodes, "rollout"),
        paper: row.paper_success_rate.map(percent),
        lead: row.paper_success_rate.map(|paper| points(row.mean_success_rate - paper)),
    };
    own.take(N_TILES).map(tile).collect()
}
