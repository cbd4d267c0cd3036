//! Algorithm 1 of the paper over a demonstration that is its own world.
//!
//! Nothing is acted. The state at each decision is the demonstration's own frame, and a primitive takes until the next
//! key frame. A program that is given a part of the demonstration has done what that part shows, so the clock of the
//! caller goes on at the end of the part.
//!
//! # Source
//!
//! Paper, section IV, read backwards: scoping divides a demonstration among programs, and where they begin and end is
//! what an annotator would write down. Ours: a part begins where its caller is, and what the gripper does bounds it. A
//! root names the *first* part that shows what is to be done; the second of several alike lies behind that.

use std::sync::Arc;

use crate::annotate::Doubt;
use crate::annotate::confidence::confidence;
use crate::annotate::gripper_changes::GripperChanges;
use crate::model::Pictures;
use crate::program::Program;
use crate::rollout::{Decision, Policy, PolicyError, Query, Specification};
use crate::scene::SlotIndex;
use crate::trace::{CallId, Observation, ObservationRows, ProgramCall, Span};

/// A demonstration taken apart. Spans count its key frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Parsed {
    /// Every call, callers before callees; a demonstration is its own specification.
    pub calls: Vec<ProgramCall>,
    /// How sure each call is: the product of the probabilities of what was decided. Of the root the least of all.
    pub confidences: Vec<f32>,
    /// What does not fit together.
    pub doubts: Vec<Doubt>,
}

/// Takes demonstrations apart, given by their key frames; side by side, each as if it were alone.
///
/// # Errors
///
/// When the policy cannot decide.
pub fn parse(
    policy: &mut dyn Policy,
    root: Program,
    demonstrations: &[ObservationRows],
) -> Result<Vec<Parsed>, PolicyError> {
    let mut walks: Vec<Walk> = demonstrations.iter().map(|rows| Walk::new(root, rows)).collect();
    loop {
        let queries: Vec<Query> = walks.iter().enumerate().filter_map(|(idx, walk)| walk.query(idx)).collect();
        if queries.is_empty() {
            break;
        }
        let decisions = policy.decide(&queries)?;
        if decisions.len() != queries.len() {
            let (policy, found) = (policy.name().to_owned(), decisions.len());
            return Err(PolicyError::Count { policy, found, expected: queries.len() });
        }
        for (query, decision) in queries.iter().zip(decisions) {
            walks[query.episode].step(query.window, decision);
        }
    }
    Ok(walks.into_iter().map(Walk::finish).collect())
}

/// How many decisions there may be for each key frame. An expert's tree has eleven for four.
const DECISIONS_OF_A_FRAME: u32 = 8;
/// Programs that run at a time. An expert's tree has three of them.
const DEEPEST: usize = 8;

/// A demonstration on its way.
struct Walk {
    specification: Arc<Specification>,
    states: ObservationRows,
    seen: Arc<Pictures>,
    changes: GripperChanges,
    n_frames: u32,
    /// The key frame that programs are at.
    at: u32,
    calls: Vec<ProgramCall>,
    confidences: Vec<f32>,
    running: Vec<Running>,
    n_decisions: u32,
    doubts: Vec<Doubt>,
}

/// A call of a composite program that goes on.
struct Running {
    call: usize,
    /// The part that it was given.
    scope: Span,
    n_steps: u16,
    /// Its last call, if that was of a primitive.
    primitive: Option<usize>,
}

impl Walk {
    fn new(root: Program, states: &ObservationRows) -> Self {
        let n_frames = states.len() as u32;
        let whole = Span { begin: 0, end: n_frames.max(1) };
        let call = ProgramCall {
            id: CallId(0),
            caller: None,
            depth: 0,
            step: 0,
            program: root,
            argument: None,
            input: whole,
            output: Some(whole),
            frames: whole,
            end_of_program: false,
            prediction: None,
        };
        Self {
            specification: Arc::new(Specification::observed(states.clone())),
            states: states.clone(),
            changes: GripperChanges::of(states),
            seen: Arc::default(),
            n_frames,
            at: 0,
            calls: vec![call],
            confidences: vec![1.0],
            running: vec![Running { call: 0, scope: whole, n_steps: 0, primitive: None }],
            n_decisions: 0,
            doubts: Vec::new(),
        }
    }

    /// What to ask the policy now; nothing when all programs have ended.
    fn query(&self, episode: usize) -> Option<Query> {
        let top = self.running.last()?;
        let running = self.calls[top.call].program;
        Some(Query {
            episode,
            decision: self.n_decisions,
            depth: (self.running.len() - 1) as u8,
            step: top.n_steps,
            specification: Arc::clone(&self.specification),
            window: top.scope,
            program: running,
            observation: observation(&self.states, self.at),
            seen: Arc::clone(&self.seen),
            allowed: self.changes.allowed(self.at, top.scope, running, self.held()),
        })
    }

    /// What the gripper was moved to before it gripped; nothing while it is empty.
    fn held(&self) -> Option<SlotIndex> {
        let last = self.calls.iter().rposition(|call| matches!(call.program, Program::Grip | Program::Release))?;
        let moved = self.calls[..last].iter().rev().find_map(|call| call.argument);
        moved.filter(|_| self.calls[last].program == Program::Grip)
    }

    /// Takes a decision down, made of what `window` shows.
    fn step(&mut self, window: Span, decision: Decision) {
        self.n_decisions += 1;
        let last = self.n_frames.saturating_sub(1);
        let is_endless = self.n_decisions > DECISIONS_OF_A_FRAME * (self.n_frames + 1) || self.running.len() > DEEPEST;
        if is_endless {
            self.doubts.push(Doubt::Endless);
            return self.break_off();
        }
        if decision.program != Program::None && self.at == last {
            return self.run_out(&decision);
        }
        let (decision, confidence) = self.seen(self.at_hand(decision), window);
        match decision.program {
            Program::None => {
                self.call(&decision, None, confidence);
                self.return_callers();
            }
            program if program.is_primitive() => self.primitive(&decision, confidence),
            _ => {
                let scope = self.scope_of(&decision);
                let call = self.call(&decision, Some(scope), confidence);
                self.running.push(Running { call, scope, n_steps: 0, primitive: None });
            }
        }
    }

    /// The decision that the gripper shows, and how sure it is. Where it closes or opens by the next key frame, a program
    /// of primitives has called `grip` or `release` and ends, whatever the policy takes the state for; before, it moves.
    fn seen(&self, mut decision: Decision, window: Span) -> (Decision, f32) {
        if self.changes.is_none() || !decision.program.is_primitive() {
            let confidence = confidence(&decision, window);
            return (decision, confidence);
        }
        let change = self.changes.next(self.at);
        let part = self.running.last().map_or(window, |top| top.scope);
        decision.end_of_program = change.is_some() || !self.changes.has_ahead(self.at + 1, part);
        match change {
            // What can be seen is sure.
            None => {
                let argument_probability = decision.argument_probability;
                (decision, argument_probability)
            }
            Some(changed) if changed == decision.program => (decision, 1.0),
            Some(changed) => (Decision { program: changed, argument: None, ..decision }, UNSEEN),
        }
    }

    /// A part that lies behind, at the present frame.
    fn at_hand(&self, decision: Decision) -> Decision {
        let Span { begin, end } = decision.scope;
        if !decision.program.is_composite() || begin >= self.at || self.running.len() > 1 {
            return decision;
        }
        let scope = Span { begin: self.at, end: self.at + (end - begin) };
        Decision { scope, ..decision }
    }

    /// The part that a callee is given: it begins where the caller is, and lies in the caller's.
    fn scope_of(&mut self, decision: &Decision) -> Span {
        let (call, at) = (self.calls.len() as u32, self.at);
        if decision.scope.begin != at {
            self.doubts.push(Doubt::ScopeBegins { call, found: decision.scope.begin, at });
        }
        let bound = self.running.last().map_or(self.n_frames, |top| top.scope.end);
        // One frame has no way to go.
        let end = decision.scope.end.min(bound).max(at + 2).min(self.n_frames);
        Span { begin: at, end }
    }

    /// Adds a call at the present frame; gives its position.
    fn call(&mut self, decision: &Decision, scope: Option<Span>, confidence: f32) -> usize {
        let position = self.calls.len();
        let Some(top) = self.running.last_mut() else { return position };
        let (caller, depth) = (self.calls[top.call].id, self.calls[top.call].depth + 1);
        let frames = scope.unwrap_or(Span { begin: self.at, end: self.at + 1 });
        self.calls.push(ProgramCall {
            id: CallId(position as u32),
            caller: Some(caller),
            depth,
            step: top.n_steps,
            program: decision.program,
            argument: decision.argument,
            input: top.scope,
            output: (decision.program != Program::None).then_some(frames),
            frames,
            end_of_program: decision.end_of_program,
            prediction: None,
        });
        self.confidences.push(confidence);
        top.n_steps = top.n_steps.saturating_add(1);
        top.primitive = None;
        position
    }

    /// A primitive takes until the next key frame. One that is called once more has only gone on.
    fn primitive(&mut self, decision: &Decision, confidence: f32) {
        let same = self.running.last().and_then(|top| top.primitive).filter(|&before| {
            let before = &self.calls[before];
            (before.program, before.argument) == (decision.program, decision.argument)
        });
        let position = match same {
            Some(before) => {
                self.calls[before].end_of_program = decision.end_of_program;
                self.confidences[before] = self.confidences[before].min(confidence);
                before
            }
            None => self.call(decision, None, confidence),
        };
        self.at += 1;
        self.calls[position].frames.end = self.at + 1;
        if let Some(top) = self.running.last_mut() {
            top.primitive = Some(position);
        }
        if decision.end_of_program {
            self.return_callers();
        }
    }

    /// The running program returns, and with it every caller that ended with the step.
    fn return_callers(&mut self) {
        while let Some(ended) = self.running.pop() {
            let is_root = ended.call == 0;
            if !is_root && ended.scope.last() != self.at {
                let (call, found, at) = (ended.call as u32, ended.scope.last(), self.at);
                self.doubts.push(Doubt::ScopeEnds { call, found, at });
            }
            if !is_root && !self.changes.has_ahead(self.at, ended.scope) {
                self.wait_until(ended.scope.last(), ended.primitive);
            }
            let (at, ends_caller) = (self.at, self.ends_caller(ended.call));
            let call = &mut self.calls[ended.call];
            call.frames.end = if is_root { call.frames.end } else { at + 1 };
            call.end_of_program = ends_caller;
            if !ends_caller {
                break;
            }
        }
    }

    /// Whether a call that returns was its caller's last: as was decided, unless the gripper shows otherwise. A root goes
    /// on until it calls nothing.
    fn ends_caller(&self, call: usize) -> bool {
        let decided = self.calls[call].end_of_program;
        match self.running.last() {
            Some(caller) if self.changes.has_ahead(self.at, caller.scope) => false,
            Some(caller) if caller.call != 0 && !self.changes.is_none() => true,
            _ => decided,
        }
    }

    /// What is left of a part when its program ends is its last primitive's.
    fn wait_until(&mut self, frame: u32, primitive: Option<usize>) {
        if frame > self.at {
            self.at = frame;
            if let Some(primitive) = primitive {
                self.calls[primitive].frames.end = frame + 1;
            }
        }
    }

    /// There is no frame left for what is decided: all programs end.
    fn run_out(&mut self, decision: &Decision) {
        let program = self.running.last().map_or(decision.program, |top| self.calls[top.call].program);
        self.doubts.push(Doubt::Unfinished { program });
        self.break_off();
    }

    /// All programs end here.
    fn break_off(&mut self) {
        while let Some(ended) = self.running.pop() {
            let frames = Span { begin: self.at, end: self.at + 1 };
            let ended_call = ended.call;
            let has_ended = self.calls.iter().rev().find(|call| call.caller == Some(self.calls[ended.call].id));
            if !has_ended.is_some_and(|last| last.end_of_program) {
                let end = Decision {
                    program: Program::None,
                    scope: frames,
                    argument: None,
                    argument_probability: 1.0,
                    end_of_program: true,
                    prediction: None,
                };
                let call = ended.call;
                self.running.push(ended);
                self.call(&end, None, 0.0);
                self.running.pop();
                self.calls[call].frames.end = self.calls[call].frames.end.max(self.at + 1);
            }
            if !self.running.is_empty() {
                self.at = self.at.max(self.calls[ended_call].frames.last());
            }
        }
    }

    fn finish(mut self) -> Parsed {
        let last = self.n_frames.saturating_sub(1);
        if self.at < last {
            self.doubts.push(Doubt::EndsEarly { frame: self.at, last });
        }
        for position in 0..self.calls.len() {
            let caller = self.calls[position].caller.map_or(position, |caller| caller.0 as usize);
            self.calls[position].input = self.calls[caller].frames;
            let call = &mut self.calls[position];
            call.output = (call.program != Program::None).then_some(call.frames);
        }
        self.check_effects();
        let least = self.confidences.iter().copied().fold(1.0, f32::min);
        self.confidences[0] = least;
        Parsed { calls: self.calls, confidences: self.confidences, doubts: self.doubts }
    }

    /// How far a slot is beside the gripper at a key frame or, if it is nearer then, at the next, where that closes: of
    /// fast hands the frame of hovering is not known well.
    fn distance_m(&self, frame: u32, slot: SlotIndex) -> f32 {
        let beside_m = |frame: u32| {
            let state = self.states.get(frame as usize)?;
            state.positions.get(usize::from(slot.0)).map(|[x, y, _]| x.hypot(*y))
        };
        let grips = (self.changes.next(frame) == Some(Program::Grip)).then_some(frame + 1);
        let nearest = [Some(frame), grips].into_iter().flatten().filter_map(beside_m).reduce(f32::min);
        nearest.unwrap_or(0.0)
    }

    /// What primitives leave behind them can be seen.
    fn check_effects(&mut self) {
        for call in self.calls.iter().filter(|call| call.program.is_primitive()) {
            let Some(state) = self.states.get(call.frames.last() as usize) else { continue };
            let (id, program, closed) = (call.id.0, call.program, !state.is_open());
            let is_wrong = match program {
                Program::Grip => !closed,
                Program::Release => closed,
                _ => false,
            };
            if is_wrong {
                self.doubts.push(Doubt::Gripper { call: id, program, closed });
            }
            let distance_m = call.argument.map_or(0.0, |slot| self.distance_m(call.frames.last(), slot));
            if distance_m > REACH_M {
                self.doubts.push(Doubt::Away { call: id, distance_m });
            }
        }
    }
}

/// How sure a call is that the policy did not make.
const UNSEEN: f32 = 0.4;
/// A gripper is not farther beside the middle of a thing than this, in metres: half of a small container, or where a bowl
/// is held at its rim.
const REACH_M: f32 = 0.075;

fn observation(states: &ObservationRows, frame: u32) -> Observation {
    states.get(frame as usize).map_or_else(
        || Observation { slots_m: Vec::new(), closed: false },
        |row| Observation { slots_m: row.positions.to_vec(), closed: !row.is_open() },
    )
}
