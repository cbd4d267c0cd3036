//! Pictures of a dataset, an episode at a time.

use std::path::{Path, PathBuf};

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::feature::Dtype;
use crate::dataset::info::Info;
use crate::dataset::layout::{self, FilePlace};
use crate::dataset::pictures::{PREFIX, video_columns};
use crate::dataset::schema::{FRAMES, META_EPISODES};
use crate::table::{self, Columns};
use crate::video::{H264Decoder, Mp4Reader, Rgb, VideoError, decode_png};

/// The pictures of one camera of a dataset. Memory holds where each episode is, and the pictures of one episode.
pub struct EpisodePictures {
    root: PathBuf,
    feature: String,
    size_px: [u32; 2],
    episodes: Vec<Place>,
    /// `None` for images in the tables.
    video: Option<OpenVideo>,
}

/// Where the pictures of an episode are.
#[derive(Clone, Copy, Debug)]
struct Place {
    file: FilePlace,
    /// Of the file: its row, or its sample.
    first: usize,
    count: usize,
}

#[derive(Default)]
struct OpenVideo {
    open: Option<(FilePlace, Mp4Reader)>,
    packet: Vec<u8>,
}

impl EpisodePictures {
    /// The cameras of a dataset, in the order of their names.
    ///
    /// # Errors
    ///
    /// When `meta/info.json` cannot be read.
    pub fn cameras(root: &Path) -> Result<Vec<String>, DatasetError> {
        let features = Self::features(root)?;
        Ok(features.iter().filter_map(|name| name.strip_prefix(PREFIX)).map(ToOwned::to_owned).collect())
    }

    /// The features that are pictures.
    pub(in crate::dataset) fn features(root: &Path) -> Result<Vec<String>, DatasetError> {
        let info: Info = read_json(&root.join(layout::INFO))?;
        let is_picture = |dtype| matches!(dtype, Dtype::Image | Dtype::Video);
        let pictures = info.features.0.into_iter().filter(|(_, feature)| is_picture(feature.dtype));
        Ok(pictures.map(|(name, _)| name).collect())
    }

    /// Finds the pictures of a camera.
    ///
    /// # Errors
    ///
    /// When the dataset has no such camera, or its tables cannot be read.
    pub fn open(root: &Path, camera: &str) -> Result<Self, DatasetError> {
        let path = root.join(layout::INFO);
        let info: Info = read_json(&path)?;
        let feature = format!("{PREFIX}{camera}");
        let declared = info.features.0.iter().find(|(name, _)| *name == feature).map(|(_, declared)| declared);
        let declared = declared.filter(|declared| matches!(declared.dtype, Dtype::Image | Dtype::Video));
        let Some(declared) = declared else {
            let cameras = Self::cameras(root)?.join(", ");
            let problem = format!("no camera {camera:?}; there are: {cameras}");
            return Err(DatasetError::Count { path, problem });
        };
        let &[height, width, 3] = declared.shape.as_slice() else {
            let problem = format!("{feature} has shape {:?}, expected [height, width, 3]", declared.shape);
            return Err(DatasetError::Count { path, problem });
        };
        let video = (declared.dtype == Dtype::Video).then(OpenVideo::default);
        let episodes = places(root, &feature, video.is_some(), f64::from(info.fps), info.total_episodes)?;
        Ok(Self { root: root.to_owned(), feature, size_px: [width as u32, height as u32], episodes, video })
    }

    /// Width and height, in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// How many episodes there are.
    pub fn n_episodes(&self) -> usize {
        self.episodes.len()
    }

    /// How many pictures an episode has; none for one that is not there.
    pub fn n_pictures(&self, episode: usize) -> usize {
        self.episodes.get(episode).map_or(0, |place| place.count)
    }

    /// The pictures of an episode, one a row.
    ///
    /// # Errors
    ///
    /// With episode and camera, when a file cannot be read or a picture cannot be decoded or has another size.
    pub fn read(&mut self, episode: usize) -> Result<Vec<Rgb>, DatasetError> {
        let count = self.n_pictures(episode);
        let mut pictures = Vec::with_capacity(count);
        self.each(episode, |_, picture| pictures.push(picture.clone()))?;
        Ok(pictures)
    }

    /// Gives the pictures of an episode to `visit` one after the other, with their numbers.
    ///
    /// # Errors
    ///
    /// As [`EpisodePictures::read`].
    pub fn each(&mut self, episode: usize, mut visit: impl FnMut(usize, &Rgb)) -> Result<(), DatasetError> {
        let (feature, expected) = (self.feature.clone(), self.size_px);
        let n_episodes = self.episodes.len();
        let path = self.path_of(episode);
        let problem = |problem: String| DatasetError::Episode {
            path: path.clone(),
            episode: episode as i64,
            problem: format!("{feature}: {problem}"),
        };
        let place = *self.episodes.get(episode).ok_or_else(|| problem(format!("there are {n_episodes} episodes")))?;
        let mut checked = |number: usize, picture: &Rgb| {
            if picture.size_px != expected {
                return Err(VideoError::Size { found: picture.size_px, expected });
            }
            visit(number, picture);
            Ok(())
        };
        let failed = |error: VideoError| problem(error.to_string());
        match &mut self.video {
            None => {
                let rows = place.first..place.first + place.count;
                for (number, png) in table::read_pictures(&path, &FRAMES, &feature, rows)?.iter().enumerate() {
                    decode_png(png).and_then(|picture| checked(number, &picture)).map_err(failed)?;
                }
            }
            Some(video) => video.each(&path, place, &mut checked).map_err(failed)?,
        }
        Ok(())
    }

    /// Decodes the first and the last picture of an episode, and of a video what is between.
    ///
    /// # Errors
    ///
    /// As [`EpisodePictures::read`].
    pub fn check_ends(&mut self, episode: usize) -> Result<(), DatasetError> {
        let Some(&whole) = self.episodes.get(episode) else { return Ok(()) };
        if self.video.is_some() || whole.count == 0 {
            return self.each(episode, |_, _| {});
        }
        for row in [whole.first, whole.first + whole.count - 1] {
            self.episodes[episode] = Place { first: row, count: 1, ..whole };
            let checked = self.each(episode, |_, _| {});
            self.episodes[episode] = whole;
            checked?;
        }
        Ok(())
    }

    fn path_of(&self, episode: usize) -> PathBuf {
        let file = self.episodes.get(episode).map_or(FilePlace::default(), |place| place.file);
        match self.video {
            None => file.in_dataset(&self.root, layout::DATA),
            Some(_) => self.root.join(file.video(&self.feature)),
        }
    }
}

impl OpenVideo {
    fn each(
        &mut self,
        path: &Path,
        place: Place,
        visit: &mut impl FnMut(usize, &Rgb) -> Result<(), VideoError>,
    ) -> Result<(), VideoError> {
        let reader = match self.open.take() {
            Some(open) if open.0 == place.file => self.open.insert(open),
            _ => self.open.insert((place.file, Mp4Reader::open(path)?)),
        };
        let mut decoder = H264Decoder::new()?;
        let mut picture = Rgb::default();
        for number in 0..place.count {
            reader.1.read(place.first + number, &mut self.packet)?;
            decoder.decode(&self.packet, &mut picture)?;
            visit(number, &picture)?;
        }
        Ok(())
    }
}

/// Where the pictures of all episodes are.
fn places(root: &Path, feature: &str, is_video: bool, fps: f64, n_episodes: u64) -> Result<Vec<Place>, DatasetError> {
    let mut places = Vec::new();
    let mut file = FilePlace::default();
    while (places.len() as u64) < n_episodes {
        let path = file.in_dataset(root, layout::META_EPISODES);
        let mut columns = table::read(&path, &META_EPISODES)?;
        let lengths = columns.int64("length")?;
        let of_file = if is_video {
            video_places(table::read_further(&path, &META_EPISODES, &video_columns(feature))?, feature, &lengths, fps)?
        } else {
            image_places(columns, &lengths)?
        };
        if of_file.is_empty() {
            let problem = format!("it ends after {} of {n_episodes} episodes", places.len());
            return Err(DatasetError::Count { path, problem });
        }
        places.extend(of_file);
        file = file.next();
    }
    if !is_video {
        count_rows_of_files(&mut places);
    }
    Ok(places)
}

fn numbers(chunk: i64, file: i64) -> FilePlace {
    FilePlace { chunk: chunk.try_into().unwrap_or(u32::MAX), file: file.try_into().unwrap_or(u32::MAX) }
}

fn image_places(mut columns: Columns, lengths: &[i64]) -> Result<Vec<Place>, DatasetError> {
    let (chunks, files) = (columns.int64("data/chunk_index")?, columns.int64("data/file_index")?);
    let first = columns.int64("dataset_from_index")?;
    let rows = chunks.into_iter().zip(files).zip(first).zip(lengths);
    Ok(rows
        .map(|(((chunk, file), first), &length)| Place {
            file: numbers(chunk, file),
            first: usize::try_from(first).unwrap_or(usize::MAX),
            count: usize::try_from(length).unwrap_or(0),
        })
        .collect())
}

/// From rows of the dataset to rows of each file.
fn count_rows_of_files(places: &mut [Place]) {
    let mut begin = (FilePlace::default(), 0);
    for place in places {
        if place.file != begin.0 {
            begin = (place.file, place.first);
        }
        place.first = place.first.saturating_sub(begin.1);
    }
}

fn video_places(mut columns: Columns, feature: &str, lengths: &[i64], fps: f64) -> Result<Vec<Place>, DatasetError> {
    let [chunk, file, from, _] = video_columns(feature).map(|(name, _)| name);
    let (chunks, files, from) = (columns.int64(&chunk)?, columns.int64(&file)?, columns.float64(&from)?);
    let rows = chunks.into_iter().zip(files).zip(from).zip(lengths);
    Ok(rows
        .map(|(((chunk, file), from), &length)| Place {
            file: numbers(chunk, file),
            first: (from * fps).round() as usize,
            count: usize::try_from(length).unwrap_or(0),
        })
        .collect())
}
