//! Pictures of episodes that are carried over. Images stay in their rows; the samples of videos are copied into new
//! files. All are decoded, for exact statistics and so that none is carried over that is damaged.

use std::path::{Path, PathBuf};

use arrow::array::{ArrayRef, AsArray as _};

use crate::dataset::DatasetError;
use crate::dataset::edit::pieces::Piece;
use crate::dataset::edit::samples::Samples;
use crate::dataset::edit::source::{Source, SourceEpisode};
use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::{FeatureInfo, Info};
use crate::dataset::pictures::{PictureMeasure, PictureStatistics, VideoFiles};
use crate::dataset::statistics::batches::scalars;
use crate::video::VideoError;

/// The picture features of a dataset that is made of others.
pub(super) struct CarriedPictures {
    features: Vec<Carried>,
}

/// One camera's pictures.
struct Carried {
    name: String,
    size_px: [u32; 2],
    measure: PictureMeasure,
    store: Store,
}

/// Where the pictures are.
enum Store {
    /// In the rows of frames, which others carry over.
    Rows,
    /// In files of their own.
    Videos(Box<Videos>),
}

struct Videos {
    files: VideoFiles,
    /// Of the file that is being written; a file has one for all its pictures.
    parameter_sets: Vec<u8>,
    samples: Samples,
}

/// What an episode's pictures are, read and decoded but not yet part of the dataset.
pub(super) struct EpisodePictures {
    /// By feature: what is known of them, and of a video its packets.
    features: Vec<(PictureMeasure, Vec<Vec<u8>>)>,
}

impl CarriedPictures {
    /// Those that a dataset declares, for a new one in `root` with files of so many bytes.
    pub(super) fn new(root: &Path, info: &Info, file_bytes: usize) -> Self {
        let feature = |(name, declared): &(String, FeatureInfo)| {
            let &[height, width, 3] = &declared.shape[..] else { return None };
            let size_px = [width as u32, height as u32];
            let store = match declared.dtype {
                Dtype::Image => Store::Rows,
                Dtype::Video => {
                    let files = VideoFiles::new(root, name, size_px, info.whole_fps(), file_bytes);
                    Store::Videos(Box::new(Videos { files, parameter_sets: Vec::new(), samples: Samples::new(name) }))
                }
                _ => return None,
            };
            Some(Carried { name: name.clone(), size_px, measure: PictureMeasure::new(size_px), store })
        };
        Self { features: info.features.0.iter().filter_map(feature).collect() }
    }

    /// Reads and decodes the pictures of an episode of a source.
    ///
    /// # Errors
    ///
    /// With episode and feature, when one cannot be read or decoded or has another size.
    pub(super) fn read(&mut self, episode: &SourceEpisode, source: &Source) -> Result<EpisodePictures, DatasetError> {
        let read = |feature: &mut Carried| {
            let mut measure = PictureMeasure::new(feature.size_px);
            let packets = feature.read(episode, source, &mut measure)?;
            Ok((measure, packets))
        };
        Ok(EpisodePictures { features: self.features.iter_mut().map(read).collect::<Result<_, DatasetError>>()? })
    }

    /// Adds what was read of an episode.
    pub(super) fn append(&mut self, read: &EpisodePictures) -> Result<(), VideoError> {
        for (feature, (measure, packets)) in self.features.iter_mut().zip(&read.features) {
            feature.measure.merge(measure);
            if let Store::Videos(videos) = &mut feature.store {
                videos.append(packets)?;
            }
        }
        Ok(())
    }

    /// The columns of `meta/episodes/` that say where videos are, of the episodes that are not yet written.
    pub(super) fn meta_columns(&self) -> Vec<(String, ArrayRef)> {
        let videos = self.features.iter().filter_map(|feature| match &feature.store {
            Store::Rows => None,
            Store::Videos(videos) => Some(videos.files.columns()),
        });
        videos.flatten().filter_map(|(name, values)| Some((name.to_owned(), scalars(values)?))).collect()
    }

    /// Forgets those columns.
    pub(super) fn clear_episodes(&mut self) {
        for feature in &mut self.features {
            if let Store::Videos(videos) = &mut feature.store {
                videos.files.clear();
            }
        }
    }

    /// Statistics by feature.
    pub(super) fn statistics(&self) -> Vec<(String, PictureStatistics)> {
        self.features.iter().map(|feature| (feature.name.clone(), feature.measure.statistics())).collect()
    }

    /// Ends the videos. Returns their files.
    pub(super) fn finish(self) -> Result<Vec<String>, VideoError> {
        let mut files = Vec::new();
        for feature in self.features {
            if let Store::Videos(videos) = feature.store {
                files.extend(videos.files.finish()?);
            }
        }
        Ok(files)
    }
}

impl Carried {
    /// Measures the pictures of an episode; gives the packets of a video.
    fn read(
        &mut self,
        episode: &SourceEpisode,
        source: &Source,
        measure: &mut PictureMeasure,
    ) -> Result<Vec<Vec<u8>>, DatasetError> {
        let (row, name) = (&episode.row, &self.name);
        let failed = |path: PathBuf, problem: String| DatasetError::Episode {
            path,
            episode: row.episode_index,
            problem: format!("{name}: {problem}"),
        };
        match &mut self.store {
            Store::Rows => {
                let measured = episode.pieces.frames.iter().try_for_each(|piece| measure_rows(piece, name, measure));
                measured.map_err(|problem| failed(source.frames_path(row.data), problem))?;
                Ok(Vec::new())
            }
            Store::Videos(videos) => {
                let packets = videos.samples.read(episode, source)?;
                let measured = measure.add_video(&packets);
                measured.map_err(|error| failed(source.root().to_owned(), error.to_string()))?;
                Ok(packets)
            }
        }
    }
}

impl Videos {
    fn append(&mut self, packets: &[Vec<u8>]) -> Result<(), VideoError> {
        if self.samples.parameter_sets() != self.parameter_sets {
            self.files.end_file()?;
            self.parameter_sets = self.samples.parameter_sets().to_vec();
        }
        self.files.append(&packets.iter().collect::<Vec<_>>())
    }
}

fn measure_rows(piece: &Piece, name: &str, measure: &mut PictureMeasure) -> Result<(), String> {
    let fields = piece.batch.column_by_name(name).and_then(|column| column.as_struct_opt());
    let bytes = fields.and_then(|fields| fields.column_by_name("bytes")).and_then(|bytes| bytes.as_binary_opt::<i32>());
    let bytes = bytes.ok_or("its column is no struct with bytes")?;
    for row in piece.begin..piece.end {
        measure.add_png(bytes.value(row)).map_err(|error| error.to_string())?;
    }
    Ok(())
}
