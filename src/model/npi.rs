//! The Neural Programmer-Interpreter: programs with arguments, an LSTM, and no task specification.
//!
//! A task is known by name: each that was trained on has a row of its own beside the program memory, which stands for
//! the root's embedding. A task that was not has none, and so nothing tells the root what to do. Programs below the
//! root are called with slots.
//!
//! # Source
//!
//! Reed and de Freitas, "Neural Programmer-Interpreters", 2016, as told in the paper, section IV.

mod by_slot;
mod by_vector;

pub use by_slot::{BySlot, SlotReading};
pub use by_vector::ByVector;

use burn::module::{Module, ModuleDisplay, Param};
use burn::tensor::{Device, Tensor, TensorData};

use crate::model::core_network::{Core, LstmCore};
use crate::model::layers::Init;
use crate::model::linear::Linear;
use crate::model::memory::ProgramMemory;
use crate::model::network::{CalledWith, CoreOutput, Network};
use crate::model::pictures::Pictures;
use crate::model::read_error::ReadError;
use crate::model::running_programs::RunningPrograms;
use crate::model::scoping_kind::ScopingKind;
use crate::model::specification_rows::States;
use crate::model::windows::Windows;
use crate::seed::Seed;
use crate::trace::{ObservationRows, Span};

/// Reads the state and the slots that a program was called with, and names the slots that it calls another with.
pub trait CallEncoder: Module + ModuleDisplay + Sync + Sized + 'static {
    /// Its widths, as they stand in a model's configuration.
    type Config: Copy;
    /// State and arguments, encoded.
    type Reading;

    /// A fresh encoder for scenes of `n_slots` slots.
    fn new(config: &Self::Config, n_slots: usize, init: &mut Init) -> Self;

    /// Features of a hidden layer, and of program embeddings and keys.
    fn widths(config: &Self::Config) -> (usize, usize);

    /// Observations and what each running program was called with.
    fn read(&self, states: &ObservationRows, called_with: &[CalledWith]) -> Self::Reading;

    /// All of it in one vector, `[B, H]`.
    fn state(reading: &Self::Reading) -> Tensor<2>;

    /// Logits over the slots of each argument: hidden `[B, H]` → `[B * arguments, N]`.
    fn arguments(&self, reading: &Self::Reading, program: Tensor<2>, hidden: Tensor<2>) -> Tensor<2>;

    /// Where the parameters are.
    fn device(&self) -> Device;
}

/// The network of the variants `npi` and `npi_paper`.
///
/// # Shapes
///
/// ```text
/// states [B, N], slots called with                 ─► state [B, H]
/// state, program + task [B, program]               ─► LSTM: hidden [B, H] ─► programs [B, P], end [B, 1]
/// slots, program + task, hidden                    ─► slots of each argument [B * arguments, N]
/// ```
#[derive(Module, Debug)]
pub struct Npi<E: Module> {
    encoder: E,
    core: LstmCore,
    key_and_end: Linear,
    memory: ProgramMemory,
    /// `[tasks + 1, embedding]`; the last is nobody's, so that there is a row without any task.
    tasks: Param<Tensor<2>>,
}

/// State and arguments, and whose call it is.
#[derive(Clone, Debug)]
pub struct NpiReading<R> {
    calls: R,
    /// What the running program's embedding has added, `[B, embedding]`.
    tasks: Tensor<2>,
}

impl<E: CallEncoder> Npi<E> {
    /// A fresh network for scenes of `n_slots` slots that knows `n_tasks` tasks by name; the same seed gives the same
    /// parameters.
    pub fn new(config: &E::Config, n_slots: usize, n_tasks: usize, seed: Seed, device: &Device) -> Self {
        Self::drawn(config, n_slots, n_tasks, &mut Init::new(seed, device))
    }

    /// The same with parameters drawn after others.
    pub(crate) fn drawn(config: &E::Config, n_slots: usize, n_tasks: usize, init: &mut Init) -> Self {
        let (n_hidden, n_program) = E::widths(config);
        Self {
            encoder: E::new(config, n_slots, init),
            core: LstmCore::new(init, n_hidden + n_program, &[n_hidden]),
            key_and_end: init.linear(n_hidden, n_program + 1),
            memory: ProgramMemory::new(init, n_program),
            tasks: init.parameter([n_tasks + 1, n_program], 1.0),
        }
    }

    /// The rows of tasks; zeros for a call that is no task's root, and for a task that is not known.
    fn task_rows(&self, called_with: &[CalledWith]) -> Tensor<2> {
        let device = self.device();
        let n_tasks = self.tasks.dims()[0];
        let mut chosen = vec![0.0_f32; called_with.len() * n_tasks];
        for (row, call) in chosen.chunks_exact_mut(n_tasks).zip(called_with) {
            if let Some(weight) = call.task.and_then(|task| row.get_mut(task)) {
                *weight = 1.0;
            }
        }
        let chosen = Tensor::<2>::from_data(TensorData::new(chosen, [called_with.len(), n_tasks]), &device);
        chosen.matmul(self.tasks.val())
    }

    fn program(&self, reading: &NpiReading<E::Reading>, running: RunningPrograms<'_>) -> Tensor<2> {
        self.memory.rows(running, reading.tasks.dims()[0]) + reading.tasks.clone()
    }
}

impl<E: CallEncoder> Network for Npi<E> {
    const IS_RECURRENT: bool = LstmCore::IS_RECURRENT;

    type Percepts = ();
    type Demonstration = ();
    type Reading = NpiReading<E::Reading>;
    type Recall = <LstmCore as Core>::Recall;

    fn scoping(&self) -> ScopingKind {
        ScopingKind::Arguments
    }

    fn perceive(&self, _pictures: &Pictures) -> Result<(), ReadError> {
        Ok(())
    }

    fn demonstration(&self, _windows: &Windows, (): &()) -> Result<(), ReadError> {
        Ok(())
    }

    fn window((): &(), _span: Span) {}

    fn read(&self, (): &(), states: &States, (): &(), called_with: &[CalledWith]) -> Result<Self::Reading, ReadError> {
        let calls = self.encoder.read(states.observations()?, called_with);
        Ok(NpiReading { calls, tasks: self.task_rows(called_with) })
    }

    fn core(
        &self,
        reading: &Self::Reading,
        running: RunningPrograms<'_>,
        steps: &[usize],
        recall: Option<Self::Recall>,
    ) -> (CoreOutput, Self::Recall) {
        let input = Tensor::cat(vec![E::state(&reading.calls), self.program(reading, running)], 1);
        let (hidden, recall) = self.core.run(input, steps, recall);
        (self.memory.decide(&self.key_and_end, hidden), recall)
    }

    fn scope(&self, _reading: &Self::Reading, _running: RunningPrograms<'_>, _core: &CoreOutput) -> Option<Tensor<3>> {
        None
    }

    fn argument(&self, reading: &Self::Reading, running: RunningPrograms<'_>, core: &CoreOutput) -> Tensor<2> {
        self.encoder.arguments(&reading.calls, self.program(reading, running), core.hidden.clone())
    }

    fn device(&self) -> Device {
        self.encoder.device()
    }
}

/// One where a slot is an argument: `[B, N, MAX_ARGUMENTS]`.
fn flags(called_with: &[CalledWith], n_slots: usize) -> Vec<f32> {
    let slots = |call: &CalledWith| {
        let arguments = call.arguments;
        (0..n_slots).flat_map(move |slot| {
            arguments.map(|argument| f32::from(u8::from(argument.is_some_and(|named| usize::from(named.0) == slot))))
        })
    };
    called_with.iter().flat_map(slots).collect()
}
