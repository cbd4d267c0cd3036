//! Why a dataset could not be made or read.

use std::path::PathBuf;

use crate::artifact::IoError;
use crate::table::TableError;
use crate::video::VideoError;
use crate::words::counted;

/// A dataset that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ConvertError {
    /// A recording could not be read.
    #[error(transparent)]
    Recording(Box<dyn std::error::Error + Send + Sync>),
    /// A table could not be written.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file could not be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The directory has something in it.
    #[error("a dataset is only written into an empty directory, but there is something in {}", path.display())]
    NotEmpty {
        /// Which directory.
        path: PathBuf,
    },
    /// There is nothing to write.
    #[error("no episode to convert: {failed} failed and were left out, of {failed}")]
    NoEpisodes {
        /// How many episodes failed.
        failed: u64,
    },
    /// A dataset has one width of observation.
    #[error("episode {episode} has {found}, but the episodes before it have {expected}", found = counted(*found, "slot"))]
    Slots {
        /// The episode's number in its recordings.
        episode: u64,
        /// Slots of the dataset.
        expected: usize,
        /// Slots of the episode.
        found: usize,
    },
    /// All episodes of a dataset are of robots with an arm's joints, or of robots without.
    #[error("episode {episode}: its robot has joints and those before it have none, or the other way round")]
    Joints {
        /// The episode's number in its recordings.
        episode: u64,
    },
    /// Targets for joints are asked for where there are none.
    #[error("episode {episode} has no joints; action = \"joints\" is allowed for recordings of an arm")]
    NoJoints {
        /// The episode's number in its recordings.
        episode: u64,
    },
    /// Pictures of a camera cannot be taken over.
    #[error("episode {episode}, camera {camera}: {problem}")]
    Pictures {
        /// The episode's number in its recordings.
        episode: u64,
        /// The camera's name.
        camera: String,
        /// What is wrong.
        problem: String,
    },
    /// A video could not be written.
    #[error(transparent)]
    Video(#[from] VideoError),
    /// Rows are to be made of frames that were not read.
    #[error("episode {episode}: all frames are to be rows, but only its boundary frames were read")]
    FramesMissing {
        /// The episode's number in its recordings.
        episode: u64,
    },
    /// A program saw a frame that is no boundary.
    #[error("episode {episode}, call {call}: frames {begin}..{end} do not begin and end at boundary frames")]
    SpanOffBoundary {
        /// The episode's number in its recordings.
        episode: u64,
        /// Which call.
        call: u32,
        /// First frame of the span.
        begin: u32,
        /// One past its last.
        end: u32,
    },
}

/// A dataset that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// A table could not be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file could not be read.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A row is not what it must be.
    #[error("{}: row {row}: {problem}", path.display())]
    Row {
        /// Which file.
        path: PathBuf,
        /// Which row of the file, from 0.
        row: u64,
        /// What was expected and found.
        problem: String,
    },
    /// A file does not have as many rows as another file says.
    #[error("{}: {problem}", path.display())]
    Count {
        /// Which file.
        path: PathBuf,
        /// What was expected and found.
        problem: String,
    },
    /// An episode's program tree is broken.
    #[error("{}: episode {episode}, call {call}: {problem}", path.display())]
    Call {
        /// The file with the call.
        path: PathBuf,
        /// Which episode.
        episode: i64,
        /// Which call.
        call: u32,
        /// Which rule it breaks.
        problem: String,
    },
    /// An episode is of no use to a learner.
    #[error("{}: episode {episode}: {problem}", path.display())]
    Episode {
        /// The file that says so.
        path: PathBuf,
        /// Which episode.
        episode: i64,
        /// Why not.
        problem: String,
    },
}
