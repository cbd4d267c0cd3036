//! The pictures of episodes while a dataset is written.

use std::path::Path;

use crate::dataset::ConvertError;
use crate::dataset::config::ConvertConfig;
use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::{CameraInfo, FeatureInfo};
use crate::dataset::pictures::statistics::EpisodeStatistics;
use crate::dataset::pictures::{PREFIX, PictureMeasure, PictureStatistics, VideoFiles, video_columns};
use crate::dataset::tables::view::EpisodeView;
use crate::recording::CameraPictures;
use crate::render::PictureFormat;
use crate::table::{ColumnKind, Value, Values};
use crate::video::VideoError;
use crate::words::counted;

/// Bytes of pictures that make a row group, at least.
const GROUP_BYTES: usize = 1 << 25;
const MEGABYTE: usize = 1 << 20;

/// The picture features of a dataset that is being written; none, if its recordings have no cameras.
#[derive(Default)]
pub(in crate::dataset) struct PictureFeatures {
    features: Vec<PictureFeature>,
    fps: u32,
}

/// One camera's pictures.
struct PictureFeature {
    name: String,
    camera: String,
    size_px: [u32; 2],
    store: Store,
    episodes: EpisodeStatistics,
    measure: PictureMeasure,
}

/// Where pictures go.
enum Store {
    /// Rows that are not yet written.
    Column(Vec<Vec<u8>>),
    Videos(Box<VideoFiles>),
}

impl PictureFeatures {
    /// Those of the first episode's cameras.
    pub(in crate::dataset) fn new(root: &Path, config: &ConvertConfig, cameras: &[CameraPictures]) -> Self {
        let (fps, file_bytes) = (config.fps.get(), config.file_megabytes.get() as usize * MEGABYTE);
        let feature = |pictures: &CameraPictures| {
            let name = format!("{PREFIX}{}", pictures.camera);
            let store = match pictures.format {
                PictureFormat::Png => Store::Column(Vec::new()),
                PictureFormat::H264 => {
                    Store::Videos(Box::new(VideoFiles::new(root, &name, pictures.size_px, fps, file_bytes)))
                }
            };
            let (camera, size_px) = (pictures.camera.clone(), pictures.size_px);
            let (episodes, measure) = (EpisodeStatistics::new(&name), PictureMeasure::new(size_px));
            PictureFeature { name, camera, size_px, store, episodes, measure }
        };
        Self { features: cameras.iter().map(feature).collect(), fps }
    }

    /// Further columns of `data/`, as lines of the schema's text.
    pub(in crate::dataset) fn data_schema(&self) -> Vec<String> {
        let images = self.features.iter().filter(|feature| matches!(feature.store, Store::Column(_)));
        let line = |feature: &PictureFeature| {
            let name = &feature.name;
            format!("  required group {name} {{ optional binary bytes; optional binary path (STRING); }}\n")
        };
        images.map(line).collect()
    }

    /// Further columns of `meta/episodes/`.
    pub(in crate::dataset) fn meta_schema(&self) -> Vec<String> {
        let place = |(name, kind): (String, ColumnKind)| {
            let physical = if kind.value == Value::Int64 { "int64" } else { "double" };
            format!("  required {physical} {name};\n")
        };
        let of_feature = |feature: &PictureFeature| {
            let places = match feature.store {
                Store::Column(_) => Vec::new(),
                Store::Videos(_) => video_columns(&feature.name).map(place).into(),
            };
            places.into_iter().chain(feature.episodes.schema()).collect::<Vec<_>>()
        };
        self.features.iter().flat_map(of_feature).collect()
    }

    /// Adds an episode's pictures, those of the frames that become rows.
    pub(in crate::dataset) fn append(
        &mut self,
        view: &EpisodeView<'_>,
        cameras: &[CameraPictures],
    ) -> Result<(), ConvertError> {
        let episode = view.episode.provenance.index;
        let wrong =
            |camera: &str, problem: String| ConvertError::Pictures { episode, camera: camera.to_owned(), problem };
        if cameras.len() != self.features.len() {
            let problem = format!("there are {}, but before {}", counted(cameras.len(), "camera"), self.features.len());
            return Err(wrong("", problem));
        }
        for (feature, pictures) in self.features.iter_mut().zip(cameras) {
            if (&feature.camera, feature.size_px) != (&pictures.camera, pictures.size_px)
                || feature.format() != pictures.format
            {
                let problem = format!("its name, size or format differs from {:?} before", feature.camera);
                return Err(wrong(&pictures.camera, problem));
            }
            let rows = rows(view, pictures).map_err(|problem| wrong(&pictures.camera, problem))?;
            feature.append(&rows).map_err(|error| wrong(&pictures.camera, error.to_string()))?;
        }
        Ok(())
    }

    /// The columns of `data/`.
    pub(in crate::dataset) fn data_columns(&self) -> impl Iterator<Item = (&str, Values<'_>)> {
        self.features.iter().filter_map(|feature| match &feature.store {
            Store::Column(rows) => Some((feature.name.as_str(), Values::Pictures(rows))),
            Store::Videos(_) => None,
        })
    }

    /// The columns of `meta/episodes/`.
    pub(in crate::dataset) fn meta_columns(&self) -> impl Iterator<Item = (&str, Values<'_>)> {
        self.features.iter().flat_map(|feature| {
            let videos = match &feature.store {
                Store::Column(_) => None,
                Store::Videos(videos) => Some(videos.columns()),
            };
            videos.into_iter().flatten().chain(feature.episodes.columns())
        })
    }

    /// Whether rows should be written before there are more.
    pub(in crate::dataset) fn are_many(&self) -> bool {
        let bytes = |feature: &PictureFeature| match &feature.store {
            Store::Column(rows) => rows.iter().map(Vec::len).sum(),
            Store::Videos(_) => 0,
        };
        self.features.iter().map(bytes).sum::<usize>() > GROUP_BYTES
    }

    /// Forgets the rows of `data/`.
    pub(in crate::dataset) fn clear_rows(&mut self) {
        for feature in &mut self.features {
            if let Store::Column(rows) = &mut feature.store {
                rows.clear();
            }
        }
    }

    /// Forgets the rows of `meta/episodes/`.
    pub(in crate::dataset) fn clear_episodes(&mut self) {
        for feature in &mut self.features {
            feature.episodes.clear();
            if let Store::Videos(videos) = &mut feature.store {
                videos.clear();
            }
        }
    }

    /// As `meta/info.json` declares them.
    pub(in crate::dataset) fn declared(&self) -> Vec<(String, FeatureInfo)> {
        self.features.iter().map(|feature| feature.declared(self.fps)).collect()
    }

    /// Statistics by feature.
    pub(in crate::dataset) fn statistics(&self) -> Vec<(String, PictureStatistics)> {
        self.features.iter().map(|feature| (feature.name.clone(), feature.measure.statistics())).collect()
    }

    /// Ends the videos. Returns their files.
    pub(in crate::dataset) fn finish(self) -> Result<Vec<String>, ConvertError> {
        let mut files = Vec::new();
        for feature in self.features {
            if let Store::Videos(videos) = feature.store {
                files.extend(videos.finish()?);
            }
        }
        Ok(files)
    }
}

/// The pictures of the frames that are rows.
fn rows<'p>(view: &EpisodeView<'_>, pictures: &'p CameraPictures) -> Result<Vec<&'p Vec<u8>>, String> {
    let (n_pictures, n_rows, n_frames) = (pictures.pictures.len(), view.n_rows(), view.episode.frames.len());
    if n_pictures == n_rows {
        return Ok(pictures.pictures.iter().collect());
    }
    if n_pictures != n_frames {
        return Err(format!(
            "it has {n_pictures} of {n_frames}",
            n_pictures = counted(n_pictures, "picture"),
            n_frames = counted(n_frames, "frame")
        ));
    }
    let frames = view.episode.frames.iter().zip(&pictures.pictures);
    Ok(frames.filter(|(frame, _)| frame.boundary).map(|(_, picture)| picture).collect())
}

impl PictureFeature {
    fn format(&self) -> PictureFormat {
        match self.store {
            Store::Column(_) => PictureFormat::Png,
            Store::Videos(_) => PictureFormat::H264,
        }
    }

    /// Adds an episode's pictures; each is decoded, for the statistics and so that none is written that is damaged.
    fn append(&mut self, rows: &[&Vec<u8>]) -> Result<(), VideoError> {
        let mut episode = PictureMeasure::new(self.size_px);
        match &mut self.store {
            Store::Column(column) => {
                rows.iter().try_for_each(|row| episode.add_png(row))?;
                column.extend(rows.iter().map(|row| (*row).clone()));
            }
            Store::Videos(videos) => {
                episode.add_video(rows.iter().copied())?;
                videos.append(rows)?;
            }
        }
        self.measure.merge(&episode);
        self.episodes.append(episode.statistics());
        Ok(())
    }

    fn declared(&self, fps: u32) -> (String, FeatureInfo) {
        let [width, height] = self.size_px;
        let names = ["height", "width", "channels"].map(ToOwned::to_owned);
        let (dtype, info) = match self.store {
            Store::Column(_) => (Dtype::Image, None),
            Store::Videos(_) => (Dtype::Video, Some(CameraInfo::h264(self.size_px, f64::from(fps)))),
        };
        let shape = vec![height as usize, width as usize, 3];
        (self.name.clone(), FeatureInfo { dtype, shape, names: Some(names.into()), info })
    }
}
