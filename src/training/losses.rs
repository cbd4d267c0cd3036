//! What a network loses on the decisions that it is shown.
//!
//! # Source
//!
//! Paper, section IV, "Model Training": cross-entropies of program, argument and scoping labels, binary of the end.

use burn::tensor::activation::{log_softmax, relu};
use burn::tensor::{Tensor, TensorData};

use crate::model::{Network, ReadError, scalar};
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
