//! What the flattened encoder reads: one vector for each frame and for the state, from positions or from pictures.

use burn::module::{Module, ModuleDisplay};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Int, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::convolution::Convolution;
use crate::model::features::{Rows, flat_width};
use crate::model::flattened::FlattenedConfig;
use crate::model::layers::Init;
use crate::model::pictures::Pictures;
use crate::model::windows::Windows;

/// Makes vectors.
pub trait Vectors: Module + ModuleDisplay + Sync + Sized + 'static {
    /// What they and what is built on them is made with.
    type Config: Copy;
    /// See [`super::Network::Percepts`].
    type Percepts: Clone + Send + Sync;

    /// Fresh ones.
    fn new(config: &Self::Config, init: &mut Init) -> Self;

    /// Widths of the encoder above.
    fn widths(config: &Self::Config) -> &FlattenedConfig;

    /// Features of a vector.
    fn width(config: &Self::Config, n_slots: usize) -> usize;

    /// See [`super::Network::perceive`].
    fn perceive(&self, pictures: &Pictures) -> Self::Percepts;

    /// Of each frame of windows, `[B, T, features]`.
    fn of_windows(windows: &Windows, percepts: &Self::Percepts, device: &Device) -> Tensor<3>;

    /// Of each state, `[B, features]`.
    fn of_states(states: &[f32], n_slots: usize, percepts: &Self::Percepts, device: &Device) -> Tensor<2>;
}

/// All slots' positions side by side.
#[derive(Module, Debug)]
pub struct Positions;

impl Vectors for Positions {
    type Config = FlattenedConfig;
    type Percepts = ();

    fn new(_config: &FlattenedConfig, _init: &mut Init) -> Self {
        Self
    }

    fn widths(config: &FlattenedConfig) -> &FlattenedConfig {
        config
    }

    fn width(_config: &FlattenedConfig, n_slots: usize) -> usize {
        flat_width(n_slots)
    }

    fn perceive(&self, _pictures: &Pictures) {}

    fn of_windows(windows: &Windows, (): &(), device: &Device) -> Tensor<3> {
        let shape = [windows.n_windows(), windows.n_frames(), flat_width(windows.n_slots())];
        Tensor::from_data(TensorData::new(windows.rows().flat(), shape), device)
    }

    fn of_states(states: &[f32], n_slots: usize, (): &(), device: &Device) -> Tensor<2> {
        let features = Rows { n_slots, values: states }.flat();
        let shape = [features.len() / flat_width(n_slots), flat_width(n_slots)];
        Tensor::from_data(TensorData::new(features, shape), device)
    }
}

/// Sizes of the paper's picture network.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConvolvedConfig {
    /// Pixels across and down a picture: 64, the paper's.
    pub pixels: usize,
    /// Features of a picture: 128, the paper's.
    pub features: usize,
    /// Widths of the encoder above.
    pub flattened: FlattenedConfig,
}

impl ConvolvedConfig {
    /// The paper's.
    pub fn of_pixels(pixels: usize) -> Self {
        Self { pixels, features: 128, flattened: FlattenedConfig::default() }
    }
}

/// Channels and stride of each layer but the last, which has [`ConvolvedConfig::features`] and covers what is left.
const LAYERS: [(usize, usize); 6] = [(16, 2), (24, 1), (32, 2), (48, 2), (64, 2), (64, 1)];

/// The paper's picture network: seven convolutions from 64x64 pixels to a vector of 128. The paper gives no more than
/// these figures; channels and strides are ours.
///
/// # Source
///
/// Paper, section V-D.
#[derive(Module, Debug)]
pub struct Convolved {
    layers: Vec<Convolution>,
}

impl Vectors for Convolved {
    type Config = ConvolvedConfig;
    type Percepts = Tensor<2>;

    fn new(config: &ConvolvedConfig, init: &mut Init) -> Self {
        let (mut layers, mut channels, mut pixels) = (Vec::new(), 3, config.pixels);
        for (n_channels, stride) in LAYERS {
            layers.push(init.conv([channels, n_channels], [3, stride, 1]));
            (channels, pixels) = (n_channels, pixels.div_ceil(stride));
        }
        layers.push(init.conv([channels, config.features], [pixels.max(1), 1, 0]));
        Self { layers }
    }

    fn widths(config: &ConvolvedConfig) -> &FlattenedConfig {
        &config.flattened
    }

    fn width(config: &ConvolvedConfig, _n_slots: usize) -> usize {
        config.features
    }

    /// `F` pictures → `[F, features]`.
    fn perceive(&self, pictures: &Pictures) -> Tensor<2> {
        let pixels = pictures.to_tensor(&self.layers[0].device());
        let seen = self.layers.iter().fold(pixels, |seen, layer| relu(layer.forward(seen)));
        seen.flatten(1, 3)
    }

    fn of_windows(windows: &Windows, percepts: &Tensor<2>, device: &Device) -> Tensor<3> {
        let features = percepts.clone().select(0, picked(windows.picture_rows(), device));
        let width = features.dims()[1];
        features.reshape([windows.n_windows(), windows.n_frames(), width])
    }

    fn of_states(states: &[f32], _n_slots: usize, percepts: &Tensor<2>, device: &Device) -> Tensor<2> {
        percepts.clone().select(0, picked(states, device))
    }
}

/// Rows as numbers of pictures.
pub(crate) fn picked(rows: &[f32], device: &Device) -> Tensor<1, Int> {
    let numbers: Vec<i32> = rows.iter().map(|&row| row as i32).collect();
    let n = numbers.len();
    Tensor::from_data(TensorData::new(numbers, [n]), device)
}
