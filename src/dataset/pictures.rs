//! Pictures in a dataset: image columns and video files, written beside the tables and read back episode by episode.
//!
//! A camera's pictures are the feature `observation.images.NAME`: PNG in a column of `data/` (`struct<bytes, path>`), or
//! H.264 in `videos/FEATURE/chunk-000/file-000.mp4`, whose samples are copied from the recordings.

mod loader;
mod measure;
mod open_files;
mod places;
mod read;
mod shelf;
mod statistics;
mod video;
mod write;

pub use loader::{EpisodeRows, PictureLoader};
pub(super) use measure::PictureMeasure;
pub use read::EpisodePictures;
pub use shelf::Wanted;
pub(crate) use statistics::PictureStatistics;
pub(super) use video::VideoFiles;
pub(super) use write::PictureFeatures;

use crate::table::{ColumnKind, Form, Value};

/// Before the camera's name.
pub(super) const PREFIX: &str = "observation.images.";

/// Columns of `meta/episodes/` about a video: where an episode's pictures are.
pub(super) fn video_columns(feature: &str) -> [(String, ColumnKind); 4] {
    let kind = |value| ColumnKind { value, form: Form::Required };
    let named = |name: &str, value| (format!("videos/{feature}/{name}"), kind(value));
    [
        named("chunk_index", Value::Int64),
        named("file_index", Value::Int64),
        named("from_timestamp", Value::Float64),
        named("to_timestamp", Value::Float64),
    ]
}
