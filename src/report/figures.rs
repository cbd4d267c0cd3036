//! The paper's figures from our rollouts: success over the length of tasks, the number of training tasks, the strength
//! of an adversary, and the objects on a table.
//!
//! # Input and output
//!
//! Suites are known by their names: `sorting_unseen_<objects>`, `stacking_unseen`, `stacking_seen`,
//! `stacking_topology`, `stacking_adversary` (25 %), `stacking_adversary_p<percent>`, `cleanup_unseen_<bowls>_<forks>`.
//! Of several decoders of a model the one that stands for it is shown ([`order::DECODERS`]).
//!
//! # Source
//!
//! The paper's own points are those that its text and tables give in numbers; its plots are not read off.

use schemars::JsonSchema;
use serde::Serialize;

use crate::report::chart::distinct;
use crate::report::claims::SIGHTED;
use crate::report::order;
use crate::report::summary::Aggregate;

/// Success over some quantity, ours and the paper's.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Figure {
    /// Its name in files.
    pub id: String,
    /// Its name for people.
    pub title: String,
    /// What stands on the horizontal axis.
    pub x_label: String,
    /// One for each variant.
    pub series: Vec<Series>,
    /// Where the paper shows it, and what it says.
    pub source: String,
}

/// The points of one variant.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Series {
    /// The variant.
    pub variant: String,
    /// Ours, by rising quantity.
    pub ours: Vec<Point>,
    /// The paper's; empty where it gives no number.
    pub paper: Vec<PaperPoint>,
}

/// A share of successes.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Point {
    /// The quantity.
    pub x: i64,
    /// Mean over training seeds.
    pub success_rate: f64,
    /// Lower end of its interval.
    pub wilson_low: f64,
    /// Upper end of its interval.
    pub wilson_high: f64,
    /// How many training seeds.
    pub seeds: u64,
    /// How many rollouts.
    pub episodes: u64,
}

/// A share of successes of the paper.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PaperPoint {
    /// The quantity.
    pub x: i64,
    /// The share.
    pub success_rate: f64,
}

/// Success over two quantities.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Grid {
    /// The variant.
    pub variant: String,
    /// One for each cell that was measured, by rows.
    pub cells: Vec<GridCell>,
}

/// One cell.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct GridCell {
    /// Bowls on the table.
    pub bowls: i64,
    /// Forks on the table.
    pub forks: i64,
    /// Mean over training seeds.
    pub success_rate: f64,
    /// How many rollouts.
    pub episodes: u64,
}

/// How a figure is made.
struct Definition {
    id: &'static str,
    title: &'static str,
    x_label: &'static str,
    source: &'static str,
    /// The quantity of a row; `None` where the row is not in the figure.
    x: fn(&Aggregate) -> Option<i64>,
    /// With fewer quantities there is nothing to see.
    least_positions: usize,
    paper: &'static [(&'static str, i64, f64)],
}

/// The figure of models that see, which is left out where there are none.
const PICTURES: &str = "stacking_pictures";

const DEFINITIONS: [Definition; 7] = [
    Definition {
        id: "sorting_length",
        title: "Object Sorting: length",
        x_label: "objects on the table",
        source: "Experiment 1: NTP over 90 % from 4 to 40 objects; flat models from around 40 % to around 25 %",
        x: sorting_length,
        least_positions: 2,
        paper: &[("ntp", 4, 0.90), ("ntp", 40, 0.90), ("flat", 4, 0.40), ("flat", 40, 0.25)],
    },
    Definition {
        id: "stacking_unseen",
        title: "Block Stacking: unseen end configurations",
        x_label: "training tasks",
        source: "Experiment 2 and table \u{201c}Adversarial Dynamics\u{201d}, no failure: 0.863 and 0.884 with 1000 tasks",
        x: stacking_unseen,
        least_positions: 2,
        paper: &[("ntp", 1000, 0.863), ("ntp_gru", 1000, 0.884)],
    },
    Definition {
        id: PICTURES,
        title: "Block Stacking: from pictures, unseen end configurations",
        x_label: "training tasks",
        source: "Experiment 4: full state above end to end above the detector; the text gives no number",
        x: stacking_pictures,
        least_positions: 2,
        paper: &[],
    },
    Definition {
        id: "stacking_seen",
        title: "Block Stacking: seen end configurations",
        x_label: "training tasks",
        source: "Experiment 2: all but Flat around 85 %",
        x: stacking_seen,
        least_positions: 2,
        paper: &[("ntp", 1000, 0.85), ("ntp_gru", 1000, 0.85), ("ntp_no_scope", 1000, 0.85), ("flat_gru", 1000, 0.85)],
    },
    Definition {
        id: "stacking_topology",
        title: "Block Stacking: towers in another order",
        x_label: "training tasks",
        source: "Experiment 2, task topology; the text gives no number",
        x: stacking_topology,
        least_positions: 2,
        paper: &[],
    },
    Definition {
        id: "stacking_adversary",
        title: "Block Stacking: adversary",
        x_label: "chance of a push after each placement, %",
        source: "Table \u{201c}Adversarial Dynamics\u{201d}: 0.863 to 0.663, with a GRU 0.884 to 0.422",
        x: adversary,
        least_positions: 2,
        paper: &[("ntp", 0, 0.863), ("ntp", 25, 0.663), ("ntp_gru", 0, 0.884), ("ntp_gru", 25, 0.422)],
    },
    Definition {
        id: "stacking_adversary_force",
        title: "Block Stacking: force of the adversary",
        x_label: "impulse of a push at 25 %, mN\u{202f}s",
        source: "Ours; the paper gives no force",
        x: force,
        least_positions: 3,
        paper: &[],
    },
];

/// Full state, and the models that see.
fn stacking_pictures(row: &Aggregate) -> Option<i64> {
    let is_shown = sees(row) || STATES.contains(&row.actor.variant.as_str());
    row.actor.train_tasks.filter(|_| is_shown && row.suite == "stacking_unseen")
}

/// What models that see are set beside.
const STATES: [&str; 2] = ["ntp", "ntp_paper"];

fn sees(row: &Aggregate) -> bool {
    row.actor.variant.starts_with(SIGHTED)
}

fn sorting_length(row: &Aggregate) -> Option<i64> {
    row.suite.strip_prefix("sorting_unseen_")?.parse().ok()
}

fn stacking_unseen(row: &Aggregate) -> Option<i64> {
    row.actor.train_tasks.filter(|_| row.suite == "stacking_unseen" && !sees(row))
}

fn stacking_seen(row: &Aggregate) -> Option<i64> {
    row.actor.train_tasks.filter(|_| row.suite == "stacking_seen")
}

fn stacking_topology(row: &Aggregate) -> Option<i64> {
    row.actor.train_tasks.filter(|_| row.suite == "stacking_topology")
}

/// Unseen tasks without an adversary count as 0 %.
fn adversary(row: &Aggregate) -> Option<i64> {
    match row.suite.as_str() {
        "stacking_unseen" => Some(0),
        "stacking_adversary" => Some(25),
        suite => suite.strip_prefix("stacking_adversary_p")?.parse().ok(),
    }
}

/// The default impulse is 60 mN s.
fn force(row: &Aggregate) -> Option<i64> {
    match row.suite.as_str() {
        "stacking_unseen" => Some(0),
        "stacking_adversary" => Some(60),
        suite => suite.strip_prefix("stacking_adversary_")?.strip_suffix("_mns")?.parse().ok(),
    }
}

/// Those figures that our rollouts have enough points of.
pub(super) fn figures(aggregates: &[Aggregate]) -> Vec<Figure> {
    let figures = DEFINITIONS.iter().map(|definition| (definition, figure(definition, aggregates)));
    let sees = |series: &Series| series.variant.starts_with(SIGHTED);
    let figures = figures.filter(|(_, figure)| figure.id != PICTURES || figure.series.iter().any(sees));
    let shown = figures.filter(|(definition, figure)| n_positions(figure) >= definition.least_positions);
    shown.map(|(_, figure)| figure).collect()
}

fn n_positions(figure: &Figure) -> usize {
    let mut positions: Vec<i64> = figure.series.iter().flat_map(|series| &series.ours).map(|point| point.x).collect();
    positions.sort_unstable();
    positions.dedup();
    positions.len()
}

fn figure(definition: &Definition, aggregates: &[Aggregate]) -> Figure {
    let rows: Vec<(i64, &Aggregate)> = aggregates
        .iter()
        .filter(|row| row.actor.is_the_papers())
        .filter_map(|row| Some(((definition.x)(row)?, row)))
        .collect();
    let mut variants = distinct(rows.iter().map(|(_, row)| &row.actor.variant));
    variants.retain(|variant| variant != "oracle");
    variants.sort_by_cached_key(|variant| order::variant(variant));
    Figure {
        id: definition.id.to_owned(),
        title: definition.title.to_owned(),
        x_label: definition.x_label.to_owned(),
        series: variants.into_iter().map(|variant| series(definition, &rows, variant)).collect(),
        source: definition.source.to_owned(),
    }
}

fn series(definition: &Definition, rows: &[(i64, &Aggregate)], variant: String) -> Series {
    let own: Vec<&(i64, &Aggregate)> = rows.iter().filter(|(_, row)| row.actor.variant == variant).collect();
    let mut positions: Vec<i64> = own.iter().map(|(x, _)| *x).collect();
    positions.sort_unstable();
    positions.dedup();
    let point = |&x: &i64| {
        let rows = own.iter().filter(|(own_x, _)| *own_x == x).map(|(_, row)| *row);
        let row = rows.min_by_key(|row| order::actor(&row.actor))?;
        Some(Point {
            x,
            success_rate: row.mean_success_rate,
            wilson_low: row.wilson_low,
            wilson_high: row.wilson_high,
            seeds: row.seeds,
            episodes: row.episodes,
        })
    };
    let base = variant.strip_suffix("_paper").unwrap_or(&variant);
    let paper = definition.paper.iter().filter(|(paper_variant, ..)| *paper_variant == base);
    Series {
        ours: positions.iter().filter_map(point).collect(),
        paper: paper.map(|&(_, x, success_rate)| PaperPoint { x, success_rate }).collect(),
        variant,
    }
}

/// Table Clean-up by bowls and forks, one grid a variant.
pub(super) fn grids(aggregates: &[Aggregate]) -> Vec<Grid> {
    let mut cells: Vec<(String, GridCell)> = Vec::new();
    let mut leading: Vec<&Aggregate> =
        aggregates.iter().filter(|row| row.actor.variant != "oracle" && row.actor.is_the_papers()).collect();
    leading.sort_by_cached_key(|row| order::actor(&row.actor));
    for row in leading {
        let Some((bowls, forks)) = bowls_and_forks(&row.suite) else { continue };
        let variant = &row.actor.variant;
        let is_there =
            |(other, cell): &(String, GridCell)| other == variant && (cell.bowls, cell.forks) == (bowls, forks);
        if !cells.iter().any(is_there) {
            let cell = GridCell { bowls, forks, success_rate: row.mean_success_rate, episodes: row.episodes };
            cells.push((variant.clone(), cell));
        }
    }
    let mut variants = distinct(cells.iter().map(|(variant, _)| variant));
    variants.sort_by_cached_key(|variant| order::variant(variant));
    let grid = |variant: String| {
        let own = cells.iter().filter(|(other, _)| *other == variant).map(|(_, cell)| cell.clone());
        let mut own: Vec<GridCell> = own.collect();
        own.sort_by_key(|cell| (cell.bowls, cell.forks));
        Grid { variant, cells: own }
    };
    variants.into_iter().map(grid).collect()
}

fn bowls_and_forks(suite: &str) -> Option<(i64, i64)> {
    let (bowls, forks) = suite.strip_prefix("cleanup_unseen_")?.split_once('_')?;
    Some((bowls.parse().ok()?, forks.parse().ok()?))
}
