//! The samples of a dataset's videos, episode by episode, as they lie in the files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, BinaryArray};
use arrow::datatypes::{Float64Type, Int64Type};

use crate::dataset::DatasetError;
use crate::dataset::edit::source::{Source, SourceEpisode};
use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::{CameraInfo, Info};
use crate::dataset::files::layout::FilePlace;
use crate::dataset::pictures::video_columns;
use crate::video::{Mp4Reader, VideoError};

/// Reads the samples of one feature; the file that was read last stays open.
pub(super) struct Samples {
    feature: String,
    open: Option<(PathBuf, Mp4Reader)>,
}

impl Samples {
    pub(super) fn new(feature: &str) -> Self {
        Self { feature: feature.to_owned(), open: None }
    }

    /// One for each video that can be read.
    pub(super) fn of_all(info: &Info) -> Vec<Self> {
        let is_video = |dtype, camera: Option<&CameraInfo>| {
            dtype == Dtype::Video && camera.is_some_and(|camera| camera.codec() == "h264")
        };
        let videos = info.features.0.iter().filter(|(_, feature)| is_video(feature.dtype, feature.info.as_ref()));
        videos.map(|(name, _)| Self::new(name)).collect()
    }

    /// The packets of an episode, one a frame.
    pub(super) fn read(&mut self, episode: &SourceEpisode, source: &Source) -> Result<Vec<Vec<u8>>, DatasetError> {
        let failed = |path: &Path, problem: String| DatasetError::Episode {
            path: path.to_owned(),
            episode: episode.row.episode_index,
            problem,
        };
        let (file, from_secs) = video_place(episode, &self.feature)
            .ok_or_else(|| failed(source.root(), format!("{}: no place of its video is given", self.feature)))?;
        let path = source.root().join(file.video(&self.feature));
        let first = (from_secs * source.info.fps).round() as usize;
        let n_samples = usize::try_from(episode.row.n_frames).unwrap_or(0);
        let packets = self.packets(&path, first, n_samples);
        packets.map_err(|error| failed(&path, format!("{}: {error}", self.feature)))
    }

    /// The same as a column.
    pub(super) fn column(
        &mut self,
        episode: &SourceEpisode,
        source: &Source,
    ) -> Result<(String, ArrayRef), DatasetError> {
        let packets = self.read(episode, source)?;
        Ok((self.feature.clone(), Arc::new(BinaryArray::from_iter_values(packets))))
    }

    /// What a decoder must know of the file that was read last.
    pub(super) fn parameter_sets(&self) -> &[u8] {
        self.open.as_ref().map_or(&[], |(_, reader)| reader.parameter_sets())
    }

    fn packets(&mut self, path: &Path, first: usize, n_samples: usize) -> Result<Vec<Vec<u8>>, VideoError> {
        let (_, reader) = match self.open.take() {
            Some(open) if open.0 == path => self.open.insert(open),
            _ => self.open.insert((path.to_owned(), Mp4Reader::open(path)?)),
        };
        let packet = |sample: usize| {
            let mut packet = Vec::new();
            reader.read(first.saturating_add(sample), &mut packet)?;
            Ok(packet)
        };
        (0..n_samples).map(packet).collect()
    }
}

/// Where an episode's video is: in which file, and at what time of it.
pub(super) fn video_place(episode: &SourceEpisode, feature: &str) -> Option<(FilePlace, f64)> {
    let piece = episode.pieces.meta.first()?;
    let [chunk, file, from, _] = video_columns(feature).map(|(name, _)| name);
    let column = |name: &str| piece.batch.column_by_name(name);
    let number = |name: &str| {
        let number = column(name)?.as_primitive_opt::<Int64Type>()?.value(piece.begin);
        u32::try_from(number).ok()
    };
    let from_secs = column(&from)?.as_primitive_opt::<Float64Type>()?.value(piece.begin);
    Some((FilePlace { chunk: number(&chunk)?, file: number(&file)? }, from_secs))
}
