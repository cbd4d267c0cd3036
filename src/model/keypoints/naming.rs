//! Names an object by what is seen where the robot comes to be, and by how each keypoint lies and moves.

use burn::module::Module;
use burn::tensor::activation::{relu, softmax};
use burn::tensor::{Tensor, TensorData};

use crate::model::encoder::ArgumentDecoder;
use crate::model::keypoints::{CellLooks, Keypoints, KeypointsConfig};
use crate::model::layers::{Init, TemporalConv};
use crate::model::linear::Linear;
use crate::model::sighted::{Sighted, SightedConfig, SightedReading};
use crate::model::windows::Padding;

/// Places about the robot that are looked at: columns and rows, one row above it and the others below, where a gripper
/// has what it acts on.
const GLIMPSE: [usize; 2] = [3, 9];
const ROWS_ABOVE: usize = 1;
/// How far these are apart, per half picture: a twelfth is four pixels of 96.
const GLIMPSE_STEP: f32 = 1.0 / 12.0;
/// How fast a cell's weight falls with its distance from the place that is looked at, per half picture.
const SHARPNESS: f32 = 16.0;

/// Keypoint `1 + n` stands for slot `n`.
///
/// ```text
/// robot in the window's last frame ─► scores of each slot's keypoint about there, in the first and in the last frame ─┐
/// each keypoint in the window and now, as the object-centric pointer reads a slot ───────────────────────────────────┴► slots
/// ```
///
/// What the gripper holds it also hides; the first frame shows what lay there before. The camera stands still within
/// a demonstration. Which place about the robot counts depends on the program.
#[derive(Module, Debug)]
pub struct GlimpseNaming {
    before: Linear,
    after: Linear,
    conv: TemporalConv,
    object: Linear,
    context: Linear,
    slot: Linear,
    /// Of the cameras behind the first: before and after.
    others: Vec<[Linear; 2]>,
}

impl GlimpseNaming {
    /// Evidence for each slot about the robot, `[B, N]`: a softmax over places, not one chosen place, so that it can
    /// be learned where to look.
    fn glimpsed([before, after]: [&Linear; 2], [first, last]: &[CellLooks; 2], context: &Tensor<2>) -> Tensor<2> {
        let looked_at = attention(last);
        let evidence = |glimpse: &Linear, looks: &CellLooks| -> Tensor<2> {
            let prior: Tensor<3> = glimpse.forward(context.clone()).unsqueeze_dim(2); // [B, places, 1]
            log_sum_exp(looked_at.clone().matmul(looks.scores.clone()) + prior)
        };
        evidence(before, first) + evidence(after, last)
    }
}

/// The cells about each of the places about the robot, `[B, places, L]`.
fn attention(looks: &CellLooks) -> Tensor<3> {
    let device = looks.robot.device();
    let [n, n_cells, _] = looks.scores.dims();
    let offsets = glimpse_offsets();
    let n_places = offsets.len();
    let offsets = Tensor::<3>::from_data(TensorData::new(offsets.into_flattened(), [1, n_places, 2]), &device);
    let places = looks.robot.clone().unsqueeze_dim::<3>(1) + offsets; // [B, places, 2]
    let cells = Tensor::<3>::from_data(TensorData::new(looks.cell_places(), [1, 2, n_cells]), &device);
    let squares = cells.clone().powf_scalar(2.0).sum_dim(1) + places.clone().powf_scalar(2.0).sum_dim(2);
    let distances = squares - places.matmul(cells.expand([n, 2, n_cells])) * 2.0;
    softmax(distances * -(SHARPNESS * SHARPNESS), 2)
}

/// x and y of the places relative to the robot.
fn glimpse_offsets() -> Vec<[f32; 2]> {
    let [columns, rows] = GLIMPSE;
    let offset = |at: usize, before: usize| (at as f32 - before as f32) * GLIMPSE_STEP;
    (0..rows * columns).map(|at| [offset(at % columns, columns / 2), offset(at / columns, ROWS_ABOVE)]).collect()
}

/// Over the middle dimension: `[B, places, N]` → `[B, N]`.
fn log_sum_exp(scores: Tensor<3>) -> Tensor<2> {
    let largest = scores.clone().max_dim(1).detach();
    ((scores - largest.clone()).exp().sum_dim(1).log() + largest).squeeze_dim(1)
}

impl ArgumentDecoder<Sighted<Keypoints>> for GlimpseNaming {
    fn new(config: &SightedConfig<KeypointsConfig>, _n_slots: usize, _n_view: usize, init: &mut Init) -> Self {
        let &SightedConfig { cameras, width, program_width, argument_kernel, .. } = config;
        let n_context = program_width + width;
        let n_places = GLIMPSE[0] * GLIMPSE[1];
        Self {
            before: init.linear(n_context, n_places),
            after: init.linear(n_context, n_places),
            conv: init.temporal_conv(argument_kernel, width, width),
            object: init.part(2 * width, width, 2 * width + n_context),
            context: init.linear(n_context, width),
            slot: init.linear(width, 1),
            others: (1..cameras)
                .map(|_| [init.linear(n_context, n_places), init.linear(n_context, n_places)])
                .collect(),
        }
    }

    fn forward(
        &self,
        reading: &SightedReading<CellLooks>,
        program: Tensor<2>,
        _view: Tensor<2>,
        hidden: Tensor<2>,
    ) -> Tensor<2> {
        let padding = reading.padding.as_ref();
        let n_percepts = reading.objects.dims()[2] / reading.ends.len().max(1);
        let context = Tensor::cat(vec![program, hidden], 1);
        let hidden: Tensor<3> = self.context.forward(context.clone()).unsqueeze_dim(1);
        let evidence = |camera: usize, glimpse: [&Linear; 2]| {
            let objects = reading.objects.clone().narrow(2, camera * n_percepts + 1, n_percepts - 1);
            let objects = Padding::mask_objects(padding, objects);
            let last = Padding::last_objects(padding, objects.clone());
            let moving = Padding::mask_objects(padding, self.conv.forward(objects)).max_dim(1).squeeze_dim(1);
            let object = self.object.forward(Tensor::<3>::cat(vec![moving, last], 2)); // [B, N, H]
            let pointed: Tensor<2> = self.slot.forward(relu(object + hidden.clone())).squeeze_dim(2);
            pointed + Self::glimpsed(glimpse, &reading.ends[camera], &context)
        };
        let first = evidence(0, [&self.before, &self.after]);
        let others = self.others.iter().zip(1..);
        others.fold(first, |sum, ([before, after], camera)| sum + evidence(camera, [before, after]))
    }
}

#[cfg(test)]
mod tests {
    use burn::tensor::{Device, Tensor, TensorData};

    use super::{GLIMPSE, attention, glimpse_offsets, log_sum_exp};
    use crate::model::keypoints::CellLooks;

    fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
        crate::model::values(tensor).unwrap()
    }

    #[test]
    fn a_glimpse_has_the_robot_in_its_second_row_and_goes_down_from_there() {
        let offsets = glimpse_offsets();
        assert_eq!(offsets[4], [0.0, 0.0]);
        assert!(offsets[0][1] < 0.0 && offsets[0][0] < 0.0 && offsets[7][1] > 0.0);
        assert_eq!(offsets[GLIMPSE[0]][0], offsets[0][0]);
    }

    #[test]
    fn a_glimpse_weighs_the_cells_about_its_place() {
        let device = Device::flex();
        // The robot is in the lower right one of 8 by 8 cells.
        let looks = CellLooks {
            scores: Tensor::zeros([1, 64, 1], &device),
            robot: Tensor::<2>::from_data(TensorData::new(vec![0.875_f32, 0.875], [1, 2]), &device),
            rows: 8,
            columns: 8,
        };
        let weights = values(attention(&looks));
        let middle = &weights[4 * 64..][..64];
        assert!((middle.iter().sum::<f32>() - 1.0).abs() < 1e-5 && middle[63] > 0.99, "{middle:?}");
    }

    #[test]
    fn the_logarithm_of_a_sum_does_not_overflow() {
        let scores = TensorData::new(vec![1000.0_f32, 1000.0, -1000.0, 0.0], [1, 2, 2]);
        let sums = values(log_sum_exp(Tensor::<3>::from_data(scores, &Device::flex())));
        assert!((sums[0] - 1000.0).abs() < 1e-3 && (sums[1] - 1000.0).abs() < 1e-3, "{sums:?}");
    }
}
