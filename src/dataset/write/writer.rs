//! Writes a dataset episode by episode, in memory that does not grow with their number.

use std::path::{Path, PathBuf};

use crate::artifact::{IoError, create_dir};
use crate::dataset::ConvertError;
use crate::dataset::config::{ConvertConfig, FailedEpisodes, FrameChoice};
use crate::dataset::tables::view::Source;
use crate::dataset::tables::view::{EpisodeView, ViewBuffers};
use crate::dataset::write::sheaf::Tables;
use crate::dataset::write::summary::ConvertSummary;
use crate::recording::{CameraPictures, Pictured};
use crate::trace::{Boundaries, Episode};

/// A dataset being written.
pub struct DatasetWriter {
    config: ConvertConfig,
    root: PathBuf,
    buffers: ViewBuffers,
    tables: Option<Tables>,
    failed_left_out: u64,
}

impl DatasetWriter {
    /// Begins a dataset in an empty directory, which is made if needed.
    ///
    /// # Errors
    ///
    /// [`ConvertError::NotEmpty`] when there is something in it.
    pub fn create(root: &Path, config: &ConvertConfig) -> Result<Self, ConvertError> {
        create_dir(root)?;
        let mut entries = std::fs::read_dir(root).map_err(IoError::system("read folder", root))?;
        if entries.next().is_some() {
            return Err(ConvertError::NotEmpty { path: root.to_owned() });
        }
        let (config, root) = (config.clone(), root.to_owned());
        Ok(Self { config, root, buffers: ViewBuffers::default(), tables: None, failed_left_out: 0 })
    }

    /// Adds an episode of a recording, named by its file and hash. One that failed may be left out.
    ///
    /// # Errors
    ///
    /// When it has another number of slots than those before, its spans are off its boundaries, or nothing can be
    /// written.
    pub fn append(&mut self, episode: &Episode, file: &str, sha256: &str) -> Result<(), ConvertError> {
        if !self.is_wanted(episode) {
            return Ok(());
        }
        self.append_with(episode, &[], file, sha256)
    }

    /// Adds an episode with what cameras saw of it.
    ///
    /// # Errors
    ///
    /// As [`DatasetWriter::append`]; when its cameras are others than before, or a picture is damaged.
    pub fn append_pictured(
        &mut self,
        pictured: &Pictured<Episode>,
        file: &str,
        sha256: &str,
    ) -> Result<(), ConvertError> {
        if !self.is_wanted(&pictured.episode) {
            return Ok(());
        }
        self.append_with(&pictured.episode, &pictured.cameras, file, sha256)
    }

    fn append_with(
        &mut self,
        episode: &Episode,
        cameras: &[CameraPictures],
        file: &str,
        sha256: &str,
    ) -> Result<(), ConvertError> {
        let view = self.buffers.view(episode, self.config.frames)?;
        append(&mut self.tables, &self.root, &self.config, &view, cameras, Source { file, sha256 })
    }

    /// Adds an episode of which only the boundary frames were read.
    ///
    /// # Errors
    ///
    /// As [`DatasetWriter::append`]; when there are frames between the boundaries, and they should be rows.
    pub fn append_boundaries(&mut self, boundaries: &Boundaries, file: &str, sha256: &str) -> Result<(), ConvertError> {
        self.append_boundaries_with(boundaries, &[], file, sha256)
    }

    /// Adds the boundary frames of an episode with what cameras saw at them.
    ///
    /// # Errors
    ///
    /// As [`DatasetWriter::append_boundaries`] and [`DatasetWriter::append_pictured`].
    pub fn append_pictured_boundaries(
        &mut self,
        pictured: &Pictured<Boundaries>,
        file: &str,
        sha256: &str,
    ) -> Result<(), ConvertError> {
        self.append_boundaries_with(&pictured.episode, &pictured.cameras, file, sha256)
    }

    fn append_boundaries_with(
        &mut self,
        boundaries: &Boundaries,
        cameras: &[CameraPictures],
        file: &str,
        sha256: &str,
    ) -> Result<(), ConvertError> {
        let (episode, recorded) = (boundaries.episode(), boundaries.recorded());
        if self.config.frames == FrameChoice::All && recorded.positions.len() != recorded.count as usize {
            return Err(ConvertError::FramesMissing { episode: episode.provenance.index });
        }
        if !self.is_wanted(episode) {
            return Ok(());
        }
        let view = self.buffers.view_boundaries(boundaries);
        append(&mut self.tables, &self.root, &self.config, &view, cameras, Source { file, sha256 })
    }

    /// Whether an episode is to be written; one that is not is counted.
    fn is_wanted(&mut self, episode: &Episode) -> bool {
        let is_left_out = !episode.outcome.is_success() && self.config.failed == FailedEpisodes::LeaveOut;
        self.failed_left_out += u64::from(is_left_out);
        !is_left_out
    }

    /// Ends the dataset: what is buffered, the statistics and the JSON files.
    ///
    /// # Errors
    ///
    /// [`ConvertError::NoEpisodes`] when none was added; else when something cannot be written.
    pub fn finish(self) -> Result<ConvertSummary, ConvertError> {
        let Self { config, root, tables, failed_left_out, .. } = self;
        let tables = tables.ok_or(ConvertError::NoEpisodes { failed: failed_left_out })?;
        tables.finish(&root, &config, failed_left_out)
    }
}

/// Adds an episode to the tables, which the first one begins. After an error there are none.
fn append(
    tables: &mut Option<Tables>,
    root: &Path,
    config: &ConvertConfig,
    view: &EpisodeView<'_>,
    cameras: &[CameraPictures],
    source: Source<'_>,
) -> Result<(), ConvertError> {
    let mut begun = match tables.take() {
        Some(begun) => begun,
        None => Tables::create(root, config, view.episode, cameras)?,
    };
    begun.append(view, cameras, source, config.fps.get())?;
    *tables = Some(begun);
    Ok(())
}
