//! Adam over all parameters of a module as one vector.
//!
//! ```text
//! m = β1 m + (1 - β1) g      v = β2 v + (1 - β2) g²
//! θ = θ - η · m · (√(1 - β2^t) / (1 - β1^t)) / (√v + ε √(1 - β2^t))
//! ```
//!
//! One vector takes a dozen launches on an accelerator, where a dozen for each parameter would be most of a step. The
//! operations are those of burn's optimizer in its order, so its numbers are the same to the last bit.
//!
//! # Source
//!
//! Kingma and Ba, "Adam: A Method for Stochastic Optimization", 2014.

use std::path::Path;

use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};

use crate::model::{ModelError, values, weights_from_bytes, weights_to_bytes};

/// β1, the share that the first moment keeps.
const KEEPS_FIRST: f32 = 0.9;
/// β2, the share that the second moment keeps.
const KEEPS_SECOND: f32 = 0.999;
/// ε, added to the root of the second moment.
const EPSILON: f32 = 1e-8;

/// The optimizer's memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Adam {
    /// t, the steps taken.
    time: u32,
    /// m and v; nothing before the first step.
    moments: Option<[Tensor<1>; 2]>,
}

/// The memory as it is saved.
#[derive(Module, Debug)]
struct Saved {
    first: Param<Tensor<1>>,
    second: Param<Tensor<1>>,
    /// One number.
    time: Param<Tensor<1>>,
}

impl Adam {
    /// The parameters after a step.
    pub(super) fn step(&mut self, learning_rate: f64, parameters: Tensor<1>, gradient: Tensor<1>) -> Tensor<1> {
        let first = gradient.clone().mul_scalar(1.0 - KEEPS_FIRST);
        let second = gradient.square().mul_scalar(1.0 - KEEPS_SECOND);
        let [first, second] = match self.moments.take() {
            Some([m, v]) => [m.mul_scalar(KEEPS_FIRST).add(first), v.mul_scalar(KEEPS_SECOND).add(second)],
            None => [first, second],
        };
        self.time += 1;
        let time = self.time as i32;
        let root = (1.0 - KEEPS_SECOND.powi(time)).sqrt();
        let factor = root / (1.0 - KEEPS_FIRST.powi(time));
        let below = second.clone().sqrt().add_scalar(EPSILON * root);
        let direction = first.clone().mul_scalar(factor).div(below);
        self.moments = Some([first, second]);
        parameters - direction.mul_scalar(learning_rate)
    }

    /// The memory of `n_parameters` as a safetensors file.
    ///
    /// # Errors
    ///
    /// As [`weights_to_bytes`]; `path` is for the message alone.
    pub(super) fn to_bytes(&self, n_parameters: usize, path: &Path) -> Result<Vec<u8>, ModelError> {
        let device = Device::flex();
        let read = |moment: Tensor<1>| {
            values(moment).map_err(|error| ModelError::Weights { problem: error.to_string(), path: path.into() })
        };
        let [first, second] = match &self.moments {
            Some(moments) => moments.clone().map(read),
            None => [Ok(vec![0.0; n_parameters]), Ok(vec![0.0; n_parameters])],
        };
        let vector = |values: Vec<f32>| {
            let n = values.len();
            Param::from_data(TensorData::new(values, [n]), &device)
        };
        let saved = Saved { first: vector(first?), second: vector(second?), time: vector(vec![self.time as f32]) };
        weights_to_bytes(&saved, path)
    }

    /// A memory of `n_parameters` that was saved, on a device.
    ///
    /// # Errors
    ///
    /// As [`weights_from_bytes`]; `path` is for the message alone.
    pub(super) fn from_bytes(
        bytes: Vec<u8>,
        n_parameters: usize,
        device: &Device,
        path: &Path,
    ) -> Result<Self, ModelError> {
        let host = Device::flex();
        let vector = |n: usize| Param::from_data(TensorData::zeros::<f32, _>([n]), &host);
        let empty = Saved { first: vector(n_parameters), second: vector(n_parameters), time: vector(1) };
        let Saved { first, second, time } = weights_from_bytes(empty, bytes, path)?;
        let unread = |problem: String| ModelError::Weights { problem, path: path.into() };
        let time = values(time.val()).map_err(|error| unread(error.to_string()))?;
        let time = time.first().copied().unwrap_or_default() as u32;
        let moments = [first, second].map(|moment| moment.val().inner().to_device(device));
        Ok(Self { time, moments: Some(moments).filter(|_| time > 0) })
    }
}

#[cfg(test)]
mod tests {
    use burn::module::{Module, Param};
    use burn::optim::{AdamConfig, GradientsParams};
    use burn::tensor::{Device, Tensor, TensorData};

    use super::Adam;
    use crate::model::values;

    #[derive(Module, Debug)]
    struct Two {
        table: Param<Tensor<2>>,
        row: Param<Tensor<1>>,
    }

    fn wave(n: usize, step: f32) -> Vec<f32> {
        (0..n).map(|at| (at as f32 * step).sin()).collect()
    }

    #[test]
    fn parameters_are_those_of_burns_optimizer_to_the_last_bit_also_from_a_saved_memory() {
        let device = Device::flex().autodiff();
        let start = wave(21, 0.7);
        let parts = |values: &[f32]| {
            (TensorData::new(values[..15].to_vec(), [3, 5]), TensorData::new(values[15..].to_vec(), [6]))
        };
        let (table, row) = parts(&start);
        let mut theirs = Two { table: Param::from_data(table, &device), row: Param::from_data(row, &device) };
        let mut optimizer = AdamConfig::new().with_epsilon(1e-8).init();
        let host = Device::flex();
        let mut ours = Tensor::<1>::from_data(TensorData::new(start, [21]), &host);
        let mut adam = Adam::default();
        let path = std::path::Path::new("moments");
        for step in 0..9 {
            let gradient = wave(21, 0.1 + step as f32);
            let (table, row) = parts(&gradient);
            let mut gradients = GradientsParams::new();
            gradients.register(theirs.table.id, Tensor::<2>::from_data(table, &host));
            gradients.register(theirs.row.id, Tensor::<1>::from_data(row, &host));
            theirs = optimizer.step(0.003, theirs, gradients);
            ours = adam.step(0.003, ours, Tensor::from_data(TensorData::new(gradient, [21]), &host));
            let saved = adam.to_bytes(21, path).expect("written");
            adam = Adam::from_bytes(saved, 21, &host, path).expect("read");
            let flat = [values(theirs.table.val()), values(theirs.row.val())].map(|read| read.expect("numbers"));
            let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
            assert_eq!(bits(values(ours.clone()).expect("numbers")), bits(flat.concat()), "step {step}");
        }
    }
}
