//! Colour slots: everything that is no background, sorted by colour.
//!
//! ```text
//! pixels that differ from the background ─► for each prototype a softmax over them by colour ─► x, y, mass, spread
//! ```
//!
//! The prototypes are parameters: they begin as cluster centres of the colours that are to be seen, and are trained by
//! the program losses alone. No label of a position enters.
//!
//! # Limits
//!
//! A fixed camera, a background that does not change, and things that differ in colour, whose number is known.
//!
//! # Source
//!
//! Ours, beyond the paper.

mod claims;
mod clusters;
mod finding;
mod foreground;

pub(crate) use claims::Claims;
pub(crate) use finding::{FIND_WIDTH, Find, Finder};

use burn::module::{Module, Param};
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::colour_slots::clusters::{centres, most_mobile};
use crate::model::colour_slots::foreground::{COLOUR_WIDTH, Foreground, background, foreground};
use crate::model::encoder::TrainingDefaults;
use crate::model::layers::{Init, replaced};
use crate::model::limits::{ConfigError, check_sizes};
use crate::model::perception::Perception;
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::sighted::{Naming, PerceptNaming};
use crate::model::values::{TensorError, values};
use crate::seed::Seed;

/// A score that no softmax lets through.
const HIDDEN_SCORE: f32 = -1e4;
/// Pixels of the prototype's colour that make a mass of one, as a share of the picture: about three blocks.
const MASS_PIXELS: f32 = 1.0 / 64.0;
/// How fast a pixel's weight falls with its colour's distance, to begin with.
const SHARPNESS: f32 = 0.5;

/// Sizes of colour slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColourSlotsConfig {
    /// Pixels across and down a picture. Default 64.
    pub pixels: usize,
    /// How many colours are told apart: one for each object, one for the gripper, and some for letters and shadows.
    pub colours: usize,
}

impl ColourSlotsConfig {
    /// Whether a network can have these sizes.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        check_sizes(&[("pixels", self.pixels), ("colours", self.colours)])
    }
}

/// Prototypes of colours, and the background that is left out.
#[derive(Module, Debug)]
pub struct ColourSlots {
    /// `[pixels * pixels * 3]`, 0 to 255; not learned but found.
    background: Param<Tensor<1>>,
    /// `[COLOUR_WIDTH, K]`
    prototypes: Param<Tensor<2>>,
    /// `[1, K]`
    log_sharpness: Param<Tensor<2>>,
}

impl ColourSlots {
    /// Augmentations change positions; here there are pictures.
    pub(crate) const TRAINING: TrainingDefaults = TrainingDefaults::plain(2000, 0.003);

    /// Fresh ones by themselves; the same seed gives the same prototypes.
    pub fn fresh(config: &ColourSlotsConfig, seed: Seed, device: &Device) -> Self {
        Self::new(config, &mut Init::new(seed, device))
    }

    fn device(&self) -> Device {
        self.prototypes.device()
    }

    fn background(&self) -> Result<Vec<f32>, TensorError> {
        values(self.background.val())
    }

    /// The pixels of pictures that are no background, and whose they are.
    pub(crate) fn claims(&self, pictures: &Pictures) -> Result<Claims, TensorError> {
        let (prototypes, log_sharpness) = (values(self.prototypes.val())?, values(self.log_sharpness.val())?);
        let background = self.background()?;
        Ok(Claims::of(pictures, &background, &foreground(pictures, &background), &prototypes, &log_sharpness))
    }

    /// The same with the colours of `slots` right behind the robot's, in this order; the others follow.
    pub(crate) fn with_first(mut self, slots: &[usize]) -> Result<Self, TensorError> {
        let n_colours = self.prototypes.dims()[1];
        let others = (1..n_colours).filter(|colour| !slots.contains(colour));
        let order: Vec<usize> = std::iter::once(0).chain(slots.iter().copied()).chain(others).collect();
        let device = self.device();
        let before = values(self.prototypes.val())?;
        let columns = before.chunks_exact(n_colours).flat_map(|feature| order.iter().map(|&colour| feature[colour]));
        let data = TensorData::new(columns.collect::<Vec<_>>(), [COLOUR_WIDTH, n_colours]);
        self.prototypes = replaced(&self.prototypes, data, &device);
        Ok(self)
    }

    /// Minus the sharpened squared distance of each point's colour to each prototype, `[F, P, K]`.
    fn scores(&self, seen: &Foreground) -> Tensor<3> {
        let device = self.device();
        let (n, n_points) = (seen.n_pictures, seen.n_points);
        let colours =
            Tensor::<2>::from_data(TensorData::new(seen.colours.clone(), [n * n_points, COLOUR_WIDTH]), &device);
        let prototypes = self.prototypes.val();
        let squares = colours.clone().powf_scalar(2.0).sum_dim(1) + prototypes.clone().powf_scalar(2.0).sum_dim(0);
        let distances = squares - colours.matmul(prototypes) * 2.0;
        let scores: Tensor<2> = distances.neg() * self.log_sharpness.val().exp();
        let n_colours = scores.dims()[1];
        let hidden = Tensor::<3>::from_data(TensorData::new(seen.hidden(HIDDEN_SCORE), [n, n_points, 1]), &device);
        scores.reshape([n, n_points, n_colours]) + hidden
    }
}

impl Naming for ColourSlots {
    type Decoder = PerceptNaming;
}

impl Perception for ColourSlots {
    type Config = ColourSlotsConfig;
    type Looks = ();

    fn new(config: &ColourSlotsConfig, init: &mut Init) -> Self {
        let log_sharpness = init.filled([1, config.colours], SHARPNESS.ln());
        Self {
            background: init.filled([config.pixels * config.pixels * 3], 0.0).set_require_grad(false),
            prototypes: init.parameter([COLOUR_WIDTH, config.colours], 5.0),
            log_sharpness,
        }
    }

    fn n_percepts(config: &ColourSlotsConfig) -> usize {
        config.colours
    }

    fn calibrated(mut self, sample: &PictureSample, seed: Seed) -> Result<Self, ReadError> {
        let device = self.device();
        let background = background(&sample.pictures);
        let seen = foreground(&sample.pictures, &background);
        let n_colours = self.prototypes.dims()[1];
        let mut found = centres(&seen, n_colours, seed);
        let robot = most_mobile(&seen, &found, &sample.lengths);
        found.swap(0, robot);
        let columns: Vec<f32> =
            (0..COLOUR_WIDTH).flat_map(|feature| found.iter().map(move |centre| centre[feature])).collect();
        self.prototypes = replaced(&self.prototypes, TensorData::new(columns, [COLOUR_WIDTH, n_colours]), &device);
        let n_values = background.len();
        let values = TensorData::new(background, [n_values]);
        self.background = replaced(&self.background, values, &device).set_require_grad(false);
        Ok(self)
    }

    fn look(&self, pictures: &Pictures) -> Result<(Tensor<3>, ()), ReadError> {
        let seen = foreground(pictures, &self.background()?);
        let scores = self.scores(&seen);
        let places = TensorData::new(seen.places(), [seen.n_pictures, 2, seen.n_points]);
        let places = Tensor::<3>::from_data(places, &self.device());
        let weights = softmax(scores.clone(), 1);
        let centres = places.clone().matmul(weights.clone()); // [F, 2, K]
        let squares = places.powf_scalar(2.0).matmul(weights);
        let variances = (squares - centres.clone().powf_scalar(2.0)).sum_dim(1).clamp_min(0.0); // [F, 1, K]
        let full = MASS_PIXELS * (pictures.width * pictures.height) as f32;
        let masses = scores.exp().sum_dim(1) / full;
        Ok((Tensor::cat(vec![centres, masses, (variances + 1e-4).sqrt()], 1).swap_dims(1, 2), ()))
    }
}
