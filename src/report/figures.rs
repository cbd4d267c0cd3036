//! The paper's figures from our rollouts: success over the length of tasks, the number of training tasks, the strength
//! of an adversary, and the objects on a table. A figure is an entry of [`definitions`] and nothing else.
//!
//! # Invariants
//!
//! A figure is of one experiment. What a row is and where it stands follows from its facts. Of several decoders of a
//! model the one that stands for it is shown ([`order::DECODERS`]). A point of the paper stands beside one of ours that
//! meets its conditions ([`crate::report::paper`]), and nowhere else.

mod definitions;

pub(super) use definitions::USUAL_PUSH;

use schemars::JsonSchema;
use serde::Serialize;

use crate::report::actor::{Actor, ModelParts};
use crate::report::facts::{Ask, TABLE_CLEANUP};
use crate::report::figures::definitions::{DEFINITIONS, Definition, asks};
use crate::report::order;
use crate::report::summary::Aggregate;

/// Success over some quantity, ours and the paper's.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Figure {
    /// Of which experiment.
    pub experiment: String,
    /// Its name in files.
    pub id: String,
    /// Its name for people.
    pub title: String,
    /// What stands on the horizontal axis.
    pub x_label: String,
    /// One for each variant.
    pub series: Vec<Series>,
    /// Where the paper shows it, and what it says where points of it are beside ours.
    pub source: String,
}

/// The points of one variant.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Series {
    /// The variant.
    pub variant: String,
    /// Its parts.
    #[serde(flatten)]
    pub parts: ModelParts,
    /// Whether it was trained otherwise on purpose: the variant's name tells how.
    #[serde(skip)]
    pub is_tagged: bool,
    /// Ours, by rising quantity.
    pub ours: Vec<Point>,
    /// The paper's, beside those of ours that meet its conditions.
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
    /// Of which experiment.
    pub experiment: String,
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

/// Those figures of each experiment that its rollouts have enough points of.
pub(super) fn figures(aggregates: &[Aggregate]) -> Vec<Figure> {
    let (papers, all) = (experiments(aggregates), experiments_of(aggregates, super::actor::Actor::is_demonstrated));
    let of_definition = |definition: &'static Definition| {
        let experiments = if definition.shows_tagged { &all } else { &papers };
        let figures = experiments.iter().map(|rows| figure(definition, rows));
        figures.filter(|figure| (definition.is_worth_it)(figure)).collect::<Vec<_>>()
    };
    DEFINITIONS.iter().flat_map(of_definition).collect()
}

/// The rows of each experiment that stand for a model of the paper, in order of models: of each the most training tasks
/// and the first decoder come first.
pub(super) fn experiments(aggregates: &[Aggregate]) -> Vec<Vec<&Aggregate>> {
    experiments_of(aggregates, Actor::is_the_papers)
}

/// The same of the models that are chosen.
fn experiments_of(aggregates: &[Aggregate], is_chosen: fn(&Actor) -> bool) -> Vec<Vec<&Aggregate>> {
    let stands = |row: &&Aggregate| is_chosen(&row.actor) && !row.actor.is_oracle();
    let mut rows: Vec<&Aggregate> = aggregates.iter().filter(stands).collect();
    rows.sort_by_cached_key(|row| (order::actor(&row.actor), order::suite(&row.suite, &row.facts)));
    rows.chunk_by(|a, b| a.actor.experiment == b.actor.experiment).map(<[_]>::to_vec).collect()
}

fn figure(definition: &Definition, rows: &[&Aggregate]) -> Figure {
    let placed = |row: &&'_ Aggregate| (definition.x)(row).is_some();
    let rows: Vec<&Aggregate> = rows.iter().copied().filter(placed).collect();
    let models = rows.chunk_by(|a, b| (&a.actor.variant, &a.actor.tag) == (&b.actor.variant, &b.actor.tag));
    let series: Vec<Series> = models.map(|rows| series(definition, rows)).collect();
    let is_beside = series.iter().any(|series| !series.paper.is_empty());
    Figure {
        experiment: rows.first().map(|row| row.actor.experiment.clone()).unwrap_or_default(),
        id: definition.id.to_owned(),
        title: definition.title.to_owned(),
        x_label: definition.x_label.to_owned(),
        series,
        source: match definition {
            Definition { source, says, .. } if is_beside => format!("{source}: {says}"),
            Definition { source, .. } => (*source).to_owned(),
        },
    }
}

/// The points of one variant: at each quantity the first row.
fn series(definition: &Definition, rows: &[&Aggregate]) -> Series {
    let most_tasks = rows.iter().map(|row| row.actor.train_tasks).max();
    let is_in = |row: &&&Aggregate| definition.is_over_tasks || Some(row.actor.train_tasks) == most_tasks;
    let placed = rows.iter().filter(is_in).filter_map(|row| Some(((definition.x)(row)?, *row)));
    let mut placed: Vec<(i64, &Aggregate)> = placed.collect();
    placed.sort_by_key(|(x, _)| *x);
    placed.dedup_by_key(|(x, _)| *x);
    let point = |(x, row): &(i64, &Aggregate)| Point {
        x: *x,
        success_rate: row.mean_success_rate,
        wilson_low: row.wilson_low,
        wilson_high: row.wilson_high,
        seeds: row.seeds,
        episodes: row.episodes,
    };
    let paper = |(x, row): &(i64, &Aggregate)| Some(PaperPoint { x: *x, success_rate: row.paper_success_rate? });
    Series {
        variant: rows[0].actor.model(),
        parts: rows[0].actor.parts.clone(),
        is_tagged: rows[0].actor.tag.is_some(),
        ours: placed.iter().map(point).collect(),
        paper: placed.iter().filter_map(paper).collect(),
    }
}

/// Table Clean-up by bowls and forks, one grid a variant of an experiment.
pub(super) fn grids(aggregates: &[Aggregate]) -> Vec<Grid> {
    let of_experiment = |rows: &Vec<&Aggregate>| {
        let models = rows.chunk_by(|a, b| a.actor.variant == b.actor.variant);
        models.filter_map(grid).collect::<Vec<_>>()
    };
    experiments(aggregates).iter().flat_map(of_experiment).collect()
}

fn grid(rows: &[&Aggregate]) -> Option<Grid> {
    let mut cells: Vec<GridCell> = rows.iter().filter_map(|row| cell(row)).collect();
    cells.sort_by_key(|cell| (cell.bowls, cell.forks));
    cells.dedup_by_key(|cell| (cell.bowls, cell.forks));
    let Aggregate { actor, .. } = rows.first()?;
    let (experiment, variant) = (actor.experiment.clone(), actor.variant.clone());
    (!cells.is_empty()).then_some(Grid { experiment, variant, cells })
}

fn cell(row: &Aggregate) -> Option<GridCell> {
    let (bowls, forks) = bowls_and_forks(row)?;
    Some(GridCell { bowls, forks, success_rate: row.mean_success_rate, episodes: row.episodes })
}

/// Bowls and forks of a suite of unseen tasks that all have as many.
pub(super) fn bowls_and_forks(row: &Aggregate) -> Option<(i64, i64)> {
    let is_unseen = asks(row, TABLE_CLEANUP, Ask::Unseen);
    row.facts.bowls.zip(row.facts.instances()).filter(|_| is_unseen)
}
