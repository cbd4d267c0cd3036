//! The dataset that is made: rows, packets and statistics of episodes are carried over; numbers of rows, episodes,
//! tasks and files are made anew. It is a `LeRobotDataset` v3.0, whatever its sources were.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, Int64Array, RecordBatch};
use arrow::compute::concat_batches;
use arrow::datatypes::SchemaRef;
use serde_json::{Map, Value, json};

use crate::artifact::write_json;
use crate::dataset::DatasetError;
use crate::dataset::edit::plain::exact::{Counted, statistic_of_row};
use crate::dataset::edit::plain::json::shaped;
use crate::dataset::edit::plain::meta::{Changed, MetaRows, MetaSource, schema_of};
use crate::dataset::edit::plain::pictures::PictureSums;
use crate::dataset::edit::plain::programs::{EpisodePrograms, SourcePrograms, TargetPrograms};
use crate::dataset::edit::plain::schema::{cast_to, fitted, plain_schema};
use crate::dataset::edit::plain::videos::{Carry, VideoCarrier};
use crate::dataset::edit::{EditError, EditSummary};
use crate::dataset::files::info::{Dtype, LEROBOT_VERSION, Stats};
use crate::dataset::files::layout::{self, CHUNK_FILES};
use crate::dataset::files::rolling::Rolling;
use crate::dataset::files::stated::{is_of_numbers, read_statistics};
use crate::dataset::plain::{Declared, DeclaredKind, FlatNumbers, PlainSource, RowCursor, whole_numbers};
use crate::dataset::schema::{FRAMES, META_EPISODES};
use crate::dataset::statistics::{FeatureStatistics, NumericFeature, Statistics};
use crate::dataset::tables::texts::write::{write_subtasks, write_tasks};
use crate::dataset::write::sheaf::MEGABYTE;
use crate::table::{BatchReader, BatchWriter, TextTable, WriteOptions};
use crate::words::counted;

/// Rows of an episode become a row group at its end, or when they are this large.
const GROUP_BYTES: usize = 24 * MEGABYTE;
/// Rows of episodes that are one row group.
const META_GROUP_ROWS: usize = 500;
/// Columns of frames that are counted anew.
const COUNTED: [&str; 4] = ["task_index", "subtask_index", "index", "episode_index"];

/// A source being read.
pub(in crate::dataset::edit) struct Reading {
    pub(in crate::dataset::edit) source: PlainSource,
    pub(in crate::dataset::edit) programs: Option<SourcePrograms>,
    rows: RowCursor,
    meta: MetaSource,
}

impl Reading {
    pub(in crate::dataset::edit) fn open(root: &Path) -> Result<Self, EditError> {
        let source = PlainSource::open(root)?;
        let has_programs = crate::dataset::plain::has_programs(root);
        let programs = has_programs.then(|| SourcePrograms::open(root)).transpose()?;
        let has_pictures = source.info.features.iter().any(|feature| feature.kind == DeclaredKind::Image);
        let meta = MetaSource::open(&source)?;
        Ok(Self { rows: RowCursor::new(has_pictures), meta, programs, source })
    }

    /// The columns of its frames.
    pub(in crate::dataset::edit) fn schema(&self) -> Result<SchemaRef, EditError> {
        let path = self.source.data_files.first();
        let missing = || DatasetError::Count {
            path: self.source.info.root().join(layout::DATA),
            problem: "there is no file of frames in it".to_owned(),
        };
        Ok(plain_schema(BatchReader::open(path.ok_or_else(missing)?, 1)?.schema()))
    }
}

/// A dataset being made of others.
pub(in crate::dataset::edit) struct PlainTarget {
    root: PathBuf,
    /// `meta/info.json` of the first source.
    info: Value,
    fps: f64,
    schema: SchemaRef,
    features: Vec<Declared>,
    numeric: Vec<NumericFeature>,
    statistics: Statistics,
    pictures: BTreeMap<String, PictureSums>,
    tasks: TextTable,
    subtasks: TextTable,
    has_subtasks: bool,
    videos: Vec<VideoCarrier>,
    frame_files: Rolling<BatchWriter>,
    meta: MetaRows,
    meta_files: Rolling<BatchWriter>,
    programs: Option<TargetPrograms>,
    /// Episodes of each split, in the order in which they came.
    splits: Vec<(String, u64)>,
    summary: EditSummary,
}

/// What is known of an episode that was written.
struct Written {
    tasks: Counted,
    subtasks: Counted,
}

impl PlainTarget {
    /// Begins a dataset like a source.
    pub(in crate::dataset::edit) fn create(root: &Path, like: &Reading, carry: Carry) -> Result<Self, EditError> {
        let (source, schema) = (&like.source, like.schema()?);
        let info = &source.info;
        let megabytes = |key: &str, usual: u64| info.total(key).unwrap_or(usual).clamp(1, 4096) as usize * MEGABYTE;
        let numeric: Vec<NumericFeature> = info.features.iter().filter_map(numeric).collect();
        let video_bytes = megabytes("video_files_size_in_mb", 200) as u64;
        let videos = info.videos().map(|video| VideoCarrier::new(root, &video.name, video_bytes, carry)).collect();
        let meta = MetaRows::new(schema_of(source)?);
        let rolling = |folder, name: &'static str, columns: &SchemaRef, bytes| {
            let columns = Arc::clone(columns);
            let begin = move |path: &Path| BatchWriter::create(path, name, &columns, WriteOptions::default());
            Rolling::new(root, folder, bytes, begin)
        };
        let data_bytes = megabytes("data_files_size_in_mb", 100);
        // LeRobot sums up all but the last side of numbers with several: their statistics are taken as they are.
        let is_picture = |of: &&Declared| matches!(of.kind, DeclaredKind::Image | DeclaredKind::Video);
        let is_summed = |of: &&Declared| is_picture(of) || numeric_kind(of).is_none() && of.shape.len() > 1;
        let pictures = info.features.iter().filter(is_summed);
        Ok(Self {
            root: root.to_owned(),
            info: info.json.clone(),
            fps: info.fps,
            features: info.features.clone(),
            statistics: Statistics::new(root, numeric.clone()),
            numeric,
            pictures: pictures
                .map(|of| (of.name.clone(), PictureSums::new(if is_picture(&of) { 3 } else { 1 })))
                .collect(),
            tasks: TextTable::default(),
            subtasks: TextTable::default(),
            has_subtasks: source.subtasks.is_some(),
            videos,
            frame_files: rolling(layout::DATA, FRAMES.name(), &schema, data_bytes),
            meta_files: rolling(layout::META_EPISODES, META_EPISODES.name(), meta.schema(), data_bytes),
            meta,
            programs: like.programs.as_ref().map(|programs| TargetPrograms::create(root, programs)).transpose()?,
            schema,
            splits: Vec::new(),
            summary: EditSummary::default(),
        })
    }

    pub(in crate::dataset::edit) fn n_episodes(&self) -> u64 {
        self.summary.episodes
    }

    /// Columns of the frames.
    pub(in crate::dataset::edit) fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    /// Columns of the episodes.
    pub(in crate::dataset::edit) fn meta_schema(&self) -> &SchemaRef {
        self.meta.schema()
    }

    /// Counts episodes that are not wanted.
    pub(in crate::dataset::edit) fn leave_out(&mut self, n_episodes: u64) {
        self.summary.left_out += n_episodes;
    }

    /// Adds an episode of a source, with its rows of the program tables where there are any.
    pub(in crate::dataset::edit) fn append(
        &mut self,
        reading: &mut Reading,
        position: usize,
        programs: Option<&EpisodePrograms>,
    ) -> Result<(), EditError> {
        let own = self.meta_files.place();
        let data = self.frame_files.place();
        let row = reading.meta.row(&reading.source, position, self.meta.schema())?;
        let episode = reading.source.episodes[position].clone();
        let mut changed: Vec<(String, Changed)> = Vec::new();
        for (video, span) in self.videos.iter_mut().zip(&episode.videos) {
            let span = span.ok_or_else(|| DatasetError::Episode {
                path: reading.source.episode_files[episode.own.0].clone(),
                episode: episode.index,
                problem: format!("it gives no place of {}", video.feature()),
            })?;
            let path = reading.source.info.video_file(video.feature(), span.file);
            let placed = video.append(&path, span, episode.length, self.fps)?;
            let [chunk, file, from, to] =
                crate::dataset::pictures::video_columns(video.feature()).map(|(name, _)| name);
            changed.extend([
                (chunk, Changed::Number(f64::from(placed.file.chunk))),
                (file, Changed::Number(f64::from(placed.file.file))),
                (from, Changed::Number(placed.from_secs)),
                (to, Changed::Number(placed.to_secs.unwrap_or(placed.from_secs))),
            ]);
        }
        let written = self.append_frames(reading, position)?;
        for (feature, sums) in &mut self.pictures {
            sums.add(feature, &row);
        }
        let (first, n_rows, number) = (self.summary.frames as i64, episode.length, self.summary.episodes);
        let numbers = [
            ("episode_index", number as f64),
            ("length", n_rows as f64),
            ("data/chunk_index", f64::from(data.chunk)),
            ("data/file_index", f64::from(data.file)),
            ("dataset_from_index", first as f64),
            ("dataset_to_index", first as f64 + n_rows as f64),
            ("meta/episodes/chunk_index", f64::from(own.chunk)),
            ("meta/episodes/file_index", f64::from(own.file)),
        ];
        changed.extend(numbers.map(|(name, number)| (name.to_owned(), Changed::Number(number))));
        if !episode.tasks.is_empty() {
            changed.push(("tasks".to_owned(), Changed::Texts(episode.tasks.clone())));
        }
        changed.extend(self.counted_statistics(&written, first, n_rows));
        self.meta.push(&row, &changed)?;
        if let (Some(target), Some(programs)) = (&mut self.programs, programs) {
            target.append(programs)?;
        }
        let split = reading.source.info.split_of(position as u64).unwrap_or_default().to_owned();
        match self.splits.last_mut() {
            Some((last, n)) if *last == split => *n += 1,
            _ => self.splits.push((split, 1)),
        }
        self.summary.episodes += 1;
        self.summary.frames += n_rows;
        if self.meta.n_rows() >= META_GROUP_ROWS {
            self.write_meta()?;
        }
        Ok(())
    }

    /// Statistics of the episode's numbers that are counted anew.
    fn counted_statistics(&self, written: &Written, first: i64, n_rows: u64) -> Vec<(String, Changed)> {
        let number = self.summary.episodes as i64;
        let names = self.meta.schema().fields().iter().map(|field| field.name());
        let of = |name: &String| {
            let (feature, statistic) = name.strip_prefix("stats/")?.rsplit_once('/')?;
            let value = match feature {
                "index" => statistic_of_row(statistic, first, n_rows),
                "episode_index" if statistic == "count" => Some(n_rows as f64),
                "episode_index" => statistic_of_row(statistic, number, 1),
                "task_index" => written.tasks.statistic(statistic),
                "subtask_index" if self.has_subtasks => written.subtasks.statistic(statistic),
                _ => None,
            };
            Some((name.clone(), Changed::Number(value?)))
        };
        names.filter_map(of).collect()
    }

    fn append_frames(&mut self, reading: &mut Reading, position: usize) -> Result<Written, EditError> {
        let source = &reading.source;
        let episode = &source.episodes[position];
        let (path, first) = source.rows_of(episode)?;
        let mut written = Written { tasks: Counted::default(), subtasks: Counted::default() };
        let mut frame = 0_i64;
        let mut held: Vec<RecordBatch> = Vec::new();
        let mut n_bytes = 0;
        reading.rows.each(&path, first, episode.length as usize, |rows| {
            let n_rows = rows.num_rows() as i64;
            let rows = self.renumbered(source, &path, &rows, frame, &mut written)?;
            frame += n_rows;
            self.measure(&path, &rows)?;
            n_bytes += rows.get_array_memory_size();
            held.push(rows);
            if n_bytes >= GROUP_BYTES {
                n_bytes = 0;
                self.write_group(&path, &mut held)?;
            }
            Ok::<_, EditError>(())
        })?;
        self.write_group(&path, &mut held)?;
        Ok(written)
    }

    fn write_group(&mut self, path: &Path, held: &mut Vec<RecordBatch>) -> Result<(), EditError> {
        let held = std::mem::take(held);
        if held.is_empty() {
            return Ok(());
        }
        let rows = concat_batches(&self.schema, &held).map_err(EditError::rows(path))?;
        Ok(self.frame_files.write(|file| file.write(&rows))?)
    }

    /// Rows with the new numbers of rows, episodes and texts.
    fn renumbered(
        &mut self,
        source: &PlainSource,
        path: &Path,
        rows: &RecordBatch,
        frame: i64,
        written: &mut Written,
    ) -> Result<RecordBatch, EditError> {
        let n_rows = rows.num_rows();
        let wrong = |name: &str| DatasetError::Count {
            path: path.to_owned(),
            problem: format!("it has no column {name} of whole numbers without nulls"),
        };
        let tasks = whole_numbers(rows, "task_index").ok_or_else(|| wrong("task_index"))?;
        let mut new_tasks = Vec::with_capacity(n_rows);
        for task in tasks {
            let text = source.tasks.get(task).ok_or_else(|| {
                let problem =
                    format!("task_index is {task}, but there are {}", counted(source.tasks.rows.len(), "task"));
                EditError::refused("edit.columns", path, problem)
            })?;
            new_tasks.push(i64::from(self.tasks.key(text)));
        }
        new_tasks.iter().for_each(|&task| written.tasks.add(task));
        let first = self.summary.frames as i64 + frame;
        let index: Vec<i64> = (first..first + n_rows as i64).collect();
        let mut columns: Vec<(&str, Vec<i64>)> = vec![
            ("task_index", new_tasks),
            ("index", index),
            ("episode_index", vec![self.summary.episodes as i64; n_rows]),
        ];
        if let (Some(texts), Some(numbers)) = (&source.subtasks, whole_numbers(rows, "subtask_index")) {
            let mut new = Vec::with_capacity(n_rows);
            for number in numbers {
                new.push(match texts.get(number) {
                    Some(text) => i64::from(self.subtasks.key(text)),
                    // No sub-task.
                    None if number < 0 => number,
                    None => {
                        let problem = format!("subtask_index is {number}, but there are {}", texts.rows.len());
                        return Err(EditError::refused("edit.columns", path, problem));
                    }
                });
            }
            new.iter().for_each(|&subtask| written.subtasks.add(subtask));
            columns.push(("subtask_index", new));
        }
        let rows = fitted(rows, &self.schema).map_err(EditError::rows(path))?;
        let mut all = rows.columns().to_vec();
        for (name, numbers) in columns {
            debug_assert!(COUNTED.contains(&name));
            let Ok(at) = self.schema.index_of(name) else { continue };
            let numbers: ArrayRef = Arc::new(Int64Array::from(numbers));
            all[at] = cast_to(&numbers, self.schema.field(at).data_type()).map_err(EditError::rows(path))?;
        }
        RecordBatch::try_new(Arc::clone(&self.schema), all).map_err(EditError::rows(path))
    }

    /// Adds rows to the statistics of the whole.
    fn measure(&mut self, path: &Path, rows: &RecordBatch) -> Result<(), EditError> {
        let mut flat = Vec::new();
        for feature in &self.numeric {
            let wrong = || {
                let problem = format!("column {:?} is not as it is declared, or has no value in a row", feature.name);
                EditError::refused("edit.columns", path, problem)
            };
            let column = rows.column_by_name(&feature.name).ok_or_else(wrong)?;
            let numbers = FlatNumbers::of(column, feature.dtype, feature.width).map_err(|_problem| wrong())?;
            flat.push(numbers);
        }
        let columns: Vec<_> = self
            .numeric
            .iter()
            .zip(&flat)
            .map(|(feature, numbers)| (feature.name.as_str(), numbers.values(feature.width)))
            .collect();
        self.statistics.append_part(&columns, &(0..rows.num_rows()));
        Ok(self.statistics.keep(&columns, rows.num_rows())?)
    }

    fn write_meta(&mut self) -> Result<(), EditError> {
        let rows = self.meta.take()?;
        Ok(rows.map_or(Ok(()), |rows| self.meta_files.write(|file| file.write(&rows)))?)
    }

    /// Ends the dataset; `statistics` are those of the only source, for what its episodes do not tell.
    pub(in crate::dataset::edit) fn finish(mut self, statistics: Option<&Path>) -> Result<EditSummary, EditError> {
        self.write_meta()?;
        write_tasks(&self.root, self.tasks.texts())?;
        let mut files: Vec<String> = [layout::INFO, layout::STATS, layout::TASKS].map(ToOwned::to_owned).into();
        if self.has_subtasks {
            write_subtasks(&self.root, self.subtasks.texts())?;
            files.push(layout::SUBTASKS.to_owned());
        }
        write_json(&self.root.join(layout::INFO), &self.info_json())?;
        let Self { root, statistics: numbers, pictures, features, mut summary, .. } = self;
        let known = statistics.filter(|path| path.is_file()).map(read_statistics).transpose()?;
        let asked: Vec<String> =
            self.numeric.iter().map(|feature| &feature.name).chain(pictures.keys()).cloned().collect();
        let numeric: Vec<(String, Value)> = numbers
            .finish()?
            .into_iter()
            .map(|(name, of)| {
                let shape = features.iter().find(|feature| feature.name == name).map(|feature| feature.shape.clone());
                (name, statistics_json(&of, &shape.unwrap_or_default()))
            })
            .collect();
        let of_source = |name: &str| known.as_ref()?.get(name).cloned();
        let pictures: Vec<(String, Value)> = pictures
            .into_iter()
            .filter_map(|(name, sums)| {
                Some((name.clone(), sums.finish().filter(is_of_numbers).or_else(|| of_source(&name))?))
            })
            .collect();
        let has = |name: &String| numeric.iter().chain(&pictures).any(|(known, _)| known == name);
        summary.without_statistics = asked.into_iter().filter(|name| !has(name)).collect();
        write_json(&root.join(layout::STATS), &Stats(numeric, pictures))?;
        for table in [self.frame_files, self.meta_files] {
            files.extend(table.finish()?);
        }
        for video in self.videos {
            files.extend(video.finish()?);
        }
        if let Some(programs) = self.programs {
            (summary.calls, summary.scopes) = (programs.n_calls, programs.n_scopes);
            files.extend(programs.finish(&root)?);
        }
        files.sort_unstable();
        summary.tasks = self.tasks.texts().len() as u64;
        summary.files = files;
        Ok(summary)
    }

    /// What is declared: as it was, with totals, splits and places of its own.
    fn info_json(&self) -> Value {
        let mut info = self.info.clone();
        info["codebase_version"] = json!(LEROBOT_VERSION);
        info["total_episodes"] = json!(self.summary.episodes);
        info["total_frames"] = json!(self.summary.frames);
        info["total_tasks"] = json!(self.tasks.texts().len());
        info["chunks_size"] = json!(CHUNK_FILES);
        info["data_path"] = json!("data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet");
        info["video_path"] = json!("videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4");
        for (key, usual) in [("data_files_size_in_mb", 100), ("video_files_size_in_mb", 200)] {
            if info[key].is_null() {
                info[key] = json!(usual);
            }
        }
        // Of older formats.
        if let Some(map) = info.as_object_mut() {
            map.remove("total_videos");
            map.remove("total_chunks");
        }
        let mut splits = Map::new();
        let mut begin = 0;
        for (name, n) in &self.splits {
            let range = format!("{begin}:{}", begin + n);
            begin += n;
            if !name.is_empty() {
                splits.insert(name.clone(), json!(range));
            }
        }
        info["splits"] = Value::Object(splits);
        info
    }
}

/// The type of a feature whose statistics are reckoned: numbers with one side.
fn numeric_kind(feature: &Declared) -> Option<Dtype> {
    match feature.kind {
        DeclaredKind::Numbers(dtype) if feature.shape.len() == 1 => Some(dtype),
        _ => None,
    }
}

/// How statistics take a feature; `None` for one that they do not.
fn numeric(feature: &Declared) -> Option<NumericFeature> {
    let dtype = numeric_kind(feature)?;
    let width = feature.width();
    // Flags in lists are counted as numbers.
    let dtype = if dtype == Dtype::Bool && width > 1 { Dtype::Int64 } else { dtype };
    (width > 0).then(|| NumericFeature { name: feature.name.clone(), dtype, width, is_of_episodes: false })
}

fn statistics_json(of: &FeatureStatistics, shape: &[usize]) -> Value {
    let FeatureStatistics { min, max, mean, std, count, q01, q10, q50, q90, q99 } = of;
    let lists = [
        ("min", min),
        ("max", max),
        ("mean", mean),
        ("std", std),
        ("q01", q01),
        ("q10", q10),
        ("q50", q50),
        ("q90", q90),
        ("q99", q99),
    ];
    let mut map: Map<String, Value> =
        lists.into_iter().map(|(name, numbers)| (name.to_owned(), shaped(numbers, shape))).collect();
    map.insert("count".to_owned(), json!(count));
    Value::Object(map)
}
