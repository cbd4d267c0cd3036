//! A detector on colour slots: where each colour is densest in the picture, how much of it there is, how the others lie to
//! it and what surrounds it tell where its object is.
//!
//! ```text
//! colour slots ─► place, mass, spread ──┐
//!     │              └─► pairs ─────────┼─► position of each thing in the world
//!     └─► patch about each place ───────┘
//! ```
//!
//! Colours are found, and slots told by them, before the first step; they are not learned further. A patch shows what hides a thing, on what it stands and where its edges lie, which moments of its visible part do
//! not. All things share their weights but for a bias. The robot is one of the colours, since it hides and holds things;
//! where it is, it knows of itself.
//!
//! # Source
//!
//! Ours, beyond the paper.

use burn::module::{Module, Param};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};
use serde::{Deserialize, Serialize};

use crate::model::colour_slots::{ColourSlots, ColourSlotsConfig, FIND_WIDTH, Find, Finder};
use crate::model::detector::assignment::colours_of_slots;
use crate::model::detector::patches::{CHANNELS, Claimed};
use crate::model::detector::{AXES, Detector, DetectorDefaults};
use crate::model::encoder::TrainingDefaults;
use crate::model::layers::{Init, Mlp};
use crate::model::limits::{ConfigError, check_sizes};
use crate::model::linear::Linear;
use crate::model::object_centric::ObjectCentric;
use crate::model::perception::Perception as _;
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::values::values;
use crate::seed::Seed;

/// What a find tells by itself: its numbers and three products of its place.
const LOOK_WIDTH: usize = FIND_WIDTH + 3;
/// Places, from -1 to 1 across and down the picture, are scaled so that neighbouring things differ by about one.
const PLACE_GAIN: f32 = 3.0;
/// Pixels that make a mass of one, as a share of the picture: a block.
const MASS_SHARE: f32 = 1.0 / 128.0;
/// Pixels that make a spread of one, as a share of the picture's width: about a block's.
const SPREAD_SHARE: f32 = 1.0 / 32.0;

/// Sizes of the detector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointDetectorConfig {
    /// Of its colour slots.
    pub perception: ColourSlotsConfig,
    /// Features of a percept. Default 64.
    pub width: usize,
    /// Features of a pair of percepts. Default 16.
    pub pair_width: usize,
    /// Pixels across and down a thing's patch. Default a quarter of the picture.
    pub patch: usize,
}

impl PointDetectorConfig {
    /// The default widths with colour slots.
    pub fn of(perception: ColourSlotsConfig) -> Self {
        Self { perception, width: 64, pair_width: 16, patch: perception.pixels / 4 }
    }

    /// Whether a detector of `n_slots` slots can have these sizes.
    pub(crate) fn check(&self, n_slots: usize) -> Result<(), ConfigError> {
        let &Self { perception, width, pair_width, patch } = self;
        perception.check()?;
        check_sizes(&[("width", width), ("pair_width", pair_width), ("patch", patch)])?;
        let ColourSlotsConfig { pixels, colours } = perception;
        ConfigError::unless(colours > n_slots, "colours", colours, "more colours than slots for a detector")?;
        ConfigError::unless((2..=pixels).contains(&patch), "patch", patch, "2 pixels to the whole picture")
    }
}

/// Colour slots, their patches and pairs, and what they tell.
#[derive(Module, Debug)]
pub struct PointDetector {
    perception: ColourSlots,
    n_slots: usize,
    patch: usize,
    pairs: Mlp,
    surroundings: Mlp,
    thing: Linear,
    /// `[N, width]`: what is known of a slot whatever is seen.
    slots: Param<Tensor<2>>,
    hidden: Mlp,
    position: Linear,
    /// The main part of a position is linear in its place in the picture.
    place: Linear,
    /// `[N, 3]`
    slot_positions: Param<Tensor<2>>,
}

/// A find as numbers of about one, with products of its place.
fn told(find: &Find, pictures: &Pictures) -> [f32; LOOK_WIDTH] {
    let pixels = [pictures.width as f32, pictures.height as f32];
    let [x, y] = [0, 1].map(|axis| PLACE_GAIN * (2.0 * find.centre[axis] / pixels[axis] - 1.0));
    let mass = |pixels_claimed: f32| pixels_claimed / (MASS_SHARE * pixels[0] * pixels[1]);
    let spread = find.spread.map(|deviation| deviation / (SPREAD_SHARE * pixels[0]));
    [x, y, mass(find.mass), spread[0], spread[1], mass(find.elsewhere), x * y, x * x, y * y]
}

/// What is seen of some pictures before anything is told of it, the robot first.
struct Looks {
    /// `[F, N + 1, LOOK_WIDTH]`
    looks: Tensor<3>,
    /// `[F, N, patch]`
    patches: Tensor<3>,
}

impl PointDetector {
    /// What is behind it learns on detections as it does on positions, in more steps.
    pub(crate) const TRAINING: DetectorDefaults = DetectorDefaults {
        steps: 3000,
        pictures: 192,
        learning_rate: 0.002,
        narrowed: None,
        behind: TrainingDefaults { steps: 2000, ..ObjectCentric::TRAINING },
    };

    fn look(&self, pictures: &Pictures) -> Result<Looks, ReadError> {
        let device = self.place.device();
        let claims = self.perception.claims(pictures)?;
        let claimed = Claimed { pictures, claims: &claims, n_things: self.n_slots };
        let mut finder = Finder::new(pictures.width, pictures.height);
        let n_percepts = self.n_slots + 1;
        let mut looks = vec![0.0; pictures.n * n_percepts * LOOK_WIDTH];
        let (side, mut patches) = (self.patch, Vec::with_capacity(self.n_slots));
        for slot in 0..n_percepts {
            let window = if slot == 0 { 3 * side / 4 } else { side / 2 };
            let finds: Vec<Find> = (0..pictures.n).map(|picture| finder.find(&claims, picture, slot, window)).collect();
            for (picture, find) in finds.iter().enumerate() {
                let at = (picture * n_percepts + slot) * LOOK_WIDTH;
                looks[at..at + LOOK_WIDTH].copy_from_slice(&told(find, pictures));
            }
            if slot == 0 {
                continue;
            }
            let centres: Vec<[f32; 2]> = finds.iter().map(|find| find.centre).collect();
            let shape = [pictures.n, 1, side * side * CHANNELS];
            let patch = TensorData::new(claimed.patches(slot, &centres, side), shape);
            patches.push(Tensor::<3>::from_data(patch, &device));
        }
        let looks = TensorData::new(looks, [pictures.n, n_percepts, LOOK_WIDTH]);
        Ok(Looks { looks: Tensor::from_data(looks, &device), patches: Tensor::cat(patches, 1) })
    }

    /// The most that the other slots and the robot tell of each thing by where they lie to it: `[F, N, pair]`.
    fn relations(&self, looks: &Tensor<3>) -> Tensor<3> {
        let [n_pictures, _, width] = looks.dims();
        let n_others = self.n_slots + 1;
        let all = [n_pictures, self.n_slots, n_others, width];
        let own: Tensor<4> = looks.clone().narrow(1, 1, self.n_slots).unsqueeze_dim::<4>(2).expand(all);
        let others: Tensor<4> = looks.clone().narrow(1, 0, n_others).unsqueeze_dim::<4>(1).expand(all);
        let pairs = self.pairs.forward(Tensor::<4>::cat(vec![others.clone() - own, others], 3));
        pairs.max_dim(2).squeeze_dim(2)
    }

    /// Positions of all things in the world, in decimetres: `[F, N, 3]`.
    fn things(&self, seen: &Looks) -> Tensor<3> {
        let looks = seen.looks.clone().narrow(1, 1, self.n_slots);
        let surroundings = self.surroundings.forward(seen.patches.clone());
        let told = Tensor::<3>::cat(vec![surroundings, looks.clone(), self.relations(&seen.looks)], 2);
        let hidden = relu(self.thing.forward(told) + self.slots.val().unsqueeze_dim::<3>(0));
        let position = self.position.forward(self.hidden.forward(hidden));
        position + self.place.forward(looks) + self.slot_positions.val().unsqueeze_dim::<3>(0)
    }
}

impl Detector for PointDetector {
    type Config = PointDetectorConfig;

    fn new(config: &PointDetectorConfig, n_slots: usize, init: &mut Init) -> Self {
        let &PointDetectorConfig { perception, width, pair_width, patch } = config;
        let n_told = width + LOOK_WIDTH + pair_width;
        Self {
            perception: ColourSlots::new(&perception, init),
            n_slots,
            patch,
            pairs: init.mlp(&[2 * LOOK_WIDTH, pair_width, pair_width]),
            surroundings: init.mlp(&[patch * patch * CHANNELS, width, width]),
            thing: init.linear(n_told, width),
            slots: init.filled([n_slots, width], 0.0),
            hidden: init.mlp(&[width, width]),
            position: init.linear(width, AXES),
            place: init.linear(LOOK_WIDTH, AXES),
            slot_positions: init.filled([n_slots, AXES], 0.0),
        }
    }

    fn calibrated(mut self, sample: &PictureSample, positions: &[[f32; 3]], seed: Seed) -> Result<Self, ReadError> {
        self.perception = self.perception.calibrated(sample, seed)?;
        let (looks, ()) = self.perception.look(&sample.pictures)?;
        let [_, n_colours, width] = looks.dims();
        let colours = colours_of_slots(&values(looks)?, [n_colours, width], positions, self.n_slots);
        self.perception = self.perception.with_first(&colours)?;
        Ok(self)
    }

    fn detect(&self, pictures: &Pictures) -> Result<Tensor<2>, ReadError> {
        Ok(self.things(&self.look(pictures)?).flatten::<2>(1, 2))
    }

    fn device(&self) -> Device {
        self.place.device()
    }
}
