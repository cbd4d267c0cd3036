//! Program calls to and from `ntp.v1.ProgramCall` and `ntp.v1.ProgramReturn`, and their order in time.

use super::error::{EpisodeProblem, MessageProblem};
use super::schema::{program_from_proto, program_to_proto, proto};
use super::start::narrow;
use crate::scene::SlotIndex;
use crate::trace::{CallId, Prediction, ProgramCall, Span};

/// A call begins or returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Step {
    Call(usize),
    Return(usize),
}

/// Beginnings and returns of calls in the order in which they happen, each with its frame. Frames never go back: calls
/// lie in their callers and follow their elder siblings.
pub(super) fn steps(calls: &[ProgramCall]) -> Result<Vec<(u32, Step)>, EpisodeProblem> {
    let mut steps = Vec::with_capacity(2 * calls.len());
    let mut running: Vec<usize> = Vec::new();
    let returned = |position: usize| (calls[position].frames.last(), Step::Return(position));
    for (position, call) in calls.iter().enumerate() {
        let caller = call.caller.map(|CallId(caller)| caller as usize);
        while let Some(&last) = running.last().filter(|&&last| Some(last) != caller) {
            steps.push(returned(last));
            running.pop();
        }
        if running.last().copied() != caller {
            return Err(EpisodeProblem::CallOrder { call: call.id.0 });
        }
        running.push(position);
        steps.push((call.frames.begin, Step::Call(position)));
    }
    steps.extend(running.into_iter().rev().map(returned));
    Ok(steps)
}

pub(super) fn encode_call(call: &ProgramCall) -> proto::ProgramCall {
    let ProgramCall { id, caller, depth, step, program, argument, input, output, frames, end_of_program, prediction } =
        call;
    let span = |span: &Span| proto::Span { begin: span.begin, end: span.end };
    proto::ProgramCall {
        call: id.0,
        caller: caller.map(|caller| caller.0),
        depth: u32::from(*depth),
        step: u32::from(*step),
        program: program_to_proto(*program),
        argument: argument.map(|slot| u32::from(slot.0)),
        input: Some(span(input)),
        output: output.as_ref().map(span),
        frame: frames.begin,
        end_of_program: *end_of_program,
        prediction: prediction.as_ref().map(encode_prediction),
    }
}

fn encode_prediction(prediction: &Prediction) -> proto::Prediction {
    let Prediction { program_probability, end_probability, start_probabilities, stop_probabilities } = prediction;
    proto::Prediction {
        program_probability: *program_probability,
        end_probability: *end_probability,
        start_probabilities: start_probabilities.clone(),
        stop_probabilities: stop_probabilities.clone(),
    }
}

pub(super) fn encode_return(call: &ProgramCall) -> proto::ProgramReturn {
    proto::ProgramReturn { call: call.id.0, program: program_to_proto(call.program), frame: call.frames.last() }
}

/// A call that has not returned yet: its span of frames is empty, at the frame of the call.
pub(super) fn decode_call(message: &mut proto::ProgramCall) -> Result<ProgramCall, MessageProblem> {
    let prediction = message.prediction.take().map(|prediction| {
        let proto::Prediction { program_probability, end_probability, start_probabilities, stop_probabilities } =
            prediction;
        Prediction { program_probability, end_probability, start_probabilities, stop_probabilities }
    });
    let argument = message.argument.map(|slot| narrow("argument", slot).map(SlotIndex)).transpose()?;
    Ok(ProgramCall {
        id: CallId(message.call),
        caller: message.caller.map(CallId),
        depth: narrow("depth", message.depth)?,
        step: narrow("step", message.step)?,
        program: program_from_proto(message.program)?,
        argument,
        input: decode_span(&message.input.ok_or(MessageProblem::Missing { field: "input" })?)?,
        output: message.output.as_ref().map(decode_span).transpose()?,
        frames: Span { begin: message.frame, end: message.frame },
        end_of_program: message.end_of_program,
        prediction,
    })
}

pub(super) fn decode_span(&proto::Span { begin, end }: &proto::Span) -> Result<Span, MessageProblem> {
    Span::new(begin, end).ok_or(MessageProblem::EmptySpan { begin, end })
}

/// Ends the call that a message names.
pub(super) fn decode_return(message: &proto::ProgramReturn, calls: &mut [ProgramCall]) -> Result<(), MessageProblem> {
    let call = calls.get_mut(message.call as usize).ok_or(MessageProblem::OutOfPlace("it returns from no call"))?;
    if has_returned(call) {
        return Err(MessageProblem::OutOfPlace("the call has returned before"));
    }
    if program_from_proto(message.program)? != call.program {
        return Err(MessageProblem::OutOfPlace("another program was called"));
    }
    let out_of_range = MessageProblem::OutOfRange { field: "frame", found: u64::from(message.frame) };
    let end = message.frame.checked_add(1).filter(|&end| call.frames.begin < end).ok_or(out_of_range)?;
    call.frames.end = end;
    Ok(())
}

/// Whether the return of a call has been read.
pub(super) fn has_returned(call: &ProgramCall) -> bool {
    !call.frames.is_empty()
}
