//! The generated message types, and which topic carries which.
//!
//! # Source
//!
//! `schemas/mcap`, compiled by `build.rs`.

use super::error::MessageProblem;
use crate::program::Program;
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
}

/// The descriptor set of a message type.
macro_rules! descriptor {
    ($message:literal) => {
        include_bytes!(concat!(env!("OUT_DIR"), "/descriptors/", $message, ".binpb"))
    };
}

impl Topic {
    /// Every topic, in the order of their channels.
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
        Self::READ.into_iter().chain([Self::Push])
    }

    /// Those that a reader cannot do without. Recordings from before there were pushes have none of them.
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
        }
    }

    /// The self-contained descriptor set of its message type.
    pub(super) fn descriptor(self) -> &'static [u8] {
        match self {
            Self::EpisodeStart => descriptor!("ntp.v1.EpisodeStart"),
            Self::EpisodeEnd => descriptor!("ntp.v1.EpisodeEnd"),
            Self::Transforms => descriptor!("foxglove.FrameTransforms"),
            Self::Observation => descriptor!("ntp.v1.Observation"),
            Self::Call => descriptor!("ntp.v1.ProgramCall"),
            Self::Return => descriptor!("ntp.v1.ProgramReturn"),
            Self::Stack => descriptor!("ntp.v1.ProgramStack"),
            Self::Scene => descriptor!("foxglove.SceneUpdate"),
            Self::Event => descriptor!("foxglove.Event"),
            Self::Log => descriptor!("foxglove.Log"),
            Self::Push => descriptor!("ntp.v1.Push"),
        }
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
        match self {
            Self::Calibration => descriptor!("foxglove.CameraCalibration"),
            Self::Transform => descriptor!("foxglove.FrameTransforms"),
            Self::Image => descriptor!("foxglove.CompressedImage"),
            Self::Video => descriptor!("foxglove.CompressedVideo"),
        }
    }
}

/// A time of the recording as Foxglove's messages have it.
pub(super) fn timestamp(log_time_nanos: u64) -> Timestamp {
    Timestamp { seconds: (log_time_nanos / 1_000_000_000) as i64, nanos: (log_time_nanos % 1_000_000_000) as i32 }
}

/// The schema's name of a program.
pub(super) fn program_to_proto(program: Program) -> proto::Program {
    match program {
        Program::None => proto::Program::None,
        Program::BlockStacking => proto::Program::BlockStacking,
        Program::ObjectSorting => proto::Program::ObjectSorting,
        Program::PickAndPlace => proto::Program::PickAndPlace,
        Program::PickAndDrop => proto::Program::PickAndDrop,
        Program::Pick => proto::Program::Pick,
        Program::Place => proto::Program::Place,
        Program::Drop => proto::Program::Drop,
        Program::MoveTo => proto::Program::MoveTo,
        Program::Grip => proto::Program::Grip,
        Program::Release => proto::Program::Release,
        Program::TableCleanup => proto::Program::TableCleanup,
    }
}

/// The program behind a number of the schema.
pub(super) fn program_from_proto(number: i32) -> Result<Program, MessageProblem> {
    let unknown = || MessageProblem::UnknownProgram { number };
    match proto::Program::try_from(number).map_err(|_error| unknown())? {
        proto::Program::Idle => Err(unknown()),
        proto::Program::None => Ok(Program::None),
        proto::Program::BlockStacking => Ok(Program::BlockStacking),
        proto::Program::ObjectSorting => Ok(Program::ObjectSorting),
        proto::Program::PickAndPlace => Ok(Program::PickAndPlace),
        proto::Program::PickAndDrop => Ok(Program::PickAndDrop),
        proto::Program::Pick => Ok(Program::Pick),
        proto::Program::Place => Ok(Program::Place),
        proto::Program::Drop => Ok(Program::Drop),
        proto::Program::MoveTo => Ok(Program::MoveTo),
        proto::Program::Grip => Ok(Program::Grip),
        proto::Program::Release => Ok(Program::Release),
        proto::Program::TableCleanup => Ok(Program::TableCleanup),
    }
}
