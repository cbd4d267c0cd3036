//! What becomes of a picture before anything is compared: slots in the picture's plane.

use std::fmt::Debug;

use burn::module::{Module, ModuleDisplay};
use burn::tensor::{Int, Tensor};

use crate::model::encoder::ArgumentDecoder;
use crate::model::layers::Init;
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::sighted::Sighted;
use crate::seed::Seed;

/// x, y, mass and spread of a percept.
pub(crate) const PERCEPT_WIDTH: usize = 4;

/// Finds a fixed number of things in each picture by itself.
pub trait Perception: Module + ModuleDisplay + Sync + Sized + 'static {
    /// What it is made with, as it stands in a model's configuration.
    type Config: Copy;
    /// What is kept of each picture besides, for naming objects: `()` where places are all.
    type Looks: Looks;
    /// How an object is named by what is found.
    type Naming: ArgumentDecoder<Sighted<Self>>;

    /// A fresh one.
    fn new(config: &Self::Config, init: &mut Init) -> Self;

    /// How many things it finds in a picture.
    fn n_percepts(config: &Self::Config) -> usize;

    /// See [`super::Network::acquainted`].
    #[must_use]
    fn acquainted(self, sample: &PictureSample, seed: Seed) -> Self;

    /// Finds them.
    ///
    /// # Shapes
    ///
    /// `F` pictures → `[F, K, 4]`: x and y from -1 to 1 across and down the picture, mass (how much of it is there)
    /// and spread (in the unit of x). The robot is the first of the `K`.
    fn look(&self, pictures: &Pictures) -> (Tensor<3>, Self::Looks);
}

/// What is kept of pictures beside the places of percepts.
pub trait Looks: Clone + Send + Sync + Debug + 'static {
    /// Those of some of the pictures.
    #[must_use]
    fn select(&self, pictures: Tensor<1, Int>) -> Self;
}

impl Looks for () {
    fn select(&self, _pictures: Tensor<1, Int>) -> Self {}
}
