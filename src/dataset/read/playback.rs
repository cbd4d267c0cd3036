//! An episode of any dataset as it can be shown: program calls, numbers and pictures over time.
//!
//! Unlike a recording, a dataset that was annotated elsewhere holds no scene of ours; what it has can still be seen.

use std::path::Path;

use arrow::array::{Array as _, AsArray as _, RecordBatch};
use arrow::compute::concat_batches;
use arrow::datatypes::Float32Type;

use crate::artifact::read_json;
use crate::dataset::files::info::Dtype;
use crate::dataset::files::info::{FeatureInfo, Info, NtpInfo};
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::pictures::{PREFIX, video_columns};
use crate::dataset::read::lookup::{episode_facts, find, read_calls};
use crate::dataset::schema::META_EPISODES;
use crate::dataset::statistics::batches::{flags, numeric_features, values};
use crate::dataset::statistics::{NumericFeature, copy_values};
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::dataset::{DatasetError, EpisodeFacts, EpisodePictures};
use crate::table::{BatchReader, ColumnKind, Form, TableError, Value, read_further};

/// Numbers of rows and labels, which calls and times show already.
const BOOKKEEPING: [&str; 6] = ["timestamp", "frame_index", "episode_index", "index", "task_index", "subtask_index"];

/// An episode over time.
#[derive(Clone, Debug)]
pub struct Playback {
    /// What it is, and its calls.
    pub facts: EpisodeFacts,
    /// By call, the frames at which it begins and at which it no longer runs.
    pub running: Vec<[u32; 2]>,
    /// Seconds from its beginning, by frame.
    pub times_secs: Vec<f64>,
    /// Its numeric features, but for numbers of rows and labels.
    pub numbers: Vec<NumberTrack>,
    /// What cameras saw.
    pub cameras: Vec<CameraTrack>,
}

/// A numeric feature over time.
#[derive(Clone, Debug, PartialEq)]
pub struct NumberTrack {
    /// Its name, e.g. `observation.state`.
    pub feature: String,
    /// Of each dimension.
    pub names: Vec<String>,
    /// `[frame, dimension]`.
    pub values: Vec<f64>,
}

/// The pictures of a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraTrack {
    /// Its name.
    pub name: String,
    /// A picture a frame.
    pub pictures: TrackPictures,
}

/// Pictures, encoded as the dataset has them.
#[derive(Clone, Debug, PartialEq)]
pub enum TrackPictures {
    /// A file each, PNG or JPEG; empty where a frame has none.
    Images(Vec<Vec<u8>>),
    /// Part of a video.
    Video {
        /// The file.
        mp4: Vec<u8>,
        /// When it shows the episode's first frame.
        from_secs: f64,
    },
}

/// Reads an episode of a dataset.
///
/// # Errors
///
/// When there is no such episode, with how many there are; or a table or a video cannot be read; or a picture of a
/// dataset of ours cannot be decoded.
pub fn play_back(root: &Path, episode: u64) -> Result<Playback, DatasetError> {
    let info: Info = read_json(&root.join(layout::INFO))?;
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    let found = find(root, episode)?;
    let calls = read_calls(root, &found)?;
    // Our own calls share the frame at which one ends and the next begins; spans that were annotated elsewhere do not.
    let is_shared = ntp.has_our_programs();
    let until = |[begin, end]: [u32; 2]| {
        [begin, if is_shared { end.saturating_sub(1).max(begin.saturating_add(1)) } else { end }]
    };
    let running = calls.iter().map(|call| until(call.frames)).collect();
    if ntp.annotated_by.is_none() {
        check_pictures(root, episode)?;
    }
    let frames = Frames::read(root, &found.row, found.frames_before)?;
    let cameras = info.features.0.iter().filter_map(|(name, feature)| camera(root, &found.row, &frames, name, feature));
    Ok(Playback {
        running,
        times_secs: frames.times_secs()?,
        numbers: frames.numbers(&info)?,
        cameras: cameras.collect::<Result<_, _>>()?,
        facts: episode_facts(found.row, calls),
    })
}

/// Makes sure that what is shown can be decoded. Datasets that were annotated elsewhere have codecs of their own.
fn check_pictures(root: &Path, episode: u64) -> Result<(), DatasetError> {
    let position = usize::try_from(episode).unwrap_or(usize::MAX);
    EpisodePictures::cameras(root)?.iter().try_for_each(|camera| EpisodePictures::open(root, camera)?.check(position))
}

/// The rows of an episode, with all their columns.
struct Frames {
    path: std::path::PathBuf,
    rows: RecordBatch,
}

impl Frames {
    fn read(root: &Path, row: &EpisodeRow, n_before: i64) -> Result<Self, DatasetError> {
        let path = row.data.in_dataset(root, layout::DATA);
        let [begin, n_rows] = [n_before, row.n_frames].map(|number| usize::try_from(number).unwrap_or(0));
        let mut reader = BatchReader::open_rows(&path, begin..begin.saturating_add(n_rows))?;
        let mut batches = Vec::new();
        while let Some(batch) = reader.next_batch()? {
            batches.push(batch);
        }
        let rows = concat_batches(reader.schema(), &batches).map_err(TableError::arrow(&path))?;
        if rows.num_rows() == n_rows {
            return Ok(Self { path, rows });
        }
        let problem = format!("it ends after {} of the {n_rows} frames of an episode", rows.num_rows());
        Err(DatasetError::Count { path, problem })
    }

    fn times_secs(&self) -> Result<Vec<f64>, DatasetError> {
        let column = self.rows.column_by_name("timestamp").and_then(|column| column.as_primitive_opt::<Float32Type>());
        let times = column.map(|times| times.values().iter().map(|&secs| f64::from(secs)).collect());
        times.ok_or_else(|| self.problem("it has no column timestamp of float"))
    }

    fn numbers(&self, info: &Info) -> Result<Vec<NumberTrack>, DatasetError> {
        let mut features = numeric_features(info, &self.rows.schema());
        let is_label =
            |name: &str| BOOKKEEPING.contains(&name) || ["ntp.", "next."].iter().any(|of| name.starts_with(of));
        features.retain(|feature| !is_label(&feature.name));
        let flags = flags(&self.rows, &features);
        let columns = values(&self.rows, &features, &flags).map_err(TableError::arrow(&self.path))?;
        let track = |(feature, (_, column)): (&NumericFeature, (&str, _))| {
            let mut values = Vec::new();
            copy_values(column, 0..self.rows.num_rows(), &mut values);
            NumberTrack { feature: feature.name.clone(), names: names(info, feature), values }
        };
        Ok(features.iter().zip(columns).map(track).collect())
    }

    /// The encoded pictures of a column.
    fn images(&self, name: &str) -> Option<Vec<Vec<u8>>> {
        let bytes = self.rows.column_by_name(name)?.as_struct_opt()?.column_by_name("bytes")?.as_binary_opt::<i32>()?;
        let image = |row| if bytes.is_valid(row) { bytes.value(row).to_vec() } else { Vec::new() };
        Some((0..bytes.len()).map(image).collect())
    }

    fn problem(&self, problem: &str) -> DatasetError {
        DatasetError::Count { path: self.path.clone(), problem: problem.to_owned() }
    }
}

/// The names of a feature's dimensions; their numbers where there are none.
fn names(info: &Info, feature: &NumericFeature) -> Vec<String> {
    let declared = info.features.0.iter().find(|(name, _)| *name == feature.name);
    let names = declared.and_then(|(_, declared)| declared.names.clone());
    let numbers = || (0..feature.width).map(|dimension| dimension.to_string()).collect();
    names.filter(|names| names.len() == feature.width).unwrap_or_else(numbers)
}

/// The pictures of a feature; `None` for one that is no camera.
fn camera(
    root: &Path,
    row: &EpisodeRow,
    frames: &Frames,
    name: &str,
    feature: &FeatureInfo,
) -> Option<Result<CameraTrack, DatasetError>> {
    let pictures = match feature.dtype {
        Dtype::Image => {
            let images = frames.images(name).map(TrackPictures::Images);
            images.ok_or_else(|| frames.problem(&format!("it has no column {name} of encoded pictures")))
        }
        Dtype::Video => video(root, row, name),
        _ => return None,
    };
    let name = name.strip_prefix(PREFIX).unwrap_or(name).to_owned();
    Some(pictures.map(|pictures| CameraTrack { name, pictures }))
}

fn video(root: &Path, row: &EpisodeRow, name: &str) -> Result<TrackPictures, DatasetError> {
    let path = row.meta.in_dataset(root, layout::META_EPISODES);
    let number = ColumnKind { value: Value::Int64, form: Form::Required };
    let mut columns = vec![("episode_index".to_owned(), number)];
    columns.extend(video_columns(name));
    let mut table = read_further(&path, &META_EPISODES, &columns)?;
    let [chunk, file, from, _] = video_columns(name).map(|(name, _)| name);
    let at = table.int64("episode_index")?.iter().position(|&episode| episode == row.episode_index);
    let (chunks, files, from) = (table.int64(&chunk)?, table.int64(&file)?, table.float64(&from)?);
    let place = at.and_then(|at| {
        let number = |number: i64| u32::try_from(number).ok();
        Some((FilePlace { chunk: number(chunks[at])?, file: number(files[at])? }, from[at]))
    });
    let missing = || DatasetError::Count { path, problem: format!("it gives no place of {name}") };
    let (file, from_secs) = place.ok_or_else(missing)?;
    let mp4 = crate::artifact::read(&root.join(file.video(name)))?;
    Ok(TrackPictures::Video { mp4, from_secs })
}
