//! What the flattened encoder reads: one vector for each frame and for the state, from positions or from pictures.

use burn::module::{Module, ModuleDisplay};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::convolution::Convolution;
use crate::model::encoder::TrainingDefaults;
use crate::model::features::{self, flat_width};
use crate::model::layers::Init;
use crate::model::limits::{ConfigError, check_cameras, check_kernels, check_sizes, is_one_camera, one_camera};
use crate::model::pictures::{Pictures, picked};
use crate::model::read_error::ReadError;
use crate::model::specification_rows::States;
use crate::model::windows::Windows;

/// Widths of the flattened networks.
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
    /// Whether the displacements between slots stand beside their positions. Default no, as in the paper.
    #[serde(default, skip_serializing_if = "is_off")]
    pub relations: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_off(setting: &bool) -> bool {
    !setting
}

impl Default for FlattenedConfig {
    fn default() -> Self {
        Self { width: 96, program_width: 32, scope_kernel: 5, argument_kernel: 3, relations: false }
    }
}

impl FlattenedConfig {
    /// Whether a network can have these sizes.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let &Self { width, program_width, scope_kernel, argument_kernel, relations: _ } = self;
        check_sizes(&[("width", width), ("program_width", program_width)])?;
        check_kernels(&[("scope_kernel", scope_kernel), ("argument_kernel", argument_kernel)])
    }
}

/// Makes vectors.
pub trait Vectors: Module + ModuleDisplay + Sync + Sized + 'static {
    /// What they and what is built on them is made with.
    type Config: Copy;
    /// See [`super::Network::Percepts`].
    type Percepts: Clone + Send + Sync;

    /// Fresh ones for scenes of `n_slots` slots.
    fn new(config: &Self::Config, n_slots: usize, init: &mut Init) -> Self;

    /// Widths of the encoder above.
    fn widths(config: &Self::Config) -> &FlattenedConfig;

    /// Features of a vector.
    fn width(config: &Self::Config, n_slots: usize) -> usize;

    /// See [`super::Network::perceive`].
    fn perceive(&self, pictures: &Pictures) -> Self::Percepts;

    /// Of each frame of windows, `[B, T, features]`.
    ///
    /// # Errors
    ///
    /// [`ReadError`] for windows of another form.
    fn of_windows(&self, windows: &Windows, percepts: &Self::Percepts, device: &Device)
    -> Result<Tensor<3>, ReadError>;

    /// Of each state, `[B, features]`.
    ///
    /// # Errors
    ///
    /// [`ReadError`] for states of another form.
    fn of_states(&self, states: &States, percepts: &Self::Percepts, device: &Device) -> Result<Tensor<2>, ReadError>;
}

/// All slots' positions side by side, and where asked for the displacements between them. Of a scene with fewer slots than
/// the network is made for, the others are zeros.
#[derive(Module, Debug)]
pub struct Positions {
    n_slots: usize,
    relations: bool,
}

impl Positions {
    /// Slots have parameters of their own, so every label must have been every slot. Jittered grippers and what was
    /// knocked over keep it from learning in this budget.
    pub(crate) const TRAINING: TrainingDefaults =
        TrainingDefaults { relabel_slots: 1.0, ..TrainingDefaults::plain(3000, 0.002) };
}

impl Vectors for Positions {
    type Config = FlattenedConfig;
    type Percepts = ();

    fn new(config: &FlattenedConfig, n_slots: usize, _init: &mut Init) -> Self {
        Self { n_slots, relations: config.relations }
    }

    fn widths(config: &FlattenedConfig) -> &FlattenedConfig {
        config
    }

    fn width(config: &FlattenedConfig, n_slots: usize) -> usize {
        flat_width(n_slots, config.relations)
    }

    fn perceive(&self, _pictures: &Pictures) {}

    fn of_windows(&self, windows: &Windows, (): &(), device: &Device) -> Result<Tensor<3>, ReadError> {
        let shape = [windows.n_windows(), windows.n_frames(), flat_width(self.n_slots, self.relations)];
        let features = features::flat(windows.observations()?, self.n_slots, self.relations);
        Ok(Tensor::from_data(TensorData::new(features, shape), device))
    }

    fn of_states(&self, states: &States, (): &(), device: &Device) -> Result<Tensor<2>, ReadError> {
        let rows = states.observations()?;
        let shape = [rows.len(), flat_width(self.n_slots, self.relations)];
        Ok(Tensor::from_data(TensorData::new(features::flat(rows, self.n_slots, self.relations), shape), device))
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
    /// How many cameras see, each through convolutions of its own. Default 1.
    #[serde(default = "one_camera", skip_serializing_if = "is_one_camera")]
    pub cameras: usize,
    /// Widths of the encoder above.
    pub flattened: FlattenedConfig,
}

impl ConvolvedConfig {
    /// The paper's.
    pub fn of_pixels(pixels: usize) -> Self {
        Self { pixels, features: 128, cameras: 1, flattened: FlattenedConfig::default() }
    }

    /// Whether a network can have these sizes.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        check_sizes(&[("pixels", self.pixels), ("features", self.features)])?;
        check_cameras(self.cameras)?;
        self.flattened.check()
    }
}

/// Channels and stride of each layer but the last, which has [`ConvolvedConfig::features`] and covers what is left.
const LAYERS: [(usize, usize); 6] = [(16, 2), (24, 1), (32, 2), (48, 2), (64, 2), (64, 1)];

/// The paper's picture network: seven convolutions from 64x64 pixels to a vector of 128. The paper gives no more than
/// these figures; channels and strides are ours. Of several cameras each has convolutions of its own, and the vectors stand
/// side by side.
///
/// # Source
///
/// Paper, section V-D.
#[derive(Module, Debug)]
pub struct Convolved {
    layers: Vec<Convolution>,
    /// Of the cameras behind the first.
    others: Vec<Vec<Convolution>>,
}

impl Convolved {
    /// Augmentations change positions; here there are pictures.
    pub(crate) const TRAINING: TrainingDefaults = TrainingDefaults::plain(3000, 0.001);
}

impl Vectors for Convolved {
    type Config = ConvolvedConfig;
    type Percepts = Tensor<2>;

    fn new(config: &ConvolvedConfig, _n_slots: usize, init: &mut Init) -> Self {
        let layers = convolutions(config, init);
        Self { layers, others: (1..config.cameras).map(|_| convolutions(config, init)).collect() }
    }

    fn widths(config: &ConvolvedConfig) -> &FlattenedConfig {
        &config.flattened
    }

    fn width(config: &ConvolvedConfig, _n_slots: usize) -> usize {
        config.cameras * config.features
    }

    /// `F` pictures → `[F, cameras * features]`.
    fn perceive(&self, pictures: &Pictures) -> Tensor<2> {
        let n_cameras = self.others.len() + 1;
        let cameras = std::iter::once(&self.layers).chain(&self.others).enumerate();
        let vectors = cameras.map(|(camera, layers)| convolved(layers, &pictures.of_camera(camera, n_cameras)));
        Tensor::cat(vectors.collect(), 1)
    }

    fn of_windows(&self, windows: &Windows, percepts: &Tensor<2>, device: &Device) -> Result<Tensor<3>, ReadError> {
        let [n_pictures, width] = percepts.dims();
        let features = percepts.clone().select(0, picked(windows.pictures()?, n_pictures, device)?);
        Ok(features.reshape([windows.n_windows(), windows.n_frames(), width]))
    }

    fn of_states(&self, states: &States, percepts: &Tensor<2>, device: &Device) -> Result<Tensor<2>, ReadError> {
        let n_pictures = percepts.dims()[0];
        Ok(percepts.clone().select(0, picked(states.pictures()?, n_pictures, device)?))
    }
}

/// Those of one camera.
fn convolutions(config: &ConvolvedConfig, init: &mut Init) -> Vec<Convolution> {
    let (mut layers, mut channels, mut pixels) = (Vec::new(), 3, config.pixels);
    for (n_channels, stride) in LAYERS {
        layers.push(init.conv([channels, n_channels], [3, stride, 1]));
        (channels, pixels) = (n_channels, pixels.div_ceil(stride));
    }
    layers.push(init.conv([channels, config.features], [pixels.max(1), 1, 0]));
    layers
}

/// `F` pictures → `[F, features]`.
fn convolved(layers: &[Convolution], pictures: &Pictures) -> Tensor<2> {
    let pixels = pictures.to_tensor(&layers[0].device());
    layers.iter().fold(pixels, |seen, layer| relu(layer.forward(seen))).flatten(1, 3)
}
