//! The JSON files of a dataset: `meta/info.json`, `meta/stats.json` and `ntp/info.json`.

use std::collections::BTreeMap;

use serde::ser::SerializeMap as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::dataset::files::layout::CHUNK_FILES;
use crate::words::or_nothing;

/// The format that `meta/` and `data/` follow.
pub(crate) const LEROBOT_VERSION: &str = "v3.0";
/// The format that `ntp/` follows.
pub(crate) const NTP_VERSION: u32 = 1;
const VIDEO_FILE_MEGABYTES: u32 = 200;

/// `meta/info.json`. Templates and order of keys are `LeRobot`'s own: some readers take them literally.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Info {
    pub(crate) codebase_version: String,
    #[serde(default, deserialize_with = "or_unknown")]
    pub(crate) robot_type: String,
    pub(crate) total_episodes: u64,
    pub(crate) total_frames: u64,
    pub(crate) total_tasks: u64,
    pub(crate) chunks_size: u32,
    pub(crate) data_files_size_in_mb: u32,
    pub(crate) video_files_size_in_mb: u32,
    #[serde(serialize_with = "as_whole_where_it_is")]
    pub(crate) fps: f64,
    #[serde(default)]
    pub(crate) splits: BTreeMap<String, String>,
    pub(crate) data_path: String,
    #[serde(default, deserialize_with = "or_unknown")]
    pub(crate) video_path: String,
    #[serde(serialize_with = "in_order")]
    pub(crate) features: Features,
}

/// Features in the order of their columns; as read, in that of their names.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(from = "BTreeMap<String, FeatureInfo>")]
pub(crate) struct Features(pub(crate) Vec<(String, FeatureInfo)>);

/// One feature of `meta/info.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct FeatureInfo {
    pub(crate) dtype: Dtype,
    pub(crate) shape: Vec<usize>,
    #[serde(default, deserialize_with = "names_of_values")]
    pub(crate) names: Option<Vec<String>>,
    /// Of videos alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) info: Option<CameraInfo>,
}

/// What one value of a feature is, among the types that all readers know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Dtype {
    Float32,
    Float64,
    Int64,
    Bool,
    String,
    /// Encoded pictures in a column.
    Image,
    /// Pictures in video files beside the tables.
    Video,
    /// Rows of text in a column.
    Language,
    /// Of others: numbers of other sizes.
    #[serde(other)]
    Other,
}

/// What is wrong where `meta/info.json` counts other episodes and frames than there are.
pub(crate) fn counts_problem(counted: [Option<u64>; 2], there_are: [u64; 2]) -> String {
    let ([episodes, frames], [n_episodes, n_frames]) = (counted.map(or_nothing), there_are);
    format!("it counts {episodes} episodes and {frames} frames, but there are {n_episodes} and {n_frames}")
}

impl Dtype {
    /// As it stands in the file.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Float32 => "float32",
            Self::Float64 => "float64",
            Self::Int64 => "int64",
            Self::Bool => "bool",
            Self::String => "string",
            Self::Image => "image",
            Self::Video => "video",
            Self::Language => "language",
            Self::Other => "a number of another size",
        }
    }
}

/// What `LeRobot` wants to know of a video.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
#[derive(Default)]
pub(crate) struct CameraInfo {
    #[serde(rename = "video.height")]
    height: u32,
    #[serde(rename = "video.width")]
    width: u32,
    #[serde(rename = "video.codec")]
    codec: String,
    #[serde(rename = "video.pix_fmt")]
    pix_fmt: String,
    #[serde(rename = "video.is_depth_map", alias = "is_depth_map")]
    is_depth_map: bool,
    #[serde(rename = "video.fps", serialize_with = "as_whole_where_it_is")]
    fps: f64,
    #[serde(rename = "video.channels")]
    channels: u32,
    has_audio: bool,
}

/// A rate as LeRobot writes it: whole where it is.
pub(crate) fn as_whole_where_it_is<S: Serializer>(fps: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if fps.fract() == 0.0 { serializer.serialize_u64(*fps as u64) } else { serializer.serialize_f64(*fps) }
}

/// Others leave out texts that say nothing of a dataset, or give none.
fn or_unknown<'de, D: Deserializer<'de>>(deserializer: D) -> Result<String, D::Error> {
    Ok(Option::<String>::deserialize(deserializer)?.unwrap_or_default())
}

impl CameraInfo {
    /// Of a video in H.264.
    pub(crate) fn h264([width, height]: [u32; 2], fps: f64) -> Self {
        let (codec, pix_fmt) = ("h264".to_owned(), "yuv420p".to_owned());
        Self { height, width, codec, pix_fmt, is_depth_map: false, fps, channels: 3, has_audio: false }
    }

    /// What its pictures are encoded by.
    pub(crate) fn codec(&self) -> &str {
        &self.codec
    }
}

/// Others also give names as a map of lists, which say nothing that is needed here.
fn names_of_values<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Vec<String>>, D::Error> {
    let names = serde_json::Value::deserialize(deserializer)?;
    Ok(serde_json::from_value(names).unwrap_or_default())
}

/// What a dataset counts.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Totals {
    pub(crate) episodes: u64,
    pub(crate) frames: u64,
    pub(crate) tasks: u64,
}

impl From<BTreeMap<String, FeatureInfo>> for Features {
    fn from(features: BTreeMap<String, FeatureInfo>) -> Self {
        Self(features.into_iter().collect())
    }
}

fn in_order<S: Serializer>(features: &Features, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(features.0.iter().map(|(name, feature)| (name, feature)))
}

impl Info {
    /// Rows a second of a dataset of ours, which are whole.
    pub(crate) fn whole_fps(&self) -> u32 {
        self.fps as u32
    }

    pub(crate) fn new(totals: Totals, features: Features, fps: f64, file_megabytes: u32) -> Self {
        Self {
            codebase_version: LEROBOT_VERSION.to_owned(),
            robot_type: "ntp_gripper".to_owned(),
            total_episodes: totals.episodes,
            total_frames: totals.frames,
            total_tasks: totals.tasks,
            chunks_size: CHUNK_FILES,
            data_files_size_in_mb: file_megabytes,
            video_files_size_in_mb: VIDEO_FILE_MEGABYTES,
            fps,
            splits: BTreeMap::from([("train".to_owned(), format!("0:{}", totals.episodes))]),
            data_path: "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet".to_owned(),
            video_path: "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4".to_owned(),
            features,
        }
    }
}

/// `meta/stats.json`: statistics of numbers by feature, in the order of the columns, then those of pictures.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stats<N, P>(pub(crate) Vec<(String, N)>, pub(crate) Vec<(String, P)>);

impl<N: Serialize, P: Serialize> Serialize for Stats<N, P> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len() + self.1.len()))?;
        self.0.iter().try_for_each(|(name, statistics)| map.serialize_entry(name, statistics))?;
        self.1.iter().try_for_each(|(name, statistics)| map.serialize_entry(name, statistics))?;
        map.end()
    }
}

/// `ntp/info.json`: what the program tables are made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NtpInfo {
    pub(crate) schema_version: u32,
    pub(crate) ntp_version: String,
    pub(crate) frames: String,
    pub(crate) families: Vec<String>,
    pub(crate) n_slots: usize,
    /// Names of the slots where all episodes have the same, else `slot_0` and so on.
    pub(crate) slots: Vec<String>,
    pub(crate) vocabulary: Vec<String>,
    pub(crate) vocabulary_hash: String,
    pub(crate) total_calls: u64,
    pub(crate) total_scopes: u64,
    pub(crate) failed_left_out: u64,
    /// What its programs were read from where they were annotated elsewhere: they are texts then, unless it was
    /// [`BY_MODEL`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) annotated_by: Option<String>,
}

/// What `annotated_by` says of a dataset whose calls are what a model of ours made of demonstrations.
pub(crate) const BY_MODEL: &str = "model";

impl NtpInfo {
    /// Whether its calls are of our programs. Else they are texts, as runs of frames that share none.
    pub(crate) fn has_our_programs(&self) -> bool {
        self.annotated_by.as_ref().is_none_or(|by| by == BY_MODEL)
    }
}
