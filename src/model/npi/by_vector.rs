//! State and arguments as one vector.

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};

use crate::model::features::{self, flat_width};
use crate::model::layers::{Init, Mlp};
use crate::model::linear::Linear;
use crate::model::network::CalledWith;
use crate::model::npi::{CallEncoder, flags};
use crate::model::scoping_kind::MAX_ARGUMENTS;
use crate::model::vectors::FlattenedConfig;
use crate::trace::ObservationRows;

/// All slots side by side, and for each whether it is an argument.
#[derive(Module, Debug)]
pub struct ByVector {
    state: Mlp,
    hidden: Mlp,
    slots: Linear,
}

impl CallEncoder for ByVector {
    type Config = FlattenedConfig;
    /// `[B, H]`
    type Reading = Tensor<2>;

    fn new(config: &FlattenedConfig, n_slots: usize, init: &mut Init) -> Self {
        let &FlattenedConfig { width, program_width, .. } = config;
        Self {
            state: init.mlp(&[flat_width(n_slots, false) + MAX_ARGUMENTS * n_slots, width, width]),
            hidden: init.mlp(&[2 * width + program_width, width]),
            slots: init.linear(width, MAX_ARGUMENTS * n_slots),
        }
    }

    fn widths(config: &FlattenedConfig) -> (usize, usize) {
        (config.width, config.program_width)
    }

    fn read(&self, states: &ObservationRows, called_with: &[CalledWith]) -> Tensor<2> {
        let device = self.device();
        let (n_batch, n_slots) = (called_with.len(), self.n_slots());
        let states = TensorData::new(features::flat(states, n_slots, false), [n_batch, flat_width(n_slots, false)]);
        let flags = TensorData::new(flags(called_with, n_slots), [n_batch, MAX_ARGUMENTS * n_slots]);
        self.state.forward(Tensor::cat(vec![Tensor::from_data(states, &device), Tensor::from_data(flags, &device)], 1))
    }

    fn state(reading: &Tensor<2>) -> Tensor<2> {
        reading.clone()
    }

    fn arguments(&self, reading: &Tensor<2>, program: Tensor<2>, hidden: Tensor<2>) -> Tensor<2> {
        let n_batch = hidden.dims()[0];
        let hidden = self.hidden.forward(Tensor::cat(vec![reading.clone(), program, hidden], 1));
        self.slots.forward(hidden).reshape([n_batch * MAX_ARGUMENTS, self.n_slots()])
    }

    fn device(&self) -> Device {
        self.slots.device()
    }
}

impl ByVector {
    fn n_slots(&self) -> usize {
        self.slots.n_outputs() / MAX_ARGUMENTS
    }
}
