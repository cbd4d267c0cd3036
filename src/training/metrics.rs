//! Learning curves, and their table `metrics.parquet` (schemas/parquet/metrics.message).

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::program::Program;
use crate::table::{self, Column, TableError, TableSchema};
use crate::training::learner::Losses;

/// One row of `metrics.parquet`: the losses of one level in one step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// The step, from 1.
    pub step: u32,
    /// The running program whose decisions were learned.
    pub level: Program,
    /// Cross-entropy of the next program.
    pub loss_program: f32,
    /// Binary cross-entropy of the end of the program.
    pub loss_end: f32,
    /// Mean cross-entropy of the scoping labels; `None` where the program's callees have no learned scope.
    pub loss_scope: Option<f32>,
    /// Cross-entropy of the argument; `None` where the program calls nothing with one.
    pub loss_argument: Option<f32>,
    /// Weighed and summed.
    pub loss_total: f32,
    /// Of the step.
    pub learning_rate: f64,
    /// How many decisions were learned from.
    pub examples: u32,
}

impl Metric {
    pub(crate) fn new(step: u32, level: Program, losses: Losses, learning_rate: f64, examples: u32) -> Self {
        let Losses { program, end, scope, argument, total } = losses;
        Self {
            step,
            level,
            loss_program: program,
            loss_end: end,
            loss_scope: scope,
            loss_argument: argument,
            loss_total: total,
            learning_rate,
            examples,
        }
    }
}

/// Writes learning curves.
///
/// # Errors
///
/// When the file cannot be written.
pub(crate) fn write(path: &Path, metrics: &[Metric]) -> Result<(), TableError> {
    let losses = |loss: fn(&Metric) -> Option<f32>| Column::OptionalFloat32(metrics.iter().map(loss).collect());
    let columns = vec![
        ("step", Column::Int64(metrics.iter().map(|metric| i64::from(metric.step)).collect())),
        ("level", Column::Text(metrics.iter().map(|metric| metric.level.name().to_owned()).collect())),
        ("loss_program", losses(|metric| Some(metric.loss_program))),
        ("loss_end", losses(|metric| Some(metric.loss_end))),
        ("loss_scope", losses(|metric| metric.loss_scope)),
        ("loss_argument", losses(|metric| metric.loss_argument)),
        ("loss_total", losses(|metric| Some(metric.loss_total))),
        ("learning_rate", Column::Float32(metrics.iter().map(|metric| metric.learning_rate as f32).collect())),
        ("examples", Column::Int64(metrics.iter().map(|metric| i64::from(metric.examples)).collect())),
    ];
    table::write(path, &TableSchema::METRICS, columns)
}
