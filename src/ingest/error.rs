//! Why recordings cannot become a dataset.

use std::path::PathBuf;

use crate::artifact::{IoError, StagingError};
use crate::dataset::plain::PlainError;
use crate::recording::RecordingError;
use crate::video::VideoError;

/// Recordings that cannot become a dataset.
#[derive(Debug, thiserror::Error)]
pub enum IngestError {
    /// The map is no map.
    #[error("{}: {problem}", path.display())]
    Map {
        /// Which file.
        path: PathBuf,
        /// What is wrong, where, and what is allowed.
        problem: String,
    },
    /// A file is given more than once.
    #[error("each of its messages would be there twice, since it is given twice: {}", path.display())]
    Twice {
        /// Which file.
        path: PathBuf,
    },
    /// A file is damaged.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A file lacks a topic that the map names, or has no message of it that can be used.
    #[error("feature {feature}: no usable message of topic {topic}{why}; topics are {}: {}", if topics.is_empty() { "none".to_owned() } else { topics.join(", ") }, path.display())]
    NoTopic {
        /// Which file.
        path: PathBuf,
        /// For which feature.
        feature: String,
        /// Which topic.
        topic: String,
        /// What was wrong with the first one that there is, after a colon.
        why: String,
        /// Topics of the file.
        topics: Vec<String>,
    },
    /// Messages that are encoded in a way that is not read.
    #[error("topic {topic}: {problem}: {}", path.display())]
    Encoding {
        /// Which file.
        path: PathBuf,
        /// Which topic.
        topic: String,
        /// What was found, and what is read.
        problem: String,
    },
    /// A video has fewer pictures than rows.
    #[error(
        "feature {feature}: two rows at {secs:.3} s show one picture of {topic}, which a video that is not encoded again \
         cannot; choose a lower fps, or store = \"png\" or \"h264\": {}",
        path.display()
    )]
    Repeated {
        /// Which file.
        path: PathBuf,
        /// Which feature.
        feature: String,
        /// Which topic.
        topic: String,
        /// When, from the file's first message.
        secs: f64,
    },
    /// No text of the task before an episode's first row.
    #[error("no text on topic {topic} before the episode at {secs:.3} s: {}", path.display())]
    NoTask {
        /// Which file.
        path: PathBuf,
        /// Which topic.
        topic: String,
        /// When, from the file's first message.
        secs: f64,
    },
    /// No episode came of all files.
    #[error("no episode: nowhere do all features have values that are young enough ({told})")]
    NoEpisode {
        /// What became of the messages.
        told: String,
    },
    /// A picture cannot be encoded.
    #[error("feature {feature}: {source}")]
    Encode {
        /// Which feature.
        feature: String,
        /// Why.
        source: VideoError,
    },
    /// The dataset cannot be written.
    #[error(transparent)]
    Dataset(#[from] PlainError),
    /// The folder cannot be made.
    #[error(transparent)]
    Staging(#[from] StagingError),
    /// A file cannot be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
}
