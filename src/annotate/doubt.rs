//! Why a person should look at an episode.

use std::fmt;

use serde::{Serialize, Serializer};

use crate::program::Program;

/// Something about an episode's labels that does not fit together. Frames are rows of the episode.
#[expect(missing_docs, reason = "the messages say what each field is")]
#[derive(Clone, Debug, PartialEq)]
pub enum Doubt {
    /// A decision was not clear.
    Unsure { call: u32, program: Program, confidence: f32 },
    /// A part begins elsewhere than where the caller is.
    ScopeBegins { call: u32, found: u32, at: u32 },
    /// A program's calls end elsewhere than the part that it was given.
    ScopeEnds { call: u32, found: u32, at: u32 },
    /// The frames end while programs still run.
    Unfinished { program: Program },
    /// The root ends before the demonstration does.
    EndsEarly { frame: u32, last: u32 },
    /// Programs call each other without end.
    Endless,
    /// The gripper is not as the primitive leaves it.
    Gripper { call: u32, program: Program, closed: bool },
    /// The gripper is not above what it moved to.
    Away { call: u32, distance_m: f32 },
    /// Another model says something else.
    Disagreement { model: String },
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsure { call, program, confidence } => {
                write!(f, "call {call} ({program}) has confidence {confidence:.2}")
            }
            Self::ScopeBegins { call, found, at } => {
                write!(f, "call {call} is given frames from {found} on, but is called at frame {at}")
            }
            Self::ScopeEnds { call, found, at } => {
                write!(f, "call {call} is given frames up to {found}, but what it calls ends at frame {at}")
            }
            Self::Unfinished { program } => write!(f, "the frames end while {program} still runs"),
            Self::EndsEarly { frame, last } => {
                write!(f, "the task ends at frame {frame}, but the demonstration goes on to frame {last}")
            }
            Self::Endless => write!(f, "programs call each other without end"),
            Self::Gripper { call, program, closed } => {
                let state = if *closed { "closed" } else { "open" };
                write!(f, "the gripper is {state} after call {call} ({program})")
            }
            Self::Away { call, distance_m } => {
                write!(f, "the gripper is {:.0} cm beside what call {call} moves to", 100.0 * distance_m)
            }
            Self::Disagreement { model } => write!(f, "model {model} says something else"),
        }
    }
}

impl Serialize for Doubt {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
