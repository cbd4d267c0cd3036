//! One program call: who called what, on which part of the specification, when, and whether the caller ended with it.

use crate::program::Program;
use crate::scene::{Scene, SlotIndex};
use crate::trace::Span;

/// Position of a call in its episode, in the order of calling (a caller before its callees).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CallId(pub u32);

/// One step of a caller: the call that it made. The root's call has no caller.
///
/// A step that only ends its program is a call of [`Program::None`], without `output`.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgramCall {
    /// Its own position.
    pub id: CallId,
    /// Who called; `None` for the root.
    pub caller: Option<CallId>,
    /// 0 for the root, else one more than the caller's.
    pub depth: u8,
    /// How many calls its caller had made before.
    pub step: u16,
    /// What was called.
    pub program: Program,
    /// What it was called with; for `move_to` alone.
    pub argument: Option<SlotIndex>,
    /// The part of the specification that the *caller* could see when it chose this call.
    pub input: Span,
    /// The part that the callee may see (the scope); `None` for [`Program::None`]. In an expert's episode the
    /// specification is the episode itself, so this equals `frames`.
    pub output: Option<Span>,
    /// The episode's own frames from the call to the return, both included.
    pub frames: Span,
    /// Whether the caller ended with this step (the paper's r >= alpha). False for the root, which has no caller.
    pub end_of_program: bool,
    /// What a learned policy thought; `None` for an expert.
    pub prediction: Option<Prediction>,
}

impl ProgramCall {
    /// What is called, in words: `move_to(block_D)`.
    pub fn label(&self, scene: &Scene) -> String {
        match self.argument {
            Some(slot) => format!("{}({})", self.program, scene.slot(slot).name),
            None => self.program.to_string(),
        }
    }

    /// The colour in which it is shown: that of the first body that its argument may show, else that of its program.
    pub fn color(&self, scene: &Scene) -> [u8; 3] {
        let argument = self.argument.map(|slot| scene.slot(slot));
        let body = argument.and_then(|slot| slot.bodies.first());
        body.map_or_else(|| self.program.color(), |&body| scene.body(body).color)
    }
}

/// Probabilities behind a learned policy's choice of a call.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Of the program that was chosen.
    pub program_probability: f32,
    /// That the caller ends with this step.
    pub end_probability: f32,
    /// Of `Start`, for each frame of the caller's window; empty for a primitive.
    pub start_probabilities: Vec<f32>,
    /// Of `End`, likewise.
    pub stop_probabilities: Vec<f32>,
}
