//! One step of the optimizer: losses of the groups' parts, their gradients, Adam.
//!
//! # Invariants
//!
//! On the processor groups run side by side on the current rayon pool, each on a copy of the parameters with a gradient
//! graph of its own. Their gradients are summed in the order of the groups, so the pool's size changes nothing.
//! Elsewhere all groups are one batch, and a step stops once, to read what is told of it.

use std::path::Path;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::activation::{log_softmax, relu};
use burn::tensor::{Device, Tensor, TensorData};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};

use crate::model::{ModelError, Network, ReadError, TensorError, scalar, values};
use crate::trace::ScopingLabel;
use crate::training::TrainError;
use crate::training::adam::Adam;
use crate::training::batch::{Group, Part};
use crate::training::config::LossWeights;

/// Losses of a part or a mini-batch, before they are weighed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// Of the next program.
    pub program: f32,
    /// Of the end of the running program.
    pub end: f32,
    /// Of the scoping labels; `None` without labels.
    pub scope: Option<f32>,
    /// Of the argument; `None` without labels.
    pub argument: Option<f32>,
    /// Weighed and summed.
    pub total: f32,
}

impl Losses {
    /// With another part of the same mini-batch.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        let sum = |a: Option<f32>, b: Option<f32>| match (a, b) {
            (None, None) => None,
            (a, b) => Some(a.unwrap_or_default() + b.unwrap_or_default()),
        };
        Self {
            program: self.program + other.program,
            end: self.end + other.end,
            scope: sum(self.scope, other.scope),
            argument: sum(self.argument, other.argument),
            total: self.total + other.total,
        }
    }
}

/// A module with its optimizer.
pub struct Learner<M> {
    module: M,
    device: Device,
    optimizer: Adam,
    /// All parameters as one vector, where they are not on the processor; nothing before the first step.
    flat: Option<Tensor<1>>,
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
        Self { module, device, optimizer: Adam::default(), flat: None, clip_norm, at_once }
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
        Self { module, flat: None, ..self }
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
                Ok((losses, gradient(module, total)?))
            })
            .collect();
        let results: Vec<(L, Vec<f32>)> = results.into_iter().collect::<Result<_, E>>()?;
        let mut sum = vec![0.0_f32; results.first().map_or(0, |(_, gradient)| gradient.len())];
        for (_, gradient) in &results {
            sum.iter_mut().zip(gradient).for_each(|(sum, part)| *sum += part);
        }
        let dropped = !clip(&mut sum, self.clip_norm);
        let Self { module, device, mut optimizer, flat, clip_norm, at_once } = self;
        let (n, host) = (sum.len(), device.clone().without_autodiff());
        let gradient = Tensor::from_data(TensorData::new(sum, [n]), &host);
        let parameters = Tensor::from_data(TensorData::new(host_parameters(&module)?, [n]), &host);
        let parameters = optimizer.step(learning_rate, parameters, gradient);
        let module = module.map(&mut FromHost { values: &values(parameters)? });
        let learner = Self { module, device, optimizer, flat, clip_norm, at_once };
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
        let gradients = GradientsParams::from_grads(total.backward(), &self.module);
        let mut parts =
            Gradients { gradients: &gradients, device: self.device.clone().without_autodiff(), flat: vec![] };
        self.module.visit(&mut parts);
        let gradient = Tensor::cat(parts.flat, 0);
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
        let Self { module, device, mut optimizer, flat, clip_norm, at_once } = self;
        let parameters = flat.unwrap_or_else(|| {
            let mut parts = Parameters(Vec::new());
            module.visit(&mut parts);
            Tensor::cat(parts.0, 0)
        });
        let parameters = optimizer.step(learning_rate, parameters, gradient);
        let module = module.map(&mut FromFlat { flat: parameters.clone(), begin: 0 });
        let learner = Self { module, device, optimizer, flat: Some(parameters), clip_norm, at_once };
        Ok(Stepped { learner, losses, dropped })
    }
}

/// The gradient of a loss in the order of the module's parameters.
fn gradient<M: Module>(module: &M, total: Option<Tensor<1>>) -> Result<Vec<f32>, TensorError> {
    let gradients = total.map(|total| GradientsParams::from_grads(total.backward(), module)).unwrap_or_default();
    let mut flat = Flattener { gradients: &gradients, flat: Ok(Vec::new()) };
    module.visit(&mut flat);
    flat.flat
}

/// Losses of a group's parts, and their sum.
///
/// # Errors
///
/// [`TrainError::NotFinite`] for the first part whose loss is no number in the step.
pub(super) fn group_losses<N: Network>(
    network: &N,
    group: &Group,
    weights: LossWeights,
    step: u32,
) -> Result<(Vec<Losses>, Option<Tensor<1>>), TrainError> {
    let percepts = network.perceive(&group.pictures)?;
    let (mut of_parts, mut sum) = (Vec::with_capacity(group.parts.len()), None);
    for part in &group.parts {
        let (losses, total) = losses(network, part, &percepts, weights)?;
        if !losses.total.is_finite() {
            return Err(TrainError::NotFinite { step, level: part.program.name(), found: losses.total });
        }
        of_parts.push(losses);
        sum = Some(sum.map_or_else(|| total.clone(), |sum: Tensor<1>| sum + total.clone()));
    }
    Ok((of_parts, sum))
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

/// Losses of a part, and the weighed sum to differentiate. `percepts` are those of its group's pictures.
///
/// # Errors
///
/// [`ReadError`] when the network cannot read the part, or its numbers cannot be read.
pub fn losses<N: Network>(
    network: &N,
    part: &Part,
    percepts: &N::Percepts,
    weights: LossWeights,
) -> Result<(Losses, Tensor<1>), ReadError> {
    let device = network.device();
    let n_batch = part.ends.len();
    let demonstration = network.demonstration(&part.windows, percepts)?;
    let reading = network.read(&demonstration, &part.states, percepts, &part.called_with)?;
    let (core, _) = network.core(&reading, part.program.into(), &part.steps, None);
    let programs = TensorData::new(part.programs.clone(), core.programs.dims());
    let program = cross_entropy(core.programs.clone(), Tensor::from_data(programs, &device));
    let ends = Tensor::from_data(TensorData::new(part.ends.clone(), [n_batch, 1]), &device);
    let end = binary_cross_entropy(core.end.clone(), ends).mul_scalar(part.weight);
    let mut total = program.clone().mul_scalar(weights.program) + end.clone().mul_scalar(weights.end);
    let labels = part.scopes.as_ref().and_then(|_| network.scope(&reading, part.program.into(), &core));
    let scope = part.scopes.as_ref().zip(labels).map(|(targets, labels)| {
        let shape = [n_batch, part.windows.n_frames(), ScopingLabel::ALL.len()];
        let targets = Tensor::<3>::from_data(TensorData::new(targets.clone(), shape), &device);
        cross_entropy(labels, targets)
    });
    let argument = part.arguments.as_ref().map(|targets| {
        let targets =
            TensorData::new(targets.clone(), [n_batch * network.scoping().n_arguments(), part.windows.n_slots()]);
        cross_entropy(network.argument(&reading, part.program.into(), &core), Tensor::from_data(targets, &device))
    });
    let weighed = [(&scope, weights.scope), (&argument, weights.argument)];
    for (loss, weight) in weighed.into_iter().filter_map(|(loss, weight)| Some((loss.clone()?, weight))) {
        total = total + loss.mul_scalar(weight);
    }
    let losses = Losses {
        program: scalar(program)?,
        end: scalar(end)?,
        scope: scope.map(scalar).transpose()?,
        argument: argument.map(scalar).transpose()?,
        total: scalar(total.clone())?,
    };
    Ok((losses, total))
}

/// Summed over everything; targets carry the weights.
fn cross_entropy<const D: usize>(logits: Tensor<D>, targets: Tensor<D>) -> Tensor<1> {
    (log_softmax(logits, D - 1) * targets).sum().neg()
}

/// Summed over the batch, in the form that does not overflow.
fn binary_cross_entropy(logits: Tensor<2>, targets: Tensor<2>) -> Tensor<1> {
    let softplus = relu(logits.clone()) + logits.clone().abs().neg().exp().log1p();
    (softplus - logits * targets).sum()
}

/// Gradients as one list; zeros for parameters that took no part.
struct Flattener<'g> {
    gradients: &'g GradientsParams,
    flat: Result<Vec<f32>, TensorError>,
}

impl ModuleVisitor for Flattener<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let Ok(flat) = &mut self.flat else { return };
        match self.gradients.get::<D>(param.id).map(values).transpose() {
            Ok(Some(gradient)) => flat.extend(gradient),
            Ok(None) => flat.resize(flat.len() + param.shape().num_elements(), 0.0),
            Err(error) => self.flat = Err(error),
        }
    }
}

/// The parameters on the processor, one after another.
fn host_parameters<M: Module>(module: &M) -> Result<Vec<f32>, TensorError> {
    let mut parts = Parameters(Vec::new());
    module.visit(&mut parts);
    let read: Vec<Vec<f32>> = parts.0.into_iter().map(values).collect::<Result<_, _>>()?;
    Ok(read.concat())
}

/// Each parameter as a vector without gradients.
struct Parameters(Vec<Tensor<1>>);

impl ModuleVisitor for Parameters {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let n = param.shape().num_elements();
        self.0.push(param.val().inner().reshape([n]));
    }
}

/// Each parameter's gradient as a vector; zeros for one that took no part.
struct Gradients<'g> {
    gradients: &'g GradientsParams,
    device: Device,
    flat: Vec<Tensor<1>>,
}

impl ModuleVisitor for Gradients<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let n = param.shape().num_elements();
        let gradient = self.gradients.get::<D>(param.id).map(|gradient| gradient.reshape([n]));
        self.flat.push(gradient.unwrap_or_else(|| Tensor::zeros([n], &self.device)));
    }
}

/// Gives parameters their values on the processor.
struct FromHost<'v> {
    values: &'v [f32],
}

impl ModuleMapper for FromHost<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (values, rest) = self.values.split_at(param.shape().num_elements());
        self.values = rest;
        let data = TensorData::new(values.to_vec(), param.shape());
        with_value(param, |device| Tensor::from_data(data, device))
    }
}

/// Gives parameters their parts of a vector.
struct FromFlat {
    flat: Tensor<1>,
    begin: usize,
}

impl ModuleMapper for FromFlat {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let shape = param.shape();
        let part = self.flat.clone().narrow(0, self.begin, shape.num_elements());
        self.begin += shape.num_elements();
        with_value(param, |_device| part.reshape(shape))
    }
}

/// The same parameter with another value, which has no gradients; it requires one if it did before.
fn with_value<const D: usize>(param: Param<Tensor<D>>, value: impl FnOnce(&Device) -> Tensor<D>) -> Param<Tensor<D>> {
    param.map(|before| {
        let after = Tensor::from_inner(value(&before.device().without_autodiff()));
        if before.is_require_grad() { after.require_grad() } else { after }
    })
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
