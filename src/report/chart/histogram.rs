//! First divergence: at which decision failed rollouts first departed from the expert, by what differed.

use serde::Serialize;

use crate::report::actor::Actor;
use crate::report::chart::scale::{coordinate, nice_step, thousands};
use crate::report::chart::{Key, PANEL, Tick, distinct};
use crate::report::order;
use crate::report::summary::{Aggregate, Divergence, FirstError};
use crate::words::counted;

/// What can differ, and its colour.
pub(in crate::report) const KINDS: [(&str, usize); 5] =
    [("program", 6), ("argument", 5), ("scope", 0), ("early_end", 3), ("late_end", 1)];
/// The error of a rollout that decided nothing wrongly before physics went wrong.
const PHYSICS: &str = "physics";
/// Most bars of a panel.
const MAX_BINS: i64 = 24;
/// Fewer bars would be slabs.
const MIN_BINS: i64 = 12;

/// All panels, one a variant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct Histograms {
    pub(in crate::report) keys: Vec<Key>,
    pub(in crate::report) panels: Vec<Histogram>,
}

/// One variant over all suites of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct Histogram {
    /// Told where there are several.
    pub(in crate::report) experiment: String,
    pub(in crate::report) title: String,
    /// How many rollouts failed.
    pub(in crate::report) failed: u64,
    /// How many of them diverged.
    pub(in crate::report) diverged: u64,
    /// How many rollouts diverged and succeeded all the same.
    pub(in crate::report) recovered: u64,
    pub(in crate::report) x_ticks: Vec<Tick>,
    pub(in crate::report) y_ticks: Vec<Tick>,
    pub(in crate::report) bars: Vec<Bar>,
    /// Rollouts by program (rows) and kind (columns).
    pub(in crate::report) programs: Vec<ProgramRow>,
}

/// A part of a bar, in units of the panel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct Bar {
    pub(in crate::report) color: usize,
    pub(in crate::report) x: String,
    pub(in crate::report) y: String,
    pub(in crate::report) width: String,
    pub(in crate::report) height: String,
    pub(in crate::report) tip: String,
}

/// How often each kind was decided otherwise in one program.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct ProgramRow {
    pub(in crate::report) program: String,
    pub(in crate::report) cells: Vec<Cell>,
}

/// One number of the table of programs and kinds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct Cell {
    pub(in crate::report) count: u64,
    /// Percent of the largest number, for the shade.
    pub(in crate::report) shade: u64,
}

/// Nothing when no failed rollout diverged. Variants stand in the order of the rows.
pub(in crate::report) fn plot(
    divergences: &[Divergence],
    errors: &[FirstError],
    aggregates: &[Aggregate],
) -> Option<Histograms> {
    let mut rows: Vec<&Aggregate> = aggregates.iter().collect();
    rows.sort_by_cached_key(|row| order::actor(&row.actor));
    rows.dedup_by(|later, row| Model::of(&later.actor) == Model::of(&row.actor));
    let panel = |row: &Aggregate| {
        let model = Model::of(&row.actor);
        let histogram = panel(divergences, aggregates, model)?;
        Some(Histogram { programs: programs(errors, model), ..histogram })
    };
    let panels: Vec<Histogram> = rows.into_iter().filter_map(panel).collect();
    let key = |(kind, color): (&str, usize)| Key { label: kind.replace('_', " "), color, hollow: false };
    (!panels.is_empty()).then(|| Histograms { keys: KINDS.into_iter().map(key).collect(), panels })
}

/// What a panel is of: an experiment and a variant.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Model<'a>(&'a str, &'a str);

impl<'a> Model<'a> {
    fn of(actor: &'a Actor) -> Self {
        Self(&actor.experiment, &actor.variant)
    }
}

fn panel(divergences: &[Divergence], aggregates: &[Aggregate], model: Model<'_>) -> Option<Histogram> {
    let own = || divergences.iter().filter(|one| Model(&one.experiment, &one.variant) == model);
    let failures: Vec<&Divergence> = own().filter(|divergence| divergence.ended == "failure").collect();
    let bins = Bins::new(&failures)?;
    let failed = aggregates.iter().filter(|row| Model::of(&row.actor) == model).map(|row| row.episodes - row.successes);
    Some(Histogram {
        experiment: model.0.to_owned(),
        title: model.1.to_owned(),
        failed: failed.sum(),
        diverged: failures.iter().map(|one| one.episodes).sum(),
        recovered: own().filter(|one| one.ended == "success").map(|one| one.episodes).sum(),
        x_ticks: bins.x_ticks(),
        y_ticks: bins.y_ticks(),
        bars: bins.bars(),
        programs: Vec::new(),
    })
}

/// Failed rollouts by decision and kind.
struct Bins {
    /// Decisions of a bin.
    per_bin: i64,
    /// Rollouts of each bin, in the order of [`KINDS`].
    counts: Vec<[u64; KINDS.len()]>,
    /// Rollouts of the fullest bin.
    highest: u64,
}

impl Bins {
    /// Nothing without a failure.
    fn new(failures: &[&Divergence]) -> Option<Self> {
        let last = failures.iter().map(|one| one.decision.max(0)).max()?;
        let per_bin = (last + MAX_BINS) / MAX_BINS;
        let n_bins = (last / per_bin + 1).max(MIN_BINS);
        let mut counts = vec![[0; KINDS.len()]; n_bins as usize];
        for one in failures {
            let kind = KINDS.iter().position(|(kind, _)| *kind == one.kind)?;
            counts[(one.decision.max(0) / per_bin) as usize][kind] += one.episodes;
        }
        let highest = counts.iter().map(|kinds| kinds.iter().sum()).max()?;
        Some(Self { per_bin, counts, highest })
    }

    fn n_decisions(&self) -> i64 {
        self.counts.len() as i64 * self.per_bin
    }

    fn y(&self, count: u64) -> f64 {
        PANEL.y(count as f64 / self.highest as f64)
    }

    fn x_ticks(&self) -> Vec<Tick> {
        let n_decisions = self.n_decisions();
        let step = nice_step(n_decisions as f64, 5.0).max(1.0) as usize;
        let middle = |decision: i64| PANEL.x((decision as f64 + 0.5) / n_decisions as f64);
        let tick = |decision: i64| Tick { at: coordinate(middle(decision)), label: thousands(decision as u64) };
        (0..n_decisions).step_by(step).map(tick).collect()
    }

    fn y_ticks(&self) -> Vec<Tick> {
        let step = nice_step(self.highest as f64, 4.0).max(1.0) as usize;
        let tick = |count: u64| Tick { at: coordinate(self.y(count)), label: thousands(count) };
        (0..=self.highest).step_by(step).map(tick).collect()
    }

    fn bars(&self) -> Vec<Bar> {
        let width = (PANEL.x(1.0) - PANEL.x(0.0)) / self.counts.len() as f64;
        let mut bars = Vec::new();
        for (bin, kinds) in self.counts.iter().enumerate() {
            let x = PANEL.x(0.0) + (bin as f64 + 0.08) * width;
            let mut below = 0;
            for ((kind, color), &count) in KINDS.into_iter().zip(kinds).filter(|(_, count)| **count > 0) {
                let (top, base) = (self.y(below + count), self.y(below));
                bars.push(Bar {
                    color,
                    x: coordinate(x),
                    y: coordinate(top),
                    width: coordinate(0.84 * width),
                    height: coordinate(base - top),
                    tip: format!(
                        "{}: {kind}, {count}",
                        bin_name(bin as i64, self.per_bin),
                        count = counted(count, "rollout")
                    ),
                });
                below += count;
            }
        }
        bars
    }
}

fn bin_name(bin: i64, per_bin: i64) -> String {
    match per_bin {
        1 => format!("decision {bin}"),
        _ => format!("decisions {} to {}", bin * per_bin, (bin + 1) * per_bin - 1),
    }
}

/// Failed rollouts by the program that was wrong first, and in what; physics in a row and a column of its own.
fn programs(errors: &[FirstError], model: Model<'_>) -> Vec<ProgramRow> {
    let own: Vec<&FirstError> = errors.iter().filter(|error| Model::of(&error.actor) == model).collect();
    let mut names = distinct(own.iter().filter_map(|error| error.program.as_ref()));
    names.sort_by_cached_key(|program| order::level(program));
    let mut rows: Vec<(Option<&String>, &str)> = names.iter().map(|name| (Some(name), name.as_str())).collect();
    if own.iter().any(|error| error.program.is_none()) {
        rows.push((None, PHYSICS));
    }
    let columns = || KINDS.into_iter().map(|(kind, _)| kind).chain([PHYSICS]);
    let count = |program: Option<&String>, kind: &str| -> u64 {
        own.iter().filter(|one| one.program.as_ref() == program && one.error == kind).map(|one| one.episodes).sum()
    };
    let highest = rows.iter().flat_map(|(program, _)| columns().map(|kind| count(*program, kind))).max();
    let highest = highest.unwrap_or(0).max(1);
    let cell = |count: u64| Cell { count, shade: 100 * count / highest };
    let row = |(program, name): &(Option<&String>, &str)| ProgramRow {
        program: (*name).to_owned(),
        cells: columns().map(|kind| cell(count(*program, kind))).collect(),
    };
    rows.iter().map(row).collect()
}
