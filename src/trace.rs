//! An episode as a checked value: frames, the tree of program calls, the outcome.
//!
//! An expert's demonstration and a policy's rollout are the same value: same writer, same viewer, same tables.
//!
//! # Invariants
//!
//! [`Episode`] can only be made by [`Episode::new`], which holds every rule of the program tree; see [`TraceError`].
//! No file access and no physics here.

mod boundaries;
mod call;
mod episode;
mod frame;
mod instruction;
mod lanes;
mod noise;
mod observation_rows;
mod outcome;
mod push;
mod recorder;
mod rules;
mod span;
mod specification;

pub use boundaries::{Boundaries, RecordedFrames};
pub use call::{CallId, Prediction, ProgramCall};
pub use episode::{Actor, Episode, EpisodeParts, Provenance};
pub use frame::{Frame, GripperState, Observation};
pub(crate) use instruction::is_sentence;
pub use instruction::{
    Instruction, InstructionError, MAX_WORDS, Vocabulary, Words, instruction_spans, instructions, sentence,
};
pub use lanes::calls_by_depth;
pub use noise::{NoiseError, ObservationNoise};
pub use observation_rows::{ObservationRow, ObservationRowMut, ObservationRows};
pub use outcome::{Cause, Outcome};
pub use push::Push;
pub use recorder::{CallRecorder, NewCall};
pub(crate) use rules::check_argument;
pub use rules::{CallProblem, PushProblem, TraceError, check_calls};
pub use span::{ScopingLabel, Span};
pub use specification::SpecificationForm;
