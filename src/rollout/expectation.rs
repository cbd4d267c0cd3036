//! What the expert would decide next, in any state.
//!
//! # Input and output
//!
//! A demonstration gives the sub-tasks and their order; an observation at a decision of the root tells which of them
//! comes next. Below the root the calls of a sub-task follow each other.
//!
//! # Invariants
//!
//! Towers are built reactively: next is the first demonstrated sub-task whose block does not rest where it belongs, so
//! what was knocked over is built again. Sorting takes its sub-tasks in turn.

use std::collections::VecDeque;

use crate::model::ScopingKind;
use crate::rollout::divergence::decided_of;
use crate::rollout::expected_calls;
use crate::scene::{BodyIndex, Scene, SlotIndex};
use crate::task::rests_on;
use crate::trace::{Episode, Observation, ProgramCall, SpecificationForm, instruction_spans, instructions};

/// The expert's way through one episode.
#[derive(Clone, Debug, Default)]
pub struct Expectation {
    sub_tasks: Vec<SubTask>,
    /// Sub-tasks begun so far.
    n_begun: usize,
    /// Calls of the present sub-task that are to come.
    under_way: VecDeque<ProgramCall>,
}

/// A call of the root and all below it.
#[derive(Clone, Debug)]
struct SubTask {
    calls: Vec<ProgramCall>,
    /// What it brings about, where that can be seen: always for towers.
    stacked: Option<Stacked>,
}

/// One block on another.
#[derive(Clone, Copy, Debug)]
struct Stacked {
    upper: SlotIndex,
    lower: SlotIndex,
    /// Between their centres.
    height_m: f32,
}

impl Expectation {
    /// For repeating a demonstration in a scene, by a policy that decides so much.
    pub fn new(scoping: ScopingKind, demonstration: &Episode, scene: &Scene) -> Self {
        let family = demonstration.provenance.family;
        let mut sub_tasks: Vec<SubTask> = Vec::new();
        for call in expected_calls(demonstration, scene) {
            match sub_tasks.last_mut() {
                Some(sub_task) if call.depth > 1 => sub_task.calls.push(call.clone()),
                _ => sub_tasks.push(SubTask { calls: vec![call.clone()], stacked: None }),
            }
        }
        if family.builds_towers() {
            sub_tasks.iter_mut().for_each(|sub_task| sub_task.stacked = Stacked::of(&sub_task.calls, scene));
        }
        let whole = demonstration.calls.first().and_then(|root| root.output);
        for sub_task in &mut sub_tasks {
            sub_task.calls = decided_of(scoping, whole, &sub_task.calls);
        }
        Self { sub_tasks, ..Self::default() }
    }

    /// With the parts of a task specification of a form in place of the demonstration's frames.
    #[must_use]
    pub fn specified_in(mut self, form: SpecificationForm, demonstration: &Episode) -> Self {
        if form == SpecificationForm::Instructions {
            let calls = &demonstration.calls;
            let parts = instruction_spans(calls, &instructions(calls, &demonstration.scene.slots));
            let part = |call: &ProgramCall| parts.get(call.id.0 as usize).copied().flatten();
            let calls = self.sub_tasks.iter_mut().flat_map(|sub_task| &mut sub_task.calls);
            calls.for_each(|call| call.output = call.output.and(part(call)));
        }
        self
    }

    /// The decisions that it takes when nothing goes wrong.
    pub fn n_decisions(&self) -> usize {
        self.sub_tasks.iter().map(|sub_task| sub_task.calls.len()).sum()
    }

    /// The most decisions of a sub-task.
    pub fn n_decisions_of_sub_task(&self) -> usize {
        self.sub_tasks.iter().map(|sub_task| sub_task.calls.len()).max().unwrap_or(0)
    }

    /// The next call, given what is seen when it is decided on; nothing when all is done.
    pub fn next(&mut self, observation: &Observation) -> Option<ProgramCall> {
        if self.under_way.is_empty() {
            let is_done = |sub_task: &&SubTask| sub_task.stacked.is_some_and(|stacked| stacked.holds(observation));
            let is_reactive = self.sub_tasks.iter().any(|sub_task| sub_task.stacked.is_some());
            let next = match is_reactive {
                true => self.sub_tasks.iter().find(|sub_task| !is_done(sub_task)),
                false => self.sub_tasks.get(self.n_begun),
            };
            self.under_way = next.map(|sub_task| sub_task.calls.iter().cloned().collect()).unwrap_or_default();
            self.n_begun += 1;
        }
        self.under_way.pop_front()
    }
}

impl Stacked {
    /// The first two moves of a sub-task say what comes on what.
    fn of(calls: &[ProgramCall], scene: &Scene) -> Option<Self> {
        let mut moves = calls.iter().filter_map(|call| call.argument);
        let (upper, lower) = (moves.next()?, moves.next()?);
        let half_m = |slot: SlotIndex| {
            let body: BodyIndex = scene.slot(slot).bodies[0];
            scene.body(body).shape.half_extents_m().z
        };
        Some(Self { upper, lower, height_m: half_m(upper) + half_m(lower) })
    }

    fn holds(&self, observation: &Observation) -> bool {
        let position = |slot: SlotIndex| observation.slots_m.get(usize::from(slot.0)).copied().unwrap_or_default();
        rests_on(&position(self.upper).into(), &position(self.lower).into(), self.height_m)
    }
}
