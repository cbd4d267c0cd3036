//! The generated message types, and which topic carries which.
//!
//! # Source
//!
//! `schemas/mcap`, compiled by `build.rs`.

use super::error::MessageProblem;
use crate::program::{KnownPrograms, Program};
use crate::render::PictureFormat;

/// Version of topics and messages. Raised when a reader of the version before could misread.
pub(super) const SCHEMA_VERSION: u32 = 1;

#[expect(clippy::all, clippy::doc_markdown, unreachable_pub, reason = "generated")]
mod generated {
    include!(concat!(env!("OUT_DIR"), "/schemas.rs"));
}

pub(super) use generated::google::protobuf::Timestamp;
pub(super) use generated::{foxglove, ntp::v1 as proto};

/// A channel of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Topic {
    EpisodeStart,
    EpisodeEnd,
    Transforms,
    Observation,
    Call,
    Return,
    Stack,
    Scene,
    Event,
    Log,
    Push,
    /// Of an arm alone.
    JointStates,
}

/// Message type, number of programs known, descriptor set.
static DESCRIPTORS: &[(&str, usize, &[u8])] = include!(concat!(env!("OUT_DIR"), "/descriptors.rs"));

/// The self-contained descriptor set of a message type that a channel may carry, in a recording that knows so many
/// programs.
fn descriptor(message: &str, known: KnownPrograms) -> &'static [u8] {
    let of_message = DESCRIPTORS.iter().filter(|(name, _, _)| *name == message);
    let fitting = of_message.filter(|(_, n_programs, _)| *n_programs <= known.count());
    fitting.max_by_key(|(_, n_programs, _)| *n_programs).map_or(&[], |(_, _, bytes)| *bytes)
}

impl Topic {
    /// Every topic that each recording has, in the order of their channels.
    pub(super) const ALL: [Self; 11] = [
        Self::EpisodeStart,
        Self::EpisodeEnd,
        Self::Transforms,
        Self::Observation,
        Self::Call,
        Self::Return,
        Self::Stack,
        Self::Scene,
        Self::Event,
        Self::Log,
        Self::Push,
    ];

    /// Those that a reader reads; the others are for viewers.
    pub(super) fn read() -> impl Iterator<Item = Self> {
        Self::READ.into_iter().chain([Self::Push, Self::JointStates])
    }

    /// Those that a reader cannot do without. Recordings from before there were pushes have none of them, and those of
    /// a gripper without an arm no joints.
    pub(super) const READ: [Self; 6] =
        [Self::EpisodeStart, Self::EpisodeEnd, Self::Transforms, Self::Observation, Self::Call, Self::Return];

    /// Its name in the file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::EpisodeStart => "/ntp/episode/start",
            Self::EpisodeEnd => "/ntp/episode/end",
            Self::Transforms => "/tf",
            Self::Observation => "/ntp/observation",
            Self::Call => "/ntp/call",
            Self::Return => "/ntp/return",
            Self::Stack => "/ntp/stack",
            Self::Scene => "/scene",
            Self::Event => "/ntp/event",
            Self::Log => "/log",
            Self::Push => "/ntp/push",
            Self::JointStates => "/joint_states",
        }
    }

    /// The full name of its message type.
    pub(super) fn message(self) -> &'static str {
        match self {
            Self::EpisodeStart => "ntp.v1.EpisodeStart",
            Self::EpisodeEnd => "ntp.v1.EpisodeEnd",
            Self::Transforms => "foxglove.FrameTransforms",
            Self::Observation => "ntp.v1.Observation",
            Self::Call => "ntp.v1.ProgramCall",
            Self::Return => "ntp.v1.ProgramReturn",
            Self::Stack => "ntp.v1.ProgramStack",
            Self::Scene => "foxglove.SceneUpdate",
            Self::Event => "foxglove.Event",
            Self::Log => "foxglove.Log",
            Self::Push => "ntp.v1.Push",
            Self::JointStates => "foxglove.JointStates",
        }
    }

    /// The self-contained descriptor set of its message type.
    pub(super) fn descriptor(self, known: KnownPrograms) -> &'static [u8] {
        descriptor(self.message(), known)
    }
}

/// A topic of a camera: `/camera/NAME/KIND`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum CameraTopic {
    /// What the camera is.
    Calibration,
    /// Where it is.
    Transform,
    /// Pictures, each by itself.
    Image,
    /// Pictures as a video.
    Video,
}

impl CameraTopic {
    const ALL: [Self; 4] = [Self::Calibration, Self::Transform, Self::Image, Self::Video];

    /// The topic of pictures in a format.
    pub(super) fn pictures(format: PictureFormat) -> Self {
        match format {
            PictureFormat::Png => Self::Image,
            PictureFormat::H264 => Self::Video,
        }
    }

    fn kind(self) -> &'static str {
        match self {
            Self::Calibration => "calibration",
            Self::Transform => "tf",
            Self::Image => "image",
            Self::Video => "video",
        }
    }

    /// Its name in the file, for the camera of a name.
    pub(super) fn name(self, camera: &str) -> String {
        format!("/camera/{camera}/{}", self.kind())
    }

    /// The camera's name and the topic behind a name in a file.
    pub(super) fn from_name(topic: &str) -> Option<(&str, Self)> {
        let (camera, kind) = topic.strip_prefix("/camera/")?.rsplit_once('/')?;
        Some((camera, Self::ALL.into_iter().find(|topic| topic.kind() == kind)?))
    }

    /// The full name of its message type.
    pub(super) fn message(self) -> &'static str {
        match self {
            Self::Calibration => "foxglove.CameraCalibration",
            Self::Transform => "foxglove.FrameTransforms",
            Self::Image => "foxglove.CompressedImage",
            Self::Video => "foxglove.CompressedVideo",
        }
    }

    /// The self-contained descriptor set of its message type.
    pub(super) fn descriptor(self) -> &'static [u8] {
        descriptor(self.message(), KnownPrograms::FIRST)
    }
}

/// A time of the recording as Foxglove's messages have it.
pub(super) fn timestamp(log_time_nanos: u64) -> Timestamp {
    Timestamp { seconds: (log_time_nanos / 1_000_000_000) as i64, nanos: (log_time_nanos % 1_000_000_000) as i32 }
}

/// The schema's number of a program: 0 is that of no program.
pub(super) fn program_to_proto(program: Program) -> i32 {
    program.index() as i32 + 1
}

/// The program behind a number of the schema.
pub(super) fn program_from_proto(number: i32) -> Result<Program, MessageProblem> {
    let index = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
    index.and_then(Program::from_index).ok_or(MessageProblem::UnknownProgram { number })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_have_the_schemas_names_and_numbers() {
        for program in Program::ALL {
            let number = program_to_proto(program);
            let name = proto::Program::try_from(number).map(|named| named.as_str_name().to_lowercase());
            assert_eq!(name.as_deref(), Ok(program.name()));
            assert_eq!(program_from_proto(number).ok(), Some(program));
        }
        let n_programs = Program::ALL.len() as i32;
        for number in [i32::MIN, -1, proto::Program::Idle as i32, n_programs + 1, i32::MAX] {
            assert!(program_from_proto(number).is_err(), "{number}");
        }
        assert!(proto::Program::try_from(n_programs + 1).is_err(), "the schema has no program that is not there");
    }

    #[test]
    fn every_message_type_has_its_descriptor() {
        for topic in Topic::ALL {
            assert!(!topic.descriptor(KnownPrograms::FIRST).is_empty(), "{topic:?}");
        }
        for topic in CameraTopic::ALL {
            assert!(!topic.descriptor().is_empty(), "{topic:?}");
        }
    }
}
