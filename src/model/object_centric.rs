//! The object-centric encoder: every slot of every demonstrated frame is compared with the same slot now.
//!
//! ```text
//! for each pair (i, k) of slots: displacement in the frame, displacement now ─► max over k ─► e_ji
//! for each slot i: e_ji, position in the frame, position now, gripper      ─► u_ji ─► max over i ─► v_j
//! temporal convolution over v_j ─► y_j ─► scoping labels;  max and last of them ─► core
//! temporal convolution over u_ji for each slot ─► pointer argument
//! ```
//!
//! # Invariants
//!
//! Slots enter through shared layers and maxima alone: relabelling them relabels the argument and changes nothing
//! else, and any number of slots will do.
//!
//! # Source
//!
//! Ours, beyond the paper, whose encoder is [`super::flattened`]; interpreter, core and memory are the paper's.

use burn::module::Module;
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::encoder::{ArgumentDecoder, Encoder, TrainingDefaults, Widths};
use crate::model::features::{self, AGENT_WIDTH, OBJECT_WIDTH, POSITION_WIDTH};
use crate::model::layers::{Init, Mlp, TemporalConv, with_most_before};
use crate::model::limits::{ConfigError, check_kernels, check_sizes};
use crate::model::linear::Linear;
use crate::model::pictures::Pictures;
use crate::model::read_error::ReadError;
use crate::model::specification_rows::States;
use crate::model::summary::{state_with_gripper, summarize};
use crate::model::windows::{Padding, Windows};
use crate::trace::{ObservationRows, Span};

/// Widths of the object-centric networks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectCentricConfig {
    /// Features of a pair of slots. Default 12.
    pub pair_width: usize,
    /// Features of a slot, of a frame, of the state, and of every hidden layer. Default 32.
    pub width: usize,
    /// Width of program embeddings and keys. Default 16.
    pub program_width: usize,
    /// Frames that a scoping label sees around itself; odd. Default 5.
    pub scope_kernel: usize,
    /// Frames that an argument sees around itself; odd. Default 3.
    pub argument_kernel: usize,
}

impl Default for ObjectCentricConfig {
    fn default() -> Self {
        Self { pair_width: 12, width: 32, program_width: 16, scope_kernel: 5, argument_kernel: 3 }
    }
}

impl ObjectCentricConfig {
    /// Whether a network can have these sizes.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let &Self { pair_width, width, program_width, scope_kernel, argument_kernel } = self;
        check_sizes(&[("pair_width", pair_width), ("width", width), ("program_width", program_width)])?;
        check_kernels(&[("scope_kernel", scope_kernel), ("argument_kernel", argument_kernel)])
    }
}

/// The object-centric encoder.
#[derive(Module, Debug)]
pub struct ObjectCentric {
    pair_demonstration: Linear,
    pair_state: Linear,
    pair: Linear,
    object_pairs: Linear,
    object_demonstration: Linear,
    object_state: Linear,
    object: Linear,
    state: Mlp,
    scope_conv: TemporalConv,
}

/// Points at a slot by what the specification and the state show of it.
#[derive(Module, Debug)]
pub struct Pointer {
    conv: TemporalConv,
    object: Linear,
    context: Linear,
    slot: Linear,
}

/// First layers of pairs and slots, for the demonstration alone.
#[derive(Clone, Debug)]
pub struct ObjectDemonstration {
    /// `[B, T, N * N, pair]`
    pairs: Tensor<4>,
    /// `[B, T, N, H]`
    objects: Tensor<4>,
    padding: Option<Padding>,
}

/// Demonstration and state, compared.
#[derive(Clone, Debug)]
pub struct ObjectReading {
    /// Each slot in each frame, `[B, T, N, H]`.
    objects: Tensor<4>,
    /// Each frame with its neighbours, `[B, T, H]`; zero beyond a window.
    frames: Tensor<3>,
    /// Most and last of the window, `[B, 2 H]`.
    context: Tensor<2>,
    /// The state with the gripper, `[B, H + AGENT_WIDTH]`.
    state: Tensor<2>,
    padding: Option<Padding>,
}

impl ObjectCentric {
    /// Relabelling changes nothing for it. It learns from jittered grippers and from what was knocked over at once.
    pub(crate) const TRAINING: TrainingDefaults =
        TrainingDefaults { gripper_jitter: 0.2, recovery_states: 0.25, ..TrainingDefaults::plain(1000, 0.003) };

    /// Each slot in each frame, compared with its pairs and itself now: `[B, T, N, H]`.
    fn compare(&self, demonstration: &ObjectDemonstration, states: &ObservationRows) -> Tensor<4> {
        let device = self.device();
        let ObjectDemonstration { pairs, objects, padding: _ } = demonstration;
        let [n_batch, n_frames, n_slots, _] = objects.dims();
        let now = [n_batch, 1, n_slots * n_slots, POSITION_WIDTH];
        let pairs_now =
            self.pair_state.forward(Tensor::<4>::from_data(TensorData::new(features::pairs(states), now), &device));
        let compared = self.pair.forward(relu(pairs.clone() + pairs_now)); // [B, T, N * N, pair]
        let n_pair = compared.dims()[3];
        let relations = compared.reshape([n_batch * n_frames, n_slots, n_slots, n_pair]).max_dim(2); // [B * T, N, 1, pair]
        let relations = relations.reshape([n_batch, n_frames, n_slots, n_pair]);
        let now = [n_batch, 1, n_slots, OBJECT_WIDTH];
        let objects_now = Tensor::<4>::from_data(TensorData::new(features::objects(states), now), &device);
        let hidden = self.object_pairs.forward(relations) + objects.clone() + self.object_state.forward(objects_now);
        relu(self.object.forward(relu(hidden)))
    }
}

impl Encoder for ObjectCentric {
    type Config = ObjectCentricConfig;
    type Percepts = ();
    type Demonstration = ObjectDemonstration;
    type Reading = ObjectReading;
    type Argument = Pointer;

    fn new(config: &ObjectCentricConfig, _n_slots: usize, init: &mut Init) -> Self {
        let &ObjectCentricConfig { pair_width, width, scope_kernel, .. } = config;
        let n_pair = 2 * POSITION_WIDTH;
        let n_object = pair_width + 2 * OBJECT_WIDTH;
        Self {
            pair_demonstration: init.part(POSITION_WIDTH, pair_width, n_pair),
            pair_state: init.linear(POSITION_WIDTH, pair_width),
            pair: init.linear(pair_width, pair_width),
            object_pairs: init.part(pair_width, width, n_object),
            object_demonstration: init.part(OBJECT_WIDTH, width, n_object),
            object_state: init.linear(OBJECT_WIDTH, width),
            object: init.linear(width, width),
            state: init.mlp(&[OBJECT_WIDTH, width, width]),
            scope_conv: init.temporal_conv(scope_kernel, width, width),
        }
    }

    fn widths(config: &ObjectCentricConfig) -> Widths {
        let &ObjectCentricConfig { width, program_width, .. } = config;
        let (context, frame) = (2 * width, 2 * width);
        Widths { context, state: width + AGENT_WIDTH, frame, program: program_width, core: vec![width] }
    }

    fn perceive(&self, _pictures: &Pictures) -> Result<(), ReadError> {
        Ok(())
    }

    fn demonstration(&self, windows: &Windows, (): &()) -> Result<ObjectDemonstration, ReadError> {
        let (device, rows) = (self.device(), windows.observations()?);
        let (n_batch, n_frames, n_slots) = (windows.n_windows(), windows.n_frames(), windows.n_slots());
        let pairs = TensorData::new(features::pairs(rows), [n_batch, n_frames, n_slots * n_slots, POSITION_WIDTH]);
        let objects = TensorData::new(features::objects(rows), [n_batch, n_frames, n_slots, OBJECT_WIDTH]);
        Ok(ObjectDemonstration {
            pairs: self.pair_demonstration.forward(Tensor::from_data(pairs, &device)),
            objects: self.object_demonstration.forward(Tensor::from_data(objects, &device)),
            padding: windows.padding(&device),
        })
    }

    fn window(demonstration: &ObjectDemonstration, span: Span) -> ObjectDemonstration {
        let cut = |frames: &Tensor<4>| frames.clone().narrow(1, span.begin as usize, span.len());
        ObjectDemonstration { pairs: cut(&demonstration.pairs), objects: cut(&demonstration.objects), padding: None }
    }

    fn read(&self, demonstration: &ObjectDemonstration, states: &States, (): &()) -> Result<ObjectReading, ReadError> {
        let padding = demonstration.padding.as_ref();
        let states = states.observations()?;
        let objects = self.compare(demonstration, states);
        let (frames, context) = summarize(&self.scope_conv, objects.clone().max_dim(2).squeeze_dim(2), padding);
        Ok(ObjectReading {
            objects,
            frames,
            context,
            state: state_with_gripper(&self.state, states, &self.scope_conv),
            padding: demonstration.padding.clone(),
        })
    }

    fn context(reading: &ObjectReading) -> Tensor<2> {
        reading.context.clone()
    }

    fn state(reading: &ObjectReading) -> Tensor<2> {
        reading.state.clone()
    }

    fn frames(reading: &ObjectReading) -> Tensor<3> {
        with_most_before(reading.frames.clone())
    }

    fn device(&self) -> Device {
        self.pair.device()
    }
}

impl ArgumentDecoder<ObjectCentric> for Pointer {
    fn new(config: &ObjectCentricConfig, _n_slots: usize, _n_view: usize, init: &mut Init) -> Self {
        let &ObjectCentricConfig { width, program_width, argument_kernel, .. } = config;
        let n_context = program_width + width;
        Self {
            conv: init.temporal_conv(argument_kernel, width, width),
            object: init.part(2 * width, width, 2 * width + n_context),
            context: init.linear(n_context, width),
            slot: init.linear(width, 1),
        }
    }

    fn forward(&self, reading: &ObjectReading, program: Tensor<2>, _view: Tensor<2>, hidden: Tensor<2>) -> Tensor<2> {
        let padding = reading.padding.as_ref();
        let objects = Padding::mask_objects(padding, reading.objects.clone());
        let last = Padding::last_objects(padding, objects.clone());
        let moving = Padding::mask_objects(padding, self.conv.forward(objects)).max_dim(1).squeeze_dim(1);
        let context = self.context.forward(Tensor::cat(vec![program, hidden], 1));
        let object = self.object.forward(Tensor::<3>::cat(vec![moving, last], 2));
        self.slot.forward(relu(object + context.unsqueeze_dim(1))).squeeze_dim(2)
    }
}
