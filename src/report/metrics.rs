//! Training metrics into curves of bounded length, by Polars.
//!
//! # Input and output
//!
//! schemas/parquet/metrics.message, one row a step and program level; one file a training.
//!
//! # Invariants
//!
//! A curve has [`N_BINS`] points at most, each the mean of its steps. Losses are summed as whole numbers, so that no
//! thread count shows in the result. A loss that is not finite is left out of its mean; a bin without any has none.

use std::path::PathBuf;

use polars::prelude::{DataType, Expr, NULL, col, lit, when};

use crate::report::frames::{Rows, collect, scan};
use crate::report::summary::{ModelSummary, TrainingEnd};
use crate::report::{ReportError, order};

/// Most points of a curve.
pub(super) const N_BINS: i64 = 120;

/// Losses are summed in these units.
const UNITS_PER_LOSS: f64 = 1e9;

/// The parts of the loss, the whole of it first.
pub(super) const PARTS: [&str; 5] = ["loss_total", "loss_program", "loss_end", "loss_scope", "loss_argument"];

/// One training and its metrics table.
#[derive(Clone, Debug, PartialEq)]
pub struct MetricsInput {
    /// The model that came of it.
    pub model: ModelSummary,
    /// Its metrics.parquet.
    pub path: PathBuf,
}

/// One training's losses at one program level.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    pub(super) model: ModelSummary,
    pub(super) level: String,
    pub(super) points: Vec<CurvePoint>,
}

/// The mean of some steps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CurvePoint {
    /// The last of the steps.
    pub(super) step: i64,
    /// In the order of [`PARTS`].
    pub(super) losses: [Option<f64>; 5],
}

/// Reads the curves of all trainings.
pub(super) fn read(inputs: &[MetricsInput]) -> Result<Vec<Curve>, ReportError> {
    let mut curves = Vec::new();
    for input in inputs {
        curves.extend(read_one(input)?);
    }
    curves.sort_by_cached_key(|curve| {
        let model = &curve.model;
        (
            model.experiment.clone(),
            order::model(&model.variant, &model.parts, false),
            model.tag.clone(),
            model.train_tasks,
            model.specification.clone(),
            model.seed,
            order::level(&curve.level),
        )
    });
    Ok(curves)
}

fn columns() -> Vec<(&'static str, DataType)> {
    let mut columns = vec![("step", DataType::Int64), ("level", DataType::String)];
    columns.extend(PARTS.map(|part| (part, DataType::Float32)));
    columns
}

fn read_one(input: &MetricsInput) -> Result<Vec<Curve>, ReportError> {
    let paths = std::slice::from_ref(&input.path);
    let steps = scan(&input.path, &columns())?.select([col("step").max()]);
    let last = Rows(&collect(steps, paths)?).whole("step")?.first().copied().unwrap_or(0);
    let bin = col("step").floor_div(lit(steps_per_bin(last))).alias("bin");
    let mut sums = vec![col("step").max()];
    sums.extend(PARTS.into_iter().flat_map(|part| [units(part).sum().alias(part), n_finite(part)]));
    let binned = scan(&input.path, &columns())?.group_by([col("level"), bin]).agg(sums);
    let table = collect(binned.sort(["level", "bin"], Default::default()), paths)?;
    let rows = Rows(&table);
    let (levels, steps) = (rows.text("level")?, rows.whole("step")?);
    let parts = PARTS.map(|part| Ok((rows.whole(part)?, rows.whole(&count_name(part))?)));
    let parts = parts.into_iter().collect::<Result<Vec<_>, ReportError>>()?;
    let mean = |part: usize, row: usize| {
        let (sums, counts) = &parts[part];
        (counts[row] > 0).then(|| sums[row] as f64 / UNITS_PER_LOSS / counts[row] as f64)
    };
    let mut curves: Vec<Curve> = Vec::new();
    for row in 0..table.height() {
        let point = CurvePoint { step: steps[row], losses: [0, 1, 2, 3, 4].map(|part| mean(part, row)) };
        match curves.last_mut().filter(|curve| curve.level == levels[row]) {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve { model: input.model.clone(), level: levels[row].clone(), points: vec![point] }),
        }
    }
    Ok(curves)
}

/// How many steps each point of a curve stands for, but perhaps the last.
pub(super) fn steps_per_bin(last_step: i64) -> i64 {
    (last_step.max(0) + N_BINS) / N_BINS
}

/// A loss in whole units; nothing where it is not finite.
fn units(part: &str) -> Expr {
    let units = (col(part).cast(DataType::Float64) * lit(UNITS_PER_LOSS)).cast(DataType::Int64);
    when(col(part).is_finite()).then(units).otherwise(lit(NULL))
}

fn n_finite(part: &str) -> Expr {
    col(part).is_finite().cast(DataType::Int64).sum().alias(count_name(part))
}

fn count_name(part: &str) -> String {
    format!("n_{part}")
}

/// Where each curve ends.
pub(super) fn ends(curves: &[Curve]) -> Vec<TrainingEnd> {
    let end = |curve: &Curve| {
        let last = curve.points.last()?;
        Some(TrainingEnd {
            experiment: curve.model.experiment.clone(),
            variant: curve.model.variant.clone(),
            tag: curve.model.tag.clone(),
            train_tasks: curve.model.train_tasks,
            specification: curve.model.specification.clone(),
            seed: curve.model.seed,
            level: curve.level.clone(),
            step: last.step,
            loss_total: last.losses[0],
        })
    };
    curves.iter().filter_map(end).collect()
}
