//! An episode of any dataset as it can be shown: program calls, numbers and pictures over time.
//!
//! Unlike a recording, a dataset that was annotated elsewhere holds no scene of ours; what it has can still be seen.

use std::path::{Path, PathBuf};

use arrow::array::{Array as _, AsArray as _, RecordBatch};
use arrow::compute::{cast, concat_batches};
use arrow::datatypes::DataType;

use crate::artifact::read_json;
use crate::dataset::files::info::NtpInfo;
use crate::dataset::files::layout;
use crate::dataset::pictures::PREFIX;
use crate::dataset::plain::{
    Declared, DeclaredKind, FlatNumbers, LabelsForm, PlainEpisode, PlainInfo, PlainLabels, PlainSource, has_programs,
    numbers,
};
use crate::dataset::read::lookup::{episode_facts, find, read_calls};
use crate::dataset::statistics::copy_values;
use crate::dataset::tables::annotated::ROOT;
use crate::dataset::{CallFacts, DatasetError, EpisodeFacts, EpisodePictures};
use crate::table::{BatchReader, TableError};
use crate::words::counted;

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

/// Reads an episode of a dataset, also of one without program tables.
///
/// # Errors
///
/// When there is no such episode, with how many there are; or a table or a video cannot be read; or a picture of a
/// dataset of ours cannot be decoded.
pub fn play_back(root: &Path, episode: u64) -> Result<Playback, DatasetError> {
    if !has_programs(root) {
        let source = PlainSource::open(root)?;
        let position = source.position(episode)?;
        let of_episode = &source.episodes[position];
        let (path, first) = source.rows_of(of_episode)?;
        let frames = Frames::read(&path, first, of_episode.length as usize)?;
        let calls = label_calls(&source, position)?;
        let running = calls.iter().map(|call| call.frames).collect();
        let facts = EpisodeFacts { calls, ..plain_facts(&source, of_episode, &path) };
        return played(&source, of_episode, &frames, facts, running);
    }
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
    let source = PlainSource::open(root)?;
    let (path, row) = (found.row.data.in_dataset(root, layout::DATA), &found.row);
    let [first, n_rows] = [found.frames_before, row.n_frames].map(|number| usize::try_from(number).unwrap_or(0));
    let frames = Frames::read(&path, first, n_rows)?;
    let of_episode = &source.episodes[source.position(episode)?];
    played(&source, of_episode, &frames, episode_facts(found.row, calls), running)
}

/// What the rows of an episode show.
fn played(
    source: &PlainSource,
    episode: &PlainEpisode,
    frames: &Frames,
    facts: EpisodeFacts,
    running: Vec<[u32; 2]>,
) -> Result<Playback, DatasetError> {
    let mut cameras = Vec::new();
    for feature in source.info.features.iter().filter(|feature| feature.kind == DeclaredKind::Image) {
        let images = frames.images(&feature.name).map(TrackPictures::Images);
        let missing = || frames.problem(&format!("it has no column {} of encoded pictures", feature.name));
        cameras.push(camera(&feature.name, images.ok_or_else(missing)?));
    }
    for (feature, span) in source.info.videos().zip(&episode.videos) {
        let missing = || DatasetError::Count {
            path: source.episode_files[episode.own.0].clone(),
            problem: format!("it gives no place of {}", feature.name),
        };
        let span = span.ok_or_else(missing)?;
        let mp4 = crate::artifact::read(&source.info.video_file(&feature.name, span.file))?;
        cameras.push(camera(&feature.name, TrackPictures::Video { mp4, from_secs: span.from_secs }));
    }
    cameras.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(Playback { running, times_secs: frames.times_secs()?, numbers: frames.numbers(&source.info)?, cameras, facts })
}

/// The labels of an episode as calls below a root; none where it has none.
fn label_calls(source: &PlainSource, position: usize) -> Result<Vec<CallFacts>, DatasetError> {
    let Some(form) = LabelsForm::of(source) else { return Ok(Vec::new()) };
    let mut labels = PlainLabels::open(form);
    let spans = labels.of_episode(source, position)?;
    let whole = [0, u32::try_from(source.episodes[position].length).unwrap_or(u32::MAX)];
    let call = |caller_id, depth, program: &str, frames| CallFacts {
        call_id: 0,
        caller_id,
        depth,
        program: program.to_owned(),
        argument: None,
        input: whole,
        output: Some(frames),
        frames,
    };
    let mut calls = vec![call(None, 0, ROOT, whole)];
    let mut outer = 0;
    for span in spans {
        let text = labels.texts().get(span.text as usize).map_or("", String::as_str);
        let caller = if span.level == 1 { 0 } else { outer };
        if span.level == 1 {
            outer = calls.len() as u32;
        }
        calls.push(call(Some(caller), span.level, text, span.frames));
    }
    (0..).zip(&mut calls).for_each(|(id, call)| call.call_id = id);
    Ok(calls)
}

/// What is known of an episode without program tables.
fn plain_facts(source: &PlainSource, episode: &PlainEpisode, path: &Path) -> EpisodeFacts {
    let task = episode.tasks.first().cloned().unwrap_or_default();
    let relative = path.strip_prefix(source.info.root()).unwrap_or(path);
    EpisodeFacts {
        episode_index: episode.index,
        task_id: task.clone(),
        task_text: task,
        family: String::new(),
        split: source.info.split_of(episode.index.unsigned_abs()).unwrap_or_default().to_owned(),
        trial: 0,
        actor: String::new(),
        outcome: String::new(),
        n_frames: episode.length as i64,
        data_file: relative.display().to_string(),
        first_index: episode.rows[0],
        recording: String::new(),
        recording_sha256: String::new(),
        recording_index: episode.index,
        calls: Vec::new(),
    }
}

/// Makes sure that what is shown can be decoded. Datasets that were annotated elsewhere have codecs of their own.
fn check_pictures(root: &Path, episode: u64) -> Result<(), DatasetError> {
    let position = usize::try_from(episode).unwrap_or(usize::MAX);
    EpisodePictures::cameras(root)?.iter().try_for_each(|camera| EpisodePictures::open(root, camera)?.check(position))
}

fn camera(feature: &str, pictures: TrackPictures) -> CameraTrack {
    CameraTrack { name: feature.strip_prefix(PREFIX).unwrap_or(feature).to_owned(), pictures }
}

/// The rows of an episode, with all their columns.
struct Frames {
    path: PathBuf,
    rows: RecordBatch,
}

impl Frames {
    /// Some rows of a file.
    fn read(path: &Path, first: usize, n_rows: usize) -> Result<Self, DatasetError> {
        let mut reader = BatchReader::open_rows(path, first..first.saturating_add(n_rows))?;
        let mut batches = Vec::new();
        while let Some(batch) = reader.next_batch()? {
            batches.push(batch);
        }
        let rows = concat_batches(reader.schema(), &batches).map_err(TableError::arrow(path))?;
        let path = path.to_owned();
        if rows.num_rows() == n_rows {
            return Ok(Self { path, rows });
        }
        let problem = format!(
            "it ends after {} of the {n_rows} of an episode",
            rows.num_rows(),
            n_rows = counted(n_rows, "frame")
        );
        Err(DatasetError::Count { path, problem })
    }

    fn times_secs(&self) -> Result<Vec<f64>, DatasetError> {
        numbers(&self.rows, "timestamp").ok_or_else(|| self.problem("it has no column timestamp of numbers"))
    }

    /// Numeric features in the order of their columns, but for numbers of rows and labels.
    fn numbers(&self, info: &PlainInfo) -> Result<Vec<NumberTrack>, DatasetError> {
        let is_label =
            |name: &str| BOOKKEEPING.contains(&name) || ["ntp.", "next."].iter().any(|of| name.starts_with(of));
        let mut tracks = Vec::new();
        for (field, column) in self.rows.schema_ref().fields().iter().zip(self.rows.columns()) {
            let declared = info.feature(field.name()).filter(|feature| !is_label(&feature.name));
            let Some((feature, DeclaredKind::Numbers(dtype))) = declared.map(|of| (of, of.kind)) else { continue };
            let width = feature.width();
            let wrong = |_problem| self.problem(&format!("column {:?} is not as it is declared", feature.name));
            let flat = FlatNumbers::of(column, dtype, width).map_err(wrong)?;
            let mut values = Vec::new();
            copy_values(flat.values(width), 0..self.rows.num_rows(), &mut values);
            tracks.push(NumberTrack { feature: feature.name.clone(), names: names(feature), values });
        }
        Ok(tracks)
    }

    /// The encoded pictures of a column.
    fn images(&self, name: &str) -> Option<Vec<Vec<u8>>> {
        let bytes =
            cast(self.rows.column_by_name(name)?.as_struct_opt()?.column_by_name("bytes")?, &DataType::LargeBinary);
        let bytes = bytes.ok()?;
        let bytes = bytes.as_binary_opt::<i64>()?;
        let image = |row| if bytes.is_valid(row) { bytes.value(row).to_vec() } else { Vec::new() };
        Some((0..bytes.len()).map(image).collect())
    }

    fn problem(&self, problem: &str) -> DatasetError {
        DatasetError::Count { path: self.path.clone(), problem: problem.to_owned() }
    }
}

/// The names of a feature's dimensions, wherever they stand; their numbers where there are none.
fn names(feature: &Declared) -> Vec<String> {
    let of = |list: &serde_json::Value| -> Option<Vec<String>> { serde_json::from_value(list.clone()).ok() };
    let declared = &feature.json["names"];
    let in_map = || declared.as_object().and_then(|map| map.values().find_map(of));
    let names = of(declared).or_else(in_map).filter(|names| names.len() == feature.width());
    names.unwrap_or_else(|| (0..feature.width()).map(|dimension| dimension.to_string()).collect())
}
