//! What belongs to one camera: its perception, and the first layers over what it finds.

use burn::module::Module;
use burn::tensor::Tensor;

use crate::model::layers::{Init, Mlp};
use crate::model::linear::Linear;
use crate::model::perception::{PERCEPT_WIDTH, Perception};
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::sighted::SightedConfig;
use crate::seed::Seed;

/// Features of a place or displacement in the picture: two linear, two bumps at zero.
pub(super) const PLACE_WIDTH: usize = 4;
/// Features of a percept: how it lies to the robot, where it is, how it looks, and how the robot looks.
pub(super) const OBJECT_WIDTH: usize = PLACE_WIDTH + 2 * PERCEPT_WIDTH;
/// Scale of the linear features, per half picture.
const LINEAR_GAIN: f32 = 3.0;
/// A bump has fallen to 1/e at about the width of a block.
const BUMP_GAIN: f32 = 8.0;

/// What belongs to a camera behind the first.
#[derive(Module, Debug)]
pub(super) struct Other<P: Module> {
    perception: P,
    pair_demonstration: Linear,
    pair_state: Linear,
    object_seen: Mlp,
    state: Mlp,
}

/// What belongs to a camera.
pub(super) struct Eye<'e, P> {
    pub(super) perception: &'e P,
    pub(super) pair_demonstration: &'e Linear,
    pub(super) pair_state: &'e Linear,
    pub(super) object_seen: &'e Mlp,
    pub(super) state: &'e Mlp,
}

/// What a camera's pictures give by themselves.
pub(super) struct Seen<L> {
    /// `[F, K * K, pair]` each.
    pub(super) pairs: [Tensor<3>; 2],
    /// `[F, K, H]`
    pub(super) objects: Tensor<3>,
    /// Most of the percepts, `[F, H]`.
    pub(super) state: Tensor<2>,
    /// `[F, PERCEPT_WIDTH]`
    pub(super) robot: Tensor<2>,
    pub(super) looks: L,
}

impl<P: Perception> Other<P> {
    pub(super) fn new(config: &SightedConfig<P::Config>, init: &mut Init) -> Self {
        let &SightedConfig { perception, pair_width, width, .. } = config;
        Self {
            perception: P::new(&perception, init),
            pair_demonstration: init.part(PLACE_WIDTH, pair_width, 2 * PLACE_WIDTH),
            pair_state: init.linear(PLACE_WIDTH, pair_width),
            object_seen: init.mlp(&[OBJECT_WIDTH, width, width]),
            state: init.mlp(&[OBJECT_WIDTH, width, width]),
        }
    }

    /// See [`crate::model::Network::calibrated`].
    pub(super) fn calibrated(mut self, sample: &PictureSample, seed: Seed) -> Result<Self, ReadError> {
        self.perception = self.perception.calibrated(sample, seed)?;
        Ok(self)
    }

    pub(super) fn eye(&self) -> Eye<'_, P> {
        let Self { perception, pair_demonstration, pair_state, object_seen, state } = self;
        Eye { perception, pair_demonstration, pair_state, object_seen, state }
    }
}

impl<P: Perception> Eye<'_, P> {
    pub(super) fn see(&self, pictures: &Pictures) -> Result<Seen<P::Looks>, ReadError> {
        let (seen, looks) = self.perception.look(pictures)?; // [F, K, PERCEPT_WIDTH]
        let [n_pictures, n_percepts, _] = seen.dims();
        let places = seen.clone().narrow(2, 0, 2);
        let robot = seen.clone().narrow(1, 0, 1); // [F, 1, PERCEPT_WIDTH]
        let relative = place_features(places.clone() - robot.clone().narrow(2, 0, 2));
        let appearance = seen * LINEAR_GAIN;
        let robots = (robot * LINEAR_GAIN).expand([n_pictures, n_percepts, PERCEPT_WIDTH]);
        let objects = Tensor::<3>::cat(vec![relative, appearance, robots.clone()], 2);
        let columns: Tensor<4> = places.clone().unsqueeze_dim(1);
        let rows: Tensor<4> = places.unsqueeze_dim(2);
        let pairs = place_features(rows - columns).reshape([n_pictures, n_percepts * n_percepts, PLACE_WIDTH]);
        Ok(Seen {
            pairs: [self.pair_demonstration.forward(pairs.clone()), self.pair_state.forward(pairs)],
            objects: self.object_seen.forward(objects.clone()),
            state: self.state.forward(objects).max_dim(1).squeeze_dim(1),
            robot: robots.narrow(1, 0, 1).squeeze_dim(1),
            looks,
        })
    }
}

/// Linear and bump features of the last dimension's two coordinates.
fn place_features<const D: usize>(places: Tensor<D>) -> Tensor<D> {
    let bumps = (places.clone() * BUMP_GAIN).powf_scalar(2.0).neg().exp();
    Tensor::cat(vec![places * LINEAR_GAIN, bumps], D - 1)
}
