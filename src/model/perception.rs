//! What becomes of a picture before anything is compared: slots in the picture's plane.

use std::fmt::Debug;

use burn::module::{Module, ModuleDisplay};
use burn::tensor::{Int, Tensor};

use crate::model::layers::Init;
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::seed::Seed;

/// x, y, mass and spread of a percept.
pub(crate) const PERCEPT_WIDTH: usize = 4;

/// Finds a fixed number of things in each picture by itself.
pub trait Perception: Module + ModuleDisplay + Sync + Sized + 'static {
    /// What it is made with, as it stands in a model's configuration.
    type Config: Copy;
    /// What is kept of each picture besides, for naming objects: `()` where places are all.
    type Looks: Looks;

    /// A fresh one.
    fn new(config: &Self::Config, init: &mut Init) -> Self;

    /// How many things it finds in a picture.
    fn n_percepts(config: &Self::Config) -> usize;

    /// See [`super::Network::calibrated`].
    ///
    /// # Errors
    ///
    /// As there.
    fn calibrated(self, sample: &PictureSample, seed: Seed) -> Result<Self, ReadError>;

    /// Finds them.
    ///
    /// # Shapes
    ///
    /// `F` pictures → `[F, K, 4]`: x and y from -1 to 1 across and down the picture, mass (how much of it is there)
    /// and spread (in the unit of x). The robot is the first of the `K`.
    ///
    /// # Errors
    ///
    /// [`ReadError`] when a tensor's numbers cannot be read.
    fn look(&self, pictures: &Pictures) -> Result<(Tensor<3>, Self::Looks), ReadError>;
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
