//! Why a recording cannot be written or read, with the place in the file.

use std::path::PathBuf;

use crate::artifact::IoError;
use crate::trace::TraceError;
use crate::video::VideoError;

/// A recording could not be written or read. Positions of episodes count from 0 in their file.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The file does not begin as MCAP files do.
    #[error("not an MCAP file: {}", path.display())]
    NotMcap {
        /// Which file.
        path: PathBuf,
    },
    /// The file ends before its end: it was cut off.
    #[error("cut off near byte {offset}: {}", path.display())]
    Truncated {
        /// Which file.
        path: PathBuf,
        /// How far it could be read, in bytes.
        offset: u64,
    },
    /// The container is damaged: a checksum, a length or a record is wrong.
    #[error("damaged near byte {offset}: {source}: {}", path.display())]
    Damaged {
        /// Which file.
        path: PathBuf,
        /// How far it could be read, in bytes.
        offset: u64,
        /// What is wrong.
        source: Damage,
    },
    /// An MCAP file of someone else: it lacks a record that every recording has.
    #[error("not a recording of ntp: no {record}; `ntp ingest` makes datasets of recordings of others: {}", path.display())]
    Foreign {
        /// Which file.
        path: PathBuf,
        /// The record that is missing.
        record: &'static str,
    },
    /// A recording of another version of the schemas.
    #[error("schema version is {found}, but this ntp reads version {expected}: {}", path.display())]
    SchemaVersion {
        /// Which file.
        path: PathBuf,
        /// As the file says.
        found: String,
        /// As it must be.
        expected: u32,
    },
    /// A recording with another vocabulary of programs.
    #[error("vocabulary is {found}, but this ntp has {expected}: {}", path.display())]
    Vocabulary {
        /// Which file.
        path: PathBuf,
        /// The file's hash.
        found: String,
        /// Hash of [`KnownPrograms::ALL`](crate::program::KnownPrograms::ALL).
        expected: String,
    },
    /// A topic that every recording has is missing.
    #[error("no topic {topic}: {}", path.display())]
    MissingTopic {
        /// Which file.
        path: PathBuf,
        /// Which topic.
        topic: &'static str,
    },
    /// A topic carries another message type than it must.
    #[error("topic {topic} carries {found}, not {expected}: {}", path.display())]
    TopicSchema {
        /// Which file.
        path: PathBuf,
        /// Which topic.
        topic: &'static str,
        /// As the file says.
        found: String,
        /// As it must be.
        expected: &'static str,
    },
    /// A message that cannot be what it should be.
    #[error("episode {episode} of the file: message {sequence} of {topic} at {log_time_nanos} ns: {problem}: {}", path.display())]
    Message {
        /// Which file.
        path: PathBuf,
        /// Which topic.
        topic: String,
        /// Position of the episode that is being read.
        episode: u64,
        /// The message's number in its topic.
        sequence: u32,
        /// The message's time.
        log_time_nanos: u64,
        /// What is wrong.
        problem: MessageProblem,
    },
    /// The messages end before the episode does.
    #[error("episode {episode} of the file has a start but no end: {}", path.display())]
    Unfinished {
        /// Which file.
        path: PathBuf,
        /// Position of the episode.
        episode: u64,
    },
    /// The messages are well formed, but together they are no episode.
    #[error("episode {episode} of the file: {source}: {}", path.display())]
    Trace {
        /// Which file.
        path: PathBuf,
        /// Position of the episode.
        episode: u64,
        /// The rule that does not hold.
        source: TraceError,
    },
    /// A picture that cannot be decoded, or has another size than its camera.
    #[error("episode {episode} of the file, camera {camera}: picture of frame {frame}: {source}: {}", path.display())]
    Picture {
        /// Which file.
        path: PathBuf,
        /// Position of the episode.
        episode: u64,
        /// The camera's name.
        camera: String,
        /// Position of the frame in its episode.
        frame: usize,
        /// Why.
        source: VideoError,
    },
    /// An episode that the file does not have is asked for.
    #[error("no episode {position}, there are {episodes}: {}", path.display())]
    NoSuchEpisode {
        /// Which file.
        path: PathBuf,
        /// What was asked for.
        position: u64,
        /// How many there are.
        episodes: u64,
    },
    /// The MCAP library refused to write.
    #[error("failed to write: {source}: {}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: Box<mcap::McapError>,
    },
    /// An episode cannot be written.
    #[error("episode {episode} cannot be recorded: {problem}: {}", path.display())]
    Unrecordable {
        /// Which file.
        path: PathBuf,
        /// Its number ([`crate::trace::Provenance::index`]).
        episode: u64,
        /// Why.
        problem: EpisodeProblem,
    },
}

/// What is wrong with a container.
#[derive(Debug, thiserror::Error)]
pub enum Damage {
    /// As the MCAP library finds.
    #[error(transparent)]
    Mcap(Box<mcap::McapError>),
    /// The index at the end of the file does not fit what it points to.
    #[error("the index points to no {record}")]
    Index {
        /// What should be there.
        record: &'static str,
    },
    /// The file has no summary section.
    #[error("no summary section")]
    NoSummary,
    /// A message names a channel that was not declared.
    #[error("message {sequence} is of unknown channel {channel}")]
    UnknownChannel {
        /// Number of the channel.
        channel: u16,
        /// Number of the message.
        sequence: u32,
    },
    /// A text is not UTF-8.
    #[error("{record} is not UTF-8")]
    Text {
        /// Where it is.
        record: &'static str,
    },
    /// The log times of messages go back.
    #[error("log time goes back from {before_nanos} to {after_nanos} ns")]
    TimeGoesBack {
        /// Time of a message.
        before_nanos: u64,
        /// Time of the next one.
        after_nanos: u64,
    },
}

/// What is wrong with a message.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MessageProblem {
    /// Not the wire form of its type.
    #[error(transparent)]
    Wire(#[from] prost::DecodeError),
    /// A field ends before its length says.
    #[error("a field is cut off")]
    CutOff,
    /// A part is not there.
    #[error("no {field}")]
    Missing {
        /// Which.
        field: &'static str,
    },
    /// A number does not fit its range.
    #[error("{field} is {found}, out of range")]
    OutOfRange {
        /// Which.
        field: &'static str,
        /// As found.
        found: u64,
    },
    /// A word that is not of its set.
    #[error("unknown {field} {word:?}")]
    UnknownWord {
        /// Which field.
        field: &'static str,
        /// As found.
        word: String,
    },
    /// A program that the vocabulary does not have.
    #[error("unknown program number {number}")]
    UnknownProgram {
        /// As found.
        number: i32,
    },
    /// A span without frames.
    #[error("empty span {begin}..{end}")]
    EmptySpan {
        /// First frame.
        begin: u32,
        /// One past the last.
        end: u32,
    },
    /// A transform of a frame that the scene does not have.
    #[error("unknown frame {frame:?}")]
    UnknownFrame {
        /// Its id.
        frame: String,
    },
    /// A rotation that is not one.
    #[error("rotation of {frame:?} is not a unit quaternion")]
    NotUnit {
        /// Its frame id.
        frame: String,
    },
    /// A number other than the one that must follow.
    #[error("{field} is {found}, not {expected}")]
    Unexpected {
        /// Which field.
        field: &'static str,
        /// As found.
        found: u64,
        /// As it must be.
        expected: u64,
    },
    /// Of what a camera saw.
    #[error("camera {camera}: {problem}")]
    Camera {
        /// The camera's name.
        camera: String,
        /// What is wrong with it.
        problem: Box<MessageProblem>,
    },
    /// A message where none of its kind may be.
    #[error("out of place: {0}")]
    OutOfPlace(&'static str),
}

impl MessageProblem {
    /// As one of a camera's.
    pub(super) fn of_camera(self, camera: &str) -> Self {
        Self::Camera { camera: camera.to_owned(), problem: Box::new(self) }
    }
}

/// Why an episode cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EpisodeProblem {
    /// The name of a body is taken: by another body, the world or the gripper.
    #[error("the frame id {name:?} is taken")]
    NameTaken {
        /// The name.
        name: String,
    },
    /// Calls are not listed in the order of calling: each before its callees, these before its younger siblings.
    #[error("call {call} is not listed in the order of calling")]
    CallOrder {
        /// Its id.
        call: u32,
    },
    /// All episodes of a file are of one family.
    #[error("it is of family {found}, the file's others are of {expected}")]
    Family {
        /// Its own.
        found: &'static str,
        /// The file's.
        expected: &'static str,
    },
    /// All episodes of a file are of robots with an arm's joints, or of robots without.
    #[error("its robot has joints and those of the file's others have none, or the other way round")]
    Joints,
    /// A camera cannot film it.
    #[error("camera {camera}: {message}")]
    Camera {
        /// Its name.
        camera: String,
        /// Why.
        message: String,
    },
    /// All episodes of a file are seen by the same cameras.
    #[error("its cameras, or how they store pictures, are not those of the file's others")]
    Cameras,
    /// Its times do not fit 64 bits of nanoseconds.
    #[error("its times overflow")]
    TimeOverflow,
}
