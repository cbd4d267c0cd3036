//! Layers that the networks share, initialised from a seed alone.
//!
//! # Shapes
//!
//! The last dimension of every tensor holds features; `[B, T, ...]` is batch and frame.

use burn::module::{Module, Param, ParamId};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use rand::Rng as _;
use rand_chacha::ChaCha8Rng;

use crate::model::convolution::Convolution;
use crate::model::linear::Linear;
use crate::program::KnownPrograms;
use crate::seed::Seed;

/// Makes parameters one after another. Their ids count from 1, so that an optimizer's saved state finds them again in
/// another process.
pub struct Init {
    known: KnownPrograms,
    shared_root: bool,
    /// What they are drawn from; `None` where they only have shapes, to be filled from a file.
    rng: Option<ChaCha8Rng>,
    next_id: u64,
    device: Device,
}

impl Init {
    pub(crate) fn new(seed: Seed, device: &Device) -> Self {
        Self { rng: Some(seed.derive("parameters", &[]).rng()), ..Self::unfilled(device) }
    }

    /// Parameters of which nothing is made until a file fills them: whatever sizes it claims, they cost nothing before
    /// its tensors are known to have them.
    pub(crate) fn unfilled(device: &Device) -> Self {
        Self { known: KnownPrograms::FIRST, shared_root: false, rng: None, next_id: 1, device: device.clone() }
    }

    /// For a network that knows these programs.
    pub(crate) fn knowing(self, known: KnownPrograms) -> Self {
        Self { known, ..self }
    }

    /// The programs that the network shall know.
    pub(crate) fn known(&self) -> KnownPrograms {
        self.known
    }

    /// For a network in which the roots of all families are one program.
    pub(crate) fn sharing_root(self, shared_root: bool) -> Self {
        Self { shared_root, ..self }
    }

    /// Whether the roots of all families are one program.
    pub(crate) fn shares_root(&self) -> bool {
        self.shared_root
    }

    /// Uniform in `-bound..bound`.
    pub(crate) fn parameter<const D: usize>(&mut self, shape: [usize; D], bound: f32) -> Param<Tensor<D>> {
        self.made(shape, |rng, n| (0..n).map(|_| rng.random_range(-bound..bound)).collect())
    }

    /// Everywhere the same.
    pub(crate) fn filled<const D: usize>(&mut self, shape: [usize; D], value: f32) -> Param<Tensor<D>> {
        self.made(shape, |_, n| vec![value; n])
    }

    fn made<const D: usize>(
        &mut self,
        shape: [usize; D],
        values: impl FnOnce(&mut ChaCha8Rng, usize) -> Vec<f32>,
    ) -> Param<Tensor<D>> {
        let id = ParamId::from(self.next_id);
        self.next_id += 1;
        let Some(rng) = &mut self.rng else {
            let zeros = move |device: &Device, _requires_gradient| Tensor::zeros(shape, device);
            return Param::uninitialized(id, zeros, self.device.clone(), true, shape.into());
        };
        let values = values(rng, shape.iter().product());
        let mut parameter = Param::from_data(TensorData::new(values, shape), &self.device);
        parameter.id = id;
        parameter
    }

    /// A layer whose weights are uniform within one over the root of `n_inputs`.
    pub(crate) fn linear(&mut self, n_inputs: usize, n_outputs: usize) -> Linear {
        let bound = (n_inputs as f32).sqrt().recip();
        let weight = self.parameter([n_inputs, n_outputs], bound);
        let bias = self.parameter([n_outputs], bound);
        Linear::new(weight, Some(bias))
    }

    /// A layer whose weights are uniform within `bound`.
    pub(crate) fn linear_within(&mut self, n_inputs: usize, n_outputs: usize, bound: f32) -> Linear {
        let weight = self.parameter([n_inputs, n_outputs], bound);
        let bias = self.filled([n_outputs], 0.0);
        Linear::new(weight, Some(bias))
    }

    /// A part of a layer that reads a concatenation of `n_concatenated` features, `n_inputs` of them here. The parts'
    /// outputs are added, which spares the concatenation and lets each part be computed where it is small.
    pub(crate) fn part(&mut self, n_inputs: usize, n_outputs: usize, n_concatenated: usize) -> Linear {
        let bound = (n_concatenated as f32).sqrt().recip();
        Linear::new(self.parameter([n_inputs, n_outputs], bound), None)
    }

    pub(crate) fn mlp(&mut self, widths: &[usize]) -> Mlp {
        Mlp { layers: widths.windows(2).map(|pair| self.linear(pair[0], pair[1])).collect() }
    }

    /// The same with the inputs' width beside the layers'.
    pub(crate) fn mlp_from(&mut self, n_inputs: usize, widths: &[usize]) -> Mlp {
        self.mlp(&[&[n_inputs], widths].concat())
    }

    /// A convolution of pictures.
    pub(crate) fn conv(
        &mut self,
        [n_inputs, n_outputs]: [usize; 2],
        [kernel, stride, padding]: [usize; 3],
    ) -> Convolution {
        let n_patch = kernel * kernel * n_inputs;
        // He's bound for rectifiers: with the smaller one of `linear` seven layers fade a picture out.
        let weight = self.parameter([n_patch, n_outputs], (6.0 / n_patch as f32).sqrt());
        Convolution::new(weight, self.filled([n_outputs], 0.0), [kernel, stride, padding])
    }

    pub(crate) fn temporal_conv(&mut self, kernel: usize, n_inputs: usize, n_outputs: usize) -> TemporalConv {
        TemporalConv { kernel, linear: self.linear(kernel * n_inputs, n_outputs) }
    }
}

/// Linear layers, each followed by a rectifier.
#[derive(Module, Debug)]
pub(crate) struct Mlp {
    layers: Vec<Linear>,
}

impl Mlp {
    pub(crate) fn forward<const D: usize>(&self, input: Tensor<D>) -> Tensor<D> {
        self.layers.iter().fold(input, |hidden, layer| relu(layer.forward(hidden)))
    }
}

/// A convolution over frames, followed by a rectifier. Beyond the window there are zeros.
///
/// # Source
///
/// Paper, section IV: a kernel takes the concatenation of k consecutive elements; rectifiers are the nonlinearity.
#[derive(Module, Debug)]
pub(crate) struct TemporalConv {
    kernel: usize,
    linear: Linear,
}

impl TemporalConv {
    pub(crate) fn device(&self) -> Device {
        self.linear.device()
    }

    /// # Shapes
    ///
    /// `[B, T, ..., n_inputs]` → `[B, T, ..., n_outputs]`
    pub(crate) fn forward<const D: usize>(&self, frames: Tensor<D>) -> Tensor<D> {
        let n_frames = frames.dims()[1];
        let mut border = frames.dims();
        border[1] = self.kernel / 2;
        let zeros = Tensor::zeros(border, &frames.device());
        let padded = Tensor::cat(vec![zeros.clone(), frames, zeros], 1);
        let shifted = (0..self.kernel).map(|offset| padded.clone().narrow(1, offset, n_frames)).collect();
        relu(self.linear.forward(Tensor::cat(shifted, D - 1)))
    }
}

/// One row for each of `n_rows` from one row.
pub(crate) fn repeat_row(row: Tensor<2>, n_rows: usize) -> Tensor<2> {
    let width = row.dims()[1];
    row.expand([n_rows, width])
}

/// Each frame, and the most of what came before it, which tells whether a segment that is still to do lies there.
///
/// # Shapes
///
/// `[B, T, H]` → `[B, T, 2 H]`; features must never be negative
pub(crate) fn with_most_before(frames: Tensor<3>) -> Tensor<3> {
    let [n_batch, n_frames, width] = frames.dims();
    let first = Tensor::zeros([n_batch, 1, width], &frames.device());
    let before = Tensor::cat(vec![first, frames.clone()], 1).narrow(1, 0, n_frames).cummax(1);
    Tensor::cat(vec![frames, before], 2)
}

/// The largest over the frames of rectified (never negative) features; frames beyond the window must be zero.
///
/// # Shapes
///
/// `[B, T, H]` → `[B, H]`
pub(crate) fn max_over_frames(frames: Tensor<3>) -> Tensor<2> {
    frames.max_dim(1).squeeze_dim(1)
}

/// The same parameter with another value.
pub(crate) fn replaced<const D: usize>(
    before: &Param<Tensor<D>>,
    value: TensorData,
    device: &Device,
) -> Param<Tensor<D>> {
    let mut parameter = Param::from_data(value, device);
    parameter.id = before.id;
    parameter
}
