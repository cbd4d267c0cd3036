//! The paper's encoder: an observation is one vector, of all objects' positions or of a picture.
//!
//! # Source
//!
//! Paper, section IV. It leaves widths, depths and input features open; where a choice decided whether it trains, the
//! reason stands beside it. The argument decoder has an encoder of its own: with a shared one its loss stays at chance.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use crate::model::encoder::{ArgumentDecoder, Encoder, Widths};
use crate::model::layers::{Init, Mlp, TemporalConv, max_over_frames};
use crate::model::linear::Linear;
use crate::model::pictures::Pictures;
use crate::model::read_error::ReadError;
use crate::model::specification_rows::States;
use crate::model::vectors::{FlattenedConfig, Positions, Vectors};
use crate::model::windows::{Padding, Windows};
use crate::trace::Span;

/// The paper's encoder of positions.
pub type Flattened = FlatEncoder<Positions>;

/// The paper's encoder.
#[derive(Module, Debug)]
pub struct FlatEncoder<V: Module> {
    vectors: V,
    state: Mlp,
    specification: SpecificationEncoder,
}

/// The paper's argument decoder, with an encoder of its own.
#[derive(Module, Debug)]
pub struct FlatArgument {
    specification: SpecificationEncoder,
    hidden: Mlp,
    slots: Linear,
}

/// `f_TSE`: frames embedded, convolved over time, and summed up in one vector.
#[derive(Module, Debug)]
struct SpecificationEncoder {
    frame: Mlp,
    conv: TemporalConv,
    summary: Mlp,
}

impl SpecificationEncoder {
    fn new(init: &mut Init, n_features: usize, width: usize, kernel: usize) -> Self {
        Self {
            frame: init.mlp(&[n_features, width, width]),
            conv: init.temporal_conv(kernel, width, width),
            summary: init.mlp(&[3 * width, width]),
        }
    }

    /// Convolved frames `[B, T, H]` and the summary `[B, H]`. The last frame is in it by itself, since the end of a
    /// program is judged by it.
    fn forward(&self, frames: Tensor<3>, padding: Option<&Padding>) -> (Tensor<3>, Tensor<2>) {
        let embedded = Padding::mask(padding, self.frame.forward(frames));
        let last = Padding::last_frame(padding, embedded.clone());
        let first = embedded.clone().narrow(1, 0, 1).squeeze_dim(1);
        let convolved = Padding::mask(padding, self.conv.forward(embedded));
        let most = max_over_frames(convolved.clone());
        (convolved, self.summary.forward(Tensor::cat(vec![most, last, first], 1)))
    }
}

/// Features of a demonstration.
#[derive(Clone, Debug)]
pub struct FlatDemonstration {
    /// `[B, T, features]`
    frames: Tensor<3>,
    padding: Option<Padding>,
    /// Slots of its scene: at most as many as the network is made for.
    n_slots: usize,
}

/// Demonstration and state, encoded.
#[derive(Clone, Debug)]
pub struct FlatReading {
    demonstration: FlatDemonstration,
    /// `[B, T, H]`
    convolved: Tensor<3>,
    /// `[B, H]`
    summary: Tensor<2>,
    /// `[B, H]`
    state: Tensor<2>,
}

impl<V: Vectors> Encoder for FlatEncoder<V> {
    type Config = V::Config;
    type Percepts = V::Percepts;
    type Demonstration = FlatDemonstration;
    type Reading = FlatReading;
    type Argument = FlatArgument;

    fn new(config: &V::Config, n_slots: usize, init: &mut Init) -> Self {
        let &FlattenedConfig { width, scope_kernel, .. } = V::widths(config);
        let n_features = V::width(config, n_slots);
        Self {
            vectors: V::new(config, n_slots, init),
            state: init.mlp(&[n_features, width, width]),
            specification: SpecificationEncoder::new(init, n_features, width, scope_kernel),
        }
    }

    fn widths(config: &V::Config) -> Widths {
        let &FlattenedConfig { width, program_width, .. } = V::widths(config);
        Widths { context: width, state: width, frame: width, program: program_width, core: vec![width, width] }
    }

    fn perceive(&self, pictures: &Pictures) -> Result<V::Percepts, ReadError> {
        Ok(self.vectors.perceive(pictures))
    }

    fn demonstration(&self, windows: &Windows, percepts: &V::Percepts) -> Result<FlatDemonstration, ReadError> {
        let device = self.device();
        let frames = self.vectors.of_windows(windows, percepts, &device)?;
        Ok(FlatDemonstration { frames, padding: windows.padding(&device), n_slots: windows.n_slots() })
    }

    fn window(demonstration: &FlatDemonstration, span: Span) -> FlatDemonstration {
        let frames = demonstration.frames.clone().narrow(1, span.begin as usize, span.len());
        FlatDemonstration { frames, padding: None, n_slots: demonstration.n_slots }
    }

    fn read(
        &self,
        demonstration: &FlatDemonstration,
        states: &States,
        percepts: &V::Percepts,
    ) -> Result<FlatReading, ReadError> {
        let FlatDemonstration { frames, padding, .. } = demonstration;
        let state = self.state.forward(self.vectors.of_states(states, percepts, &self.device())?);
        let (convolved, summary) = self.specification.forward(frames.clone(), padding.as_ref());
        Ok(FlatReading { demonstration: demonstration.clone(), convolved, summary, state })
    }

    fn context(reading: &FlatReading) -> Tensor<2> {
        reading.summary.clone()
    }

    fn state(reading: &FlatReading) -> Tensor<2> {
        reading.state.clone()
    }

    fn frames(reading: &FlatReading) -> Tensor<3> {
        reading.convolved.clone()
    }

    fn device(&self) -> Device {
        self.specification.conv.device()
    }
}

impl<V: Vectors> ArgumentDecoder<FlatEncoder<V>> for FlatArgument {
    fn new(config: &V::Config, n_slots: usize, n_view: usize, init: &mut Init) -> Self {
        let &FlattenedConfig { width, program_width, argument_kernel, .. } = V::widths(config);
        Self {
            specification: SpecificationEncoder::new(init, V::width(config, n_slots), width, argument_kernel),
            hidden: init.mlp(&[width + program_width + n_view, width]),
            slots: init.linear(width, n_slots),
        }
    }

    fn forward(&self, reading: &FlatReading, program: Tensor<2>, view: Tensor<2>, _hidden: Tensor<2>) -> Tensor<2> {
        let FlatDemonstration { frames, padding, n_slots } = &reading.demonstration;
        let (_, summary) = self.specification.forward(frames.clone(), padding.as_ref());
        let logits = self.slots.forward(self.hidden.forward(Tensor::cat(vec![summary, program, view], 1)));
        if logits.dims()[1] > *n_slots { logits.narrow(1, 0, *n_slots) } else { logits }
    }
}
