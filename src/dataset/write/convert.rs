//! Recordings in, one dataset out.

use std::path::Path;

use crate::dataset::ConvertError;
use crate::dataset::config::ConvertConfig;
use crate::dataset::write::summary::ConvertSummary;
use crate::dataset::write::writer::DatasetWriter;
use crate::recording::Pictured;
use crate::trace::{Boundaries, Episode};

/// One recording: its name and hash, and its episodes in order.
#[derive(Clone, Debug)]
pub struct RecordingEpisodes<I> {
    /// As it shall stand in the provenance, relative to the folder of the recordings.
    pub file: String,
    /// SHA-256 of the file in hexadecimal.
    pub sha256: String,
    /// Its episodes; read one by one.
    pub episodes: I,
}

/// What can be a part of a dataset: an [`Episode`], or the [`Boundaries`] of one.
pub trait RecordedEpisode {
    /// Adds it to a dataset, as [`DatasetWriter::append`] does.
    ///
    /// # Errors
    ///
    /// What the writer says.
    fn append_to(&self, writer: &mut DatasetWriter, file: &str, sha256: &str) -> Result<(), ConvertError>;
}

impl RecordedEpisode for Episode {
    fn append_to(&self, writer: &mut DatasetWriter, file: &str, sha256: &str) -> Result<(), ConvertError> {
        writer.append(self, file, sha256)
    }
}

impl RecordedEpisode for Boundaries {
    fn append_to(&self, writer: &mut DatasetWriter, file: &str, sha256: &str) -> Result<(), ConvertError> {
        writer.append_boundaries(self, file, sha256)
    }
}

impl RecordedEpisode for Pictured<Episode> {
    fn append_to(&self, writer: &mut DatasetWriter, file: &str, sha256: &str) -> Result<(), ConvertError> {
        writer.append_pictured(self, file, sha256)
    }
}

impl RecordedEpisode for Pictured<Boundaries> {
    fn append_to(&self, writer: &mut DatasetWriter, file: &str, sha256: &str) -> Result<(), ConvertError> {
        writer.append_pictured_boundaries(self, file, sha256)
    }
}

/// Writes recordings as a dataset into an empty directory.
///
/// Episodes are numbered as they come. Memory holds one episode, some thousand rows of each table, and the distinct
/// task texts, whatever the number of episodes. The same episodes give the same bytes.
///
/// # Errors
///
/// The first error of a recording, or what [`DatasetWriter`] says. What was written so far is then left in the
/// directory, without `meta/info.json`.
pub fn convert<R, I, T, E>(
    recordings: R,
    config: &ConvertConfig,
    directory: &Path,
) -> Result<ConvertSummary, ConvertError>
where
    R: IntoIterator<Item = Result<RecordingEpisodes<I>, E>>,
    I: IntoIterator<Item = Result<T, E>>,
    T: RecordedEpisode,
    E: std::error::Error + Send + Sync + 'static,
{
    let mut writer = DatasetWriter::create(directory, config)?;
    for recording in recordings {
        let RecordingEpisodes { file, sha256, episodes } = recording.map_err(from_recording)?;
        for episode in episodes {
            episode.map_err(from_recording)?.append_to(&mut writer, &file, &sha256)?;
        }
    }
    writer.finish()
}

fn from_recording(error: impl std::error::Error + Send + Sync + 'static) -> ConvertError {
    ConvertError::Recording(Box::new(error))
}
