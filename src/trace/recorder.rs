//! Builds the list of calls while programs run.

use crate::program::Program;
use crate::scene::SlotIndex;
use crate::trace::{CallId, Prediction, ProgramCall, Span};

/// What is known of a call when it is made.
#[derive(Clone, Debug, PartialEq)]
pub struct NewCall {
    /// What is called.
    pub program: Program,
    /// For `move_to`.
    pub argument: Option<SlotIndex>,
    /// The part of the specification the callee may see; `None` for [`Program::None`].
    pub scope: Option<Span>,
    /// Whether the caller ends with this step.
    pub end_of_program: bool,
    /// What a learned policy thought.
    pub prediction: Option<Prediction>,
}

/// A call stack that remembers.
#[derive(Clone, Debug)]
pub struct CallRecorder {
    calls: Vec<ProgramCall>,
    running: Vec<Running>,
}

#[derive(Clone, Debug)]
struct Running {
    id: CallId,
    n_steps: u16,
}

impl CallRecorder {
    /// Begins with the root program, called on the whole specification at frame 0.
    pub fn new(root: Program, specification: Span) -> Self {
        let call = ProgramCall {
            id: CallId(0),
            caller: None,
            depth: 0,
            step: 0,
            program: root,
            argument: None,
            input: specification,
            output: Some(specification),
            frames: Span { begin: 0, end: 1 },
            end_of_program: false,
            prediction: None,
        };
        Self { calls: vec![call], running: vec![Running { id: CallId(0), n_steps: 0 }] }
    }

    /// The running call, or nothing once the root has returned.
    pub fn top(&self) -> Option<&ProgramCall> {
        self.running.last().map(|running| &self.calls[running.id.0 as usize])
    }

    /// How many calls the running call has made.
    pub fn steps_of_top(&self) -> u16 {
        self.running.last().map_or(0, |running| running.n_steps)
    }

    /// How many calls were made, the root's included.
    pub fn len(&self) -> usize {
        self.calls.len()
    }

    /// Never: the root's call is there from the start.
    pub fn is_empty(&self) -> bool {
        self.calls.is_empty()
    }

    /// The running program calls another at `frame`. Nothing happens once the root has returned.
    pub fn call(&mut self, new: NewCall, frame: u32) {
        let NewCall { program, argument, scope, end_of_program, prediction } = new;
        let Some(caller) = self.running.last_mut() else { return };
        let id = CallId(self.calls.len() as u32);
        let parent = &self.calls[caller.id.0 as usize];
        self.calls.push(ProgramCall {
            id,
            caller: Some(caller.id),
            depth: parent.depth.saturating_add(1),
            step: caller.n_steps,
            program,
            argument,
            input: parent.output.unwrap_or(parent.input),
            output: scope,
            frames: Span { begin: frame, end: frame + 1 },
            end_of_program,
            prediction,
        });
        caller.n_steps = caller.n_steps.saturating_add(1);
        self.running.push(Running { id, n_steps: 0 });
    }

    /// The running program returns at `frame`, and with it every caller that ended with the step.
    pub fn returned(&mut self, frame: u32) {
        while let Some(running) = self.running.pop() {
            let call = &mut self.calls[running.id.0 as usize];
            call.frames.end = frame + 1;
            if !call.end_of_program {
                break;
            }
        }
    }

    /// The calls, with those that still run broken off at `frame`.
    pub fn finish(mut self, frame: u32) -> Vec<ProgramCall> {
        for running in &self.running {
            self.calls[running.id.0 as usize].frames.end = frame + 1;
        }
        self.calls
    }

    /// The calls of a demonstration, which is its own specification: what a call may see is what it did.
    pub fn finish_demonstration(self, frame: u32) -> Vec<ProgramCall> {
        let mut calls = self.finish(frame);
        for position in 0..calls.len() {
            let caller = calls[position].caller.map_or(position, |caller| caller.0 as usize);
            calls[position].input = calls[caller].frames;
            let call = &mut calls[position];
            call.output = (call.program != Program::None).then_some(call.frames);
        }
        calls
    }
}
