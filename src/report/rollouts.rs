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

use polars::prelude::{DataType, Expr, LazyFrame, NULL, SortMultipleOptions, UnionArgs, col, concat, len, lit, when};

use crate::report::actor::{Actor, ModelParts};
use crate::report::chart::histogram::KINDS;
use crate::report::facts::{self, SuiteFacts};
use crate::report::frames::{Rows, collect, scan, scan_with};
use crate::report::interval::wilson;
use crate::report::summary::{Divergence, FirstError, SuiteResult};
use crate::report::{ReportError, order};
use crate::trace::ObservationNoise;

const COLUMNS: [(&str, DataType); 17] = [
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
    ("train_tasks", DataType::Int64),
    ("specification", DataType::String),
    ("decoder", DataType::String),
    ("fault_decision", DataType::Int64),
    ("pushes", DataType::Int64),
    ("toppled", DataType::Int64),
];

/// Columns that files of earlier versions lack, beside those of [`facts::COLUMNS`].
const LATER: [(&str, DataType); 7] = [
    ("goals", DataType::Int64),
    ("goals_met", DataType::Int64),
    ("core", DataType::String),
    ("scoping", DataType::String),
    ("encoder", DataType::String),
    ("localisation_mm", DataType::Float64),
    ("failure", DataType::String),
];

/// What a file does not say of itself: to which experiment it belongs.
const EXPERIMENT: &str = "experiment";
/// Nor what tells its model apart from others of its variant.
const TAG: &str = "tag";
/// What tells actors apart; see [`Actor`].
const ACTOR: [&str; 9] =
    [EXPERIMENT, "variant", "core", "scoping", "encoder", TAG, "train_tasks", "specification", "decoder"];
const MICROS_PER_SEC: f64 = 1e6;
const MICROS_PER_MILLI: f64 = 1e3;
const MILLIONTHS: i64 = 1_000_000;

/// The rollouts of one model in one suite.
#[derive(Clone, Debug, PartialEq)]
pub struct RolloutsInput {
    /// Of which experiment.
    pub experiment: String,
    /// What tells the model apart from others of its variant.
    pub tag: Option<String>,
    /// How far the positions that it was told were off.
    pub noise: ObservationNoise,
    /// Its rollouts.parquet.
    pub path: PathBuf,
}

/// What the rollouts say.
#[derive(Debug, Default)]
pub(super) struct Rollouts {
    pub(super) results: Vec<SuiteResult>,
    pub(super) divergences: Vec<Divergence>,
    pub(super) errors: Vec<FirstError>,
}

/// Reads and sums up; nothing when there are no files.
pub(super) fn read(inputs: &[RolloutsInput]) -> Result<Rollouts, ReportError> {
    if inputs.is_empty() {
        return Ok(Rollouts::default());
    }
    for input in inputs {
        check_rows(&input.path)?;
    }
    let later: Vec<_> = LATER.into_iter().chain(facts::COLUMNS).collect();
    let frames = inputs.iter().map(|input| {
        let experiment = lit(input.experiment.clone()).alias(EXPERIMENT);
        let tag = input.tag.clone().map_or_else(|| lit(NULL).cast(DataType::String), lit).alias(TAG);
        let ObservationNoise { frame_m, offset_m } = input.noise;
        let [frame, offset] = [(facts::NOISE[0], frame_m), (facts::NOISE[1], offset_m)]
            .map(|(name, noise_m)| lit(f64::from(noise_m)).alias(name));
        Ok(scan_with(&input.path, &COLUMNS, &later)?.with_columns([experiment, tag, frame, offset]))
    });
    let frames = frames.collect::<Result<Vec<_>, ReportError>>()?;
    let paths: Vec<PathBuf> = inputs.iter().map(|input| input.path.clone()).collect();
    let all = concat(&frames, UnionArgs::default()).map_err(ReportError::Query)?;
    Ok(Rollouts {
        results: results(&all, &paths)?,
        errors: errors(&all, &paths)?,
        divergences: divergences(all, &paths)?,
    })
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
        (
            "first_divergence has no program, or a kind that is not one of program, argument, scope, early_end, late_end",
            divergence,
        ),
    ] {
        let table =
            collect(scan(path, &COLUMNS)?.filter(wrong).select([len().alias("rows")]), std::slice::from_ref(path))?;
        if let Some(&rows @ 1..) = Rows(&table).whole("rows")?.first() {
            return Err(ReportError::Rows { path: path.clone(), rows, problem });
        }
    }
    Ok(())
}

fn key(more: &[&str]) -> Vec<Expr> {
    [ACTOR.as_slice(), more].concat().into_iter().map(col).collect()
}

/// The actor of each row of a table that was grouped by [`key`].
fn actors(rows: &Rows<'_>) -> Result<Vec<Actor>, ReportError> {
    let (mut experiments, mut variants) = (rows.text(EXPERIMENT)?, rows.text("variant")?);
    let text = |name: &str| rows.optional_text(name);
    let (mut tags, mut specifications, mut decoders) = (text(TAG)?, text("specification")?, text("decoder")?);
    let (mut cores, mut scopings, mut encoders) = (text("core")?, text("scoping")?, text("encoder")?);
    let train_tasks = rows.optional_whole("train_tasks")?;
    let actor = |row: usize| Actor {
        experiment: std::mem::take(&mut experiments[row]),
        variant: std::mem::take(&mut variants[row]),
        parts: ModelParts { core: cores[row].take(), scoping: scopings[row].take(), encoder: encoders[row].take() },
        tag: tags[row].take(),
        train_tasks: train_tasks[row],
        specification: specifications[row].take(),
        decoder: decoders[row].take(),
    };
    Ok((0..train_tasks.len()).map(actor).collect())
}

fn results(all: &LazyFrame, paths: &[PathBuf]) -> Result<Vec<SuiteResult>, ReportError> {
    let micros = (col("sim_secs") * lit(MICROS_PER_SEC)).cast(DataType::Int64).sum();
    let met = (col("goals_met") * lit(MILLIONTHS)).floor_div(col("goals"));
    let mut sums = vec![
        len().alias("episodes"),
        col("episode").n_unique().alias("distinct"),
        col("success").cast(DataType::Int64).sum().alias("successes"),
        col("calls").sum(),
        micros.alias("sim_micros"),
        col("pushes").count().alias("disturbed"),
        col("pushes").sum(),
        col("toppled").sum(),
        col("goals_met").count().alias("judged"),
        met.sum().alias("met"),
        col("localisation_mm").count().alias("localised"),
        (col("localisation_mm") * lit(MICROS_PER_MILLI) + lit(0.5)).cast(DataType::Int64).sum().alias("off_micros"),
    ];
    for name in facts::COLUMNS.into_iter().map(|(name, _)| name).chain(facts::NOISE) {
        sums.extend([col(name).min(), col(name).max().alias(facts::highest(name))]);
    }
    let by = key(&["suite", "training_seed"]);
    let grouped = all.clone().group_by(by.clone()).agg(sums);
    let table = collect(grouped.sort_by_exprs(by, SortMultipleOptions::default()), paths)?;
    let rows = Rows(&table);
    let (suites, seeds) = (rows.text("suite")?, rows.whole("training_seed")?);
    let (episodes, distinct) = (rows.whole("episodes")?, rows.whole("distinct")?);
    let (successes, calls, micros) = (rows.whole("successes")?, rows.whole("calls")?, rows.whole("sim_micros")?);
    let (disturbed, pushes, toppled) = (rows.whole("disturbed")?, rows.whole("pushes")?, rows.whole("toppled")?);
    let (judged, met) = (rows.whole("judged")?, rows.whole("met")?);
    let (localised, off_micros) = (rows.whole("localised")?, rows.whole("off_micros")?);
    let facts = SuiteFacts::read(&rows)?;
    let mut causes = counts(all, "outcome", paths)?;
    let mut failures = counts(all, "failure", paths)?;
    let mut results = Vec::with_capacity(table.height());
    for (row, (actor, facts)) in actors(&rows)?.into_iter().zip(facts).enumerate() {
        let (suite, seed) = (suites[row].clone(), seeds[row]);
        if distinct[row] != episodes[row] {
            let rows = episodes[row] - distinct[row];
            return Err(ReportError::Repeated { actor: Box::new(actor), suite, seed, rows });
        }
        let n = episodes[row].max(1) as f64;
        let (wilson_low, wilson_high) = wilson(successes[row] as u64, episodes[row] as u64);
        results.push(SuiteResult {
            causes: causes.remove(&(actor.clone(), suite.clone(), seed)).unwrap_or_default(),
            failures: failures.remove(&(actor.clone(), suite.clone(), seed)).unwrap_or_default(),
            actor,
            suite,
            facts,
            seed,
            episodes: episodes[row] as u64,
            successes: successes[row] as u64,
            success_rate: successes[row] as f64 / n,
            wilson_low,
            wilson_high,
            goals_met: (judged[row] > 0).then(|| met[row] as f64 / MILLIONTHS as f64 / judged[row] as f64),
            localisation_mm: (localised[row] > 0)
                .then(|| off_micros[row] as f64 / MICROS_PER_MILLI / localised[row] as f64),
            mean_calls: calls[row] as f64 / n,
            mean_sim_secs: micros[row] as f64 / MICROS_PER_SEC / n,
            pushes: (disturbed[row] > 0).then_some(pushes[row] as u64),
            toppled: (disturbed[row] > 0).then_some(toppled[row] as u64),
        });
    }
    results.sort_by_cached_key(|result| {
        (order::suite(&result.suite, &result.facts), order::actor(&result.actor), result.seed)
    });
    Ok(results)
}

type Counts = BTreeMap<(Actor, String, i64), BTreeMap<String, u64>>;

/// How many failures have each value of a column.
fn counts(all: &LazyFrame, column: &str, paths: &[PathBuf]) -> Result<Counts, ReportError> {
    let failures = all.clone().filter(col("success").not().and(col(column).is_not_null()));
    let query = failures.group_by(key(&["suite", "training_seed", column])).agg([len().alias("episodes")]);
    let table = collect(query, paths)?;
    let rows = Rows(&table);
    let (suites, seeds) = (rows.text("suite")?, rows.whole("training_seed")?);
    let (values, episodes) = (rows.text(column)?, rows.whole("episodes")?);
    let mut counts = Counts::new();
    for (row, actor) in actors(&rows)?.into_iter().enumerate() {
        let counts = counts.entry((actor, suites[row].clone(), seeds[row])).or_default();
        counts.insert(values[row].clone(), episodes[row] as u64);
    }
    Ok(counts)
}

/// A failed rollout's first error is its first departure from the expert, unless physics went wrong before, or nothing
/// was decided otherwise at all.
fn errors(all: &LazyFrame, paths: &[PathBuf]) -> Result<Vec<FirstError>, ReportError> {
    let in_time = col("fault_decision").is_null().or(col("fault_decision").gt_eq(col("first_divergence")));
    let decided = col("first_divergence").is_not_null().and(in_time);
    let error = when(decided.clone()).then(col("divergence_kind")).otherwise(lit("physics")).alias("error");
    let program = when(decided).then(col("divergence_program")).otherwise(lit(NULL)).alias("program");
    let failures = all.clone().filter(col("success").not()).with_columns([error, program]);
    let counts = failures.group_by(key(&["suite", "error", "program"])).agg([len().alias("episodes")]);
    let table = collect(counts, paths)?;
    let rows = Rows(&table);
    let (suites, errors) = (rows.text("suite")?, rows.text("error")?);
    let (programs, episodes) = (rows.optional_text("program")?, rows.whole("episodes")?);
    let first = |(row, actor): (usize, Actor)| FirstError {
        actor,
        suite: suites[row].clone(),
        program: programs[row].clone(),
        error: errors[row].clone(),
        episodes: episodes[row] as u64,
    };
    let mut errors: Vec<FirstError> = actors(&rows)?.into_iter().enumerate().map(first).collect();
    errors.sort();
    Ok(errors)
}

fn divergences(all: LazyFrame, paths: &[PathBuf]) -> Result<Vec<Divergence>, ReportError> {
    let ended = when(col("success")).then(lit("success")).otherwise(lit("failure")).alias("ended");
    let by = [EXPERIMENT, "variant", "suite", "ended", "first_divergence", "divergence_kind", "divergence_program"];
    let query = all.filter(col("first_divergence").is_not_null()).with_column(ended).group_by(by.map(col));
    let table = collect(query.agg([len().alias("episodes")]), paths)?;
    let rows = Rows(&table);
    let (experiments, variants) = (rows.text(EXPERIMENT)?, rows.text("variant")?);
    let (suites, ended) = (rows.text("suite")?, rows.text("ended")?);
    let (kinds, programs) = (rows.text("divergence_kind")?, rows.text("divergence_program")?);
    let (decisions, episodes) = (rows.whole("first_divergence")?, rows.whole("episodes")?);
    let divergence = |row: usize| Divergence {
        experiment: experiments[row].clone(),
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
