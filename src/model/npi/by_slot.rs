//! State and arguments slot by slot.

use burn::module::Module;
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};

use crate::model::features::{self, OBJECT_WIDTH, POSITION_WIDTH};
use crate::model::layers::Init;
use crate::model::linear::Linear;
use crate::model::network::CalledWith;
use crate::model::npi::{CallEncoder, flags};
use crate::model::object_centric::ObjectCentricConfig;
use crate::model::scoping_kind::MAX_ARGUMENTS;
use crate::trace::ObservationRows;

/// Each slot with its relations to the others and whether it is an argument. Slots are named through a layer with
/// parameters for each of them: what a task does to which slot stands in the weights alone.
#[derive(Module, Debug)]
pub struct BySlot {
    pair: Linear,
    object: Linear,
    hidden: Linear,
    slot_object: Linear,
    slot_context: Linear,
    slot: Linear,
}

/// Each slot `[B, N, H]`, and the most of them `[B, H]`.
#[derive(Clone, Debug)]
pub struct SlotReading {
    objects: Tensor<3>,
    state: Tensor<2>,
}

impl CallEncoder for BySlot {
    type Config = ObjectCentricConfig;
    type Reading = SlotReading;

    fn new(config: &ObjectCentricConfig, n_slots: usize, init: &mut Init) -> Self {
        let &ObjectCentricConfig { pair_width, width, program_width, .. } = config;
        let n_slot = 2 * width + program_width;
        Self {
            pair: init.linear(POSITION_WIDTH, pair_width),
            object: init.linear(pair_width + OBJECT_WIDTH + MAX_ARGUMENTS, width),
            hidden: init.linear(width, width),
            slot_object: init.part(width, width, n_slot),
            slot_context: init.linear(program_width + width, n_slots * width),
            slot: init.linear(width, MAX_ARGUMENTS),
        }
    }

    fn widths(config: &ObjectCentricConfig) -> (usize, usize) {
        (config.width, config.program_width)
    }

    fn read(&self, states: &ObservationRows, called_with: &[CalledWith]) -> SlotReading {
        let device = self.device();
        let (n_batch, n_slots) = (called_with.len(), self.n_slots());
        let pairs = TensorData::new(features::pairs(states), [n_batch, n_slots, n_slots, POSITION_WIDTH]);
        let pairs = relu(self.pair.forward(Tensor::<4>::from_data(pairs, &device)));
        let relations = pairs.max_dim(2).squeeze_dim::<3>(2); // [B, N, pair]
        let objects = TensorData::new(features::objects(states), [n_batch, n_slots, OBJECT_WIDTH]);
        let flags = TensorData::new(flags(called_with, n_slots), [n_batch, n_slots, MAX_ARGUMENTS]);
        let features = vec![relations, Tensor::from_data(objects, &device), Tensor::from_data(flags, &device)];
        let objects = relu(self.hidden.forward(relu(self.object.forward(Tensor::cat(features, 2)))));
        SlotReading { state: objects.clone().max_dim(1).squeeze_dim(1), objects }
    }

    fn state(reading: &SlotReading) -> Tensor<2> {
        reading.state.clone()
    }

    fn arguments(&self, reading: &SlotReading, program: Tensor<2>, hidden: Tensor<2>) -> Tensor<2> {
        let [n_batch, n_slots, width] = reading.objects.dims();
        let context = self.slot_context.forward(Tensor::cat(vec![program, hidden], 1));
        let context = context.reshape([n_batch, n_slots, width]);
        let slots = relu(self.slot_object.forward(reading.objects.clone()) + context);
        let logits = self.slot.forward(slots); // [B, N, arguments]
        logits.swap_dims(1, 2).reshape([n_batch * MAX_ARGUMENTS, n_slots])
    }

    fn device(&self) -> Device {
        self.pair.device()
    }
}

impl BySlot {
    fn n_slots(&self) -> usize {
        self.slot_context.n_outputs() / self.slot_object.n_outputs()
    }
}
