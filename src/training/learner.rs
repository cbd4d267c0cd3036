//! One step of the optimizer: gradients of what is lost, clipped, and Adam.
//!
//! # Invariants
//!
//! On the processor groups run side by side on the current rayon pool, each on a copy of the parameters with a gradient
//! graph of its own. Their gradients are summed in the order of the groups, so the pool's size changes nothing.
//! Elsewhere all groups are one batch, and a step stops once, to read what is told of it.

use std::path::Path;

use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};

use crate::model::{ModelError, TensorError, values};
use crate::training::adam::Adam;
use crate::training::flat;

/// A module with its optimizer.
pub struct Learner<M> {
    module: M,
    device: Device,
    optimizer: Adam,
    /// All parameters as one vector, where they are not on the processor; nothing before the first step.
    parameters: Option<Tensor<1>>,
    clip_norm: f32,
    /// Whether a step is one batch.
    at_once: bool,
}

/// What comes of a step.
pub struct Stepped<M, L> {
    /// The learner after it.
    pub learner: Learner<M>,
    /// What was lost.
    pub losses: L,
    /// Whether the gradient was no number and was left out: the parameters follow earlier ones alone.
    pub dropped: bool,
}

impl<M: Module + Sync> Learner<M> {
    /// Begins with a module on a device with gradients; learns group by group unless `at_once`.
    pub fn new(module: M, device: Device, clip_norm: f32, at_once: bool) -> Self {
        Self { module, device, optimizer: Adam::default(), parameters: None, clip_norm, at_once }
    }

    /// The module as it is now.
    pub fn module(&self) -> &M {
        &self.module
    }

    /// Whether a step is one batch, and not group by group.
    pub(super) fn learns_at_once(&self) -> bool {
        self.at_once
    }

    /// The same with other parameters.
    #[must_use]
    pub fn with_module(self, module: M) -> Self {
        Self { module, parameters: None, ..self }
    }

    /// The module alone, when there is nothing more to learn.
    pub fn into_module(self) -> M {
        self.module
    }

    /// The optimizer's moments, to go on with later, anywhere.
    ///
    /// # Errors
    ///
    /// When they cannot be read or written; `path` is for the message alone.
    pub(super) fn optimizer_bytes(&self, path: &Path) -> Result<Vec<u8>, ModelError> {
        self.optimizer.to_bytes(self.module.num_params(), path)
    }

    /// Goes on with saved moments.
    ///
    /// # Errors
    ///
    /// When the bytes are no moments of this module; `path` is for the message alone.
    pub(super) fn with_optimizer(self, bytes: Vec<u8>, path: &Path) -> Result<Self, ModelError> {
        let device = self.device.clone().without_autodiff();
        let optimizer = Adam::from_bytes(bytes, self.module.num_params(), &device, path)?;
        Ok(Self { optimizer, ..self })
    }

    /// Learns from groups, on the processor. `lose` says what a module loses on a group, and what is to be
    /// differentiated; the former comes back in the groups' order.
    ///
    /// # Errors
    ///
    /// The first group's that cannot be learned from; nothing is learned then.
    pub fn step<G: Sync, L: Send, E: Send + From<TensorError>>(
        self,
        groups: &[G],
        learning_rate: f64,
        lose: impl Fn(&M, &G) -> Result<(L, Option<Tensor<1>>), E> + Sync,
    ) -> Result<Stepped<M, Vec<L>>, E> {
        let copies: Vec<(M, &G)> = groups.iter().map(|group| (self.module.clone().fork(&self.device), group)).collect();
        let results: Vec<Result<(L, Vec<f32>), E>> = copies
            .par_iter()
            .map(|(module, group)| {
                let (losses, total) = lose(module, group)?;
                Ok((losses, flat::host_gradient(module, total)?))
            })
            .collect();
        let results: Vec<(L, Vec<f32>)> = results.into_iter().collect::<Result<_, E>>()?;
        let mut sum = vec![0.0_f32; results.first().map_or(0, |(_, gradient)| gradient.len())];
        for (_, gradient) in &results {
            sum.iter_mut().zip(gradient).for_each(|(sum, part)| *sum += part);
        }
        let dropped = !clip(&mut sum, self.clip_norm);
        let Self { module, device, mut optimizer, parameters: kept, clip_norm, at_once } = self;
        let (n, host) = (sum.len(), device.clone().without_autodiff());
        let gradient = Tensor::from_data(TensorData::new(sum, [n]), &host);
        let parameters = Tensor::from_data(TensorData::new(flat::host_parameters(&module)?, [n]), &host);
        let parameters = optimizer.step(learning_rate, parameters, gradient);
        let module = flat::with_host_parameters(module, &values(parameters)?);
        let learner = Self { module, device, optimizer, parameters: kept, clip_norm, at_once };
        Ok(Stepped { learner, losses: results.into_iter().map(|(losses, _)| losses).collect(), dropped })
    }

    /// Learns from everything at once, on an accelerator: gradients and parameters stay there. `lose` says what is to be
    /// told, and what is to be differentiated; `told` makes losses of the numbers, before anything is learned.
    ///
    /// # Errors
    ///
    /// When nothing can be learned; nothing is learned then.
    pub(super) fn step_at_once<L, E: From<TensorError>>(
        self,
        learning_rate: f64,
        lose: impl FnOnce(&M) -> Result<(Tensor<1>, Tensor<1>), E>,
        told: impl FnOnce(&[f32]) -> Result<L, E>,
    ) -> Result<Stepped<M, L>, E> {
        let (telling, total) = lose(&self.module)?;
        let gradient = flat::gradient(&self.module, &total, self.device.clone().without_autodiff());
        let norm = gradient.clone().square().sum().sqrt();
        // The one stop of a step.
        let read = values(Tensor::cat(vec![norm, telling.inner()], 0))?;
        let (norm, read) = read.split_first().map_or((f32::NAN, &read[..]), |(norm, read)| (*norm, read));
        let losses = told(read)?;
        let dropped = !norm.is_finite();
        let gradient = match scale_to(norm, self.clip_norm) {
            _ if dropped => gradient.zeros_like(),
            Some(scale) => gradient.mul_scalar(scale),
            None => gradient,
        };
        let Self { module, device, mut optimizer, parameters, clip_norm, at_once } = self;
        let parameters = parameters.unwrap_or_else(|| flat::parameters(&module));
        let parameters = optimizer.step(learning_rate, parameters, gradient);
        let module = flat::with_parameters(module, parameters.clone());
        let learner = Self { module, device, optimizer, parameters: Some(parameters), clip_norm, at_once };
        Ok(Stepped { learner, losses, dropped })
    }
}

/// Scales a gradient down to a norm that it exceeds. One that is not finite is dropped whole, and `false` returned.
fn clip(gradient: &mut [f32], largest_norm: f32) -> bool {
    let norm = gradient.iter().map(|value| f64::from(*value).powi(2)).sum::<f64>().sqrt() as f32;
    if !norm.is_finite() {
        gradient.fill(0.0);
        return false;
    }
    if let Some(scale) = scale_to(norm, largest_norm) {
        gradient.iter_mut().for_each(|value| *value *= scale);
    }
    true
}

/// What scales a gradient of a norm down to the largest; nothing where it is not larger.
fn scale_to(norm: f32, largest_norm: f32) -> Option<f32> {
    Some(largest_norm / norm.max(f32::MIN_POSITIVE)).filter(|scale| *scale < 1.0)
}

#[cfg(test)]
mod tests {
    use super::clip;

    #[test]
    fn a_gradient_is_scaled_down_to_a_norm_that_it_exceeds() {
        let (mut long, mut short) = ([3.0, 4.0], [0.3, 0.4]);
        assert!(clip(&mut long, 1.0) && clip(&mut short, 1.0));
        assert!((long[0] - 0.6).abs() < 1e-6 && (long[1] - 0.8).abs() < 1e-6, "{long:?}");
        assert_eq!(short, [0.3, 0.4]);
    }

    #[test]
    fn a_gradient_that_is_no_number_is_dropped_whole_and_told_of() {
        for wrong in [f32::NAN, f32::INFINITY] {
            let mut gradient = [1.0, wrong];
            assert!(!clip(&mut gradient, 5.0));
            assert_eq!(gradient, [0.0, 0.0]);
        }
    }
}
