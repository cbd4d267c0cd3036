//! Algorithm 1 of the paper, with a call stack in place of recursion so that many episodes ask a policy at once.
//!
//! A step whose program ends is a tail call: the caller returns together with its last callee. That is what
//! Algorithm 1 does, whose loop tests `r` only after the call.

use std::sync::Arc;

use rayon::iter::{IntoParallelRefMutIterator as _, ParallelIterator as _};

use crate::model::{Pictures, ScopingKind};
use crate::program::Program;
use crate::robot::{Action, Judgement, RobotApi, judge};
use crate::rollout::divergence::divergence;
use crate::rollout::failure::{Asked, Localisation, due_to};
use crate::rollout::{Decision, Divergence, Expectation, Failure, Policy, PolicyError, Query, Specification};
use crate::scene::Scene;
use crate::task::Task;
use crate::trace::{
    CallRecorder, Cause, Episode, EpisodeParts, Frame, NewCall, Outcome, Provenance, Push, SpecificationForm,
    TraceError, check_argument,
};

/// An episode about to be acted: a demonstration, and a world of another trial.
pub struct Start<'t> {
    /// What is to be reached; the policy never sees it.
    pub task: &'t Task,
    /// The expert's episode of another trial of the task; boundary frames alone or all.
    pub demonstration: Episode,
    /// The world to act in.
    pub world: Box<dyn RobotApi + Send>,
    /// For a policy that sees; `None` for one that is given positions.
    pub sight: Option<Sight>,
    /// Where the new episode comes from.
    pub provenance: Provenance,
}

/// A camera before the world.
pub trait Eye: Send {
    /// What it sees of a frame: one picture.
    fn look(&mut self, scene: &Scene, frame: &Frame) -> Pictures;
}

/// What a policy that sees is given in place of positions.
pub struct Sight {
    /// Pictures of the demonstration's boundary frames.
    pub video: Pictures,
    /// What it looks at the world with.
    pub eye: Box<dyn Eye>,
}

/// When a rollout is given up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Decisions allowed, as a multiple of what the expert needs. What an adversary topples must be done again and is
    /// counted in.
    pub decisions_factor: f32,
    /// Deepest stack of running programs.
    pub max_depth: u8,
}

/// However much is toppled, a rollout is given up after so many times the limit that it has without an adversary.
const MOST_REPETITIONS: usize = 10;

impl Default for Limits {
    fn default() -> Self {
        Self { decisions_factor: 3.0, max_depth: 8 }
    }
}

/// An acted episode and how it compares with the expert.
#[derive(Clone, Debug, PartialEq)]
pub struct RolloutEpisode {
    /// The episode; its specification is the demonstration's boundary frames.
    pub episode: Episode,
    /// How many decisions the policy made.
    pub decisions: u32,
    /// The first that differs from the expert's; `None` when none does.
    pub first_divergence: Option<Divergence>,
    /// The decision whose primitive was the first that went wrong in physics; `None` when none did.
    pub fault_decision: Option<u32>,
    /// What an adversary did; `None` in a world without one.
    pub pushes: Option<Vec<Push>>,
    /// How many goals of the task hold in the end, also where the policy never ended.
    pub judgement: Judgement,
    /// What a failure is due to; `None` for a success.
    pub failure: Option<Failure>,
    /// Level distance of what the policy was told from true places, the mean over slots and decisions, in millimetres;
    /// `None` where it was told true ones.
    pub localisation_mm: Option<f64>,
}

/// Episodes that cannot be acted.
#[derive(Debug, thiserror::Error)]
pub enum RolloutError {
    /// The policy could not decide.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// An episode breaks a rule of traces: a bug in world or policy.
    #[error(transparent)]
    Trace(#[from] TraceError),
}

/// Acts all episodes to their ends. Physics of different episodes runs on the current rayon pool; the result does not
/// depend on its size.
///
/// # Errors
///
/// [`RolloutError`] when the policy cannot decide, or when an episode breaks a rule of traces.
pub fn run(
    policy: &mut dyn Policy,
    starts: Vec<Start<'_>>,
    limits: Limits,
) -> Result<Vec<RolloutEpisode>, RolloutError> {
    let mut running: Vec<Running<'_>> =
        starts.into_iter().map(|start| Running::new(start, policy.scoping(), policy.reads(), limits)).collect();
    loop {
        let asking = running.iter_mut().enumerate();
        let queries: Vec<Query> =
            asking.filter_map(|(idx, run)| run.query(idx).inspect(|query| run.note(query))).collect();
        if queries.is_empty() {
            break;
        }
        let decisions = policy.decide(&queries)?;
        if decisions.len() != queries.len() {
            let (policy, found) = (policy.name().to_owned(), decisions.len());
            return Err(PolicyError::Count { policy, found, expected: queries.len() }.into());
        }
        for (query, decision) in queries.iter().zip(decisions) {
            running[query.episode].pending = Some(decision);
        }
        running.par_iter_mut().for_each(Running::step);
    }
    let variant = policy.name().to_owned();
    running.into_iter().map(|run| run.finish(&variant, policy)).collect()
}

/// One episode on its way.
struct Running<'t> {
    task: &'t Task,
    world: Box<dyn RobotApi + Send>,
    eye: Option<Box<dyn Eye>>,
    /// What the eye sees now.
    seen: Arc<Pictures>,
    provenance: Provenance,
    specification: Arc<Specification>,
    expectation: Expectation,
    calls: CallRecorder,
    pending: Option<Decision>,
    limits: Limits,
    decisions: u32,
    first_divergence: Option<Divergence>,
    /// What it was asked until then, where it is told what the robot sees.
    asked: Asked,
    /// What that was off by.
    localisation: Localisation,
    /// What first went wrong in physics, at which decision.
    first_fault: Option<(u32, Cause)>,
    /// Why it was given up before its end.
    given_up: Option<Cause>,
    /// The decision that no call can be made of, if there was one.
    unlawful: Option<TraceError>,
}

impl<'t> Running<'t> {
    fn new(start: Start<'t>, scoping: ScopingKind, reads: SpecificationForm, limits: Limits) -> Self {
        let Start { task, demonstration, world, sight, provenance } = start;
        let demonstration = demonstration.boundaries_only();
        let expectation = Expectation::new(scoping, &demonstration, world.scene()).specified_in(reads, &demonstration);
        let (video, mut eye) = sight.map(|sight| (sight.video, sight.eye)).unzip();
        let specification = match video {
            Some(video) if reads == SpecificationForm::Video => Specification::video(&demonstration, video),
            _ => Specification::in_form(reads, &demonstration),
        };
        let specification = Arc::new(specification);
        let seen = Arc::new(seen(&mut eye, world.as_ref()));
        Self {
            task,
            world,
            eye,
            seen,
            provenance,
            calls: CallRecorder::new(task.family.root_program(), specification.whole()),
            specification,
            pending: None,
            limits,
            expectation,
            decisions: 0,
            first_divergence: None,
            asked: Asked::default(),
            localisation: Localisation::default(),
            first_fault: None,
            given_up: None,
            unlawful: None,
        }
    }

    /// What to ask the policy now; nothing when the episode is over.
    fn query(&self, episode: usize) -> Option<Query> {
        let top = self.calls.top().filter(|_| self.given_up.is_none() && self.unlawful.is_none())?;
        Some(Query {
            episode,
            decision: self.decisions,
            depth: top.depth,
            step: self.calls.steps_of_top(),
            specification: Arc::clone(&self.specification),
            window: top.output.unwrap_or(top.input),
            program: top.program,
            observation: self.world.observe(),
            seen: Arc::clone(&self.seen),
            allowed: None,
        })
    }

    /// Notes what is asked, and how far off it is.
    fn note(&mut self, query: &Query) {
        if self.world.is_told_what_it_sees() {
            self.localisation.add(&query.observation, &self.world.now().observation());
            if self.first_divergence.is_none() {
                self.asked.note(query.clone());
            }
        }
    }

    /// Carries out the pending decision.
    fn step(&mut self) {
        let Some(decision) = self.pending.take() else { return };
        let caller = self.calls.top().map_or(Program::None, |top| top.program);
        let number = self.decisions;
        let Decision { program, scope, argument, argument_probability: _, end_of_program, prediction } = decision;
        if let Err(problem) = check_argument(self.world.scene().slots.len(), program, argument) {
            self.unlawful = Some(TraceError::Call { call: self.calls.len() as u32, problem });
            return;
        }
        let scope = (program != Program::None).then_some(scope);
        let new = NewCall { program, argument, scope, end_of_program, prediction };
        self.calls.call(new, self.frame());
        self.compare(caller);
        self.decisions += 1;
        if let Some(action) = Action::new(program, argument)
            && let Err(cause) = self.world.act(action)
        {
            self.first_fault.get_or_insert((number, cause));
            self.given_up = (cause == Cause::RobotLost).then_some(cause);
        }
        if program.is_primitive() {
            self.seen = Arc::new(seen(&mut self.eye, self.world.as_ref()));
        }
        if !program.is_composite() {
            self.calls.returned(self.frame());
        }
        let too_deep = self.calls.top().is_some_and(|top| top.depth >= self.limits.max_depth);
        if self.calls.top().is_some() && (self.decisions >= self.max_decisions() || too_deep) {
            self.given_up.get_or_insert(Cause::NeverEnded);
        }
    }

    /// Compares the call just made with the expert's, until one differs.
    fn compare(&mut self, caller: Program) {
        if self.first_divergence.is_none() {
            let observation = self.world.now().observation();
            let wanted = self.expectation.next(&observation);
            let made = self.calls.top();
            self.first_divergence = made.and_then(|made| divergence(self.decisions, caller, made, wanted.as_ref()));
            if self.first_divergence.is_some() {
                self.asked.diverged(wanted.as_ref(), observation);
            }
        }
    }

    /// What is toppled costs a sub-task each.
    fn max_decisions(&self) -> u32 {
        let toppled: usize = self.world.pushes().into_iter().flatten().map(|push| push.toppled.len()).sum();
        let alone = self.expectation.n_decisions();
        let expected = alone + toppled * self.expectation.n_decisions_of_sub_task();
        (expected.min(MOST_REPETITIONS * alone) as f32 * self.limits.decisions_factor) as u32 + 20
    }

    fn frame(&self) -> u32 {
        (self.world.frames().len() as u32).saturating_sub(1)
    }

    fn finish(mut self, variant: &str, policy: &mut dyn Policy) -> Result<RolloutEpisode, RolloutError> {
        if let Some(unlawful) = self.unlawful {
            return Err(unlawful.into());
        }
        let judgement = judge(self.task, self.world.as_mut());
        let lost = judgement.cause.filter(|&cause| cause == Cause::RobotLost);
        let cause = lost.or(self.given_up).or(judgement.cause);
        let fault = self.first_fault.filter(|_| cause != Some(Cause::RobotLost));
        let first_cause = |cause| fault.map_or(cause, |(_, fault)| fault);
        let outcome = cause.map_or(Outcome::Success, |cause| Outcome::Failure(first_cause(cause)));
        let frame = self.frame();
        let calls = self.calls.finish(frame);
        self.provenance.actor = crate::trace::Actor::Policy(variant.to_owned());
        let episode = Episode::new(EpisodeParts {
            provenance: self.provenance,
            scene: self.world.scene().clone(),
            frames: self.world.frames().to_vec(),
            specification_frames: self.specification.whole().end,
            calls,
            pushes: self.world.pushes().unwrap_or_default().to_vec(),
            outcome,
        })?;
        let fault_decision = self.first_fault.map(|(decision, _)| decision);
        let failure = (!outcome.is_success()).then(|| {
            let right = || self.asked.is_right_when_told(policy);
            due_to(self.first_divergence.map(|divergence| divergence.decision), fault_decision, right)
        });
        Ok(RolloutEpisode {
            episode,
            decisions: self.decisions,
            first_divergence: self.first_divergence,
            fault_decision,
            pushes: self.world.pushes().map(<[Push]>::to_vec),
            judgement,
            failure: failure.transpose()?,
            localisation_mm: self.localisation.mean_mm(),
        })
    }
}

/// What an eye sees of the world now; nothing without an eye.
fn seen(eye: &mut Option<Box<dyn Eye>>, world: &dyn RobotApi) -> Pictures {
    eye.as_mut().map_or_else(Pictures::default, |eye| eye.look(world.scene(), world.now()))
}
