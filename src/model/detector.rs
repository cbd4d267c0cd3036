//! Detectors: from a picture to the positions of all slots' objects.
//!
//! # Shapes
//!
//! A detection is a row of `3 N` numbers: x, y, z of each slot in the world, in decimetres. Where the gripper is and
//! whether it is closed a robot knows of itself: observation rows are relative to that.
//!
//! # Source
//!
//! Paper, section V-D: a separately trained network that predicts the positions of the N objects.

mod assignment;
mod patches;
mod points;
mod vgg;

use burn::module::{Module, ModuleDisplay};
use burn::tensor::{Device, Tensor, TensorData};

pub use points::{PointDetector, PointDetectorConfig};
pub use vgg::{VggDetector, VggDetectorConfig};

use crate::model::layers::Init;
use crate::model::pictures::{PictureSample, Pictures};
use crate::seed::Seed;
use crate::trace::{GripperState, Observation};

/// Detections are in decimetres: numbers of about one.
const PER_METRE: f32 = 10.0;
/// Errors below three millimetres count by their square, larger ones as they are.
const SMALL_ERROR: f32 = 0.03;

/// Finds objects in a picture.
pub trait Detector: Module + ModuleDisplay + Sync + Sized + 'static {
    /// What it is made with.
    type Config: Copy;

    /// A fresh one for `n_slots` slots.
    fn new(config: &Self::Config, n_slots: usize, init: &mut Init) -> Self;

    /// See [`super::Network::acquainted`]. `positions` are those in the sample's pictures, `[F, 3 N]` in the world in
    /// metres.
    #[must_use]
    fn acquainted(self, _sample: &PictureSample, _positions: &[f32], _seed: Seed) -> Self {
        self
    }

    /// `F` pictures → `[F, 3 N]`. The grippers beside the pictures are not looked at.
    fn detect(&self, pictures: &Pictures) -> Tensor<2>;

    /// Where the parameters are.
    fn device(&self) -> Device;
}

/// A fresh detector for `n_slots` slots; the same seed gives the same parameters.
pub fn detector_of<D: Detector>(config: &D::Config, n_slots: usize, seed: Seed, device: &Device) -> D {
    D::new(config, n_slots, &mut Init::new(seed, device))
}

/// Observation rows that detections amount to for robots in some states, `[F, 3 N + 2]` in metres.
pub(crate) fn rows(detections: Tensor<2>, grippers: &[GripperState]) -> Vec<f32> {
    let [n, width] = detections.dims();
    let values: Vec<f32> = detections.into_data().try_into_vec().unwrap_or_default();
    let mut rows = Vec::with_capacity(n * (width + 2));
    for (positions, gripper) in values.chunks_exact(width.max(1)).zip(grippers) {
        let origin = gripper.in_world_m.iter().cycle();
        let closed = f32::from(u8::from(gripper.closed));
        rows.extend(positions.iter().zip(origin).map(|(value, origin)| value / PER_METRE - origin));
        rows.extend([1.0 - closed, closed]);
    }
    rows
}

/// Where all slots' objects are in the world, `[F, 3 N]` in metres, by observation rows and the grippers that they are
/// relative to.
pub(crate) fn positions_in_world(rows: &[f32], n_slots: usize, grippers: &[GripperState]) -> Vec<f32> {
    let rows = rows.chunks_exact(Observation::width(n_slots)).zip(grippers);
    let in_world = rows.flat_map(|(row, gripper)| {
        row[..3 * n_slots].iter().zip(gripper.in_world_m.iter().cycle()).map(|(value, origin)| value + origin)
    });
    in_world.collect()
}

/// What a detector is told of its errors.
#[derive(Debug)]
pub struct DetectionLoss {
    /// Mean error of positions, to be differentiated.
    pub total: Tensor<1>,
    /// Mean distance between detected and true positions, in metres.
    pub distance_m: f32,
}

/// How far detections are from positions in the world, `[F, 3 N]` in metres.
pub(crate) fn loss(detections: Tensor<2>, positions: &[f32]) -> DetectionLoss {
    let device = detections.device();
    let positions: Vec<f32> = positions.iter().map(|value| value * PER_METRE).collect();
    let positions = Tensor::<2>::from_data(TensorData::new(positions, detections.dims()), &device);
    let errors = detections - positions;
    let distances: Vec<f32> = errors.clone().into_data().try_into_vec().unwrap_or_default();
    let distances = distances.as_chunks::<3>().0;
    let length = |error: &[f32; 3]| error.iter().map(|value| value * value).sum::<f32>().sqrt();
    let distance_m = distances.iter().map(length).sum::<f32>() / distances.len().max(1) as f32 / PER_METRE;
    let smooth = (errors.powf_scalar(2.0) + SMALL_ERROR * SMALL_ERROR).sqrt() - SMALL_ERROR;
    DetectionLoss { total: smooth.mean(), distance_m }
}
