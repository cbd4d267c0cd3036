//! The paper's network: an observation is one vector of all objects' positions.
//!
//! # Source
//!
//! Paper, section IV. It leaves widths, depths and input features open; where a choice decided whether it trains, the
//! reason stands beside it. The argument decoder has an encoder of its own: with a shared one its loss stays at chance.

use burn::module::Module;
use burn::nn::Linear;
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::features::{Rows, flat_width};
use crate::model::heads::{CoreOutput, ReactiveCore, ScopeHead};
use crate::model::layers::{Init, Mlp, TemporalConv, max_over_frames, repeat_row};
use crate::model::memory::ProgramMemory;
use crate::model::network::{Network, Padding, Windows};
use crate::program::Program;
use crate::seed::Seed;
use crate::trace::Span;

/// Widths of the flattened network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlattenedConfig {
    /// Features of frames and states, and of every hidden layer. Default 96.
    pub width: usize,
    /// Width of program embeddings and keys. Default 32.
    pub program_width: usize,
    /// Frames that a scoping label sees around itself; odd. Default 5.
    pub scope_kernel: usize,
    /// Frames that an argument sees around itself; odd. Default 3.
    pub argument_kernel: usize,
}

impl Default for FlattenedConfig {
    fn default() -> Self {
        Self { width: 96, program_width: 32, scope_kernel: 5, argument_kernel: 3 }
    }
}

/// The network of variant `ntp_paper`.
#[derive(Module, Debug)]
pub struct Flattened {
    state: Mlp,
    specification: SpecificationEncoder,
    scope: ScopeHead,
    core: ReactiveCore,
    memory: ProgramMemory,
    argument: SpecificationEncoder,
    argument_hidden: Mlp,
    argument_slots: Linear,
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

impl Flattened {
    /// A fresh network for scenes of `n_slots` slots; the same seed gives the same parameters.
    pub fn new(config: &FlattenedConfig, n_slots: usize, seed: Seed, device: &Device) -> Self {
        let &FlattenedConfig { width, program_width, scope_kernel, argument_kernel } = config;
        let init = &mut Init::new(seed, device);
        let n_features = flat_width(n_slots);
        let n_context = program_width + width;
        Self {
            state: init.mlp(&[n_features, width, width]),
            specification: SpecificationEncoder::new(init, n_features, width, scope_kernel),
            scope: ScopeHead::new(init, width, n_context, width),
            core: ReactiveCore::new(init, &[width + n_context, width, width], program_width),
            memory: ProgramMemory::new(init, program_width),
            argument: SpecificationEncoder::new(init, n_features, width, argument_kernel),
            argument_hidden: init.mlp(&[width + n_context, width]),
            argument_slots: init.linear(width, n_slots),
        }
    }

    /// Program and state side by side, `[B, program + H]`.
    fn program_and_state(&self, reading: &FlatReading, program: Program) -> Tensor<2> {
        let state = reading.state.clone();
        let program = repeat_row(self.memory.embedding(program), state.dims()[0]);
        Tensor::cat(vec![program, state], 1)
    }
}

impl Network for Flattened {
    type Demonstration = FlatDemonstration;
    type Reading = FlatReading;

    fn demonstration(&self, windows: &Windows) -> FlatDemonstration {
        let device = self.device();
        let shape = [windows.n_windows(), windows.n_frames(), flat_width(windows.n_slots())];
        let frames = Tensor::from_data(TensorData::new(windows.rows().flat(), shape), &device);
        FlatDemonstration { frames, padding: windows.padding(&device) }
    }

    fn window(demonstration: &FlatDemonstration, span: Span) -> FlatDemonstration {
        let frames = demonstration.frames.clone().narrow(1, span.begin as usize, span.len());
        FlatDemonstration { frames, padding: None }
    }

    fn read(&self, demonstration: &FlatDemonstration, states: &[f32]) -> FlatReading {
        let n_slots = self.argument_slots.weight.dims()[1];
        let states = Rows { n_slots, values: states }.flat();
        let shape = [demonstration.frames.dims()[0], flat_width(n_slots)];
        let states = Tensor::<2>::from_data(TensorData::new(states, shape), &self.device());
        let (convolved, summary) =
            self.specification.forward(demonstration.frames.clone(), demonstration.padding.as_ref());
        FlatReading { demonstration: demonstration.clone(), convolved, summary, state: self.state.forward(states) }
    }

    fn core(&self, reading: &FlatReading, program: Program) -> CoreOutput {
        let input = Tensor::cat(vec![reading.summary.clone(), self.program_and_state(reading, program)], 1);
        self.core.forward(input, &self.memory)
    }

    fn scope(&self, reading: &FlatReading, program: Program) -> Tensor<3> {
        self.scope.forward(reading.convolved.clone(), self.program_and_state(reading, program))
    }

    fn argument(&self, reading: &FlatReading, program: Program, _core: &CoreOutput) -> Tensor<2> {
        let FlatDemonstration { frames, padding } = &reading.demonstration;
        let (_, summary) = self.argument.forward(frames.clone(), padding.as_ref());
        let input = Tensor::cat(vec![summary, self.program_and_state(reading, program)], 1);
        self.argument_slots.forward(self.argument_hidden.forward(input))
    }

    fn device(&self) -> Device {
        self.argument_slots.weight.device()
    }
}
