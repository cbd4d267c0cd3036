//! A detector of VGG16's shape: thirteen convolutions in five blocks, and above them dense layers, or heat maps.
//!
//! Dense layers must learn for each place anew what a thing looks like there. Heat maps (ours, not the paper's) look for
//! each slot's object everywhere alike: a softmax over cells gives the place in the picture, and what lies there the
//! height. The last two blocks then keep the cells of the third: a thing is smaller than a cell of the fifth.
//!
//! # Source
//!
//! Simonyan and Zisserman, "Very Deep Convolutional Networks", configuration D, which the paper names; the width is a
//! parameter, since a CPU has no week for the full one.

use burn::module::{Module, Param};
use burn::nn::pool::MaxPool2dConfig;
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor};
use serde::{Deserialize, Serialize};

use crate::model::convolution::Convolution;
use crate::model::detector::heat_maps::HeatMaps;
use crate::model::detector::{AXES, Detector, DetectorDefaults};
use crate::model::encoder::TrainingDefaults;
use crate::model::layers::{Init, Mlp, replaced};
use crate::model::limits::{ConfigError, check_sizes};
use crate::model::linear::Linear;
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::seed::Seed;

/// Channels of each block's convolutions at full width, and how many there are.
const BLOCKS: [(usize, usize); 5] = [(64, 2), (128, 2), (256, 3), (512, 3), (512, 3)];
/// Blocks after which the picture is halved below heat maps.
const HALVED_BELOW_MAPS: usize = 3;
/// Features of each of the two layers above them at full width.
const TOP: usize = 4096;

/// Pictures that are all alike are not divided by nothing.
const LEAST_DEVIATION: f32 = 1e-3;

/// Sizes of the detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VggDetectorConfig {
    /// Pixels across and down a picture; the paper's are 224.
    pub pixels: usize,
    /// What the widths of VGG16 are divided by: 1 is full width. Default [`VggDetectorConfig::NARROWED`].
    pub narrowed: usize,
    /// Heat maps above the convolutions in place of the paper's dense layers.
    #[serde(default, skip_serializing_if = "is_off")]
    pub heat_maps: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes fields by reference")]
fn is_off(setting: &bool) -> bool {
    !setting
}

impl VggDetectorConfig {
    /// An eighth of the full width, which a CPU can train.
    pub const NARROWED: usize = 8;
    /// No layer is left at a greater one.
    pub const MOST_NARROWED: usize = 64;
    /// Five times halved, a picture must still have a pixel.
    pub const LEAST_PIXELS: usize = 32;

    /// Whether a network can have these sizes.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let &Self { pixels, narrowed, heat_maps: _ } = self;
        check_sizes(&[("pixels", pixels)])?;
        let (is_seen, is_wide) = (pixels >= Self::LEAST_PIXELS, (1..=Self::MOST_NARROWED).contains(&narrowed));
        ConfigError::unless(is_seen, "pixels", pixels, "32 and more, which are halved five times")?;
        ConfigError::unless(is_wide, "narrowed", narrowed, "1 (full width) to 64")
    }
}

/// VGG16's layers.
#[derive(Module, Debug)]
pub struct VggDetector {
    /// `[pixels, pixels, 3]`: what the pictures mostly show; not learned but found. Without it what differs between two
    /// pictures drowns in what does not.
    mean: Param<Tensor<3>>,
    /// `[1]`: the deviations from it.
    deviation: Param<Tensor<1>>,
    blocks: Vec<Vec<Convolution>>,
    top: Option<Mlp>,
    positions: Option<Linear>,
    maps: Option<HeatMaps>,
}

impl VggDetector {
    /// What is behind it learns slower than on positions, and without their augmentations.
    pub(crate) const TRAINING: DetectorDefaults = DetectorDefaults {
        steps: 3000,
        pictures: 32,
        learning_rate: 0.0005,
        narrowed: Some(VggDetectorConfig::NARROWED as u32),
        behind: TrainingDefaults::plain(3000, 0.001),
    };
}

impl Detector for VggDetector {
    type Config = VggDetectorConfig;

    fn new(config: &VggDetectorConfig, n_slots: usize, init: &mut Init) -> Self {
        let narrowed = config.narrowed.max(1);
        let (mut channels, mut pixels) = (3, config.pixels);
        let mut blocks = Vec::new();
        for (block, (full, n_layers)) in BLOCKS.into_iter().enumerate() {
            let width = (full / narrowed).max(1);
            let mut layer = |inputs| init.conv([inputs, width], [3, 1, 1]);
            let first = layer(channels);
            let rest = (1..n_layers).map(|_| layer(width));
            blocks.push(std::iter::once(first).chain(rest).collect());
            channels = width;
            pixels = if is_halved(block, config.heat_maps) { pixels / 2 } else { pixels };
        }
        let (top, is_dense) = (TOP / narrowed, !config.heat_maps);
        Self {
            mean: init.filled([config.pixels, config.pixels, 3], 0.0).set_require_grad(false),
            deviation: init.filled([1], 1.0).set_require_grad(false),
            blocks,
            top: is_dense.then(|| init.mlp(&[channels * pixels * pixels, top, top])),
            positions: is_dense.then(|| init.linear(top, AXES * n_slots)),
            maps: config.heat_maps.then(|| HeatMaps::new(channels, n_slots, init)),
        }
    }

    fn calibrated(mut self, sample: &PictureSample, _positions: &[[f32; 3]], _seed: Seed) -> Result<Self, ReadError> {
        let pixels = sample.pictures.to_tensor(&self.device());
        let mean = pixels.clone().mean_dim(0);
        let deviation = (pixels - mean.clone()).powf_scalar(2.0).mean().sqrt().clamp_min(LEAST_DEVIATION);
        self.mean = replaced(&self.mean, mean.squeeze_dim::<3>(0).into_data(), &self.device()).set_require_grad(false);
        self.deviation = replaced(&self.deviation, deviation.into_data(), &self.device()).set_require_grad(false);
        Ok(self)
    }

    fn detect(&self, pictures: &Pictures) -> Result<Tensor<2>, ReadError> {
        let pixels = pictures.to_tensor(&self.device()) - self.mean.val().unsqueeze::<4>();
        let pixels = pixels / self.deviation.val().unsqueeze::<4>();
        let pool = MaxPool2dConfig::new([2, 2]).with_strides([2, 2]).init();
        let seen = self.blocks.iter().enumerate().fold(pixels, |seen, (at, block)| {
            let seen = block.iter().fold(seen, |seen, layer| relu(layer.forward(seen)));
            if is_halved(at, self.maps.is_some()) {
                pool.forward(seen.permute([0, 3, 1, 2])).permute([0, 2, 3, 1])
            } else {
                seen
            }
        });
        Ok(match (&self.maps, &self.top, &self.positions) {
            (Some(maps), ..) => maps.forward(seen),
            (None, Some(top), Some(positions)) => positions.forward(top.forward(seen.flatten::<2>(1, 3))),
            // Made with one or the other: `new`.
            (None, ..) => seen.flatten::<2>(1, 3),
        })
    }

    fn device(&self) -> Device {
        self.mean.val().device()
    }
}

/// Whether the picture is halved behind a block.
fn is_halved(block: usize, has_maps: bool) -> bool {
    !has_maps || block < HALVED_BELOW_MAPS
}
