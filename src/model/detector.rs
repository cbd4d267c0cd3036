//! Detectors: from a picture to the positions of all slots' objects.
//!
//! # Shapes
//!
//! A detection is x, y, z of each slot in the world, in decimetres: a row of `3 N` numbers. Where the gripper is and
//! whether it is closed a robot knows of itself: observation rows are relative to that.
//!
//! # Source
//!
//! Paper, section V-D: a separately trained network that predicts the positions of the N objects.

mod assignment;
mod heat_maps;
mod patches;
mod points;
mod vgg;

use burn::module::{Module, ModuleDisplay};
use burn::tensor::{Device, Tensor, TensorData};

pub use points::{PointDetector, PointDetectorConfig};
pub use vgg::{VggDetector, VggDetectorConfig};

use crate::model::encoder::TrainingDefaults;
use crate::model::layers::Init;
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::values::{TensorError, values};
use crate::seed::Seed;
use crate::trace::{GripperState, Observation, ObservationRow, ObservationRows};

/// Detections are in decimetres: numbers of about one.
const PER_METRE: f32 = 10.0;
/// Numbers of a position: x, y and z.
pub(crate) const AXES: usize = 3;
/// Errors below three millimetres count by their square, larger ones as they are.
const SMALL_ERROR: f32 = 0.03;

/// How a detector is trained unless a pipeline file says otherwise. The values stand beside each detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DetectorDefaults {
    /// Steps of the optimizer.
    pub steps: u32,
    /// Pictures of a step.
    pub pictures: u32,
    /// Highest learning rate.
    pub learning_rate: f32,
    /// What its widths are divided by; nothing where they are not.
    pub narrowed: Option<u32>,
    /// Of the network behind it.
    pub behind: TrainingDefaults,
}

/// Finds objects in a picture.
pub trait Detector: Module + ModuleDisplay + Sync + Sized + 'static {
    /// What it is made with.
    type Config: Copy;

    /// A fresh one for `n_slots` slots.
    fn new(config: &Self::Config, n_slots: usize, init: &mut Init) -> Self;

    /// See [`super::Network::calibrated`]. `positions` are those in the sample's pictures, `[F * N]` in the world in
    /// metres.
    ///
    /// # Errors
    ///
    /// As there.
    fn calibrated(self, _sample: &PictureSample, _positions: &[[f32; 3]], _seed: Seed) -> Result<Self, ReadError> {
        Ok(self)
    }

    /// `F` pictures → `[F, 3 N]`. The grippers beside the pictures are not looked at.
    ///
    /// # Errors
    ///
    /// [`ReadError`] when a tensor's numbers cannot be read.
    fn detect(&self, pictures: &Pictures) -> Result<Tensor<2>, ReadError>;

    /// Where the parameters are.
    fn device(&self) -> Device;
}

/// A fresh detector for `n_slots` slots; the same seed gives the same parameters.
pub fn detector_of<D: Detector>(config: &D::Config, n_slots: usize, seed: Seed, device: &Device) -> D {
    D::new(config, n_slots, &mut Init::new(seed, device))
}

/// Observations that detections amount to for robots in some states, a row each.
pub(crate) fn rows(detections: Tensor<2>, grippers: &[GripperState]) -> Result<ObservationRows, TensorError> {
    let n_slots = detections.dims()[1] / AXES;
    let positions = values(detections)?;
    let pictures = positions.as_chunks::<AXES>().0.chunks_exact(n_slots.max(1)).zip(grippers);
    let observation = |(positions, gripper): (&[[f32; AXES]], &GripperState)| {
        let relative = |position: &[f32; AXES]| -> [f32; AXES] {
            std::array::from_fn(|axis| position[axis] / PER_METRE - gripper.in_world_m[axis])
        };
        Observation { slots_m: positions.iter().map(relative).collect(), closed: gripper.closed }
    };
    let observations: Vec<Observation> = pictures.map(observation).collect();
    Ok(ObservationRows::of(n_slots, &observations))
}

/// Where all slots' objects are in the world, `[F * N]` in metres, by observations and the grippers that they are
/// relative to.
pub(crate) fn positions_in_world(rows: &ObservationRows, grippers: &[GripperState]) -> Vec<[f32; 3]> {
    let in_world = |position: &[f32; AXES], gripper: &GripperState| -> [f32; AXES] {
        std::array::from_fn(|axis| position[axis] + gripper.in_world_m[axis])
    };
    let of_row = |(row, gripper): (ObservationRow<'_>, &GripperState)| -> Vec<[f32; AXES]> {
        row.positions.iter().map(|position| in_world(position, gripper)).collect()
    };
    rows.iter().zip(grippers).flat_map(of_row).collect()
}

/// What a detector is told of its errors.
#[derive(Debug)]
pub struct DetectionLoss {
    /// Mean error of positions, to be differentiated.
    pub total: Tensor<1>,
    /// Mean distance between detected and true positions, in metres.
    pub distance_m: f32,
}

/// How far detections are from positions in the world, `[F * N]` in metres.
pub(crate) fn loss(detections: Tensor<2>, positions: &[[f32; 3]]) -> Result<DetectionLoss, TensorError> {
    let errors = errors(detections, positions);
    let distances = values(errors.clone())?;
    let distances = distances.as_chunks::<AXES>().0;
    let length = |error: &[f32; AXES]| error.iter().map(|value| value * value).sum::<f32>().sqrt();
    let distance_m = distances.iter().map(length).sum::<f32>() / distances.len().max(1) as f32 / PER_METRE;
    Ok(DetectionLoss { total: mean_error(errors), distance_m })
}

/// The same without a stop: the mean error, to be differentiated, and the mean distance in metres.
pub(crate) fn loss_and_distance(detections: Tensor<2>, positions: &[[f32; 3]]) -> [Tensor<1>; 2] {
    let errors = errors(detections, positions);
    let squares = errors.clone().square().reshape([positions.len(), AXES]).sum_dim(1);
    [mean_error(errors), squares.sqrt().mean() / PER_METRE]
}

/// In the detector's unit of length.
fn errors(detections: Tensor<2>, positions: &[[f32; 3]]) -> Tensor<2> {
    let device = detections.device();
    let positions: Vec<f32> = positions.as_flattened().iter().map(|value| value * PER_METRE).collect();
    let positions = Tensor::<2>::from_data(TensorData::new(positions, detections.dims()), &device);
    detections - positions
}

/// Linear in what is large, and smooth about nothing.
fn mean_error(errors: Tensor<2>) -> Tensor<1> {
    let smooth = (errors.powf_scalar(2.0) + SMALL_ERROR * SMALL_ERROR).sqrt() - SMALL_ERROR;
    smooth.mean()
}
