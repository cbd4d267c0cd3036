//! Heat maps: for each slot a softmax over the cells of a picture, and from what lies there a position.
//!
//! ```text
//! [F, h, w, C] ─linear► scores of slots ─softmax over cells► place x, y, and the features there
//!                                                            └─ linear of the place, plus layers over all of it ─► x, y, z
//! ```
//!
//! # Source
//!
//! Spatial softmax: C. Finn et al., "Deep Spatial Autoencoders for Visuomotor Learning", 2016. Departure: a map is a
//! slot's, and features are read where it is hot.

use burn::module::Module;
use burn::tensor::activation::softmax;
use burn::tensor::{Device, Tensor, TensorData};

use crate::model::detector::AXES;
use crate::model::layers::{Init, Mlp};
use crate::model::linear::Linear;

/// Numbers of a place in a picture.
const PLACE: usize = 2;
/// Width of the layers from a place and its features to a position.
const HIDDEN: usize = 64;
/// Scores are this much sharper than a layer's outputs, so that heat has a place to begin with.
const SHARPNESS: f32 = 8.0;

/// Heat maps of all slots, and what makes positions of them.
#[derive(Module, Debug)]
pub(super) struct HeatMaps {
    scores: Linear,
    /// A camera that stands still shows the table as a plane: the place alone says most.
    plane: Linear,
    hidden: Mlp,
    position: Linear,
}

impl HeatMaps {
    pub(super) fn new(channels: usize, n_slots: usize, init: &mut Init) -> Self {
        Self {
            scores: init.linear(channels, n_slots),
            plane: init.linear(PLACE, AXES),
            hidden: init.mlp(&[PLACE + channels, HIDDEN]),
            position: init.linear(HIDDEN, AXES),
        }
    }

    /// # Shapes
    ///
    /// `[F, h, w, C]` → `[F, 3 N]`
    pub(super) fn forward(&self, seen: Tensor<4>) -> Tensor<2> {
        let [n, height, width, channels] = seen.dims();
        let n_slots = self.scores.n_outputs();
        let cells: Tensor<3> = seen.reshape([n, height * width, channels]);
        let scores = self.scores.forward(cells.clone()) * SHARPNESS;
        let heat = softmax(scores, 1).swap_dims(1, 2); // [F, N, h w]
        let grid = places(height, width, &cells.device()).expand([n, height * width, PLACE]);
        let place = heat.clone().matmul(grid);
        let there = Tensor::cat(vec![place.clone(), heat.matmul(cells)], 2);
        let position = self.plane.forward(place) + self.position.forward(self.hidden.forward(there));
        position.reshape([n, AXES * n_slots])
    }
}

/// Where the cells of a picture are, row by row: x to the right and y down, from -1 to 1 from edge to edge.
///
/// # Shapes
///
/// `[1, height * width, 2]`
fn places(height: usize, width: usize, device: &Device) -> Tensor<3> {
    let along = |at: usize, n: usize| (2 * at + 1) as f32 / n as f32 - 1.0;
    let of_cell = |cell: usize| [along(cell % width, width), along(cell / width, height)];
    let places: Vec<f32> = (0..height * width).flat_map(of_cell).collect();
    Tensor::from_data(TensorData::new(places, [1, height * width, PLACE]), device)
}

#[cfg(test)]
mod tests {
    use burn::module::Param;
    use burn::tensor::{Device, Tensor};

    use super::{HIDDEN, HeatMaps};
    use crate::model::layers::Init;
    use crate::model::linear::Linear;
    use crate::seed::Seed;

    #[test]
    fn a_slots_position_follows_the_cell_where_its_feature_is() {
        let device = Device::flex();
        let mut init = Init::new(Seed(1), &device);
        let linear = |weight: Vec<f32>, inputs: usize, outputs: usize| {
            let weight = Tensor::<1>::from_data(weight.as_slice(), &device).reshape([inputs, outputs]);
            Linear::new(Param::from_tensor(weight), None)
        };
        let maps = HeatMaps {
            // The first slot is hot where the second feature is, the second where the first is.
            scores: linear(vec![0.0, 10.0, 10.0, 0.0], 2, 2),
            plane: linear(vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0], 2, 3),
            hidden: init.mlp(&[4, HIDDEN]),
            position: linear(vec![0.0; 3 * HIDDEN], HIDDEN, 3),
        };
        // Two rows of four cells: the first feature in the upper left, the second in the lower row's third.
        let mut cells = [[0.0_f32; 2]; 8];
        cells[0][0] = 1.0;
        cells[6][1] = 1.0;
        let seen = Tensor::<1>::from_data(cells.as_flattened(), &device).reshape([1, 2, 4, 2]);
        let found: Vec<f32> = maps.forward(seen).into_data().try_into_vec().unwrap();
        for (found, expected) in found.iter().zip([0.25, 0.5, 0.0, -0.75, -0.5, 0.0]) {
            assert!((found - expected).abs() < 1e-5, "{found} instead of {expected}");
        }
    }
}
