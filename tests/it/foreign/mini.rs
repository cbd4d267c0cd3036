//! A small `LeRobotDataset` as others write them, put together column by column.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{
    ArrayRef, FixedSizeListArray, Float32Array, Float64Array, Int64Array, ListArray, RecordBatch, StringArray,
};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field, Schema};
use ntp::video::{H264Encoder, Mp4Writer};
use parquet::arrow::ArrowWriter;
use parquet::basic::Compression;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use serde_json::{Value, json};

/// What a dataset is made of. Episodes are of 6, 5 and 4 frames at 10 a second, of two tasks.
pub(crate) struct Mini {
    pub(crate) lengths: Vec<usize>,
    pub(crate) frames: Vec<(String, ArrayRef)>,
    pub(crate) episodes: Vec<(String, ArrayRef)>,
    pub(crate) info: Value,
    pub(crate) stats: Value,
    /// Whether pandas takes the task texts for the index.
    pub(crate) is_indexed: bool,
    pub(crate) subtasks: Option<Vec<&'static str>>,
    pub(crate) compression: Compression,
}

pub(crate) const TASKS: [&str; 2] = ["pick the cube", "open the drawer"];
pub(crate) const CAMERA: &str = "observation.images.front";
pub(crate) const SIZE_PX: [u32; 2] = [64, 48];

/// A feature of one number.
pub(crate) fn one(dtype: &str) -> Value {
    json!({ "dtype": dtype, "shape": [1], "names": null })
}

/// A column of whole numbers.
pub(crate) fn whole(numbers: impl IntoIterator<Item = i64>) -> ArrayRef {
    Arc::new(Int64Array::from_iter_values(numbers))
}

/// A column of doubles.
pub(crate) fn doubles(numbers: impl IntoIterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(numbers))
}

/// A list a row, of values one after another.
pub(crate) fn lists(values: ArrayRef, lengths: &[usize]) -> ArrayRef {
    let item = Arc::new(Field::new("element", values.data_type().clone(), true));
    Arc::new(ListArray::new(item, OffsetBuffer::from_lengths(lengths.iter().copied()), values, None))
}

impl Mini {
    pub(crate) fn new() -> Self {
        Self::of_lengths(&[6, 5, 4])
    }

    pub(crate) fn of_lengths(lengths: &[usize]) -> Self {
        let n_frames: usize = lengths.iter().sum();
        let places: Vec<(i64, i64, usize)> = lengths
            .iter()
            .enumerate()
            .flat_map(|(episode, &length)| (0..length).map(move |frame| (episode as i64, frame as i64, length)))
            .collect();
        let actions: Vec<f32> = (0..n_frames).flat_map(|row| [0.5, row as f32]).collect();
        let item = Arc::new(Field::new("element", DataType::Float32, false));
        let action = FixedSizeListArray::new(item, 2, Arc::new(Float32Array::from(actions)), None);
        let frames: Vec<(String, ArrayRef)> = vec![
            ("action".into(), Arc::new(action)),
            ("timestamp".into(), Arc::new(Float32Array::from_iter_values(places.iter().map(|of| of.1 as f32 / 10.0)))),
            ("frame_index".into(), whole(places.iter().map(|of| of.1))),
            ("episode_index".into(), whole(places.iter().map(|of| of.0))),
            ("index".into(), whole(0..n_frames as i64)),
            ("task_index".into(), whole(places.iter().map(|of| of.0 % 2))),
            ("subtask_index".into(), whole(places.iter().map(|of| of.1 * 2 / of.2 as i64))),
        ];
        let n = lengths.len();
        let begins: Vec<i64> = (0..n).map(|at| lengths[..at].iter().sum::<usize>() as i64).collect();
        let ends = begins.iter().zip(lengths).map(|(begin, length)| begin + *length as i64);
        let zeros = || whole(std::iter::repeat_n(0, n));
        let tasks: StringArray = (0..n).map(|at| Some(TASKS[at % 2])).collect();
        let episodes: Vec<(String, ArrayRef)> = vec![
            ("episode_index".into(), whole(0..n as i64)),
            ("tasks".into(), lists(Arc::new(tasks), &vec![1; n])),
            ("length".into(), whole(lengths.iter().map(|&length| length as i64))),
            ("data/chunk_index".into(), zeros()),
            ("data/file_index".into(), zeros()),
            ("dataset_from_index".into(), whole(begins.iter().copied())),
            ("dataset_to_index".into(), whole(ends)),
            ("meta/episodes/chunk_index".into(), zeros()),
            ("meta/episodes/file_index".into(), zeros()),
        ];
        let mut features = json!({ "action": { "dtype": "float32", "shape": [2], "names": ["x", "y"] } });
        features["timestamp"] = one("float32");
        for name in ["frame_index", "episode_index", "index", "task_index", "subtask_index"] {
            features[name] = one("int64");
        }
        let info = json!({
            "codebase_version": "v3.0", "robot_type": "so101", "fps": 10, "features": features,
            "total_episodes": n, "total_frames": n_frames, "total_tasks": 2, "chunks_size": 1000,
            "data_files_size_in_mb": 100, "video_files_size_in_mb": 200, "splits": { "train": format!("0:{n}") },
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4",
        });
        let last = n_frames as f64 - 1.0;
        let mean = last / 2.0;
        let stats = json!({
            "action": { "min": [0.5, 0], "max": [0.5, last], "mean": [0.5, mean], "std": [0.0, 1.0], "count": [n_frames] },
            "subtask_index": { "min": [0], "max": [1], "mean": [places.iter().map(|of| of.1 * 2 / of.2 as i64).sum::<i64>() as f64 / n_frames as f64], "std": [0.5], "count": [n_frames] },
        });
        let subtasks = Some(vec!["reach", "lift"]);
        let compression = Compression::SNAPPY;
        Self { lengths: lengths.to_vec(), frames, episodes, info, stats, is_indexed: true, subtasks, compression }
    }

    /// Adds a column of frames with its feature.
    pub(crate) fn column(&mut self, name: &str, feature: Value, column: ArrayRef) -> &mut Self {
        self.frames.push((name.to_owned(), column));
        self.info["features"][name] = feature;
        self
    }

    /// Takes another column for one of frames.
    pub(crate) fn replace(&mut self, name: &str, column: ArrayRef) -> &mut Self {
        let (_, old) = self.frames.iter_mut().find(|(known, _)| known == name).unwrap();
        *old = column;
        self
    }

    /// Declares a camera whose video holds all episodes, one behind the other.
    pub(crate) fn camera(&mut self) -> &mut Self {
        let n = self.lengths.len();
        let begins: Vec<f64> = (0..n).map(|at| self.lengths[..at].iter().sum::<usize>() as f64 / 10.0).collect();
        let ends: Vec<f64> =
            begins.iter().zip(&self.lengths).map(|(begin, length)| begin + *length as f64 / 10.0).collect();
        for (name, column) in [
            ("chunk_index", whole(std::iter::repeat_n(0, n))),
            ("file_index", whole(std::iter::repeat_n(0, n))),
            ("from_timestamp", doubles(begins)),
            ("to_timestamp", doubles(ends)),
        ] {
            self.episodes.push((format!("videos/{CAMERA}/{name}"), column));
        }
        self.info["features"][CAMERA] = json!({
            "dtype": "video", "shape": [SIZE_PX[1], SIZE_PX[0], 3], "names": ["height", "width", "channels"],
            "info": { "video.codec": "h264", "video.fps": 10.0, "is_depth_map": false },
        });
        self
    }

    /// Writes the video of the camera; episodes begin at key frames if they shall.
    pub(crate) fn write_video(&self, root: &Path, has_keys: bool) {
        let path = root.join(format!("videos/{CAMERA}/chunk-000/file-000.mp4"));
        let mut writer = Mp4Writer::create(&path, SIZE_PX, 10).unwrap();
        let mut encoder = H264Encoder::new(SIZE_PX, 10).unwrap();
        let mut shown = 0_u32;
        for &length in &self.lengths {
            for frame in 0..length {
                let picture: Vec<u8> = (0..SIZE_PX[0] * SIZE_PX[1] * 3).map(|at| (at / 7 + shown * 9) as u8).collect();
                let mut packet = Vec::new();
                encoder.encode(&picture, shown == 0 || (has_keys && frame == 0), &mut packet).unwrap();
                writer.write(&packet).unwrap();
                shown += 1;
            }
        }
        writer.finish().unwrap();
    }

    pub(crate) fn write(&self, root: &Path) {
        let write = |file: &str, columns: &[(String, ArrayRef)], pandas: Option<&str>| {
            write_table(&root.join(file), columns, pandas, self.compression);
        };
        write("data/chunk-000/file-000.parquet", &self.frames, None);
        write("meta/episodes/chunk-000/file-000.parquet", &self.episodes, None);
        let texts = |number: &str, text: &str, texts: &[&str]| {
            let column: ArrayRef = Arc::new(StringArray::from_iter_values(texts));
            vec![(number.to_owned(), whole(0..texts.len() as i64)), (text.to_owned(), column)]
        };
        let index = self.is_indexed.then_some("task");
        write("meta/tasks.parquet", &texts("task_index", "task", &TASKS), index);
        if let Some(subtasks) = &self.subtasks {
            write("meta/subtasks.parquet", &texts("subtask_index", "subtask", subtasks), Some("subtask"));
        }
        std::fs::write(root.join("meta/info.json"), self.info.to_string()).unwrap();
        std::fs::write(root.join("meta/stats.json"), self.stats.to_string()).unwrap();
    }

    /// The same in the format v2.1: a file an episode, lines of JSON.
    pub(crate) fn write_v21(&self, root: &Path) {
        let rows =
            RecordBatch::try_from_iter(self.frames.iter().map(|(name, column)| (name, Arc::clone(column)))).unwrap();
        let mut begin = 0;
        let (mut episodes, mut stats) = (String::new(), String::new());
        for (at, &length) in self.lengths.iter().enumerate() {
            let part = rows.slice(begin, length);
            let columns: Vec<(String, ArrayRef)> = self
                .frames
                .iter()
                .zip(part.columns())
                .map(|((name, _), column)| (name.clone(), Arc::clone(column)))
                .collect();
            write_table(
                &root.join(format!("data/chunk-000/episode_{at:06}.parquet")),
                &columns,
                None,
                self.compression,
            );
            begin += length;
            episodes
                .push_str(&format!("{}\n", json!({ "episode_index": at, "tasks": [TASKS[at % 2]], "length": length })));
            let of = json!({ "index": { "min": [0], "max": [1], "mean": [0.5], "std": [0.1], "count": [length] } });
            stats.push_str(&format!("{}\n", json!({ "episode_index": at, "stats": of })));
        }
        let mut info = self.info.clone();
        info["codebase_version"] = json!("v2.1");
        info["data_path"] = json!("data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet");
        info["video_path"] = json!("videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4");
        std::fs::create_dir_all(root.join("meta")).unwrap();
        let tasks: String = TASKS
            .iter()
            .enumerate()
            .map(|(at, task)| format!("{}\n", json!({ "task_index": at, "task": task })))
            .collect();
        for (file, text) in [
            ("info.json", info.to_string()),
            ("episodes.jsonl", episodes),
            ("episodes_stats.jsonl", stats),
            ("tasks.jsonl", tasks),
        ] {
            std::fs::write(root.join("meta").join(file), text).unwrap();
        }
    }
}

/// Writes a table; `pandas` is the column that pandas makes the index.
pub(crate) fn write_table(path: &Path, columns: &[(String, ArrayRef)], pandas: Option<&str>, compression: Compression) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let fields: Vec<Field> =
        columns.iter().map(|(name, column)| Field::new(name, column.data_type().clone(), true)).collect();
    let schema = Arc::new(Schema::new(fields));
    let arrays = columns.iter().map(|(_, column)| Arc::clone(column)).collect();
    let rows = RecordBatch::try_new(Arc::clone(&schema), arrays).unwrap();
    let pandas = pandas.map(|index| {
        vec![KeyValue::new("pandas".to_owned(), json!({ "index_columns": [index], "columns": [] }).to_string())]
    });
    let properties = WriterProperties::builder().set_compression(compression).set_key_value_metadata(pandas).build();
    let file = std::fs::File::create(path).unwrap();
    let mut writer = ArrowWriter::try_new(file, schema, Some(properties)).unwrap();
    writer.write(&rows).unwrap();
    writer.close().unwrap();
}
