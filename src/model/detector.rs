//! Detectors: from a picture to the positions of all slots' objects.
//!
//! # Shapes
//!
//! A detection is a row of `3 N + 1` numbers: x, y, z of each slot relative to the gripper in decimetres, and the logit
//! of a closed gripper.
//!
//! # Source
//!
//! Paper, section V-D: a separately trained network that predicts the positions of the N objects.

mod assignment;
mod patches;
mod points;
mod vgg;

use burn::module::{Module, ModuleDisplay};
use burn::tensor::activation::relu;
use burn::tensor::{Device, Tensor, TensorData};

pub use points::{PointDetector, PointDetectorConfig};
pub use vgg::{VggDetector, VggDetectorConfig};

use crate::model::layers::Init;
use crate::model::pictures::{PictureSample, Pictures};
use crate::seed::Seed;
use crate::trace::Observation;

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

    /// See [`super::Network::acquainted`]. `rows` are the observation rows of the sample's pictures.
    #[must_use]
    fn acquainted(self, _sample: &PictureSample, _rows: &[f32], _seed: Seed) -> Self {
        self
    }

    /// `F` pictures → `[F, 3 N + 1]`.
    fn detect(&self, pictures: &Pictures) -> Tensor<2>;

    /// Where the parameters are.
    fn device(&self) -> Device;
}

/// A fresh detector for `n_slots` slots; the same seed gives the same parameters.
pub fn detector_of<D: Detector>(config: &D::Config, n_slots: usize, seed: Seed, device: &Device) -> D {
    D::new(config, n_slots, &mut Init::new(seed, device))
}

/// Observation rows that detections amount to, `[F, 3 N + 2]` in metres.
pub(crate) fn rows(detections: Tensor<2>) -> Vec<f32> {
    let [_, width] = detections.dims();
    let values: Vec<f32> = detections.into_data().try_into_vec().unwrap_or_default();
    let mut rows = Vec::with_capacity(values.len() / width * (width + 1));
    for detection in values.chunks_exact(width) {
        let (positions, closed) = detection.split_at(width - 1);
        let closed = f32::from(u8::from(closed[0] > 0.0));
        rows.extend(positions.iter().map(|value| value / PER_METRE));
        rows.extend([1.0 - closed, closed]);
    }
    rows
}

/// What a detector is told of its errors.
#[derive(Debug)]
pub struct DetectionLoss {
    /// Mean error of positions and of the gripper, to be differentiated.
    pub total: Tensor<1>,
    /// Mean distance between detected and true positions, in metres.
    pub distance_m: f32,
}

/// How far detections are from observation rows `[F, 3 N + 2]`.
pub(crate) fn loss(detections: Tensor<2>, n_slots: usize, rows: &[f32]) -> DetectionLoss {
    let device = detections.device();
    let n = detections.dims()[0];
    let observed = rows.chunks_exact(Observation::width(n_slots));
    let positions: Vec<f32> =
        observed.clone().flat_map(|row| &row[..3 * n_slots]).map(|value| value * PER_METRE).collect();
    let closed: Vec<f32> = observed.map(|row| row[3 * n_slots + 1]).collect();
    let positions = Tensor::<2>::from_data(TensorData::new(positions, [n, 3 * n_slots]), &device);
    let closed = Tensor::<2>::from_data(TensorData::new(closed, [n, 1]), &device);
    let errors = detections.clone().narrow(1, 0, 3 * n_slots) - positions;
    let distances: Vec<f32> = errors.clone().into_data().try_into_vec().unwrap_or_default();
    let distances = distances.as_chunks::<3>().0;
    let length = |error: &[f32; 3]| error.iter().map(|value| value * value).sum::<f32>().sqrt();
    let distance_m = distances.iter().map(length).sum::<f32>() / distances.len().max(1) as f32 / PER_METRE;
    let smooth = (errors.powf_scalar(2.0) + SMALL_ERROR * SMALL_ERROR).sqrt() - SMALL_ERROR;
    let logits = detections.narrow(1, 3 * n_slots, 1);
    let softplus = relu(logits.clone()) + logits.clone().abs().neg().exp().log1p();
    DetectionLoss { total: smooth.mean() + (softplus - logits * closed).mean(), distance_m }
}
