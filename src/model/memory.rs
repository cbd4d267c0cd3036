//! The key-value program memory.
//!
//! # Source
//!
//! Paper, section IV: `j* = argmax_j (M_key[j] . k)` and `p = M_prog[j*]`. The memory has a row for
//! [`Program::None`] besides, which the paper has not: a program can end without a last call.

use burn::module::{Module, Param};
use burn::tensor::Tensor;

use crate::model::layers::{Init, repeat_row};
use crate::model::linear::Linear;
use crate::model::network::CoreOutput;
use crate::model::running_programs::{RunningPrograms, one_hot};
use crate::program::Program;

/// Embeddings of programs, and the keys they are found by.
#[derive(Module, Debug)]
pub struct ProgramMemory {
    /// `[programs, embedding]`
    programs: Param<Tensor<2>>,
    /// `[programs, key]`
    keys: Param<Tensor<2>>,
    /// Whether the roots of all families are one program.
    #[module(skip)]
    shared_root: bool,
}

impl ProgramMemory {
    pub(crate) fn new(init: &mut Init, width: usize) -> Self {
        let n_programs = init.known().count();
        Self {
            programs: init.parameter([n_programs, width], 0.5),
            keys: init.parameter([n_programs, width], 0.5),
            shared_root: init.shares_root(),
        }
    }

    /// A memory of given rows.
    pub fn from_rows(programs: Tensor<2>, keys: Tensor<2>) -> Self {
        Self { programs: Param::from_tensor(programs), keys: Param::from_tensor(keys), shared_root: false }
    }

    /// The embedding of a program.
    ///
    /// # Shapes
    ///
    /// `[1, embedding]`
    pub fn embedding(&self, program: Program) -> Tensor<2> {
        self.programs.val().narrow(0, self.row(program).index(), 1)
    }

    /// The program whose row a running program is read from.
    fn row(&self, program: Program) -> Program {
        if self.shared_root && program.is_root() { Program::ANY_ROOT } else { program }
    }

    /// The embeddings of the running programs of `n_rows` decisions, a row each.
    ///
    /// # Shapes
    ///
    /// `[B, embedding]`
    pub(crate) fn rows(&self, running: RunningPrograms<'_>, n_rows: usize) -> Tensor<2> {
        match running {
            RunningPrograms::One(program) => repeat_row(self.embedding(program), n_rows),
            RunningPrograms::Each(programs) => {
                let all = self.programs.val();
                let programs: Vec<Program> = programs.iter().map(|&program| self.row(program)).collect();
                Tensor::<2>::from_data(one_hot(&programs, all.dims()[0]), &all.device()).matmul(all)
            }
        }
    }

    /// How well each row's key fits: the logits of the next program.
    ///
    /// # Shapes
    ///
    /// `[B, key]` → `[B, programs]`
    pub fn address(&self, key: Tensor<2>) -> Tensor<2> {
        key.matmul(self.keys.val().transpose())
    }

    /// The core's decision from its hidden vector: `key_and_end` gives the key and, behind it, the end.
    ///
    /// # Shapes
    ///
    /// `[B, hidden]`
    pub(crate) fn decide(&self, key_and_end: &Linear, hidden: Tensor<2>) -> CoreOutput {
        let output = key_and_end.forward(hidden.clone());
        let n_key = output.dims()[1] - 1;
        let programs = self.address(output.clone().narrow(1, 0, n_key));
        CoreOutput { programs, end: output.narrow(1, n_key, 1), hidden }
    }
}
