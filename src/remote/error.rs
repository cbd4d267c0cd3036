//! What a robot did that the protocol does not allow.

use crate::remote::wire::MAX_LINE_BYTES;
use crate::words::counted;

/// A robot that cannot be acted with any longer, and why.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("robot {robot}, asked to {method}: {problem}")]
pub struct RemoteError {
    /// Where the robot is.
    pub robot: String,
    /// What it had been asked.
    pub method: &'static str,
    /// What is wrong.
    pub problem: RemoteProblem,
}

/// What is wrong with an answer.
#[expect(missing_docs, reason = "the messages say what each field is")]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RemoteProblem {
    #[error(transparent)]
    Link(#[from] LinkProblem),
    #[error("its line is not a message: {problem}")]
    Json { problem: String },
    #[error("it answers request {found:?}, but {expected} was asked")]
    Id { found: Option<u64>, expected: u64 },
    #[error("it answers with an error: {message}")]
    Refused { message: String },
    #[error("its {part} is not as the protocol asks: {problem}")]
    Part { part: &'static str, problem: String },
    #[error("it speaks protocol {found}; allowed: {expected}")]
    Protocol { found: u32, expected: u32 },
    #[error("it reports more than {most} in one action", most = counted(*most, "frame"))]
    TooManyFrames { most: usize },
    #[error("its time goes from {before} ns to {now} ns; time must grow")]
    Time { before: u64, now: u64 },
    #[error("it cannot {capability}; it can: {able}")]
    Incapable { capability: &'static str, able: String },
    #[error("it reports the cause {found:?}; allowed: {allowed}")]
    Cause { found: String, allowed: String },
    #[error("it names {what} {found:?}; the scene has: {allowed}")]
    Name { what: &'static str, found: String, allowed: String },
    #[error("it does not say where {name} is")]
    Missing { name: String },
    #[error("its {what} is {found}; allowed: {allowed}")]
    Value { what: String, found: String, allowed: &'static str },
    #[error("its {what} {position} of the scene is {found}, but {expected} was asked for")]
    Scene { what: &'static str, position: usize, found: String, expected: String },
}

/// What is wrong with the way to a robot.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LinkProblem {
    /// The program could not be started, or nobody listens.
    #[error("it cannot be reached: {0}")]
    Unreachable(String),
    /// Its end is closed.
    #[error("it has gone")]
    Gone,
    /// It did not answer in time.
    #[error("no answer within {0} s")]
    Late(u64),
    /// Its line does not end.
    #[error("its line is longer than {MAX_LINE_BYTES} bytes")]
    TooLong,
    /// Its line is no text.
    #[error("its line is not UTF-8")]
    NotText,
    /// The user ended the command.
    #[error("interrupted")]
    Interrupted,
}
