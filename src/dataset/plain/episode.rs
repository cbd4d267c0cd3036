//! Episodes of anybody's dataset: how long, of which tasks, where their rows and videos lie.

use std::path::{Path, PathBuf};

use arrow::array::RecordBatch;

use crate::dataset::DatasetError;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::pictures::video_columns;
use crate::dataset::plain::arrays::{numbers, text_lists, whole_numbers};
use crate::dataset::plain::declared::PlainInfo;
use crate::dataset::plain::lines::json_lines;
use crate::dataset::plain::listing::parquet_files;
use crate::table::BatchReader;

/// Episodes of older datasets, a line each.
pub(crate) const EPISODE_LINES: &str = "meta/episodes.jsonl";
/// Rows that are read at a time.
const BATCH_ROWS: usize = 4096;

/// Where an episode is in a video: which file, and seconds in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct VideoSpan {
    pub(crate) file: FilePlace,
    pub(crate) from_secs: f64,
    /// `None` where it is not told.
    pub(crate) to_secs: Option<f64>,
}

/// An episode.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlainEpisode {
    pub(crate) index: i64,
    pub(crate) tasks: Vec<String>,
    pub(crate) length: u64,
    /// The file of its frames; `None` where it is not told.
    pub(crate) data: Option<FilePlace>,
    /// `index` of its first frame, and one past its last.
    pub(crate) rows: [i64; 2],
    /// A span for each video, in the order of the features; `None` where it is not told.
    pub(crate) videos: Vec<Option<VideoSpan>>,
    /// The file of its own row, by position among those of its kind, and which row of it.
    pub(crate) own: (usize, usize),
}

/// All episodes, with the files that tell of them.
pub(crate) fn read_episodes(info: &PlainInfo) -> Result<(Vec<PlainEpisode>, Vec<PathBuf>), DatasetError> {
    if info.version.is_by_episode() { read_lines(info) } else { read_tables(info) }
}

fn read_lines(info: &PlainInfo) -> Result<(Vec<PlainEpisode>, Vec<PathBuf>), DatasetError> {
    let path = info.root().join(EPISODE_LINES);
    let mut begin = 0;
    let episodes = json_lines(&path, |row, line| {
        let index = line["episode_index"].as_i64().ok_or("episode_index is no whole number")?;
        let length = line["length"].as_u64().ok_or("length is no whole number")?;
        let tasks = match &line["tasks"] {
            serde_json::Value::String(task) => vec![task.clone()],
            other => serde_json::from_value(other.clone()).map_err(|_error| "tasks is no list of texts".to_owned())?,
        };
        let end = begin + i64::try_from(length).map_err(|_error| "length is too large")?;
        let rows = [std::mem::replace(&mut begin, end), end];
        let number = u32::try_from(index).map_err(|_error| format!("episode_index is {index}"))?;
        let file = info.place_of_episode(number);
        let span = VideoSpan { file, from_secs: 0.0, to_secs: None };
        let videos = info.videos().map(|_| Some(span)).collect();
        Ok(PlainEpisode { index, tasks, length, data: Some(file), rows, videos, own: (0, row as usize) })
    })?;
    Ok((episodes, vec![path]))
}

fn read_tables(info: &PlainInfo) -> Result<(Vec<PlainEpisode>, Vec<PathBuf>), DatasetError> {
    let files = parquet_files(&info.root().join(layout::META_EPISODES))?;
    if files.is_empty() {
        let path = info.root().join(layout::META_EPISODES);
        return Err(DatasetError::Count { path, problem: "there is no file of episodes in it".to_owned() });
    }
    let mut episodes = Vec::new();
    for (own, path) in files.iter().enumerate() {
        let mut reader = BatchReader::open_columns(path, BATCH_ROWS, |name| !name.starts_with("stats/"))?;
        let mut row = 0;
        while let Some(batch) = reader.next_batch()? {
            read_batch(info, path, &batch, (own, row), &mut episodes)?;
            row += batch.num_rows();
        }
    }
    Ok((episodes, files))
}

fn read_batch(
    info: &PlainInfo,
    path: &Path,
    batch: &RecordBatch,
    (own, first_row): (usize, usize),
    episodes: &mut Vec<PlainEpisode>,
) -> Result<(), DatasetError> {
    let missing = |name: &str| DatasetError::Count {
        path: path.to_owned(),
        problem: format!("it has no column {name} of whole numbers without nulls"),
    };
    let needed = |name: &str| whole_numbers(batch, name).ok_or_else(|| missing(name));
    let indices = needed("episode_index")?;
    let (from, to) = (needed("dataset_from_index")?, needed("dataset_to_index")?);
    let (chunks, numbers_of_files) =
        (whole_numbers(batch, "data/chunk_index"), whole_numbers(batch, "data/file_index"));
    let lengths = whole_numbers(batch, "length");
    let tasks = text_lists(batch, "tasks");
    let videos: Vec<VideoColumns> = info.videos().map(|video| VideoColumns::of(batch, &video.name)).collect();
    for row in 0..batch.num_rows() {
        let place = |numbers: &Option<Vec<i64>>| u32::try_from(*numbers.as_ref()?.get(row)?).ok();
        let data = place(&chunks).zip(place(&numbers_of_files)).map(|(chunk, file)| FilePlace { chunk, file });
        let length = lengths.as_ref().map_or(to[row].saturating_sub(from[row]), |lengths| lengths[row]);
        let length = u64::try_from(length).map_err(|_error| DatasetError::Row {
            path: path.to_owned(),
            row: (first_row + row) as u64,
            problem: format!("length is {length}"),
        })?;
        episodes.push(PlainEpisode {
            index: indices[row],
            tasks: tasks.as_ref().map(|tasks| tasks[row].clone()).unwrap_or_default(),
            length,
            data,
            rows: [from[row], to[row]],
            videos: videos.iter().map(|video| video.span(row)).collect(),
            own: (own, first_row + row),
        });
    }
    Ok(())
}

/// Where the videos of one feature are, by row.
struct VideoColumns {
    place: [Option<Vec<i64>>; 2],
    secs: [Option<Vec<f64>>; 2],
}

impl VideoColumns {
    fn of(batch: &RecordBatch, feature: &str) -> Self {
        let [chunk, file, from, to] = video_columns(feature).map(|(name, _)| name);
        Self {
            place: [chunk, file].map(|name| whole_numbers(batch, &name)),
            secs: [from, to].map(|name| numbers(batch, &name)),
        }
    }

    fn span(&self, row: usize) -> Option<VideoSpan> {
        let [chunk, file] = self.place.each_ref().map(|of| u32::try_from(*of.as_ref()?.get(row)?).ok());
        let [from, to] = self.secs.each_ref().map(|of| of.as_ref()?.get(row).copied());
        Some(VideoSpan { file: FilePlace { chunk: chunk?, file: file? }, from_secs: from?, to_secs: to })
    }
}
