//! The dataset that is being written: rows, episodes, files.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, Float32Array, Int64Array, RecordBatch};
use arrow::datatypes::{DataType, Field, Schema};

use crate::artifact::write_json;
use crate::dataset::files::info::{Dtype, FeatureInfo, Features, Info, LEROBOT_VERSION, Stats};
use crate::dataset::files::layout::{self, CHUNK_FILES, FilePlace};
use crate::dataset::plain::column::PlainColumn;
use crate::dataset::plain::feature::{Cell, PlainError, PlainFeature, PlainKind};
use crate::dataset::plain::meta::{self, MetaRow};
use crate::dataset::statistics::{NumericFeature, Statistics};
use crate::dataset::tables::texts::write::write_tasks;
use crate::table::{BatchWriter, TableError, TextTable, Values, WriteOptions};

/// Pictures of a feature that are held before they are written.
const GROUP_BYTES: usize = 12 << 20;
const MEGABYTE: u32 = 1 << 20;

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PlainSummary {
    pub(crate) episodes: u64,
    pub(crate) frames: u64,
    pub(crate) tasks: u64,
}

/// A dataset being written.
pub(crate) struct PlainWriter {
    root: PathBuf,
    fps: u32,
    robot_type: String,
    file_megabytes: u32,
    columns: Vec<PlainColumn>,
    statistics: Statistics,
    tasks: TextTable,
    /// Of the episode that is being written.
    task_index: i64,
    n_rows: u64,
    /// Rows of the episode that are in the file.
    n_flushed: u64,
    place: FilePlace,
    writer: Option<BatchWriter>,
    meta: Vec<MetaRow>,
    n_frames: u64,
}

impl PlainWriter {
    /// Begins a dataset in an empty folder.
    pub(crate) fn create(
        root: &Path,
        features: &[PlainFeature],
        fps: u32,
        robot_type: &str,
        file_megabytes: u32,
    ) -> Self {
        let file_bytes = (file_megabytes * MEGABYTE) as usize;
        let columns = features.iter().map(|feature| PlainColumn::new(root, feature, fps, file_bytes));
        let numeric = |feature: &PlainFeature| match &feature.kind {
            PlainKind::Numbers(dtype, names) => {
                let (name, width) = (feature.name.clone(), names.len());
                Some(NumericFeature { name, dtype: *dtype, width, is_of_episodes: true })
            }
            _ => None,
        };
        let of_row = |(name, dtype): (&str, Dtype)| {
            let name = name.to_owned();
            NumericFeature { name, dtype, width: 1, is_of_episodes: true }
        };
        let numeric = features.iter().filter_map(numeric).chain(ROW_NUMBERS.map(of_row)).collect();
        Self {
            root: root.to_owned(),
            fps,
            robot_type: robot_type.to_owned(),
            file_megabytes,
            columns: columns.collect(),
            statistics: Statistics::new(root, numeric),
            tasks: TextTable::default(),
            task_index: 0,
            n_rows: 0,
            n_flushed: 0,
            place: FilePlace::default(),
            writer: None,
            meta: Vec::new(),
            n_frames: 0,
        }
    }

    /// Begins an episode of a task.
    pub(crate) fn begin_episode(&mut self, task: &str) {
        self.task_index = i64::from(self.tasks.key(task));
        (self.n_rows, self.n_flushed) = (0, 0);
    }

    /// Adds a frame: a cell for each feature.
    pub(crate) fn row(&mut self, cells: Vec<Cell>) -> Result<(), PlainError> {
        let number = self.n_rows;
        let pairs = self.columns.iter_mut().zip(cells);
        pairs.into_iter().try_for_each(|(column, cell)| column.push(cell, number))?;
        self.n_rows += 1;
        if self.columns.iter().any(|column| column.n_picture_bytes() >= GROUP_BYTES) {
            self.flush()?;
        }
        Ok(())
    }

    /// Ends the episode; one without frames is none.
    pub(crate) fn end_episode(&mut self) -> Result<(), PlainError> {
        if self.n_rows == 0 {
            return Ok(());
        }
        self.flush()?;
        let row_numbers = self.row_numbers(0..self.n_rows);
        let mut values: Vec<(&str, Values<'_>)> = self.columns.iter().filter_map(PlainColumn::values).collect();
        values.extend(ROW_NUMBERS.iter().zip(row_numbers.values()).map(|((name, _), values)| (*name, values)));
        let n_rows = self.n_rows as usize;
        self.statistics.append(&values, &(0..n_rows));
        self.statistics.keep(&values, n_rows)?;
        let from = self.n_frames;
        self.n_frames += self.n_rows;
        let task = self.tasks.texts()[self.task_index as usize].clone();
        let mut row = MetaRow { task, length: self.n_rows, from, data: self.place, ..MetaRow::default() };
        row.statistics = meta::owned(self.statistics.columns());
        self.statistics.clear();
        for column in &mut self.columns {
            column.end_episode(&mut row)?;
        }
        self.meta.push(row);
        self.end_full_file()
    }

    /// Writes what is left, and the tables under `meta/`.
    pub(crate) fn finish(mut self) -> Result<PlainSummary, PlainError> {
        if self.meta.is_empty() {
            return Err(PlainError::NoEpisode);
        }
        if let Some(writer) = self.writer.take() {
            writer.commit()?;
        }
        meta::write(&self.root, &self.meta)?;
        write_tasks(&self.root, self.tasks.texts())?;
        let (episodes, tasks) = (self.meta.len() as u64, self.tasks.texts().len() as u64);
        let summary = PlainSummary { episodes, frames: self.n_frames, tasks };
        write_json(&self.root.join(layout::INFO), &self.info(summary))?;
        let mut pictures = Vec::new();
        for column in self.columns {
            pictures.extend(column.finish()?);
        }
        write_json(&self.root.join(layout::STATS), &Stats(self.statistics.finish()?, pictures))?;
        Ok(summary)
    }

    /// Writes the rows that are held as a row group.
    fn flush(&mut self) -> Result<(), PlainError> {
        let rows = self.n_flushed..self.n_rows;
        if rows.is_empty() {
            return Ok(());
        }
        let range = rows.start as usize..rows.end as usize;
        let mut fields = Vec::new();
        let mut arrays: Vec<ArrayRef> = Vec::new();
        for column in &mut self.columns {
            if let Some((field, array)) = column.array(&range)? {
                fields.push(field);
                arrays.push(array);
            }
        }
        let numbers = self.row_numbers(rows.clone());
        fields.extend(ROW_NUMBERS.map(|(name, dtype)| {
            let kind = if dtype == Dtype::Float32 { DataType::Float32 } else { DataType::Int64 };
            Field::new(name, kind, false)
        }));
        arrays.extend(numbers.arrays());
        let schema = Arc::new(Schema::new(fields));
        let path = self.place.in_dataset(&self.root, layout::DATA);
        let batch = RecordBatch::try_new(Arc::clone(&schema), arrays).map_err(TableError::arrow(&path))?;
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => BatchWriter::create(&path, "frames", &schema, WriteOptions::default())?,
        };
        writer.write(&batch)?;
        self.writer = Some(writer);
        self.n_flushed = self.n_rows;
        Ok(())
    }

    fn end_full_file(&mut self) -> Result<(), PlainError> {
        let is_full = |writer: &BatchWriter| writer.bytes_written() >= (self.file_megabytes * MEGABYTE) as usize;
        if self.writer.as_ref().is_some_and(is_full)
            && let Some(writer) = self.writer.take()
        {
            writer.commit()?;
            self.place = self.place.next();
        }
        Ok(())
    }

    fn row_numbers(&self, rows: std::ops::Range<u64>) -> RowNumbers {
        let n = (rows.end - rows.start) as usize;
        RowNumbers {
            timestamps: rows.clone().map(|row| (row as f64 / f64::from(self.fps)) as f32).collect(),
            frames: rows.clone().map(|row| row as i64).collect(),
            episodes: vec![self.meta.len() as i64; n],
            indices: rows.map(|row| (self.n_frames + row) as i64).collect(),
            tasks: vec![self.task_index; n],
        }
    }

    fn info(&self, summary: PlainSummary) -> Info {
        let of_row = |(name, dtype): (&str, Dtype)| {
            (name.to_owned(), FeatureInfo { dtype, shape: vec![1], names: None, info: None })
        };
        let features = self.columns.iter().map(PlainColumn::declared).chain(ROW_NUMBERS.map(of_row));
        Info {
            codebase_version: LEROBOT_VERSION.to_owned(),
            robot_type: self.robot_type.clone(),
            total_episodes: summary.episodes,
            total_frames: summary.frames,
            total_tasks: summary.tasks,
            chunks_size: CHUNK_FILES,
            data_files_size_in_mb: self.file_megabytes,
            video_files_size_in_mb: self.file_megabytes,
            fps: f64::from(self.fps),
            splits: [("train".to_owned(), format!("0:{}", summary.episodes))].into(),
            data_path: "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet".to_owned(),
            video_path: "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4".to_owned(),
            features: Features(features.collect()),
        }
    }
}

/// Features that every dataset has, and that no other may be named as.
pub(crate) const ROW_FEATURES: [&str; 5] = ["timestamp", "frame_index", "episode_index", "index", "task_index"];

/// The columns that every dataset has, behind those of the features.
const ROW_NUMBERS: [(&str, Dtype); 5] = [
    ("timestamp", Dtype::Float32),
    ("frame_index", Dtype::Int64),
    ("episode_index", Dtype::Int64),
    ("index", Dtype::Int64),
    ("task_index", Dtype::Int64),
];

/// Their values in some rows of an episode.
struct RowNumbers {
    timestamps: Vec<f32>,
    frames: Vec<i64>,
    episodes: Vec<i64>,
    indices: Vec<i64>,
    tasks: Vec<i64>,
}

impl RowNumbers {
    fn values(&self) -> [Values<'_>; 5] {
        [
            Values::Float32(&self.timestamps),
            Values::Int64(&self.frames),
            Values::Int64(&self.episodes),
            Values::Int64(&self.indices),
            Values::Int64(&self.tasks),
        ]
    }

    fn arrays(self) -> [ArrayRef; 5] {
        let numbers = |numbers: Vec<i64>| Arc::new(Int64Array::from(numbers)) as ArrayRef;
        let Self { timestamps, frames, episodes, indices, tasks } = self;
        [Arc::new(Float32Array::from(timestamps)), numbers(frames), numbers(episodes), numbers(indices), numbers(tasks)]
    }
}
