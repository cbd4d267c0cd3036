//! Pictures of a dataset, an episode at a time.

use std::path::{Path, PathBuf};

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::Info;
use crate::dataset::files::layout;
use crate::dataset::pictures::PREFIX;
use crate::dataset::pictures::open_files::OpenFiles;
use crate::dataset::pictures::places::{Place, places};
use crate::dataset::schema::FRAMES;
use crate::table::{PictureReader, TableError};
use crate::video::{Mp4Pictures, Mp4Reader, Rgb, VideoError, decode_png};
use crate::words::counted;

/// The pictures of one camera of a dataset, any episode in any order. Memory holds where each episode is, and the
/// footers of the files that were read last.
pub struct EpisodePictures {
    root: PathBuf,
    feature: String,
    size_px: [u32; 2],
    episodes: Vec<Place>,
    files: Files,
}

/// How pictures are stored, with the files that are open.
enum Files {
    Images(OpenFiles<PictureReader>),
    Videos(OpenFiles<Mp4Reader>),
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
        let is_video = declared.dtype == Dtype::Video;
        let episodes = places(root, &feature, is_video, info.fps, info.total_episodes)?;
        let files = if is_video { Files::Videos(OpenFiles::default()) } else { Files::Images(OpenFiles::default()) };
        Ok(Self { root: root.to_owned(), feature, size_px: [width as u32, height as u32], episodes, files })
    }

    /// Width and height, in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// How many episodes there are.
    pub fn n_episodes(&self) -> usize {
        self.episodes.len()
    }

    /// How many pictures an episode has, one a row; none for one that is not there.
    pub fn n_pictures(&self, episode: usize) -> usize {
        self.episodes.get(episode).map_or(0, |place| place.count)
    }

    /// The pictures of an episode, one a row.
    ///
    /// # Errors
    ///
    /// As [`EpisodePictures::visit`].
    pub fn read(&mut self, episode: usize) -> Result<Vec<Rgb>, DatasetError> {
        let rows = self.rows(episode)?;
        let mut pictures = Vec::with_capacity(rows.len());
        self.visit(episode, &rows, |picture| pictures.push(picture.clone()))?;
        Ok(pictures)
    }

    /// Gives the pictures of some rows of an episode, in rising order, to `visit` one after the other.
    ///
    /// # Errors
    ///
    /// With episode, camera and row, when a file cannot be read, or a picture is not there, cannot be decoded or has
    /// another size.
    pub fn visit(&mut self, episode: usize, rows: &[u32], mut visit: impl FnMut(&Rgb)) -> Result<(), DatasetError> {
        let (place, path) = self.find(episode, rows)?;
        let Self { feature, size_px: expected, files, .. } = self;
        let wrong = |problem: String| {
            let problem = format!("{feature}: {problem}");
            DatasetError::Episode { path: path.clone(), episode: episode as i64, problem }
        };
        let wrong_row = |row: u32| {
            let wrong = &wrong;
            move |error: VideoError| wrong(format!("picture of row {row}: {error}"))
        };
        match files {
            Files::Images(files) => {
                let open = || PictureReader::open(&path, &FRAMES, feature);
                let file = files.get(place.file, open).map_err(|error| wrong(error.to_string()))?;
                let of_file: Vec<usize> = rows.iter().map(|&row| place.first.saturating_add(row as usize)).collect();
                let encoded = file.read(&of_file).map_err(|error| wrong(words(&error)))?;
                for (&row, png) in rows.iter().zip(&encoded) {
                    let picture = decode_png(png).map_err(wrong_row(row))?;
                    picture.check_size(*expected).map_err(wrong_row(row))?;
                    visit(&picture);
                }
            }
            Files::Videos(files) => {
                let file =
                    files.get(place.file, || Mp4Reader::open(&path)).map_err(|error| wrong(error.to_string()))?;
                let mut video = Mp4Pictures::new(file).map_err(|error| wrong(error.to_string()))?;
                for &row in rows {
                    let picture = video.get(place.first.saturating_add(row as usize)).map_err(wrong_row(row))?;
                    picture.check_size(*expected).map_err(wrong_row(row))?;
                    visit(picture);
                }
            }
        }
        Ok(())
    }

    /// Makes sure that an episode has pictures of some rows, without reading them.
    ///
    /// # Errors
    ///
    /// With episode and camera, for the first row without a picture.
    pub fn check_rows(&self, episode: usize, rows: &[u32]) -> Result<(), DatasetError> {
        self.find(episode, rows).map(|_| ())
    }

    /// Decodes all pictures of an episode.
    ///
    /// # Errors
    ///
    /// As [`EpisodePictures::visit`].
    pub fn check(&mut self, episode: usize) -> Result<(), DatasetError> {
        let rows = self.rows(episode)?;
        self.visit(episode, &rows, |_| {})
    }

    /// All rows of an episode. The last one is read first: a length that is not true must not fill the memory.
    fn rows(&mut self, episode: usize) -> Result<Vec<u32>, DatasetError> {
        let n_pictures = self.n_pictures(episode) as u32;
        self.visit(episode, &n_pictures.checked_sub(1).map_or(Vec::new(), |last| vec![last]), |_| {})?;
        Ok((0..n_pictures).collect())
    }

    /// Where an episode with certain rows is, and the path of the file.
    fn find(&self, episode: usize, rows: &[u32]) -> Result<(Place, PathBuf), DatasetError> {
        let (place, n_episodes) = (self.episodes.get(episode), self.episodes.len());
        let file = place.map(|place| place.file).unwrap_or_default();
        let path = match self.files {
            Files::Images(_) => file.in_dataset(&self.root, layout::DATA),
            Files::Videos(_) => self.root.join(file.video(&self.feature)),
        };
        let problem = match place {
            None => format!("there are {n_episodes}", n_episodes = counted(n_episodes, "episode")),
            Some(place) => match rows.iter().find(|&&row| row as usize >= place.count) {
                None => return Ok((*place, path)),
                Some(row) => format!("row {row} has no picture, there are {}", counted(place.count, "row")),
            },
        };
        let problem = format!("{}: {problem}", self.feature);
        Err(DatasetError::Episode { path, episode: episode as i64, problem })
    }
}

/// What is wrong with a table, whose path stands before it.
fn words(error: &TableError) -> String {
    match error {
        TableError::Null { row, .. } => format!("row {row} of the file has no picture"),
        other => other.to_string(),
    }
}
