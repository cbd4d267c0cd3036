//! What the expert would decide in an episode, and where a policy first differs.

use std::fmt;

use crate::model::ScopingKind;
use crate::program::Program;
use crate::scene::{Scene, SlotIndex};
use crate::trace::{CallId, Episode, ProgramCall, Span};

/// How a decision differs from the expert's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DivergenceKind {
    /// Another program was called.
    Program,
    /// The same with another argument.
    Argument,
    /// The same on another part of the demonstration.
    Scope,
    /// The caller ended before it should.
    EarlyEnd,
    /// The caller did not end when it should.
    LateEnd,
}

impl DivergenceKind {
    /// Every kind.
    pub const ALL: [Self; 5] = [Self::Program, Self::Argument, Self::Scope, Self::EarlyEnd, Self::LateEnd];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Program => "program",
            Self::Argument => "argument",
            Self::Scope => "scope",
            Self::EarlyEnd => "early_end",
            Self::LateEnd => "late_end",
        }
    }
}

/// The first decision that differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Divergence {
    /// Number of the decision in the episode, from 0.
    pub decision: u32,
    /// How it differs.
    pub kind: DivergenceKind,
    /// The program that decided.
    pub program: Program,
}

impl Divergence {
    /// The call that it made. Each decision makes one, and the root's is nobody's.
    pub fn call(&self) -> CallId {
        CallId(self.decision + 1)
    }
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "decision {} ({} of {})", self.decision, self.kind.name(), self.program)
    }
}

/// The calls an expert makes to repeat a demonstration in a scene, without the root's: every sub-task once for each
/// body that its source shows, on the *first* part of the demonstration that shows such a sub-task. That part is a
/// function of what is seen, the k-th of several alike is not.
pub fn expected_calls<'d>(demonstration: &'d Episode, scene: &Scene) -> Vec<&'d ProgramCall> {
    let calls = &demonstration.calls;
    let mut expected = Vec::new();
    let mut seen: Vec<Vec<SlotIndex>> = Vec::new();
    for (position, call) in calls.iter().enumerate().filter(|(_, call)| call.caller == Some(CallId(0))) {
        let subtree = subtree(calls, position);
        let arguments: Vec<SlotIndex> = subtree.iter().filter_map(|call| call.argument).collect();
        if call.program == Program::None {
            expected.push(call);
        } else if !seen.contains(&arguments) {
            let times = arguments.first().map_or(1, |&source| scene.slot(source).bodies.len());
            expected.extend((0..times).flat_map(|_| subtree));
            seen.push(arguments);
        }
    }
    expected
}

/// What of the expert's calls a policy is expected to decide; the whole of the specification is `whole`.
pub(super) fn decided_of(scoping: ScopingKind, whole: Option<Span>, calls: &[ProgramCall]) -> Vec<ProgramCall> {
    let unscoped = |call: ProgramCall| ProgramCall { output: call.output.and(whole), ..call };
    match scoping {
        ScopingKind::Scoped => calls.to_vec(),
        ScopingKind::Unscoped | ScopingKind::Arguments => calls.iter().cloned().map(unscoped).collect(),
        ScopingKind::Primitives => {
            let end_of_program = |call: &ProgramCall| call.program == Program::None;
            let decided = calls.iter().filter(|call| !call.program.is_composite());
            decided.map(|call| ProgramCall { end_of_program: end_of_program(call), ..call.clone() }).collect()
        }
    }
}

/// A call and all below it, which follow it in the order of calling.
fn subtree(calls: &[ProgramCall], position: usize) -> &[ProgramCall] {
    let depth = calls[position].depth;
    let after = calls[position + 1..].iter().position(|call| call.depth <= depth);
    &calls[position..after.map_or(calls.len(), |n_below| position + 1 + n_below)]
}

/// How a decision of `program` leaves what is expected; nothing when it does not.
pub(super) fn divergence(
    decision: u32,
    program: Program,
    call: &ProgramCall,
    wanted: Option<&ProgramCall>,
) -> Option<Divergence> {
    let kind = match wanted {
        Some(wanted) => difference(call, wanted),
        None => Some(DivergenceKind::LateEnd),
    };
    kind.map(|kind| Divergence { decision, kind, program })
}

fn difference(call: &ProgramCall, wanted: &ProgramCall) -> Option<DivergenceKind> {
    if call.program != wanted.program {
        Some(match (call.program, wanted.program) {
            (Program::None, _) => DivergenceKind::EarlyEnd,
            (_, Program::None) => DivergenceKind::LateEnd,
            _ => DivergenceKind::Program,
        })
    } else if call.argument != wanted.argument {
        Some(DivergenceKind::Argument)
    } else if call.program.is_composite() && call.output != wanted.output {
        Some(DivergenceKind::Scope)
    } else if call.end_of_program != wanted.end_of_program {
        Some(if call.end_of_program { DivergenceKind::EarlyEnd } else { DivergenceKind::LateEnd })
    } else {
        None
    }
}
