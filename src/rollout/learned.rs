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

use burn::tensor::{Device, Tensor};
use rayon::iter::{
    IndexedParallelIterator as _, IntoParallelIterator as _, IntoParallelRefIterator as _, ParallelIterator as _,
};

use crate::model::{
    self, CalledWith, CoreOutput, Decoder, LabelScores, MAX_ARGUMENTS, ModelConfig, ModelError, Network, NetworkUse,
    PictureIndex, Pictures, ReadError, ScopingKind, States, Windows, scalar, span_from, values,
};
use crate::program::Program;
use crate::rollout::{Allowed, Decision, Policy, PolicyError, Query, Specification};
use crate::scene::SlotIndex;
use crate::trace::{ObservationRows, Prediction, ScopingLabel, Span, SpecificationForm};

/// A program ends when its end is at least this likely (the paper's alpha).
const END_THRESHOLD: f32 = 0.5;

/// A policy from a model's folder, with the model's configuration.
///
/// # Errors
///
/// As [`model::load`].
pub fn load_policy(folder: &Path, decoder: Decoder) -> Result<(ModelConfig, Box<dyn Policy + Send>), ModelError> {
    load_policy_on(&Device::flex(), folder, decoder)
}

/// The same, deciding on a device.
///
/// # Errors
///
/// As [`model::load`].
pub fn load_policy_on(
    device: &Device,
    folder: &Path,
    decoder: Decoder,
) -> Result<(ModelConfig, Box<dyn Policy + Send>), ModelError> {
    let config = model::load_config(folder)?;
    let deciding = Deciding {
        name: config.variant.name(),
        reads: config.network.specification(),
        decoder,
        tasks: config.tasks.clone(),
    };
    let policy = model::load(folder, &config, device, deciding)?;
    Ok((config, policy))
}

/// Makes a policy of a network.
struct Deciding {
    name: String,
    reads: SpecificationForm,
    decoder: Decoder,
    tasks: Vec<String>,
}

impl NetworkUse for Deciding {
    type Output = Box<dyn Policy + Send>;

    fn run<N: Network>(self, network: N) -> Self::Output {
        Box::new(LearnedPolicy::new(&self.name, network, self.decoder).reading(self.reads).knowing(self.tasks))
    }
}

/// A network that decides.
pub struct LearnedPolicy<N: Network> {
    name: String,
    reads: SpecificationForm,
    network: N,
    decoder: Decoder,
    /// By address, which the `Arc` in the value keeps from being given to another specification.
    demonstrations: HashMap<usize, Known<N::Demonstration>>,
    /// The running calls of each episode, from the root's up.
    stacks: HashMap<usize, Vec<Running<N::Recall>>>,
    /// The tasks that the network knows by name.
    tasks: Vec<String>,
}

/// A decision, the running call after it, and the call that it makes.
type Decided<R> = (Decision, [Running<R>; 2]);

/// A call on an episode's stack.
struct Running<R> {
    called_with: CalledWith,
    /// What it remembers of its steps.
    recall: Option<R>,
}

impl<R> Running<R> {
    fn called(called_with: CalledWith) -> Self {
        Self { called_with, recall: None }
    }
}

/// What does not change in an episode, kept as long as its specification is in use.
struct Known<D> {
    specification: Arc<Specification>,
    demonstration: D,
}

impl<N: Network> LearnedPolicy<N> {
    /// A policy of the given name that reads trajectories. The network is used without gradients.
    pub fn new(name: &str, network: N, decoder: Decoder) -> Self {
        let (demonstrations, stacks) = (HashMap::new(), HashMap::new());
        Self {
            name: name.to_owned(),
            reads: SpecificationForm::default(),
            network: network.valid(),
            decoder,
            demonstrations,
            stacks,
            tasks: Vec::new(),
        }
    }

    /// The same, reading task specifications of a form.
    #[must_use]
    pub fn reading(self, reads: SpecificationForm) -> Self {
        Self { reads, ..self }
    }

    /// The same for a network that knows tasks by name, in the order of its rows.
    #[must_use]
    pub fn knowing(self, tasks: Vec<String>) -> Self {
        Self { tasks, ..self }
    }

    /// Reads the demonstrations of new episodes, and forgets those of episodes that are over.
    fn refresh(&mut self, queries: &[Query]) -> Result<(), PolicyError> {
        self.demonstrations.retain(|_, known| Arc::strong_count(&known.specification) > 1);
        let mut unknown: Vec<&Arc<Specification>> = Vec::new();
        for specification in queries.iter().map(|query| &query.specification) {
            let is_new = !self.demonstrations.contains_key(&key(specification));
            if is_new && !unknown.iter().any(|other| Arc::ptr_eq(other, specification)) {
                unknown.push(specification);
            }
        }
        let read: Vec<Result<Known<N::Demonstration>, PolicyError>> =
            unknown.into_par_iter().map(|specification| self.read(specification)).collect();
        for known in read {
            let known = known?;
            self.demonstrations.insert(key(&known.specification), known);
        }
        Ok(())
    }

    fn read(&self, specification: &Arc<Specification>) -> Result<Known<N::Demonstration>, PolicyError> {
        let demonstration = || -> Result<N::Demonstration, ReadError> {
            let windows = Windows::new(specification.n_slots, &[&specification.rows])?;
            self.network.demonstration(&windows, &self.network.perceive(&specification.pictures)?)
        };
        match demonstration() {
            Ok(demonstration) => Ok(Known { specification: Arc::clone(specification), demonstration }),
            Err(problem) => Err(self.cannot(specification, problem)),
        }
    }

    /// Why nothing can be decided in an episode.
    fn cannot(&self, specification: &Specification, problem: ReadError) -> PolicyError {
        PolicyError::Read { policy: self.name.clone(), task_id: specification.task_id.clone(), problem }
    }

    /// Takes the running call off its episode's stack. Calls above it have returned, and one that has just begun
    /// remembers nothing.
    fn running(&mut self, query: &Query) -> Running<N::Recall> {
        let stack = self.stacks.entry(query.episode).or_default();
        stack.resize_with(usize::from(query.depth) + 1, || Running::called(CalledWith::default()));
        let mut running = stack.pop().unwrap_or_else(|| Running::called(CalledWith::default()));
        running.recall = running.recall.filter(|_| query.step > 0);
        if query.depth == 0 {
            running.called_with.task = self.tasks.iter().position(|task| *task == query.specification.task_id);
        }
        running
    }

    /// The decision, the running call after it, and what its callee is called with.
    fn decide_one(&self, query: &Query, running: Running<N::Recall>) -> Result<Decided<N::Recall>, ReadError> {
        let Running { called_with, recall } = running;
        let known = &self.demonstrations[&key(&query.specification)];
        let window = N::window(&known.demonstration, query.window);
        let percepts = self.network.perceive(&query.seen)?;
        let reading = self.network.read(&window, &states(query), &percepts, &[called_with])?;
        let (core, recall) = self.network.core(&reading, query.program.into(), &[1], recall);
        let (decision, arguments) = self.decision(query, &reading, &core)?;
        let callee = Running::called(CalledWith { task: None, arguments });
        Ok((decision, [Running { called_with, recall: Some(recall) }, callee]))
    }

    /// The decision, and the slots that its callee is called with.
    fn decision(
        &self,
        query: &Query,
        reading: &N::Reading,
        core: &CoreOutput,
    ) -> Result<(Decision, Arguments), ReadError> {
        let end_probability = logistic(finite(scalar(core.end.clone())?, "the end of the program")?);
        let programs = all_finite(core.programs.clone(), "the next program")?;
        let allowed = query.allowed.as_ref();
        let (program, program_probability) = likeliest_program(programs, self.network.scoping(), allowed);
        let labels = program.is_composite().then(|| self.network.scope(reading, query.program.into(), core)).flatten();
        let labels: Vec<LabelScores> = labels.map(label_scores).transpose()?.unwrap_or_default();
        let scope = self.scope(&labels, query);
        let (arguments, argument_probability) = self.arguments(reading, query, core, program)?;
        let probabilities =
            |label: ScopingLabel| labels.iter().map(|scores| scores[label as usize].exp()).collect::<Vec<f32>>();
        let decision = Decision {
            program,
            scope: scope.unwrap_or(query.window),
            argument: arguments[0].filter(|_| program.takes_argument()),
            argument_probability: if program.takes_argument() { argument_probability } else { 1.0 },
            end_of_program: program == Program::None || end_probability >= END_THRESHOLD,
            prediction: Some(Prediction {
                program_probability,
                end_probability,
                start_probabilities: probabilities(ScopingLabel::Start),
                stop_probabilities: probabilities(ScopingLabel::End),
            }),
        };
        Ok((decision, arguments))
    }

    /// The part that a callee is given; nothing without labels.
    fn scope(&self, labels: &[LabelScores], query: &Query) -> Option<Span> {
        let window = query.window;
        let within = match &query.allowed {
            Some(Allowed { begin, lasts, .. }) if window.contains_frame(*begin) && !labels.is_empty() => {
                let lasts = lasts.iter().filter(|&&last| *begin <= last && window.contains_frame(last));
                let lasts: Vec<u32> = lasts.map(|last| last - window.begin).collect();
                span_from(labels, begin - window.begin, &lasts)
            }
            _ => self.decoder.decode(labels),
        };
        within.map(|within| Span { begin: window.begin + within.begin, end: window.begin + within.end })
    }

    /// The slots that a program is called with, and how likely the first of them is.
    fn arguments(
        &self,
        reading: &N::Reading,
        query: &Query,
        core: &CoreOutput,
        callee: Program,
    ) -> Result<(Arguments, f32), ReadError> {
        let (mut arguments, mut first_probability) = (Arguments::default(), 1.0);
        let n_arguments = self.network.scoping().n_arguments_of(callee);
        if n_arguments > 0 {
            let mut logits = all_finite(self.network.argument(reading, query.program.into(), core), "the argument")?;
            let refused = query.allowed.as_ref().and_then(|allowed| allowed.not_argument);
            if let Some(logit) = refused.and_then(|slot| logits.get_mut(usize::from(slot.0))) {
                *logit = f32::MIN;
            }
            let rows = logits.chunks_exact(query.specification.n_slots.max(1)).take(n_arguments);
            for (number, (slot, row)) in arguments.iter_mut().zip(rows).enumerate() {
                let (likeliest, probability) = likeliest(row);
                *slot = Some(SlotIndex(likeliest as u16));
                first_probability = if number == 0 { probability } else { first_probability };
            }
        }
        Ok((arguments, first_probability))
    }
}

/// The slots of a call.
type Arguments = [Option<SlotIndex>; MAX_ARGUMENTS];

impl<N: Network> Policy for LearnedPolicy<N> {
    fn name(&self) -> &str {
        &self.name
    }

    fn scoping(&self) -> ScopingKind {
        self.network.scoping()
    }

    fn reads(&self) -> SpecificationForm {
        self.reads
    }

    fn detect(&self, pictures: &Pictures) -> Result<Option<ObservationRows>, PolicyError> {
        match self.network.perceive(pictures) {
            Ok(percepts) => Ok(N::detected(&percepts).cloned()),
            Err(problem) => Err(PolicyError::Detect { policy: self.name.clone(), problem }),
        }
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        self.refresh(queries)?;
        let running: Vec<_> = queries.iter().map(|query| self.running(query)).collect();
        let decided: Vec<_> =
            queries.par_iter().zip(running).map(|(query, running)| self.decide_one(query, running)).collect();
        let mut decisions = Vec::with_capacity(queries.len());
        for (query, decided) in queries.iter().zip(decided) {
            let (decision, running) = decided.map_err(|problem| self.cannot(&query.specification, problem))?;
            self.stacks.entry(query.episode).or_default().extend(running);
            decisions.push(decision);
        }
        Ok(decisions)
    }
}

/// What is seen at a query: its only picture, or where things are.
fn states(query: &Query) -> States {
    if query.seen.n > 0 {
        States::Pictures(vec![PictureIndex(0)])
    } else {
        States::Observations(ObservationRows::of(query.observation.slots_m.len(), [&query.observation]))
    }
}

fn key(specification: &Arc<Specification>) -> usize {
    Arc::as_ptr(specification).addr()
}

/// What a network says. What is no number says nothing, and nothing is decided by it.
fn finite(said: f32, what: &'static str) -> Result<f32, ReadError> {
    if said.is_finite() { Ok(said) } else { Err(ReadError::NotFinite { what, found: said.to_string() }) }
}

fn all_finite<const D: usize>(tensor: Tensor<D>, what: &'static str) -> Result<Vec<f32>, ReadError> {
    values(tensor)?.into_iter().map(|said| finite(said, what)).collect()
}

fn logistic(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

/// The likeliest program that may be called, and its probability among those that the scoping allows.
fn likeliest_program(mut logits: Vec<f32>, scoping: ScopingKind, allowed: Option<&Allowed>) -> (Program, f32) {
    for (logit, program) in logits.iter_mut().zip(Program::ALL) {
        if !scoping.may_call(program) {
            *logit = f32::NEG_INFINITY;
        }
    }
    let mut among = logits.clone();
    let programs = allowed.map_or(&[][..], |allowed| &allowed.programs);
    for (logit, program) in among.iter_mut().zip(Program::ALL) {
        if !programs.is_empty() && !programs.contains(&program) {
            *logit = f32::NEG_INFINITY;
        }
    }
    let (idx, _) = likeliest(&among);
    (Program::from_index(idx).unwrap_or(Program::None), probability(&logits, idx))
}

/// Log-probabilities of each frame's labels.
fn label_scores(logits: Tensor<3>) -> Result<Vec<LabelScores>, ReadError> {
    let logits = all_finite(logits, "the scoping labels")?;
    Ok(logits.as_chunks::<{ ScopingLabel::ALL.len() }>().0.iter().map(log_probabilities).collect())
}

/// The first of the largest logits, and its probability.
fn likeliest(logits: &[f32]) -> (usize, f32) {
    let best = (0..logits.len()).reduce(|best, idx| if logits[idx] > logits[best] { idx } else { best }).unwrap_or(0);
    (best, probability(logits, best))
}

/// The probability of one of some logits.
fn probability(logits: &[f32], idx: usize) -> f32 {
    logits.iter().map(|logit| (logit - logits[idx]).exp()).sum::<f32>().recip()
}

fn log_probabilities(logits: &LabelScores) -> LabelScores {
    let largest = logits.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let sum: f32 = logits.iter().map(|logit| (logit - largest).exp()).sum();
    logits.map(|logit| logit - largest - sum.ln())
}
