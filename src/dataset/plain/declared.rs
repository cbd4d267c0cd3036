//! `meta/info.json` of anybody's dataset: what is declared, taken as readers take it, with what is wrong about it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::info::Dtype;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::plain::template::{Word, fill};

/// Which format a dataset follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PlainVersion {
    /// A file for each episode, and lines of JSON.
    V2_0,
    /// The same, with statistics of each episode.
    V2_1,
    /// Files of many episodes.
    V3_0,
}

/// What a feature holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeclaredKind {
    /// Numbers; as statistics take them.
    Numbers(Dtype),
    Text,
    /// Encoded pictures in a column.
    Image,
    /// Pictures in video files.
    Video,
    /// Rows of text in a column.
    Language,
    /// Of a type that no reader knows.
    Other,
}

/// One feature.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Declared {
    pub(crate) name: String,
    /// As it is written.
    pub(crate) dtype: String,
    pub(crate) kind: DeclaredKind,
    pub(crate) shape: Vec<usize>,
    /// As it is declared.
    pub(crate) json: Value,
}

/// Something that is wrong in `meta/info.json`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Problem {
    /// As schemas/findings.md has it.
    pub(crate) code: &'static str,
    pub(crate) place: String,
    pub(crate) message: String,
}

/// What a dataset declares.
#[derive(Clone, Debug)]
pub(crate) struct PlainInfo {
    root: PathBuf,
    /// The file as it is.
    pub(crate) json: Value,
    pub(crate) version: PlainVersion,
    pub(crate) fps: f64,
    pub(crate) features: Vec<Declared>,
    pub(crate) splits: Vec<(String, Range<u64>)>,
    chunks_size: u32,
    data_path: String,
    video_path: String,
    pub(crate) problems: Vec<Problem>,
}

/// Types of numbers that `datasets` reads, and as what statistics take them.
const NUMBERS: [(&str, Dtype); 14] = [
    ("float32", Dtype::Float32),
    ("float64", Dtype::Float64),
    ("int64", Dtype::Int64),
    ("bool", Dtype::Bool),
    ("float16", Dtype::Float32),
    ("int8", Dtype::Int64),
    ("int16", Dtype::Int64),
    ("int32", Dtype::Int64),
    ("uint8", Dtype::Int64),
    ("uint16", Dtype::Int64),
    ("uint32", Dtype::Int64),
    ("uint64", Dtype::Int64),
    ("float", Dtype::Float32),
    ("double", Dtype::Float64),
];

/// Those of them that every reader takes.
const N_SAFE: usize = 4;

/// The most numbers that a row can have in one feature: those of a picture of 4096x4096 pixels.
const MOST_NUMBERS: usize = 3 << 24;

/// Columns that a dataset must have.
pub(crate) const REQUIRED: [&str; 5] = ["timestamp", "frame_index", "episode_index", "index", "task_index"];

impl PlainInfo {
    /// Reads the file. What can be passed over is a problem; what cannot is an error.
    pub(crate) fn read(root: &Path) -> Result<Self, DatasetError> {
        let path = root.join(layout::INFO);
        let json: Value = read_json(&path)?;
        let wrong = |problem: String| DatasetError::Count { path: path.clone(), problem };
        let version = match json["codebase_version"].as_str() {
            Some("v3.0") => PlainVersion::V3_0,
            Some("v2.1") => PlainVersion::V2_1,
            Some("v2.0") => PlainVersion::V2_0,
            _ => {
                let found = &json["codebase_version"];
                return Err(wrong(format!("codebase_version is {found}; v3.0, v2.1 and v2.0 are read")));
            }
        };
        let fps = json["fps"].as_f64().filter(|fps| *fps > 0.0 && fps.is_finite());
        let fps = fps.ok_or_else(|| wrong(format!("fps is {}, expected a number above 0", json["fps"])))?;
        let declared = json["features"].as_object();
        let declared = declared.ok_or_else(|| wrong("features is missing, or no object".to_owned()))?;
        let mut problems = Vec::new();
        let features = declared.iter().map(|(name, feature)| Declared::read(name, feature, &mut problems)).collect();
        let splits = read_splits(&json["splits"], &mut problems);
        for key in ["total_episodes", "total_frames", "total_tasks"] {
            if !json[key].is_null() && json[key].as_u64().is_none() {
                let message = format!("it is {}, expected a whole number", json[key]);
                problems.push(Problem { code: "info.value", place: key.to_owned(), message });
            }
        }
        let template = |key: &str, default: &str| json[key].as_str().unwrap_or(default).to_owned();
        let [data, video] = version.templates();
        let info = Self {
            root: root.to_owned(),
            version,
            fps,
            features,
            splits,
            chunks_size: json["chunks_size"].as_u64().and_then(|size| u32::try_from(size).ok()).unwrap_or(1000).max(1),
            data_path: template("data_path", data),
            video_path: template("video_path", video),
            problems,
            json,
        };
        info.checked()
    }

    /// Makes sure that the templates can be filled in.
    fn checked(mut self) -> Result<Self, DatasetError> {
        let wrong = |key: &str, template: &str| DatasetError::Count {
            path: self.root.join(layout::INFO),
            problem: format!("{key} is {template:?}, which names something unknown"),
        };
        let (place, root) = (FilePlace::default(), Path::new(""));
        if self.filled(root, &self.data_path, place, "").is_none() {
            return Err(wrong("data_path", &self.data_path));
        }
        if self.filled(root, &self.video_path, place, "").is_none() {
            return Err(wrong("video_path", &self.video_path));
        }
        let missing: Vec<&str> = REQUIRED.into_iter().filter(|name| self.feature(name).is_none()).collect();
        for name in missing {
            let message = format!("{name:?} is not declared: every dataset has it");
            self.problems.push(Problem { code: "info.features", place: name.to_owned(), message });
        }
        Ok(self)
    }

    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// A feature by its name.
    pub(crate) fn feature(&self, name: &str) -> Option<&Declared> {
        self.features.iter().find(|feature| feature.name == name)
    }

    /// The features that are videos, in order.
    pub(crate) fn videos(&self) -> impl Iterator<Item = &Declared> {
        self.features.iter().filter(|feature| feature.kind == DeclaredKind::Video)
    }

    /// What the file counts, where it does.
    pub(crate) fn total(&self, key: &str) -> Option<u64> {
        self.json[key].as_u64()
    }

    /// The file of some frames.
    pub(crate) fn data_file(&self, place: FilePlace) -> PathBuf {
        self.filled(&self.root, &self.data_path, place, "").unwrap_or_default()
    }

    /// The file of a video.
    pub(crate) fn video_file(&self, feature: &str, place: FilePlace) -> PathBuf {
        self.filled(&self.root, &self.video_path, place, feature).unwrap_or_default()
    }

    /// Where the files of an episode are that has files of its own.
    pub(crate) fn place_of_episode(&self, episode: u32) -> FilePlace {
        FilePlace { chunk: episode / self.chunks_size, file: episode }
    }

    fn filled(&self, root: &Path, template: &str, place: FilePlace, video: &str) -> Option<PathBuf> {
        let words = [
            ("chunk_index", Word::Number(place.chunk)),
            ("file_index", Word::Number(place.file)),
            ("episode_chunk", Word::Number(place.chunk)),
            ("episode_index", Word::Number(place.file)),
            ("video_key", Word::Text(video)),
        ];
        Some(root.join(fill(template, &words)?))
    }

    /// The split of an episode; the first of several.
    pub(crate) fn split_of(&self, episode: u64) -> Option<&str> {
        self.splits.iter().find(|(_, range)| range.contains(&episode)).map(|(name, _)| name.as_str())
    }
}

impl PlainVersion {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::V2_0 => "v2.0",
            Self::V2_1 => "v2.1",
            Self::V3_0 => "v3.0",
        }
    }

    /// Whether an episode has files of its own.
    pub(crate) fn is_by_episode(self) -> bool {
        self != Self::V3_0
    }

    fn templates(self) -> [&'static str; 2] {
        match self {
            Self::V3_0 => [
                "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
                "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
            ],
            Self::V2_0 | Self::V2_1 => [
                "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
                "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4",
            ],
        }
    }
}

impl Declared {
    fn read(name: &str, json: &Value, problems: &mut Vec<Problem>) -> Self {
        let mut problem = |code, message: String| problems.push(Problem { code, place: name.to_owned(), message });
        if let Some(key) = ["dtype", "shape", "names"].into_iter().find(|key| json.get(key).is_none()) {
            problem(
                "info.features",
                format!("{key:?} is missing: LeRobot takes dtype, shape and names of every feature"),
            );
        }
        if name.contains('/') {
            problem("info.features", "a name with a slash: LeRobot refuses it".to_owned());
        }
        let dtype = json["dtype"].as_str().unwrap_or_default().to_owned();
        let number = NUMBERS.iter().position(|(known, _)| *known == dtype);
        let kind = match (dtype.as_str(), number) {
            (_, Some(at)) => DeclaredKind::Numbers(NUMBERS[at].1),
            ("string", _) => DeclaredKind::Text,
            ("image", _) => DeclaredKind::Image,
            ("video", _) => DeclaredKind::Video,
            ("language", _) => DeclaredKind::Language,
            _ => DeclaredKind::Other,
        };
        if kind == DeclaredKind::Other {
            problem("info.features", format!("dtype {dtype:?} is known to no reader"));
        }
        if number.is_some_and(|at| at >= N_SAFE) {
            problem("info.dtype", format!("dtype {dtype:?}: LeRobot reads it, Rerun refuses the dataset for it"));
        }
        let sides = json["shape"].as_array().map(Vec::as_slice).unwrap_or_default();
        let side = |side: &Value| side.as_u64().and_then(|side| usize::try_from(side).ok());
        let shape = sides.iter().map(side).collect::<Option<Vec<usize>>>().filter(|shape| is_of_a_row(shape));
        let shape = shape.unwrap_or_default();
        let is_picture = matches!(kind, DeclaredKind::Image | DeclaredKind::Video);
        if shape.is_empty() || shape.contains(&0) || (is_picture && shape.len() != 3) {
            let found = &json["shape"];
            problem("info.features", format!("shape is {found}, expected {}", Self::allowed_shape()));
        }
        let declared = Self { name: name.to_owned(), dtype, kind, shape, json: json.clone() };
        if is_picture && !declared.has_three_names() {
            let message = format!("names is {}, expected three of sides: LeRobot's policies fail on it", json["names"]);
            problem("info.names", message);
        }
        declared
    }

    /// What a shape is to be, in words.
    pub(crate) fn allowed_shape() -> String {
        format!("sides above 0, of pictures three, and at most {MOST_NUMBERS} numbers in all")
    }

    /// Whether its shape says how many numbers a row has; an empty one is taken for a single number.
    pub(crate) fn has_shape(&self) -> bool {
        !self.shape.is_empty() || self.json["shape"].as_array().is_some_and(Vec::is_empty)
    }

    /// Numbers of a row.
    pub(crate) fn width(&self) -> usize {
        self.shape.iter().product()
    }

    /// Width and height of pictures, in pixels. Where names do not tell which side is which, the side of at most four
    /// is that of the channels.
    pub(crate) fn size_px(&self) -> Option<[u32; 2]> {
        let &[a, b, c] = &self.shape[..] else { return None };
        let names = self.json["names"].as_array();
        let side = |name: &str| {
            let at = names?.iter().position(|of| of.as_str().is_some_and(|of| of == name || of == &name[..1]))?;
            self.shape.get(at).copied()
        };
        let by_shape = if c <= 4 { (b, a) } else { (c, b) };
        let (width, height) = side("width").zip(side("height")).unwrap_or(by_shape);
        Some([u32::try_from(width).ok()?, u32::try_from(height).ok()?])
    }

    /// What is declared of a video under a name such as `video.codec`; older datasets have another place for it.
    pub(crate) fn video(&self, key: &str) -> Option<&Value> {
        let of = |place: &str| self.json.get(place)?.get(key);
        of("info").or_else(|| of("video_info"))
    }

    /// Whether sides of a picture have names: policies look at the third.
    fn has_three_names(&self) -> bool {
        self.json["names"].as_array().is_some_and(|names| names.len() >= 3)
    }
}

/// Whether a row can have so many numbers.
fn is_of_a_row(shape: &[usize]) -> bool {
    let n_numbers = shape.iter().try_fold(1_usize, |n, &side| n.checked_mul(side));
    n_numbers.is_some_and(|n| n <= MOST_NUMBERS)
}

/// Ranges of episodes by name; other forms than `0:50` are problems.
fn read_splits(json: &Value, problems: &mut Vec<Problem>) -> Vec<(String, Range<u64>)> {
    let all: BTreeMap<&String, &Value> = json.as_object().into_iter().flatten().collect();
    let mut splits = Vec::new();
    for (name, value) in all {
        let range = value.as_str().and_then(|text| {
            let (begin, end) = text.split_once(':')?;
            let (begin, end) = (begin.trim().parse::<u64>().ok()?, end.trim().parse::<u64>().ok()?);
            (begin <= end).then_some(begin..end)
        });
        match range {
            Some(range) => splits.push((name.clone(), range)),
            None => problems.push(Problem {
                code: "info.value",
                place: format!("splits, {name}"),
                message: format!("it is {value}, expected a range of episodes such as \"0:50\""),
            }),
        }
    }
    splits.sort_by_key(|(_, range)| (range.start, range.end));
    splits
}
