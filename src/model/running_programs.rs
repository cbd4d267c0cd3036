//! Which programs run in a batch of decisions.

use burn::tensor::TensorData;

use crate::program::Program;

/// The running programs of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunningPrograms<'p> {
    /// The same in each decision.
    One(Program),
    /// Its own in each.
    Each(&'p [Program]),
}

impl From<Program> for RunningPrograms<'_> {
    fn from(program: Program) -> Self {
        Self::One(program)
    }
}

/// A one in the column of each program: `[B, n_programs]`.
pub(crate) fn one_hot(programs: &[Program], n_programs: usize) -> TensorData {
    let mut hot = vec![0.0_f32; programs.len() * n_programs];
    for (row, program) in hot.chunks_exact_mut(n_programs.max(1)).zip(programs) {
        if let Some(column) = row.get_mut(program.index()) {
            *column = 1.0;
        }
    }
    TensorData::new(hot, [programs.len(), n_programs])
}
