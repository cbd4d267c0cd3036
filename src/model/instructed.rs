//! The encoder of instructions: every sentence says which slot it speaks of, and that slot's place is read off the
//! state.
//!
//! ```text
//! words of sentence j ─► which slot it means, q_j ─► that slot's position, and its displacement from the slots that
//!                                                    the sentences before and after mean
//! words and these ─► temporal convolution ─► y_j ─► scoping labels;  max and last of them ─► core
//! attention over the sentences ─► q of the one that is meant ─► argument
//! ```
//!
//! # Source
//!
//! Ours: the paper names "a list of language instructions" as a form of task specification and leaves it open. What
//! the words mean is not given; it is learned from the program losses.

use burn::module::Module;
use burn::tensor::activation::{relu, softmax};
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::encoder::{ArgumentDecoder, Encoder, Widths};
use crate::model::features::{self, AGENT_WIDTH, OBJECT_WIDTH, POSITION_WIDTH};
use crate::model::layers::{Init, Mlp, TemporalConv, with_most_before};
use crate::model::limits::{ConfigError, check_kernels, check_sizes};
use crate::model::linear::Linear;
use crate::model::pictures::Pictures;
use crate::model::read_error::ReadError;
use crate::model::specification_rows::States;
use crate::model::summary::{state_with_gripper, summarize};
use crate::model::windows::{Padding, Windows};
use crate::trace::{ObservationRows, Span, Vocabulary};

/// Sharpens what a sentence means: a mixture of slots has no place.
const REFERENT_GAIN: f32 = 8.0;

/// Widths of the encoder of instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InstructedConfig {
    /// Features of a sentence, of the state, and of every hidden layer. Default 32.
    pub width: usize,
    /// Width of program embeddings and keys. Default 16.
    pub program_width: usize,
    /// Sentences that a scoping label sees around itself; odd. Default 5.
    pub scope_kernel: usize,
}

impl Default for InstructedConfig {
    fn default() -> Self {
        Self { width: 32, program_width: 16, scope_kernel: 5 }
    }
}

impl InstructedConfig {
    /// Whether a network can have these sizes.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        check_sizes(&[("width", self.width), ("program_width", self.program_width)])?;
        check_kernels(&[("scope_kernel", self.scope_kernel)])
    }
}

/// Reads sentences beside the state.
#[derive(Module, Debug)]
pub struct Instructed {
    words: Linear,
    referent: Linear,
    place: Linear,
    sentence: Linear,
    state: Mlp,
    scope_conv: TemporalConv,
}

/// Points at the slot that one of the sentences means.
#[derive(Module, Debug)]
pub struct Referent {
    sentence: Linear,
    context: Linear,
    attention: Linear,
}

/// What sentences say by themselves.
#[derive(Clone, Debug)]
pub struct Sentences {
    /// First layer of the words, `[B, T, H]`.
    words: Tensor<3>,
    /// Logits of the slot that is meant, `[B, T, N]`.
    referents: Tensor<3>,
    padding: Option<Padding>,
}

/// Sentences beside the state.
#[derive(Clone, Debug)]
pub struct InstructedReading {
    sentences: Sentences,
    /// Each sentence with its neighbours, `[B, T, H]`; zero beyond a window.
    frames: Tensor<3>,
    /// Most and last of the window, `[B, 2 H]`.
    context: Tensor<2>,
    /// The state with the gripper, `[B, H + AGENT_WIDTH]`.
    state: Tensor<2>,
}

impl Instructed {
    /// What the sentences mean, `[B, T, N]`: shares that sum to one, zero beyond a window.
    fn meant(sentences: &Sentences) -> Tensor<3> {
        Padding::mask(sentences.padding.as_ref(), softmax(sentences.referents.clone(), 2))
    }

    /// Where what is meant is, and how it lies to what the sentences before and after mean: `[B, T, places]`.
    fn places(&self, sentences: &Sentences, states: &ObservationRows) -> Tensor<3> {
        let device = self.device();
        let meant = Self::meant(sentences);
        let [n_batch, n_frames, n_slots] = meant.dims();
        let objects = TensorData::new(features::objects(states), [n_batch, n_slots, OBJECT_WIDTH]);
        let own = meant.clone().matmul(Tensor::<3>::from_data(objects, &device));
        let pairs = TensorData::new(features::pairs(states), [n_batch, n_slots, n_slots * POSITION_WIDTH]);
        let from_own = meant.clone().matmul(Tensor::<3>::from_data(pairs, &device)); // [B, T, N * position]
        let from_own = from_own.reshape([n_batch, n_frames, n_slots, POSITION_WIDTH]);
        let to = |other: Tensor<3>| (from_own.clone() * other.unsqueeze_dim(3)).sum_dim(2).squeeze_dim::<3>(2);
        let none = Tensor::zeros([n_batch, 1, n_slots], &device);
        let around = Tensor::cat(vec![none.clone(), meant, none], 1);
        let (before, after) = (around.clone().narrow(1, 0, n_frames), around.narrow(1, 2, n_frames));
        Tensor::cat(vec![own, to(before), to(after)], 2)
    }
}

impl Encoder for Instructed {
    type Config = InstructedConfig;
    type Percepts = ();
    type Demonstration = Sentences;
    type Reading = InstructedReading;
    type Argument = Referent;

    fn new(config: &InstructedConfig, n_slots: usize, init: &mut Init) -> Self {
        let &InstructedConfig { width, scope_kernel, .. } = config;
        let n_words = Vocabulary::size(n_slots);
        let n_places = OBJECT_WIDTH + 2 * POSITION_WIDTH;
        Self {
            words: init.linear(n_words, width),
            referent: init.linear(n_words, n_slots),
            place: init.part(n_places, width, n_places + n_words),
            sentence: init.linear(width, width),
            state: init.mlp(&[OBJECT_WIDTH, width, width]),
            scope_conv: init.temporal_conv(scope_kernel, width, width),
        }
    }

    fn widths(config: &InstructedConfig) -> Widths {
        let &InstructedConfig { width, program_width, .. } = config;
        let (context, frame) = (2 * width, 2 * width);
        Widths { context, state: width + AGENT_WIDTH, frame, program: program_width, core: vec![width] }
    }

    fn perceive(&self, _pictures: &Pictures) -> Result<(), ReadError> {
        Ok(())
    }

    fn demonstration(&self, windows: &Windows, (): &()) -> Result<Sentences, ReadError> {
        let n_words = Vocabulary::size(windows.n_slots());
        let shape = [windows.n_windows(), windows.n_frames(), n_words];
        let words = Tensor::from_data(TensorData::new(windows.bags_of_words(n_words)?, shape), &self.device());
        Ok(Sentences {
            referents: self.referent.forward(words.clone()) * REFERENT_GAIN,
            words: self.words.forward(words),
            padding: windows.padding(&self.device()),
        })
    }

    fn window(sentences: &Sentences, span: Span) -> Sentences {
        let cut = |rows: &Tensor<3>| rows.clone().narrow(1, span.begin as usize, span.len());
        Sentences { words: cut(&sentences.words), referents: cut(&sentences.referents), padding: None }
    }

    fn read(&self, sentences: &Sentences, states: &States, (): &()) -> Result<InstructedReading, ReadError> {
        let padding = sentences.padding.as_ref();
        let states = states.observations()?;
        let places = self.place.forward(self.places(sentences, states));
        let frames = relu(self.sentence.forward(relu(sentences.words.clone() + places)));
        let (frames, context) = summarize(&self.scope_conv, frames, padding);
        let state = state_with_gripper(&self.state, states, &self.scope_conv);
        Ok(InstructedReading { sentences: sentences.clone(), frames, context, state })
    }

    fn context(reading: &InstructedReading) -> Tensor<2> {
        reading.context.clone()
    }

    fn state(reading: &InstructedReading) -> Tensor<2> {
        reading.state.clone()
    }

    fn frames(reading: &InstructedReading) -> Tensor<3> {
        with_most_before(reading.frames.clone())
    }

    fn device(&self) -> Device {
        self.sentence.device()
    }
}

impl ArgumentDecoder<Instructed> for Referent {
    fn new(config: &InstructedConfig, _n_slots: usize, _n_view: usize, init: &mut Init) -> Self {
        let &InstructedConfig { width, program_width, .. } = config;
        let n_context = program_width + width;
        Self {
            sentence: init.part(width, width, width + n_context),
            context: init.linear(n_context, width),
            attention: init.linear(width, 1),
        }
    }

    fn forward(
        &self,
        reading: &InstructedReading,
        program: Tensor<2>,
        _view: Tensor<2>,
        hidden: Tensor<2>,
    ) -> Tensor<2> {
        let Sentences { referents, padding, .. } = &reading.sentences;
        let context = self.context.forward(Tensor::cat(vec![program, hidden], 1));
        let sentences = self.sentence.forward(reading.frames.clone()) + context.unsqueeze_dim(1);
        let scores = Padding::hide(padding.as_ref(), self.attention.forward(relu(sentences))); // [B, T, 1]
        (referents.clone() * softmax(scores, 1)).sum_dim(1).squeeze_dim(1)
    }
}
