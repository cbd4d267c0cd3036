//! Keypoints: what learned convolutions find in a picture, wherever it is.
//!
//! ```text
//! picture, contrasts ─► convolutions ─► features of each cell ─► for each keypoint a score of each cell
//! softmax over cells ─► x, y, presence, spread
//! ```
//!
//! Keypoint `1 + n` is slot `n`'s object: the argument decoder takes its scores for those of the slot
//! ([`GlimpseNaming`]), so that naming an object and finding it are one thing to learn. No label of a position enters.
//!
//! # Limits
//!
//! None of colour, background or camera: things may differ in what is written on them alone.
//!
//! # Source
//!
//! Ours, beyond the paper. Spatial softmax after C. Finn et al., "Deep Spatial Autoencoders for Visuomotor Learning",
//! ICRA 2016.

mod naming;

use burn::module::Module;
use burn::tensor::activation::{relu, sigmoid, softmax};
use burn::tensor::{Device, Int, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::convolution::Convolution;
use crate::model::encoder::TrainingDefaults;
pub use crate::model::keypoints::naming::GlimpseNaming;
use crate::model::layers::Init;
use crate::model::limits::{ConfigError, check_sizes};
use crate::model::linear::Linear;
use crate::model::perception::{Looks, Perception};
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::sighted::Naming;
use crate::seed::Seed;

/// Scores are this much sharper than a layer's outputs, so that heat has a place to begin with.
const SCORE_GAIN: f32 = 4.0;

/// Sizes of keypoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeypointsConfig {
    /// Pixels across and down a picture. Default 64.
    pub pixels: usize,
    /// Slots whose objects are found; the robot is found besides.
    pub slots: usize,
    /// Features of a cell, four pixels across and down; half as many after the first layer. Default 32.
    pub features: usize,
}

impl KeypointsConfig {
    /// The default widths.
    pub fn of(pixels: usize, slots: usize) -> Self {
        Self { pixels, slots, features: 32 }
    }

    /// Whether a network for `n_slots` slots can have these sizes.
    pub(crate) fn check(&self, n_slots: usize) -> Result<(), ConfigError> {
        let &Self { pixels, slots, features } = self;
        check_sizes(&[("pixels", pixels), ("features", features)])?;
        ConfigError::unless(features >= 2, "features", features, "at least 2, as the first layer has half of them")?;
        ConfigError::unless(slots == n_slots, "slots", slots, "as many as n_slots")
    }
}

/// Convolutions and the scores on top of them.
#[derive(Module, Debug)]
pub struct Keypoints {
    /// Each halves the picture.
    shrinking: Vec<Convolution>,
    /// Each adds to its input.
    widening: Vec<Convolution>,
    scores: Linear,
}

/// Scores of the cells of `F` pictures.
#[derive(Clone, Debug)]
pub struct CellLooks {
    /// Of the slots' keypoints, `[F, L, N]`.
    pub(crate) scores: Tensor<3>,
    /// x and y of the robot, `[F, 2]`.
    pub(crate) robot: Tensor<2>,
    /// Of cells.
    pub(crate) rows: usize,
    /// Of cells.
    pub(crate) columns: usize,
}

impl CellLooks {
    /// Of the slots' keypoints in each cell, row by row: `[F, L, N]`.
    pub fn scores(&self) -> Tensor<3> {
        self.scores.clone()
    }

    /// All x, then all y of the cells' middles.
    fn cell_places(&self) -> Vec<f32> {
        cell_places(self.rows, self.columns)
    }
}

impl Looks for CellLooks {
    fn select(&self, pictures: Tensor<1, Int>) -> Self {
        Self {
            scores: self.scores.clone().select(0, pictures.clone()),
            robot: self.robot.clone().select(0, pictures),
            ..*self
        }
    }
}

impl Keypoints {
    /// Augmentations change positions; here there are pictures.
    pub(crate) const TRAINING: TrainingDefaults = TrainingDefaults::plain(3000, 0.002);

    /// Fresh ones by themselves; the same seed gives the same parameters.
    pub fn fresh(config: &KeypointsConfig, seed: Seed, device: &Device) -> Self {
        Self::new(config, &mut Init::new(seed, device))
    }

    /// `F` pictures → features of their cells, `[F, rows, columns, features]`.
    fn cells(&self, pictures: &Pictures) -> Tensor<4> {
        let seen = self
            .shrinking
            .iter()
            .fold(pictures.to_contrast_tensor(&self.scores.device()), |seen, layer| relu(layer.forward(seen)));
        self.widening.iter().fold(seen, |seen, layer| relu(seen.clone() + layer.forward(seen)))
    }
}

impl Naming for Keypoints {
    type Decoder = GlimpseNaming;
}

impl Perception for Keypoints {
    type Config = KeypointsConfig;
    type Looks = CellLooks;

    fn new(config: &KeypointsConfig, init: &mut Init) -> Self {
        let &KeypointsConfig { slots, features, .. } = config;
        let half = features / 2;
        Self {
            shrinking: vec![init.conv([4, half], [5, 2, 2]), init.conv([half, features], [3, 2, 1])],
            widening: vec![init.conv([features, features], [3, 1, 1])],
            scores: init.linear(features, 1 + slots),
        }
    }

    fn n_percepts(config: &KeypointsConfig) -> usize {
        1 + config.slots
    }

    fn calibrated(self, _sample: &PictureSample, _seed: Seed) -> Result<Self, ReadError> {
        Ok(self)
    }

    fn look(&self, pictures: &Pictures) -> Result<(Tensor<3>, CellLooks), ReadError> {
        let cells = self.cells(pictures);
        let [n, rows, columns, width] = cells.dims();
        let n_cells = rows * columns;
        let features = cells.reshape([n, n_cells, width]);
        let scores = self.scores.forward(features) * SCORE_GAIN; // [F, L, K]
        let n_points = scores.dims()[2];
        let places = TensorData::new(cell_places(rows, columns), [1, 2, n_cells]);
        let places = Tensor::<3>::from_data(places, &scores.device()).expand([n, 2, n_cells]);
        let heat = softmax(scores.clone(), 1);
        let centres = places.clone().matmul(heat.clone()); // [F, 2, K]
        let squares = places.powf_scalar(2.0).matmul(heat);
        let variances = (squares - centres.clone().powf_scalar(2.0)).sum_dim(1).clamp_min(0.0); // [F, 1, K]
        let presence = sigmoid(scores.clone().max_dim(1));
        let percepts = Tensor::cat(vec![centres, presence, (variances + 1e-4).sqrt()], 1).swap_dims(1, 2);
        let robot = percepts.clone().narrow(1, 0, 1).narrow(2, 0, 2).squeeze_dim(1);
        Ok((percepts, CellLooks { scores: scores.narrow(2, 1, n_points - 1), robot, rows, columns }))
    }
}

/// All x, then all y of the cells' middles, from -1 to 1.
fn cell_places(rows: usize, columns: usize) -> Vec<f32> {
    let middle = |at: usize, size: usize| (at as f32 + 0.5) / size as f32 * 2.0 - 1.0;
    let x = (0..rows * columns).map(|cell| middle(cell % columns, columns));
    let y = (0..rows * columns).map(|cell| middle(cell / columns, rows));
    x.chain(y).collect()
}

#[cfg(test)]
mod tests {
    use super::cell_places;

    #[test]
    fn places_are_the_middles_of_cells_across_and_down() {
        assert_eq!(cell_places(1, 2), [-0.5, 0.5, 0.0, 0.0]);
        assert_eq!(cell_places(2, 1), [0.0, 0.0, -0.5, 0.5]);
    }
}
