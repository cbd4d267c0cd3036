//! What an encoder is to the rest of a network.
//!
//! An encoder reads the task specification and the state. The core, the scoping head and the program memory only see
//! what it makes of them, so another kind of specification or of observation is another encoder.

use burn::module::{Module, ModuleDisplay};
use burn::tensor::{Device, Tensor};

use crate::model::layers::Init;
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::specification_rows::States;
use crate::model::windows::Windows;
use crate::seed::Seed;
use crate::trace::Span;

/// Features that an encoder gives, and the layers that suit it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Widths {
    /// Of the specification as a whole.
    pub context: usize,
    /// Of the state.
    pub state: usize,
    /// Of each frame of the specification.
    pub frame: usize,
    /// Of program embeddings and keys.
    pub program: usize,
    /// Of the core's layers; the last is what it decides from.
    pub core: Vec<usize>,
}

impl Widths {
    /// What the core decides from.
    pub fn hidden(&self) -> usize {
        self.core.last().copied().unwrap_or_default()
    }
}

/// How a network with an encoder is trained unless a pipeline file says otherwise. The values stand beside each encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingDefaults {
    /// Steps of the optimizer.
    pub steps: u32,
    /// Highest learning rate.
    pub learning_rate: f32,
    /// How often slots are relabelled, 0 to 1.
    pub relabel_slots: f32,
    /// How often an empty gripper is put elsewhere before it moves, 0 to 1.
    pub gripper_jitter: f32,
    /// How often part of what was built lies on the table again, 0 to 1.
    pub recovery_states: f32,
}

impl TrainingDefaults {
    /// Without augmentations.
    pub(crate) const fn plain(steps: u32, learning_rate: f32) -> Self {
        Self { steps, learning_rate, relabel_slots: 0.0, gripper_jitter: 0.0, recovery_states: 0.0 }
    }
}

/// Reads the task specification and the state (the paper's `f_TSE` and `f_ENC`).
pub trait Encoder: Module + ModuleDisplay + Sync + Sized + 'static {
    /// Its widths, as they stand in a model's configuration.
    type Config: Copy;
    /// See [`super::Network::Percepts`].
    type Percepts: Clone + Send + Sync;
    /// What is computed of a specification before any state is seen.
    type Demonstration: Clone + Send + Sync;
    /// Specification and state, encoded.
    type Reading;
    /// How it finds the argument of a primitive.
    type Argument: ArgumentDecoder<Self>;

    /// A fresh encoder for scenes of `n_slots` slots.
    fn new(config: &Self::Config, n_slots: usize, init: &mut Init) -> Self;

    /// What it gives.
    fn widths(config: &Self::Config) -> Widths;

    /// See [`super::Network::calibrated`].
    ///
    /// # Errors
    ///
    /// As there.
    fn calibrated(self, _sample: &PictureSample, _seed: Seed) -> Result<Self, ReadError> {
        Ok(self)
    }

    /// See [`super::Network::perceive`].
    ///
    /// # Errors
    ///
    /// As there.
    fn perceive(&self, pictures: &Pictures) -> Result<Self::Percepts, ReadError>;

    /// See [`super::Network::demonstration`].
    ///
    /// # Errors
    ///
    /// As there.
    fn demonstration(&self, windows: &Windows, percepts: &Self::Percepts) -> Result<Self::Demonstration, ReadError>;

    /// See [`super::Network::window`].
    fn window(demonstration: &Self::Demonstration, span: Span) -> Self::Demonstration;

    /// See [`super::Network::read`].
    ///
    /// # Errors
    ///
    /// As there.
    fn read(
        &self,
        demonstration: &Self::Demonstration,
        states: &States,
        percepts: &Self::Percepts,
    ) -> Result<Self::Reading, ReadError>;

    /// The specification as a whole, `[B, context]`.
    fn context(reading: &Self::Reading) -> Tensor<2>;

    /// The state, `[B, state]`.
    fn state(reading: &Self::Reading) -> Tensor<2>;

    /// Each frame of the specification as the scoping head sees it, `[B, T, frame]`.
    fn frames(reading: &Self::Reading) -> Tensor<3>;

    /// Where the parameters are.
    fn device(&self) -> Device;
}

/// Finds the argument of a primitive.
pub trait ArgumentDecoder<E: Encoder>: Module + ModuleDisplay + Sync + 'static {
    /// A fresh decoder. `n_view` is the width of what stands for the state, see [`super::Core::view_width`].
    fn new(config: &E::Config, n_slots: usize, n_view: usize, init: &mut Init) -> Self;

    /// Logits over the slots.
    ///
    /// # Shapes
    ///
    /// program `[B, program]`, view `[B, view]`, hidden `[B, hidden]` → `[B, N]`
    fn forward(&self, reading: &E::Reading, program: Tensor<2>, view: Tensor<2>, hidden: Tensor<2>) -> Tensor<2>;
}
