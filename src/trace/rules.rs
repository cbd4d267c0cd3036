//! The rules of frames and of the program tree, and what breaks them.

use crate::geometry::Pose;
use crate::program::Program;
use crate::scene::{BodyIndex, Scene, SlotIndex};
use crate::trace::{CallId, Frame, Outcome, ProgramCall, Push, Span};
use crate::words::counted;

/// A rule of the trace that does not hold. `call` and `frame` count from 0.
#[expect(missing_docs, reason = "the messages say what each field is")]
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TraceError {
    #[error("the episode has no frames")]
    NoFrames,
    #[error("the episode's first frame is not a boundary")]
    FirstFrameInside,
    #[error("frame {frame}: its time is not after the frame before")]
    TimeNotIncreasing { frame: usize },
    #[error("frame {frame}: {found} body poses, but the scene has {expected}", expected = counted(*expected, "body"))]
    BodyCount { frame: usize, found: usize, expected: usize },
    #[error("frame {frame}: {found}, but the scene has {expected}", found = counted(*found, "slot"))]
    SlotCount { frame: usize, found: usize, expected: usize },
    #[error("frame {frame}: slot {slot} shows body {body}, which is not one of the slot's bodies")]
    ForeignBody { frame: usize, slot: usize, body: u16 },
    #[error("frame {frame}: a pose is not finite")]
    NotFinite { frame: usize },
    #[error("frame {frame}: it tells joints and the first frame does not, or the other way round")]
    Joints { frame: usize },
    #[error("frame {frame}: body {body} is held, but the scene has {bodies}", bodies = counted(*bodies, "body"))]
    HeldBody { frame: usize, body: u16, bodies: usize },
    #[error("slot {slot} may show body {body}, but the scene has {bodies}", bodies = counted(*bodies, "body"))]
    SlotBody { slot: usize, body: u16, bodies: usize },
    #[error("the episode has no calls")]
    NoCalls,
    #[error("call {call}: {problem}")]
    Call { call: u32, problem: CallProblem },
    #[error("call {call}: frames {span} do not begin and end at boundary frames")]
    OffBoundary { call: u32, span: Span },
    #[error("push {push}: {problem}")]
    Push { push: usize, problem: PushProblem },
}

/// A rule of pushes that one breaks.
#[expect(missing_docs, reason = "the messages say what each field is")]
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PushProblem {
    #[error("its frames {found} are not two or more of the episode's {frames}")]
    Frames { found: Span, frames: usize },
    #[error("its last frame {frame} is not a boundary")]
    OffBoundary { frame: u32 },
    #[error("it begins at frame {begin}, before the push before has come to rest at frame {before}")]
    Overlap { begin: u32, before: u32 },
    #[error("it is of body {body}, but the scene has {bodies}", bodies = counted(*bodies, "body"))]
    Body { body: u16, bodies: usize },
    #[error("its impulse is not finite")]
    NotFinite,
}

/// A rule of the program tree that a call breaks.
#[expect(missing_docs, reason = "the messages say what each field is")]
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CallProblem {
    #[error("its id is {found}, not its position")]
    Misnumbered { found: u32 },
    #[error("the first call must be a composite root without caller, and no other call may be without")]
    Root,
    #[error("its span {found} holds no frame")]
    EmptySpan { found: Span },
    #[error("its caller {caller} does not come before it")]
    CallerAfter { caller: u32 },
    #[error("its caller runs {caller}, which calls nothing")]
    CallerIsLeaf { caller: Program },
    #[error("its depth is {found}, but its caller's is {caller}")]
    Depth { found: u8, caller: u8 },
    #[error("it is step {found} of its caller, but {expected} came before", expected = counted(*expected, "call"))]
    Step { found: u16, expected: u16 },
    #[error("its caller had already ended")]
    AfterEnd,
    #[error("its caller's window is {}, but its input is {input}", caller.map_or_else(|| "nothing".to_owned(), |of| of.to_string()))]
    InputIsNotCallersWindow { input: Span, caller: Option<Span> },
    #[error("its output {output} does not lie inside its input {input}")]
    OutputOutsideInput { input: Span, output: Span },
    #[error("{program} and an output span do not go together as found")]
    OutputPresence { program: Program },
    #[error("its input reaches frame {end}, but the specification has {frames}")]
    BeyondSpecification { end: u32, frames: u32 },
    #[error("its frames {found} do not lie inside its caller's {caller}")]
    FramesOutsideCaller { found: Span, caller: Span },
    #[error("it begins at frame {begin}, before its elder sibling returned at frame {sibling}")]
    SiblingOverlap { begin: u32, sibling: u32 },
    #[error("{program} and {} do not go together", argument.map_or_else(|| "no argument".to_owned(), |slot| format!("slot {} as argument", slot.0)))]
    Argument { program: Program, argument: Option<SlotIndex> },
    #[error("its argument is slot {slot}, but the scene has {slots}, counted from 0")]
    UnknownSlot { slot: u16, slots: usize },
    #[error("the composite {program} returned without ending")]
    NotEnded { program: Program },
}

pub(super) fn check_slots(scene: &Scene) -> Result<(), TraceError> {
    let n_bodies = scene.bodies.len();
    for (slot, value) in scene.slots.iter().enumerate() {
        if let Some(body) = value.bodies.iter().find(|body| usize::from(body.0) >= n_bodies) {
            return Err(TraceError::SlotBody { slot, body: body.0, bodies: n_bodies });
        }
    }
    Ok(())
}

pub(super) fn check_frames(scene: &Scene, frames: &[Frame]) -> Result<(), TraceError> {
    let first = frames.first().ok_or(TraceError::NoFrames)?;
    if !first.boundary {
        return Err(TraceError::FirstFrameInside);
    }
    for (frame, pair) in frames.windows(2).enumerate() {
        if pair[1].time_nanos <= pair[0].time_nanos {
            return Err(TraceError::TimeNotIncreasing { frame: frame + 1 });
        }
    }
    let has_joints = |frame: &Frame| frame.state.joints_rad.is_some();
    if let Some(frame) = frames.iter().position(|frame| has_joints(frame) != has_joints(first)) {
        return Err(TraceError::Joints { frame });
    }
    frames.iter().enumerate().try_for_each(|(frame, value)| check_frame(scene, frame, value))
}

fn check_frame(scene: &Scene, frame: usize, value: &Frame) -> Result<(), TraceError> {
    let (n_bodies, n_slots) = (scene.bodies.len(), scene.slots.len());
    let poses = &value.state.bodies_in_world;
    if poses.len() != n_bodies {
        return Err(TraceError::BodyCount { frame, found: poses.len(), expected: n_bodies });
    }
    if value.slots.len() != n_slots {
        return Err(TraceError::SlotCount { frame, found: value.slots.len(), expected: n_slots });
    }
    let pairs = value.slots.iter().zip(&scene.slots).enumerate();
    if let Some((slot, (body, _))) = pairs.into_iter().find(|(_, (body, slot))| !slot.bodies.contains(body)) {
        return Err(TraceError::ForeignBody { frame, slot, body: body.0 });
    }
    if let Some(body) = value.state.held.filter(|body| usize::from(body.0) >= n_bodies) {
        return Err(TraceError::HeldBody { frame, body: body.0, bodies: n_bodies });
    }
    let all_finite = poses.iter().fold(is_finite(&value.state.gripper_in_world), |all, pose| all & is_finite(pose));
    let are_joints_finite = value.state.joints_rad.is_none_or(|joints| joints.iter().all(|angle| angle.is_finite()));
    if !(all_finite && are_joints_finite) {
        return Err(TraceError::NotFinite { frame });
    }
    Ok(())
}

/// Without a branch per number: every pose of every frame is looked at.
fn is_finite(pose: &Pose) -> bool {
    let finite = |numbers: &[f32]| numbers.iter().fold(true, |all, number| all & number.is_finite());
    finite(pose.translation.vector.as_slice()) & finite(pose.rotation.coords.as_slice())
}

/// Pushes follow one another, each from a frame to a later boundary.
pub(super) fn check_pushes(n_bodies: usize, frames: &[Frame], pushes: &[Push]) -> Result<(), TraceError> {
    let mut before = 0;
    for (number, push) in pushes.iter().enumerate() {
        let problem = |problem| Err(TraceError::Push { push: number, problem });
        let Push { frames: found, body, impulse_ns, toppled } = push;
        let has_two = found.begin.checked_add(2).is_some_and(|least| least <= found.end);
        let Some(last) = frames.get(found.end.saturating_sub(1) as usize).filter(|_| has_two) else {
            return problem(PushProblem::Frames { found: *found, frames: frames.len() });
        };
        if !last.boundary {
            return problem(PushProblem::OffBoundary { frame: found.last() });
        }
        if found.begin < before {
            return problem(PushProblem::Overlap { begin: found.begin, before });
        }
        if let Some(&BodyIndex(body)) = [body].into_iter().chain(toppled).find(|body| usize::from(body.0) >= n_bodies) {
            return problem(PushProblem::Body { body, bodies: n_bodies });
        }
        if !impulse_ns.iter().all(|part| part.is_finite()) {
            return problem(PushProblem::NotFinite);
        }
        before = found.last();
    }
    Ok(())
}

/// Holds every rule of the program tree, for calls among `n_frames` frames whose arguments are among `n_slots` slots.
///
/// # Errors
///
/// The first rule that does not hold.
pub fn check_calls(
    n_slots: usize,
    n_frames: u32,
    specification_frames: u32,
    calls: &[ProgramCall],
    outcome: Outcome,
) -> Result<(), TraceError> {
    if calls.is_empty() {
        return Err(TraceError::NoCalls);
    }
    let mut progress = vec![CallProgress::default(); calls.len()];
    for (position, call) in calls.iter().enumerate() {
        let in_tree = |()| match call.caller {
            None => check_root(position, call, n_frames, specification_frames),
            Some(caller) => check_callee(position, call, caller, calls, &mut progress),
        };
        check_spans(call)
            .and_then(in_tree)
            .and_then(|()| check_alone(n_slots, position, call))
            .map_err(|problem| TraceError::Call { call: position as u32, problem })?;
    }
    if outcome.is_success() {
        let open = calls.iter().zip(&progress).find(|(call, seen)| call.program.is_composite() && !seen.ended);
        if let Some((call, _)) = open {
            return Err(TraceError::Call { call: call.id.0, problem: CallProblem::NotEnded { program: call.program } });
        }
    }
    Ok(())
}

/// What has been seen of a call's callees.
#[derive(Clone, Default)]
struct CallProgress {
    n_callees: u16,
    ended: bool,
    last_return: u32,
}

fn check_spans(call: &ProgramCall) -> Result<(), CallProblem> {
    let spans = [Some(call.input), call.output, Some(call.frames)];
    match spans.into_iter().flatten().find(|span| span.is_empty()) {
        Some(found) => Err(CallProblem::EmptySpan { found }),
        None => Ok(()),
    }
}

fn check_root(
    position: usize,
    call: &ProgramCall,
    n_frames: u32,
    specification_frames: u32,
) -> Result<(), CallProblem> {
    if position != 0 || !call.program.is_composite() || call.depth != 0 || call.step != 0 || call.end_of_program {
        return Err(CallProblem::Root);
    }
    if call.input.end > specification_frames {
        return Err(CallProblem::BeyondSpecification { end: call.input.end, frames: specification_frames });
    }
    if call.frames.end > n_frames {
        let caller = Span { begin: 0, end: n_frames };
        return Err(CallProblem::FramesOutsideCaller { found: call.frames, caller });
    }
    Ok(())
}

fn check_callee(
    position: usize,
    call: &ProgramCall,
    CallId(caller_id): CallId,
    calls: &[ProgramCall],
    progress: &mut [CallProgress],
) -> Result<(), CallProblem> {
    if caller_id as usize >= position {
        return Err(CallProblem::CallerAfter { caller: caller_id });
    }
    let caller = &calls[caller_id as usize];
    let seen = &mut progress[caller_id as usize];
    if !caller.program.is_composite() {
        return Err(CallProblem::CallerIsLeaf { caller: caller.program });
    }
    if call.depth != caller.depth.saturating_add(1) {
        return Err(CallProblem::Depth { found: call.depth, caller: caller.depth });
    }
    if call.step != seen.n_callees {
        return Err(CallProblem::Step { found: call.step, expected: seen.n_callees });
    }
    if seen.ended {
        return Err(CallProblem::AfterEnd);
    }
    if Some(call.input) != caller.output {
        return Err(CallProblem::InputIsNotCallersWindow { input: call.input, caller: caller.output });
    }
    if !caller.frames.contains(call.frames) {
        return Err(CallProblem::FramesOutsideCaller { found: call.frames, caller: caller.frames });
    }
    if seen.n_callees > 0 && call.frames.begin < seen.last_return {
        return Err(CallProblem::SiblingOverlap { begin: call.frames.begin, sibling: seen.last_return });
    }
    *seen = CallProgress { n_callees: seen.n_callees + 1, ended: call.end_of_program, last_return: call.frames.last() };
    Ok(())
}

fn check_alone(n_slots: usize, position: usize, call: &ProgramCall) -> Result<(), CallProblem> {
    let ProgramCall {
        id,
        caller: _,
        depth: _,
        step: _,
        program,
        argument,
        input,
        output,
        frames: _,
        end_of_program,
        prediction: _,
    } = call;
    if id.0 as usize != position {
        return Err(CallProblem::Misnumbered { found: id.0 });
    }
    if output.is_some() == (*program == Program::None) || (*program == Program::None && !end_of_program) {
        return Err(CallProblem::OutputPresence { program: *program });
    }
    if let Some(output) = output.filter(|&output| !input.contains(output)) {
        return Err(CallProblem::OutputOutsideInput { input: *input, output });
    }
    check_argument(n_slots, *program, *argument)
}

/// Whether a call of a program has the argument that it needs, in a scene of so many slots.
pub(crate) fn check_argument(n_slots: usize, program: Program, argument: Option<SlotIndex>) -> Result<(), CallProblem> {
    if argument.is_some() != program.takes_argument() {
        return Err(CallProblem::Argument { program, argument });
    }
    match argument.filter(|slot| usize::from(slot.0) >= n_slots) {
        Some(slot) => Err(CallProblem::UnknownSlot { slot: slot.0, slots: n_slots }),
        None => Ok(()),
    }
}
