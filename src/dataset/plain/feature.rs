//! What a dataset's features are, what a frame has of them, and why they cannot be written.

use crate::artifact::IoError;
use crate::dataset::files::info::Dtype;
use crate::dataset::plain::picture::Picture;
use crate::dataset::plain::video::Packet;
use crate::table::TableError;
use crate::video::VideoError;

/// A dataset that could not be written.
#[derive(Debug, thiserror::Error)]
pub enum PlainError {
    /// A table could not be written.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A file could not be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A picture cannot be encoded, decoded or stored.
    #[error("{feature}: {source}")]
    Picture {
        /// Of which feature.
        feature: String,
        /// Why.
        source: VideoError,
    },
    /// There is nothing to write.
    #[error("no episode")]
    NoEpisode,
}

/// What a feature holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum PlainKind {
    /// Numbers of one type, by name: one for each.
    Numbers(Dtype, Vec<String>),
    /// A text.
    Text,
    /// An encoded picture of this width and height, in the table.
    Image([u32; 2]),
    /// The same as H.264, in video files.
    Video([u32; 2]),
}

/// A feature of a dataset.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlainFeature {
    pub(crate) name: String,
    pub(crate) kind: PlainKind,
}

/// What a feature holds in a frame.
#[derive(Clone, Debug)]
pub(crate) enum Cell {
    Numbers(Vec<f64>),
    Text(String),
    Image(Picture),
    /// Packets of a video, of which the last one is shown with the frame; those before are needed to decode it.
    Video(Vec<Packet>),
}
