//! `index.html`: the report as one page that needs no other file.
//!
//! Numbers become words and places here and in [`chart`](super::chart); the look is in the templates beside this file.

use minijinja::{Environment, UndefinedBehavior};
use serde::Serialize;

use crate::report::chart::bars::{self, BarPlot};
use crate::report::chart::curves::{self, CurveGrid};
use crate::report::chart::dots::{self, DotPlot};
use crate::report::chart::histogram::{self, Histograms};
use crate::report::chart::lines::{self, LinePlot};
use crate::report::chart::scale::{percent, thousands};
use crate::report::chart::{Key, PANEL, Panel, color_of, distinct, has_paper_encoder};
use crate::report::claims::{Claim, Verdict};
use crate::report::markdown;
use crate::report::metrics::{self, Curve};
use crate::report::order::{self, DECODERS};
use crate::report::summary::{Actor, Aggregate, Fact, Report, SuiteResult};
use crate::report::tables::{self, AdversaryRow, CostRow, DetectionRow, HeatGrid, ModelRow, PushRow};

/// Most headline figures.
const N_TILES: usize = 4;

/// What the template is filled in with.
#[derive(Serialize)]
struct Page<'a> {
    report: &'a Report,
    style: &'static str,
    panel: Panel,
    lede: Vec<String>,
    tiles: Vec<Tile>,
    dots: Option<DotPlot>,
    rows: Vec<Row>,
    seeds: Vec<SeedRow>,
    bars: Option<BarPlot>,
    variants: Vec<Key>,
    curves: Vec<CurveGrid>,
    /// Most training steps behind a point of a curve.
    steps_per_point: String,
    divergence: Option<Histograms>,
    facts: Vec<FactGroup<'a>>,
    claims: Vec<ClaimRow<'a>>,
    figures: Vec<LinePlot>,
    figure_keys: Vec<Key>,
    has_paper_encoder: bool,
    adversary: Vec<AdversaryRow>,
    pushes: Vec<PushRow>,
    heat: Vec<HeatGrid>,
    detections: Vec<DetectionRow>,
    models: Vec<ModelRow>,
    cost_stages: Vec<String>,
    costs: Vec<CostRow>,
    /// Program, commits, training seeds, cost.
    made_by: String,
    total_cpu_mins: String,
}

/// A claim of the paper.
#[derive(Serialize)]
struct ClaimRow<'a> {
    claim: &'a str,
    /// Whether it stands in the row before too.
    again: bool,
    encoder: &'a str,
    ours: &'a str,
    verdict: &'static str,
    /// Names its colour.
    class: Verdict,
}

/// What there is to say of one experiment.
#[derive(Serialize)]
struct FactGroup<'a> {
    experiment: &'a str,
    facts: &'a [Fact],
}

/// A headline figure.
#[derive(Serialize)]
struct Tile {
    suite: String,
    variant: String,
    value: String,
    low: String,
    high: String,
    rollouts: String,
    paper: Option<String>,
    /// Percentage points above the paper's, with sign.
    lead: Option<String>,
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

/// The page of a report.
pub(super) fn render(report: &Report, curves: &[Curve]) -> Result<String, minijinja::Error> {
    let trained = distinct(curves.iter().map(|curve| &curve.model.variant));
    let key = |name: &String| Key::of_variant(name);
    let last_step = curves.iter().flat_map(|curve| &curve.points).map(|point| point.step).max().unwrap_or(0);
    let steps_per_point = metrics::steps_per_bin(last_step) as u64;
    let leading = order::leading(&report.aggregates);
    let (cost_stages, costs) = tables::costs(&report.costs);
    let in_figures = || report.figures.iter().flat_map(|figure| &figure.series).map(|series| &series.variant);
    let page = Page {
        report,
        style: include_str!("style.css"),
        panel: PANEL,
        lede: lede(report),
        tiles: tiles(&leading),
        dots: dots::plot(&leading, &report.results),
        rows: rows(&report.aggregates),
        seeds: report.results.iter().map(seed_row).collect(),
        bars: bars::plot(&leading),
        variants: trained.iter().map(key).collect(),
        curves: curves::grids(curves),
        steps_per_point: plural(steps_per_point, "step", "steps"),
        divergence: histogram::plot(&report.divergences, &report.errors, &report.aggregates),
        facts: fact_groups(&report.facts),
        claims: claim_rows(&report.claims),
        figures: report.figures.iter().map(lines::plot).collect(),
        figure_keys: figure_keys(in_figures()),
        has_paper_encoder: in_figures().any(|variant| has_paper_encoder(variant)),
        adversary: tables::adversary(&report.figures),
        pushes: tables::pushes(&report.aggregates),
        heat: tables::heat(&report.grids),
        detections: tables::detections(&report.detections),
        models: tables::models(&report.models),
        cost_stages,
        costs,
        made_by: markdown::made_by(report),
        total_cpu_mins: format!("{:.1}", report.costs.iter().map(|cost| cost.cpu_secs).sum::<f64>() / 60.0),
    };
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    environment.add_template("charts.html.j2", include_str!("charts.html.j2"))?;
    environment.add_template("page.html.j2", include_str!("page.html.j2"))?;
    environment.get_template("page.html.j2")?.render(page)
}

fn claim_rows(claims: &[Claim]) -> Vec<ClaimRow<'_>> {
    let mut rows: Vec<ClaimRow<'_>> = Vec::with_capacity(claims.len());
    for (at, claim) in claims.iter().enumerate() {
        rows.push(ClaimRow {
            claim: &claim.claim,
            again: at > 0 && claims[at - 1].id == claim.id,
            encoder: &claim.encoder,
            ours: &claim.ours,
            verdict: claim.verdict.words(),
            class: claim.verdict,
        });
    }
    rows
}

/// Kinds of variants, whichever their encoder.
fn figure_keys<'a>(variants: impl Iterator<Item = &'a String>) -> Vec<Key> {
    let kinds: Vec<String> = variants.map(|name| name.strip_suffix("_paper").unwrap_or(name).to_owned()).collect();
    let mut kinds = distinct(kinds.iter());
    kinds.sort_by_cached_key(|kind| order::variant(kind));
    kinds.iter().map(|kind| Key::of_variant(kind)).collect()
}

fn fact_groups(facts: &[Fact]) -> Vec<FactGroup<'_>> {
    let groups = facts.chunk_by(|a, b| a.experiment == b.experiment);
    groups.map(|facts| FactGroup { experiment: &facts[0].experiment, facts }).collect()
}

/// A name for reading: `stacking_unseen` is `Stacking · unseen`.
pub(super) fn title_of(name: &str) -> String {
    let (first, rest) = name.split_once('_').unwrap_or((name, ""));
    let mut letters = first.chars();
    let first: String = letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect();
    if rest.is_empty() { first } else { format!("{first} · {}", rest.replace('_', " ")) }
}

/// An actor in a few words: `ntp`, and what else tells it apart.
pub(super) fn name_of(actor: &Actor) -> String {
    let tasks = actor.train_tasks.map(|tasks| format!(" {tasks}"));
    let decoder = actor.decoder.as_deref().filter(|decoder| *decoder != DECODERS[0]).map(|name| format!(" {name}"));
    format!("{}{}{}", actor.model(), tasks.unwrap_or_default(), decoder.unwrap_or_default())
}

fn tasks_of(actor: &Actor) -> Option<String> {
    actor.train_tasks.map(|tasks| thousands(tasks.max(0) as u64))
}

fn plural(count: u64, one: &str, many: &str) -> String {
    format!("{} {}", thousands(count), if count == 1 { one } else { many })
}

fn lede(report: &Report) -> Vec<String> {
    let episodes: u64 = report.aggregates.iter().map(|row| row.episodes).sum();
    if episodes == 0 {
        return Vec::new();
    }
    let mut seeds: Vec<i64> = report.results.iter().map(|row| row.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    let variants = distinct(report.aggregates.iter().map(|row| &row.actor.variant)).len() as u64;
    let suites = distinct(report.aggregates.iter().map(|row| &row.suite)).len() as u64;
    vec![
        plural(episodes, "rollout", "rollouts"),
        plural(suites, "suite", "suites"),
        plural(variants, "variant", "variants"),
        plural(seeds.len() as u64, "training seed", "training seeds"),
    ]
}

/// The first model's suites: it is the one the run is about.
fn tiles(aggregates: &[Aggregate]) -> Vec<Tile> {
    let rank = |row: &&Aggregate| (order::variant(&row.actor.variant), !row.actor.is_demonstrated());
    let lead = aggregates.iter().min_by_key(rank).map(|row| row.actor.model());
    let own = aggregates.iter().filter(|row| Some(row.actor.model()) == lead);
    let tile = |row: &Aggregate| Tile {
        suite: title_of(&row.suite),
        variant: name_of(&row.actor),
        value: percent(row.mean_success_rate),
        low: percent(row.wilson_low),
        high: percent(row.wilson_high),
        rollouts: plural(row.episodes, "rollout", "rollouts"),
        paper: row.paper_success_rate.map(percent),
        lead: row.paper_success_rate.map(|paper| points(row.mean_success_rate - paper)),
    };
    own.take(N_TILES).map(tile).collect()
}

/// A difference in percentage points, with a true minus sign.
fn points(difference: f64) -> String {
    let sign = if difference < 0.0 { '\u{2212}' } else { '+' };
    format!("{sign}{:.1}", 100.0 * difference.abs())
}

fn rows(aggregates: &[Aggregate]) -> Vec<Row> {
    let starts_suite = |at: usize| at == 0 || aggregates[at - 1].suite != aggregates[at].suite;
    let row = |(at, row): (usize, &Aggregate)| Row {
        suite: row.suite.clone(),
        variant: row.actor.model(),
        tasks: tasks_of(&row.actor),
        decoder: row.actor.decoder.clone(),
        color: color_of(&row.actor.variant),
        mean: percent(row.mean_success_rate),
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

fn seed_row(row: &SuiteResult) -> SeedRow {
    SeedRow {
        suite: row.suite.clone(),
        variant: name_of(&row.actor),
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
