//! A detector on colour slots: where each colour lies in the picture, how much of it there is, and how the others lie
//! to it, tell where its object is.

use burn::module::Module;
use burn::nn::Linear;
use burn::tensor::Tensor;
use serde::{Deserialize, Serialize};

use crate::model::colour_slots::{ColourSlots, ColourSlotsConfig};
use crate::model::detector::Detector;
use crate::model::layers::{Init, Mlp};
use crate::model::perception::{PERCEPT_WIDTH, Perception as _};
use crate::model::pictures::{PictureSample, Pictures};
use crate::seed::Seed;

/// Sizes of the detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointDetectorConfig {
    /// Of its colour slots.
    pub perception: ColourSlotsConfig,
    /// Features of a percept. Default 48.
    pub width: usize,
    /// Features of a pair of percepts. Default 16.
    pub pair_width: usize,
}

impl PointDetectorConfig {
    /// The default widths with colour slots.
    pub fn of(perception: ColourSlotsConfig) -> Self {
        Self { perception, width: 48, pair_width: 16 }
    }
}

/// Colour slots, their pairs, and what they tell.
#[derive(Module, Debug)]
pub struct PointDetector {
    perception: ColourSlots,
    pairs: Mlp,
    percepts: Mlp,
    positions: Linear,
    /// The main part of a position is linear in its place in the picture.
    places: Linear,
}

impl Detector for PointDetector {
    type Config = PointDetectorConfig;

    fn new(config: &PointDetectorConfig, n_slots: usize, init: &mut Init) -> Self {
        let &PointDetectorConfig { perception, width, pair_width } = config;
        let n_percepts = perception.colours;
        let n_outputs = 3 * n_slots + 1;
        Self {
            perception: ColourSlots::new(&perception, init),
            pairs: init.mlp(&[2 * PERCEPT_WIDTH, pair_width, pair_width]),
            percepts: init.mlp(&[pair_width + 2 * PERCEPT_WIDTH, width, width]),
            positions: init.linear(n_percepts * width, n_outputs),
            places: init.linear(n_percepts * PERCEPT_WIDTH, n_outputs),
        }
    }

    fn acquainted(mut self, sample: &PictureSample, seed: Seed) -> Self {
        self.perception = self.perception.acquainted(sample, seed);
        self
    }

    fn detect(&self, pictures: &Pictures) -> Tensor<2> {
        let seen = self.perception.look(pictures).0 * 3.0; // [F, K, PERCEPT_WIDTH]
        let [n_pictures, n_percepts, width] = seen.dims();
        let all = [n_pictures, n_percepts, n_percepts, width];
        let own: Tensor<4> = seen.clone().unsqueeze_dim::<4>(2).expand(all);
        let others: Tensor<4> = seen.clone().unsqueeze_dim::<4>(1).expand(all);
        let pairs = self.pairs.forward(Tensor::<4>::cat(vec![others.clone() - own, others], 3));
        let pairs: Tensor<3> = pairs.max_dim(2).squeeze_dim(2); // [F, K, pair]
        let robot = seen.clone().narrow(1, 0, 1).expand([n_pictures, n_percepts, width]);
        let percepts = self.percepts.forward(Tensor::<3>::cat(vec![pairs, seen.clone(), robot], 2));
        self.positions.forward(percepts.flatten::<2>(1, 2)) + self.places.forward(seen.flatten::<2>(1, 2))
    }
}
