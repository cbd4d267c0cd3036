//! Learning curves, and their table `metrics.parquet`.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::program::Program;
use crate::table::{TableError, TableRows as _, table};
use crate::training::losses::Losses;

table! {
    /// `metrics.parquet` of a model: its learning curves, a row a logged step and level.
    metrics {
        /// the step, from 1
        step: Int64,
        /// the running program whose decisions were learned
        level: Text,
        /// cross-entropy of the next program
        loss_program: OptionalFloat32,
        /// binary cross-entropy of the end of the program
        loss_end: OptionalFloat32,
        /// mean cross-entropy of the scoping labels; null where no scope is learned
        loss_scope: OptionalFloat32,
        /// cross-entropy of the argument; null where nothing is called with one
        loss_argument: OptionalFloat32,
        /// weighed and summed
        loss_total: OptionalFloat32,
        /// of the step
        learning_rate: Float32,
        /// decisions learned from
        examples: Int64,
    }
}

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
    let mut rows = Rows::default();
    for metric in metrics {
        rows.push(Row {
            step: i64::from(metric.step),
            level: metric.level.name().into(),
            loss_program: Some(metric.loss_program),
            loss_end: Some(metric.loss_end),
            loss_scope: metric.loss_scope,
            loss_argument: metric.loss_argument,
            loss_total: Some(metric.loss_total),
            learning_rate: metric.learning_rate as f32,
            examples: i64::from(metric.examples),
        });
    }
    rows.write(path)
}
