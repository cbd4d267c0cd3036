//! One step of the optimizer: losses of the groups' parts, their gradients, Adam.
//!
//! # Invariants
//!
//! Groups run side by side on the current rayon pool, each on a copy of the parameters with a gradient graph of its
//! own. Their gradients are summed in the order of the groups, so the pool's size changes nothing.

use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::{AdamConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::activation::{log_softmax, relu};
use burn::tensor::{Bytes, Device, Tensor, TensorData};
use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};

use crate::model::{Network, ReadError, TensorError, scalar, values};
use crate::trace::ScopingLabel;
use crate::training::TrainError;
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
    optimizer: ModuleOptimizer,
    clip_norm: f32,
}

/// What comes of a step.
pub struct Stepped<M, L> {
    /// The learner after it.
    pub learner: Learner<M>,
    /// What was lost on each group.
    pub losses: Vec<L>,
    /// Whether the gradient was no number and was left out: the parameters follow earlier ones alone.
    pub dropped: bool,
}

impl<M: Module + Sync> Learner<M> {
    /// Begins with a module on a device with gradients.
    pub fn new(module: M, device: Device, clip_norm: f32) -> Self {
        Self { module, device, optimizer: AdamConfig::new().with_epsilon(1e-8).init(), clip_norm }
    }

    /// The module as it is now.
    pub fn module(&self) -> &M {
        &self.module
    }

    /// The same with other parameters.
    #[must_use]
    pub fn with_module(self, module: M) -> Self {
        Self { module, ..self }
    }

    /// The module alone, when there is nothing more to learn.
    pub fn into_module(self) -> M {
        self.module
    }

    /// The optimizer's moments, to go on with later.
    ///
    /// # Errors
    ///
    /// When they cannot be written in burn's format.
    pub fn optimizer_bytes(&self) -> Result<Bytes, String> {
        self.optimizer.into_bytes().map_err(|error| error.to_string())
    }

    /// Goes on with saved moments.
    ///
    /// # Errors
    ///
    /// When the bytes are no optimizer's.
    pub fn with_optimizer(self, bytes: Vec<u8>) -> Result<Self, String> {
        let optimizer = self.optimizer.from_bytes(Bytes::from_bytes_vec(bytes)).map_err(|error| error.to_string())?;
        Ok(Self { optimizer, ..self })
    }

    /// Learns from groups. `lose` says what a module loses on a group, and what is to be differentiated; the former comes
    /// back in the groups' order.
    ///
    /// # Errors
    ///
    /// The first group's that cannot be learned from; nothing is learned then.
    pub fn step<G: Sync, L: Send, E: Send + From<TensorError>>(
        self,
        groups: &[G],
        learning_rate: f64,
        lose: impl Fn(&M, &G) -> Result<(L, Option<Tensor<1>>), E> + Sync,
    ) -> Result<Stepped<M, L>, E> {
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
        let gradients = from_flat(&self.module, &sum);
        let Self { module, device, mut optimizer, clip_norm } = self;
        let module = optimizer.step(learning_rate, module, gradients);
        let learner = Self { module, device, optimizer, clip_norm };
        Ok(Stepped { learner, losses: results.into_iter().map(|(losses, _)| losses).collect(), dropped })
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
    let scale = (largest_norm / norm.max(f32::MIN_POSITIVE)).min(1.0);
    if scale < 1.0 {
        gradient.iter_mut().for_each(|value| *value *= scale);
    }
    true
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
    let (core, _) = network.core(&reading, part.program, &part.steps, None);
    let programs = TensorData::new(part.programs.clone(), core.programs.dims());
    let program = cross_entropy(core.programs.clone(), Tensor::from_data(programs, &device));
    let ends = Tensor::from_data(TensorData::new(part.ends.clone(), [n_batch, 1]), &device);
    let end = binary_cross_entropy(core.end.clone(), ends).mul_scalar(part.weight);
    let mut total = program.clone().mul_scalar(weights.program) + end.clone().mul_scalar(weights.end);
    let labels = part.scopes.as_ref().and_then(|_| network.scope(&reading, part.program, &core));
    let scope = part.scopes.as_ref().zip(labels).map(|(targets, labels)| {
        let shape = [n_batch, part.windows.n_frames(), ScopingLabel::ALL.len()];
        let targets = Tensor::<3>::from_data(TensorData::new(targets.clone(), shape), &device);
        cross_entropy(labels, targets)
    });
    let argument = part.arguments.as_ref().map(|targets| {
        let targets =
            TensorData::new(targets.clone(), [n_batch * network.scoping().n_arguments(), part.windows.n_slots()]);
        cross_entropy(network.argument(&reading, part.program, &core), Tensor::from_data(targets, &device))
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

/// The other way round.
struct Unflattener<'g> {
    flat: &'g [f32],
    gradients: GradientsParams,
}

impl ModuleVisitor for Unflattener<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let (gradient, rest) = self.flat.split_at(param.shape().num_elements());
        self.flat = rest;
        let data = TensorData::new(gradient.to_vec(), param.shape());
        self.gradients.register(param.id, Tensor::<D>::from_data(data, &param.device().inner()));
    }
}

fn from_flat<N: Module>(network: &N, flat: &[f32]) -> GradientsParams {
    let mut unflattener = Unflattener { flat, gradients: GradientsParams::new() };
    network.visit(&mut unflattener);
    unflattener.gradients
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
