//! A trained network as a policy.
//!
//! # Invariants
//!
//! Each query is evaluated by itself, so a decision does not depend on which queries come together, nor on the number
//! of threads that they are spread over.
//!
//! What is decided is always lawful: a scope lies in the window, an argument goes with `move_to` alone, and a step
//! that calls nothing ends its program.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use burn::tensor::Tensor;
use rayon::iter::{IntoParallelIterator as _, IntoParallelRefIterator as _, ParallelIterator as _};

use crate::model::{self, AnyNetwork, Decoder, LabelScores, ModelConfig, ModelError, Network, Windows};
use crate::program::Program;
use crate::rollout::{Decision, Policy, Query, Specification};
use crate::scene::SlotIndex;
use crate::trace::{Prediction, ScopingLabel, Span};

/// A program ends when its end is at least this likely (the paper's alpha).
const END_THRESHOLD: f32 = 0.5;

/// A policy from a model's folder, with the model's configuration.
///
/// # Errors
///
/// As [`model::load`].
pub fn load_policy(folder: &Path, decoder: Decoder) -> Result<(ModelConfig, Box<dyn Policy + Send>), ModelError> {
    let (config, network) = model::load(folder)?;
    let name = config.variant.name();
    let policy: Box<dyn Policy + Send> = match network {
        AnyNetwork::ObjectCentric(network) => Box::new(LearnedPolicy::new(name, *network, decoder)),
        AnyNetwork::Flattened(network) => Box::new(LearnedPolicy::new(name, *network, decoder)),
    };
    Ok((config, policy))
}

/// A network that decides.
pub struct LearnedPolicy<N: Network> {
    name: String,
    network: N,
    decoder: Decoder,
    /// By address, which the `Arc` in the value keeps from being given to another specification.
    demonstrations: HashMap<usize, Known<N::Demonstration>>,
}

/// What does not change in an episode, kept as long as its specification is in use.
struct Known<D> {
    specification: Arc<Specification>,
    demonstration: D,
}

impl<N: Network> LearnedPolicy<N> {
    /// A policy of the given name. The network is used without gradients.
    pub fn new(name: &str, network: N, decoder: Decoder) -> Self {
        Self { name: name.to_owned(), network: network.valid(), decoder, demonstrations: HashMap::new() }
    }

    /// Reads the demonstrations of new episodes, and forgets those of episodes that are over.
    fn refresh(&mut self, queries: &[Query]) {
        self.demonstrations.retain(|_, known| Arc::strong_count(&known.specification) > 1);
        let mut unknown: Vec<&Arc<Specification>> = Vec::new();
        for specification in queries.iter().map(|query| &query.specification) {
            let is_new = !self.demonstrations.contains_key(&key(specification));
            if is_new && !unknown.iter().any(|other| Arc::ptr_eq(other, specification)) {
                unknown.push(specification);
            }
        }
        let network = &self.network;
        let read: Vec<Known<N::Demonstration>> = unknown
            .into_par_iter()
            .map(|specification| Known {
                specification: Arc::clone(specification),
                demonstration: network
                    .demonstration(&Windows::new(specification.n_slots, &[specification.observations.as_slice()])),
            })
            .collect();
        self.demonstrations.extend(read.into_iter().map(|known| (key(&known.specification), known)));
    }

    fn decide_one(&self, query: &Query) -> Decision {
        let Some(known) = self.demonstrations.get(&key(&query.specification)) else { return Decision::end(query) };
        let window = N::window(&known.demonstration, query.window);
        let reading = self.network.read(&window, &query.observation.to_flat());
        let core = self.network.core(&reading, query.program);
        let end_probability = logistic(values(core.end.clone()).first().copied().unwrap_or_default());
        let programs = values(core.programs.clone());
        let (program_idx, program_probability) = likeliest(&programs);
        let program = Program::from_index(program_idx).unwrap_or(Program::None);
        let labels: Vec<LabelScores> = if program.is_composite() {
            let logits = values(self.network.scope(&reading, query.program));
            logits.as_chunks::<{ ScopingLabel::ALL.len() }>().0.iter().map(log_probabilities).collect()
        } else {
            Vec::new()
        };
        let scope = self
            .decoder
            .decode(&labels)
            .map(|within| Span { begin: query.window.begin + within.begin, end: query.window.begin + within.end });
        let argument = program.takes_argument().then(|| {
            let slots = values(self.network.argument(&reading, query.program, &core));
            SlotIndex(likeliest(&slots).0 as u16)
        });
        let probabilities =
            |label: ScopingLabel| labels.iter().map(|scores| scores[label as usize].exp()).collect::<Vec<f32>>();
        Decision {
            program,
            scope: scope.unwrap_or(query.window),
            argument,
            end_of_program: program == Program::None || end_probability >= END_THRESHOLD,
            prediction: Some(Prediction {
                program_probability,
                end_probability,
                start_probabilities: probabilities(ScopingLabel::Start),
                stop_probabilities: probabilities(ScopingLabel::End),
            }),
        }
    }
}

impl<N: Network> Policy for LearnedPolicy<N> {
    fn name(&self) -> &str {
        &self.name
    }

    fn decide(&mut self, queries: &[Query]) -> Vec<Decision> {
        self.refresh(queries);
        queries.par_iter().map(|query| self.decide_one(query)).collect()
    }
}

fn key(specification: &Arc<Specification>) -> usize {
    Arc::as_ptr(specification).addr()
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_into_vec().unwrap_or_default()
}

fn logistic(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

/// The first of the largest logits, and its probability.
fn likeliest(logits: &[f32]) -> (usize, f32) {
    let best = (0..logits.len()).reduce(|best, idx| if logits[idx] > logits[best] { idx } else { best }).unwrap_or(0);
    let sum: f32 = logits.iter().map(|logit| (logit - logits[best]).exp()).sum();
    (best, sum.recip())
}

fn log_probabilities(logits: &LabelScores) -> LabelScores {
    let largest = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let sum: f32 = logits.iter().map(|logit| (logit - largest).exp()).sum();
    logits.map(|logit| logit - largest - sum.ln())
}
