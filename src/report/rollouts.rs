//! Rollouts tables into results, by Polars.
//!
//! # Input and output
//!
//! schemas/parquet/rollouts.message, one row an episode; any number of files.
//!
//! # Invariants
//!
//! Sums are of whole numbers, so that no thread count and no order of rows shows in the result.

use std::collections::BTreeMap;
use std::path::PathBuf;

use polars::prelude::{DataType, Expr, LazyFrame, SortMultipleOptions, UnionArgs, col, concat, len, lit, when};

use crate::report::chart::histogram::KINDS;
use crate::report::frames::{Rows, collect, scan};
use crate::report::interval::wilson;
use crate::report::summary::{Aggregate, Divergence, SuiteResult};
use crate::report::{PaperValue, ReportError, order};

const COLUMNS: [(&str, DataType); 13] = [
    ("variant", DataType::String),
    ("suite", DataType::String),
    ("training_seed", DataType::Int64),
    ("episode", DataType::Int64),
    ("outcome", DataType::String),
    ("success", DataType::Boolean),
    ("calls", DataType::Int64),
    ("first_divergence", DataType::Int64),
    ("divergence_kind", DataType::String),
    ("divergence_program", DataType::String),
    ("sim_secs", DataType::Float64),
    ("pushes", DataType::Int64),
    ("toppled", DataType::Int64),
];

const KEY: [&str; 3] = ["variant", "suite", "training_seed"];
const MICROS_PER_SEC: f64 = 1e6;

/// What the rollouts say.
#[derive(Debug, Default)]
pub(super) struct Rollouts {
    pub(super) results: Vec<SuiteResult>,
    pub(super) divergences: Vec<Divergence>,
}

/// Reads and sums up; nothing when there are no files.
pub(super) fn read(paths: &[PathBuf]) -> Result<Rollouts, ReportError> {
    if paths.is_empty() {
        return Ok(Rollouts::default());
    }
    for path in paths {
        check_rows(path)?;
    }
    let frames = paths.iter().map(|path| scan(path, &COLUMNS)).collect::<Result<Vec<_>, _>>()?;
    let all = concat(&frames, UnionArgs::default()).map_err(ReportError::Query)?;
    Ok(Rollouts { results: results(&all, paths)?, divergences: divergences(all, paths)? })
}

/// A table whose columns contradict each other is not trusted: `success` says again what `outcome` says, and a
/// divergence is of a known kind, in some program.
fn check_rows(path: &PathBuf) -> Result<(), ReportError> {
    let outcome = col("success").neq(col("outcome").eq(lit("success")));
    let is_of = |(kind, _)| col("divergence_kind").eq(lit(kind)).fill_null(lit(false));
    let known = KINDS.map(is_of).into_iter().fold(lit(false), Expr::or).and(col("divergence_program").is_not_null());
    let divergence = col("first_divergence").is_not_null().and(known.not());
    for (problem, wrong) in [
        ("success is not what the outcome says", outcome),
        ("first_divergence has no program, or a kind that is not one of program, argument, scope, end", divergence),
    ] {
        let table =
            collect(scan(path, &COLUMNS)?.filter(wrong).select([len().alias("rows")]), std::slice::from_ref(path))?;
        if let Some(&rows @ 1..) = Rows(&table).whole("rows")?.first() {
            return Err(ReportError::Rows { path: path.clone(), rows, problem });
        }
    }
    Ok(())
}

fn key() -> [Expr; 3] {
    KEY.map(col)
}

fn results(all: &LazyFrame, paths: &[PathBuf]) -> Result<Vec<SuiteResult>, ReportError> {
    let micros = (col("sim_secs") * lit(MICROS_PER_SEC)).cast(DataType::Int64).sum();
    let sums = [
        len().alias("episodes"),
        col("episode").n_unique().alias("distinct"),
        col("success").cast(DataType::Int64).sum().alias("successes"),
        col("calls").sum(),
        micros.alias("sim_micros"),
        col("pushes").count().alias("disturbed"),
        col("pushes").sum(),
        col("toppled").sum(),
    ];
    let by_seed = all.clone().group_by(key()).agg(sums).sort(KEY, SortMultipleOptions::default());
    let table = collect(by_seed, paths)?;
    let rows = Rows(&table);
    let (variants, suites, seeds) = (rows.text("variant")?, rows.text("suite")?, rows.whole("training_seed")?);
    let (episodes, distinct) = (rows.whole("episodes")?, rows.whole("distinct")?);
    let (successes, calls, micros) = (rows.whole("successes")?, rows.whole("calls")?, rows.whole("sim_micros")?);
    let (disturbed, pushes, toppled) = (rows.whole("disturbed")?, rows.whole("pushes")?, rows.whole("toppled")?);
    let mut causes = causes(all, paths)?;
    let mut results = Vec::with_capacity(table.height());
    for row in 0..table.height() {
        let (variant, suite, seed) = (variants[row].clone(), suites[row].clone(), seeds[row]);
        if distinct[row] != episodes[row] {
            return Err(ReportError::Repeated { variant, suite, seed, rows: episodes[row] - distinct[row] });
        }
        let n = episodes[row].max(1) as f64;
        let (wilson_low, wilson_high) = wilson(successes[row] as u64, episodes[row] as u64);
        results.push(SuiteResult {
            causes: causes.remove(&(variant.clone(), suite.clone(), seed)).unwrap_or_default(),
            variant,
            suite,
            seed,
            episodes: episodes[row] as u64,
            successes: successes[row] as u64,
            success_rate: successes[row] as f64 / n,
            wilson_low,
            wilson_high,
            mean_calls: calls[row] as f64 / n,
            mean_sim_secs: micros[row] as f64 / MICROS_PER_SEC / n,
            pushes: (disturbed[row] > 0).then_some(pushes[row] as u64),
            toppled: (disturbed[row] > 0).then_some(toppled[row] as u64),
        });
    }
    results.sort_by_cached_key(|result| (order::suite(&result.suite), order::variant(&result.variant), result.seed));
    Ok(results)
}

type Causes = BTreeMap<(String, String, i64), BTreeMap<String, u64>>;

fn causes(all: &LazyFrame, paths: &[PathBuf]) -> Result<Causes, ReportError> {
    let by = [KEY.as_slice(), &["outcome"]].concat().into_iter().map(col).collect::<Vec<_>>();
    let failures = all.clone().filter(col("success").not()).group_by(by).agg([len().alias("episodes")]);
    let table = collect(failures, paths)?;
    let rows = Rows(&table);
    let (variants, suites, seeds) = (rows.text("variant")?, rows.text("suite")?, rows.whole("training_seed")?);
    let (outcomes, episodes) = (rows.text("outcome")?, rows.whole("episodes")?);
    let mut causes = Causes::new();
    for row in 0..table.height() {
        let key = (variants[row].clone(), suites[row].clone(), seeds[row]);
        causes.entry(key).or_default().insert(outcomes[row].clone(), episodes[row] as u64);
    }
    Ok(causes)
}

fn divergences(all: LazyFrame, paths: &[PathBuf]) -> Result<Vec<Divergence>, ReportError> {
    let ended = when(col("success")).then(lit("success")).otherwise(lit("failure")).alias("ended");
    let by = ["variant", "suite", "ended", "first_divergence", "divergence_kind", "divergence_program"].map(col);
    let query = all.filter(col("first_divergence").is_not_null()).with_column(ended).group_by(by);
    let table = collect(query.agg([len().alias("episodes")]), paths)?;
    let rows = Rows(&table);
    let (variants, suites, ended) = (rows.text("variant")?, rows.text("suite")?, rows.text("ended")?);
    let (kinds, programs) = (rows.text("divergence_kind")?, rows.text("divergence_program")?);
    let (decisions, episodes) = (rows.whole("first_divergence")?, rows.whole("episodes")?);
    let divergence = |row: usize| Divergence {
        variant: variants[row].clone(),
        suite: suites[row].clone(),
        ended: ended[row].clone(),
        decision: decisions[row],
        kind: kinds[row].clone(),
        program: programs[row].clone(),
        episodes: episodes[row] as u64,
    };
    let mut divergences: Vec<Divergence> = (0..table.height()).map(divergence).collect();
    divergences.sort();
    Ok(divergences)
}

/// Sums results over training seeds. They stand sorted, so those of one variant and suite are neighbours.
pub(super) fn aggregates(results: &[SuiteResult], paper: &[PaperValue]) -> Vec<Aggregate> {
    let same = |a: &SuiteResult, b: &SuiteResult| (&a.variant, &a.suite) == (&b.variant, &b.suite);
    results.chunk_by(same).map(|seeds| aggregate(seeds, paper)).collect()
}

fn aggregate(seeds: &[SuiteResult], paper: &[PaperValue]) -> Aggregate {
    let (variant, suite) = (seeds[0].variant.clone(), seeds[0].suite.clone());
    let rates = || seeds.iter().map(|seed| seed.success_rate);
    let episodes = seeds.iter().map(|seed| seed.episodes).sum();
    let successes = seeds.iter().map(|seed| seed.successes).sum();
    let (wilson_low, wilson_high) = wilson(successes, episodes);
    let mut causes = BTreeMap::new();
    for (cause, count) in seeds.iter().flat_map(|seed| &seed.causes) {
        *causes.entry(cause.clone()).or_default() += count;
    }
    let paper_success_rate = paper.iter().find(|value| value.is_for(&variant, &suite)).map(|value| value.success_rate);
    Aggregate {
        variant,
        suite,
        seeds: seeds.len() as u64,
        episodes,
        successes,
        mean_success_rate: rates().sum::<f64>() / seeds.len() as f64,
        lowest_success_rate: rates().fold(1.0, f64::min),
        highest_success_rate: rates().fold(0.0, f64::max),
        wilson_low,
        wilson_high,
        causes,
        paper_success_rate,
    }
}
