//! All parts of a step as one batch, for accelerators: there a launch costs more than what padding adds.
//!
//! # Shapes
//!
//! `B` decisions of all parts, `T` frames of the longest window, `N` slots. Targets are those of [`Part`], zero where a
//! decision has no label, so that it adds nothing.
//!
//! # Invariants
//!
//! Losses are those of the parts by themselves, but for rounding. Steps of calls stay packed as
//! [`crate::model::Network`] says.

use burn::tensor::activation::{log_softmax, relu};
use burn::tensor::{Device, Tensor, TensorData};

use crate::model::{CalledWith, Network, Pictures, ReadError, RunningPrograms, SpecificationRows, States, Windows};
use crate::program::Program;
use crate::trace::ScopingLabel;
use crate::training::batch::{Group, Part};
use crate::training::config::LossWeights;
use crate::training::losses::Losses;

/// Losses of each mini-batch: program, end, scope and argument.
const N_LOSSES: usize = 4;

/// A step's mini-batches as one.
pub(super) struct Merged {
    pictures: Pictures,
    windows: Windows,
    states: States,
    called_with: Vec<CalledWith>,
    running: Vec<Program>,
    steps: Vec<usize>,
    /// `[B, programs]`
    programs: Vec<f32>,
    /// One where the program ends, and its weight: `[B]` each.
    ends: [Vec<f32>; 2],
    /// `[B, T, 4]`; nothing where no decision has labels.
    scopes: Option<Vec<f32>>,
    /// `[B, arguments * N]`; nothing where no decision has labels.
    arguments: Option<Vec<f32>>,
    /// Which mini-batch each decision is of.
    batches: Vec<usize>,
    /// Whether each mini-batch has scoping labels, and arguments.
    has_labels: Vec<[bool; 2]>,
}

/// A decision by its part's group, its part, and its row in that.
type Place<'g> = (usize, &'g Part, usize);

impl Merged {
    /// Puts the parts of `n_batches` mini-batches together.
    ///
    /// # Errors
    ///
    /// [`ReadError`] when they do not go together: a bug.
    pub(super) fn new(groups: &[Group], n_batches: usize) -> Result<Self, ReadError> {
        let (places, steps) = packed(groups);
        let first_pictures = first_pictures(groups);
        let windows: Vec<SpecificationRows> = (places.iter())
            .map(|&(group, part, row)| part.windows.window(row).counted_from(first_pictures[group]))
            .collect();
        let n_slots = places.first().map_or(0, |(_, part, _)| part.windows.n_slots());
        let windows = Windows::new(n_slots, &windows.iter().collect::<Vec<_>>())?;
        let states: Vec<States> = (places.iter())
            .map(|&(group, part, row)| part.states.decision(row).counted_from(first_pictures[group]))
            .collect();
        let mut has_labels = vec![[false; 2]; n_batches];
        for part in groups.iter().flat_map(|group| &group.parts) {
            let [scopes, arguments] = &mut has_labels[part.batch_idx];
            *scopes |= part.scopes.is_some();
            *arguments |= part.arguments.is_some();
        }
        Ok(Self {
            pictures: pictures(groups),
            states: States::concat(states.iter())?,
            called_with: places.iter().map(|(_, part, row)| part.called_with[*row]).collect(),
            running: places.iter().map(|(_, part, _)| part.program).collect(),
            steps,
            programs: places.iter().flat_map(|(_, part, row)| row_of(&part.programs, part, *row)).copied().collect(),
            ends: [
                places.iter().map(|(_, part, row)| part.ends[*row]).collect(),
                places.iter().map(|(_, part, _)| part.weight).collect(),
            ],
            scopes: targets(&places, windows.n_frames() * ScopingLabel::ALL.len(), |part| part.scopes.as_ref()),
            arguments: targets(&places, n_arguments(&places), |part| part.arguments.as_ref()),
            batches: places.iter().map(|(_, part, _)| part.batch_idx).collect(),
            windows,
            has_labels,
        })
    }

    /// Losses of each mini-batch, `[n_batches * 4]`, to be told by [`Self::told`]; and their weighed sum, to be
    /// differentiated.
    ///
    /// # Errors
    ///
    /// [`ReadError`] when the network cannot read the batch.
    pub(super) fn losses<N: Network>(
        &self,
        network: &N,
        weights: LossWeights,
    ) -> Result<(Tensor<1>, Tensor<1>), ReadError> {
        let (device, n) = (network.device(), self.batches.len());
        let percepts = network.perceive(&self.pictures)?;
        let demonstration = network.demonstration(&self.windows, &percepts)?;
        let reading = network.read(&demonstration, &self.states, &percepts, &self.called_with)?;
        let running = RunningPrograms::Each(&self.running);
        let (core, _) = network.core(&reading, running, &self.steps, None);
        let program = cross_entropies(core.programs.clone(), &self.programs);
        let [ends, end_weights] = self.ends.each_ref().map(|values| table(values, n, &device));
        let end = binary_cross_entropies(core.end.clone(), ends) * end_weights;
        let nothing = || Tensor::<2>::zeros([n, 1], &device);
        let labels = self.scopes.as_ref().and_then(|_| network.scope(&reading, running, &core));
        let scope = self.scopes.as_ref().zip(labels);
        let scope = scope.map_or_else(nothing, |(targets, labels)| cross_entropies(labels, targets));
        let argument = self.arguments.as_ref().map_or_else(nothing, |targets| {
            cross_entropies(network.argument(&reading, running, &core), targets).reshape([n as i32, -1]).sum_dim(1)
        });
        let losses = Tensor::cat(vec![program, end, scope, argument], 1); // [B, 4]
        let of_batches = self.membership(&device).matmul(losses); // [n_batches, 4]
        let weights = [weights.program, weights.end, weights.scope, weights.argument];
        let total = (of_batches.clone() * table(&weights, 1, &device)).sum();
        Ok((of_batches.reshape([self.has_labels.len() * N_LOSSES]), total))
    }

    /// What was told of each mini-batch.
    pub(super) fn told(&self, read: &[f32], weights: LossWeights) -> Vec<Losses> {
        let of_batch = |(&[program, end, scope, argument], has): (&[f32; N_LOSSES], &[bool; 2])| Losses {
            program,
            end,
            scope: Some(scope).filter(|_| has[0]),
            argument: Some(argument).filter(|_| has[1]),
            total: program * weights.program + end * weights.end + scope * weights.scope + argument * weights.argument,
        };
        read.as_chunks::<N_LOSSES>().0.iter().zip(&self.has_labels).map(of_batch).collect()
    }

    /// A one where a decision is of a mini-batch: `[n_batches, B]`.
    fn membership(&self, device: &Device) -> Tensor<2> {
        let n = self.batches.len();
        let mut ones = vec![0.0_f32; self.has_labels.len() * n];
        for (decision, batch) in self.batches.iter().enumerate() {
            ones[batch * n + decision] = 1.0;
        }
        table(&ones, self.has_labels.len(), device)
    }
}

/// The decisions of all parts, step by step with the longest calls first, and how many there are of each step.
fn packed(groups: &[Group]) -> (Vec<Place<'_>>, Vec<usize>) {
    let parts = groups.iter().enumerate().flat_map(|(at, group)| group.parts.iter().map(move |part| (at, part)));
    let mut calls: Vec<Vec<Place<'_>>> = Vec::new();
    for (group, part) in parts {
        let first = calls.len();
        let mut row = 0;
        for &n_calls in &part.steps {
            calls.resize_with(calls.len().max(first + n_calls), Vec::new);
            calls[first..first + n_calls].iter_mut().zip(row..).for_each(|(call, row)| call.push((group, part, row)));
            row += n_calls;
        }
    }
    calls.sort_by_key(|call| std::cmp::Reverse(call.len()));
    let longest = calls.first().map_or(0, Vec::len);
    let of_step = |step: usize| calls.iter().filter_map(move |call| call.get(step));
    let steps = (0..longest).map(|step| of_step(step).count()).collect();
    ((0..longest).flat_map(of_step).copied().collect(), steps)
}

/// Pictures of all groups, one after another.
fn pictures(groups: &[Group]) -> Pictures {
    let mut all = Pictures::default();
    for group in groups {
        all.append(group.pictures.clone());
    }
    all
}

/// The number of each group's first picture among all.
fn first_pictures(groups: &[Group]) -> Vec<u32> {
    let before = groups.iter().scan(0, |next, group| Some(std::mem::replace(next, *next + group.pictures.n as u32)));
    before.collect()
}

/// The part of a decision in what a part has of all.
fn row_of<'v>(values: &'v [f32], part: &Part, row: usize) -> &'v [f32] {
    let width = values.len() / part.ends.len().max(1);
    &values[row * width..][..width]
}

/// The targets of all decisions, `width` each; zeros where a part has none, and behind what it has fewer.
fn targets(places: &[Place<'_>], width: usize, of_part: impl Fn(&Part) -> Option<&Vec<f32>>) -> Option<Vec<f32>> {
    if places.iter().all(|(_, part, _)| of_part(part).is_none()) {
        return None;
    }
    let mut all = vec![0.0; places.len() * width];
    for ((_, part, row), own) in places.iter().zip(all.chunks_exact_mut(width.max(1))) {
        let targets = of_part(part).map(|values| row_of(values, part, *row)).unwrap_or_default();
        own.iter_mut().zip(targets).for_each(|(own, target)| *own = *target);
    }
    Some(all)
}

/// Numbers of a decision's arguments: of the first part that has any.
fn n_arguments(places: &[Place<'_>]) -> usize {
    let of_part = |part: &Part| part.arguments.as_ref().map(|values| values.len() / part.ends.len().max(1));
    places.iter().find_map(|(_, part, _)| of_part(part)).unwrap_or(0)
}

fn table(values: &[f32], n_rows: usize, device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values.to_vec(), [n_rows, values.len() / n_rows.max(1)]), device)
}

/// Of each row, summed over everything else; targets carry the weights: `[rows, 1]`.
fn cross_entropies<const D: usize>(logits: Tensor<D>, targets: &[f32]) -> Tensor<2> {
    let dims = logits.dims();
    let targets = Tensor::<D>::from_data(TensorData::new(targets.to_vec(), dims), &logits.device());
    (log_softmax(logits, D - 1) * targets).reshape([dims[0] as i32, -1]).sum_dim(1).neg()
}

/// Of each row, in the form that does not overflow: `[rows, 1]`.
fn binary_cross_entropies(logits: Tensor<2>, targets: Tensor<2>) -> Tensor<2> {
    relu(logits.clone()) + logits.clone().abs().neg().exp().log1p() - logits * targets
}
