//! Learning curves.

use serde::{Deserialize, Serialize};

use crate::program::Program;
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
