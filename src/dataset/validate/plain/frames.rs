//! The rows of frames: in order, at regular times, of texts that are there, with every declared feature as declared.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use arrow::array::RecordBatch;
use arrow::datatypes::{DataType, Schema};

use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::plain::{Declared, DeclaredKind, FlatNumbers, FlatProblem, PlainSource, numbers, whole_numbers};
use crate::dataset::validate::plain::images::check_images;
use crate::dataset::validate::plain::language::check_language;
use crate::dataset::validate::plain::ranges::Range;
use crate::dataset::validate::plain::run::Run;
use crate::table::BatchReader;
use crate::words::counted;

/// Rows that are read at a time; fewer where they hold pictures.
const BATCH_ROWS: usize = 8192;
const PICTURE_BATCH_ROWS: usize = 128;

/// How far `timestamp` may be from `frame_index / fps`: what LeRobot allows, and what a float of that size can tell.
const TOLERANCE_SECS: f64 = 1e-4;

/// Reads all frames; gives what the numeric features range over, and how many rows there are.
pub(super) fn check(source: &PlainSource, validation: &mut Validation) -> (BTreeMap<String, Range>, u64) {
    let mut walk = Walk::new(source);
    for (at, path) in source.data_files.iter().enumerate() {
        if source.info.version.is_by_episode() {
            walk.begin_file_of(at);
        }
        walk.file(path, validation);
    }
    walk.finish(validation)
}

/// A place among the episodes while their rows are read.
pub(super) struct Walk<'s> {
    source: &'s PlainSource,
    ranges: BTreeMap<String, Range>,
    /// The episode that the next row is of, and its frame.
    episode: usize,
    frame: u64,
    n_rows: u64,
    /// Whether rows were where they should be so far: behind one that is not, nothing is known of the others.
    is_in_order: bool,
    /// What was told already: of a kind, in an episode or of a feature.
    told: BTreeSet<(&'static str, String)>,
}

/// The columns that frames are understood by.
struct Bookkeeping {
    index: Vec<i64>,
    episode: Vec<i64>,
    frame: Vec<i64>,
    task: Vec<i64>,
    secs: Vec<f64>,
    subtask: Option<Vec<i64>>,
}

impl<'s> Walk<'s> {
    fn new(source: &'s PlainSource) -> Self {
        let told = BTreeSet::new();
        Self { source, ranges: BTreeMap::new(), episode: 0, frame: 0, n_rows: 0, is_in_order: true, told }
    }

    /// One that begins at an episode.
    pub(super) fn from(source: &'s PlainSource, episode: usize) -> Self {
        Self { episode, ..Self::new(source) }
    }

    /// A file of one episode: what was wrong with those before says nothing of it.
    fn begin_file_of(&mut self, episode: usize) {
        (self.episode, self.frame, self.is_in_order) = (episode, 0, true);
    }

    fn file(&mut self, path: &Path, validation: &mut Validation) {
        let info = &self.source.info;
        let has_pictures = info.features.iter().any(|feature| feature.kind == DeclaredKind::Image);
        let batch_rows = if has_pictures { PICTURE_BATCH_ROWS } else { BATCH_ROWS };
        let reader = BatchReader::open_columns(path, batch_rows, |name| info.feature(name).is_some());
        let mut reader = match reader {
            Ok(reader) => reader,
            Err(error) => {
                self.is_in_order = false;
                return validation.failed("frames.row", &error.into());
            }
        };
        self.columns(path, reader.schema(), validation);
        let mut first_row = 0;
        loop {
            match reader.next_batch() {
                Ok(None) => break,
                Ok(Some(batch)) => {
                    self.batch(path, first_row, &batch, validation);
                    first_row += batch.num_rows() as u64;
                }
                Err(error) => {
                    self.is_in_order = false;
                    return validation.failed("frames.row", &error.into());
                }
            }
        }
        let (episode, frame) = (self.episode, self.frame);
        if self.source.info.version.is_by_episode() && self.is_in_order && frame > 0 {
            let message = format!("it ends after {frame} of episode {episode}", frame = counted(frame, "frame"));
            validation.error("frames.row", path, String::new(), message);
        }
    }

    /// Features without a column; columns without a feature are looked for in the file's own list.
    fn columns(&mut self, path: &Path, schema: &Schema, validation: &mut Validation) {
        let has_column = |feature: &&Declared| feature.kind != DeclaredKind::Video;
        for feature in self.source.info.features.iter().filter(has_column) {
            if schema.field_with_name(&feature.name).is_err() {
                let message = format!("no column {:?}, which is declared: readers take nothing for it", feature.name);
                validation.error("frames.missing", path, String::new(), message);
            }
        }
        let Ok(all) = BatchReader::open(path, 1) else { return };
        let is_known =
            |name: &String| self.source.info.feature(name).is_some_and(|feature| feature.kind != DeclaredKind::Video);
        let names: Vec<&String> = all.schema().fields().iter().map(|field| field.name()).collect();
        if let Some((_, name)) = names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)) {
            let message = format!("column {name:?} is there twice: readers take the one or the other");
            validation.error("file.columns", path, String::new(), message);
        }
        for field in all.schema().fields().iter().filter(|field| !is_known(field.name())) {
            let message = format!("column {:?} is not declared in {}", field.name(), layout::INFO);
            validation.error("file.undeclared", path, String::new(), message);
        }
    }

    pub(super) fn batch(&mut self, path: &Path, first_row: u64, batch: &RecordBatch, validation: &mut Validation) {
        validation.frames += batch.num_rows() as u64;
        let runs = match Bookkeeping::of(batch) {
            Ok(columns) => self.rows(path, first_row, &columns, validation),
            Err(name) => {
                self.is_in_order = false;
                let message = format!("column {name} is missing, has nulls or is not of numbers");
                self.tell("file.columns", name.to_owned(), (path, String::new(), message), validation);
                Vec::new()
            }
        };
        self.n_rows += batch.num_rows() as u64;
        let source = self.source;
        for feature in &source.info.features {
            let Some(column) = batch.column_by_name(&feature.name) else { continue };
            let found = match feature.kind {
                DeclaredKind::Numbers(dtype) => {
                    let flat = FlatNumbers::of(column, dtype, feature.width());
                    self.numbers(feature, flat, &runs)
                }
                DeclaredKind::Text => match column.data_type() {
                    DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View | DataType::Dictionary(..) => None,
                    other => Some(("file.columns", 0, format!("it is declared as text, but is {other}"))),
                },
                DeclaredKind::Image => check_images(feature, column, &runs),
                DeclaredKind::Language => check_language(feature, column, &runs),
                DeclaredKind::Video | DeclaredKind::Other => None,
            };
            if let Some((code, row, problem)) = found {
                let place = format!("row {}", first_row + row as u64);
                let message = format!("{}: {problem}", feature.name);
                self.tell(code, feature.name.clone(), (path, place, message), validation);
            }
        }
    }

    /// Something of a kind about a feature is told once.
    fn tell(
        &mut self,
        code: &'static str,
        what: String,
        (path, place, message): (&Path, String, String),
        validation: &mut Validation,
    ) {
        if self.told.insert((code, what)) {
            validation.error(code, path, place, message);
        }
    }

    fn numbers(
        &mut self,
        feature: &Declared,
        flat: Result<FlatNumbers, FlatProblem>,
        runs: &[Run],
    ) -> Option<(&'static str, usize, String)> {
        let (width, shape) = (feature.width(), &feature.shape);
        let flat = match flat {
            Ok(flat) => flat,
            Err(FlatProblem::Type(found)) => {
                return Some(("file.columns", 0, format!("it is declared as {}, but is {found}", feature.dtype)));
            }
            Err(FlatProblem::Null(row)) => return Some(("file.null", row, "it has no value".to_owned())),
            Err(FlatProblem::Width(row, found)) => {
                return Some((
                    "frames.shape",
                    row,
                    format!("it has {found}, but its shape is {shape:?}", found = counted(found, "value")),
                ));
            }
        };
        let range = self.ranges.entry(feature.name.clone()).or_insert_with(|| Range::new(width));
        range.add(&flat);
        let at = flat.first_not_finite()?;
        let row = at / width.max(1);
        let run = runs.iter().find(|run| run.rows.contains(&row));
        let frame = run.map(|run| (run.episode, run.first_frame + (row - run.rows.start) as u64));
        let words = frame.map_or_else(String::new, |(episode, frame)| format!(" (episode {episode}, frame {frame})"));
        Some(("frames.value", row, format!("dimension {} is no finite number{words}", at % width.max(1))))
    }

    /// Holds the rows against the episodes; gives which are of which.
    fn rows(&mut self, path: &Path, first_row: u64, columns: &Bookkeeping, validation: &mut Validation) -> Vec<Run> {
        let mut runs = Vec::new();
        let n_rows = columns.index.len();
        let mut at = 0;
        while at < n_rows && self.is_in_order {
            let Some(episode) = self.source.episodes.get(self.episode) else {
                self.is_in_order = false;
                let message = "it has rows behind those of the last episode".to_owned();
                validation.error("frames.row", path, format!("row {}", first_row + at as u64), message);
                break;
            };
            let n = usize::try_from(episode.length - self.frame.min(episode.length)).unwrap_or(usize::MAX);
            let rows = at..n_rows.min(at.saturating_add(n));
            let is_last = self.frame + rows.len() as u64 == episode.length;
            let run = Run { rows, episode: self.episode, first_frame: self.frame, is_last };
            at = run.rows.end;
            if let Some((row, problem)) = columns.order_problem(&run, episode.index, episode.rows[0]) {
                self.is_in_order = false;
                validation.error("frames.row", path, format!("row {}", first_row + row as u64), problem);
                break;
            }
            self.run(path, &run, columns, validation);
            self.frame += run.rows.len() as u64;
            if is_last {
                (self.episode, self.frame) = (self.episode + 1, 0);
            }
            runs.push(run);
        }
        runs
    }

    /// Times and texts of rows that are where they should be.
    fn run(&mut self, path: &Path, run: &Run, columns: &Bookkeeping, validation: &mut Validation) {
        let problems = [
            ("frames.time", columns.time_problem(run, self.source.info.fps)),
            ("frames.task", columns.task_problem(run, self.source)),
            ("frames.task", columns.subtask_problem(run, self.source)),
        ];
        for (code, problem) in problems {
            if let Some((row, problem)) = problem {
                let frame = run.first_frame + (row - run.rows.start) as u64;
                let place = format!("episode {}, frame {frame}", run.episode);
                self.tell(code, run.episode.to_string(), (path, place, problem), validation);
            }
        }
    }

    fn finish(self, validation: &mut Validation) -> (BTreeMap<String, Range>, u64) {
        let n_episodes = self.source.episodes.len();
        let ended = self.episode >= n_episodes || self.source.info.version.is_by_episode();
        if self.is_in_order && !ended {
            let path: PathBuf = self.source.info.root().join(layout::DATA);
            let message = format!(
                "the files end after {}, within episode {} of {n_episodes}",
                counted(self.n_rows, "row"),
                self.episode
            );
            validation.error("frames.row", &path, String::new(), message);
        }
        (self.ranges, self.n_rows)
    }
}

impl Bookkeeping {
    /// Those of a batch, or the name of one that is not as it must be.
    fn of(batch: &RecordBatch) -> Result<Self, &'static str> {
        let whole = |name: &'static str| whole_numbers(batch, name).ok_or(name);
        Ok(Self {
            index: whole("index")?,
            episode: whole("episode_index")?,
            frame: whole("frame_index")?,
            task: whole("task_index")?,
            secs: numbers(batch, "timestamp").ok_or("timestamp")?,
            subtask: whole_numbers(batch, "subtask_index"),
        })
    }

    fn order_problem(&self, run: &Run, episode: i64, first_index: i64) -> Option<(usize, String)> {
        let first = run.first_frame as i64;
        let expected = |row: usize| {
            let frame = first + (row - run.rows.start) as i64;
            (first_index + frame, episode, frame)
        };
        let found = |row: usize| (self.index[row], self.episode[row], self.frame[row]);
        let row = run.rows.clone().find(|&row| found(row) != expected(row))?;
        let names = "(index, episode_index, frame_index)";
        Some((row, format!("{names} are {:?}, but should be {:?}", found(row), expected(row))))
    }

    fn time_problem(&self, run: &Run, fps: f64) -> Option<(usize, String)> {
        let expected = |row: usize| (run.first_frame + (row - run.rows.start) as u64) as f64 / fps;
        let is_off = |&row: &usize| {
            let expected = expected(row);
            // What is no number is off too.
            let off_by = (self.secs[row] - expected).abs();
            off_by.is_nan() || off_by > TOLERANCE_SECS + expected * f64::from(f32::EPSILON)
        };
        let mut off = run.rows.clone().filter(is_off);
        let first = off.next()?;
        let further = off.count();
        let more = if further > 0 { format!(", as in {further} of the frames behind it") } else { String::new() };
        Some((first, format!("timestamp is {}, but should be {}{more}", self.secs[first], expected(first))))
    }

    fn task_problem(&self, run: &Run, source: &PlainSource) -> Option<(usize, String)> {
        let of_episode = &source.episodes[run.episode].tasks;
        first_problem(&self.task, run, |task| match source.tasks.get(task) {
            None => Some(format!("task_index is {task}, but there are {}", counted(source.tasks.rows.len(), "task"))),
            Some(text) if !of_episode.is_empty() && !of_episode.iter().any(|of| of == text) => {
                Some(format!("task_index {task} is {text:?}, but the tasks of the episode are {of_episode:?}"))
            }
            Some(_) => None,
        })
    }

    /// A negative number of a sub-task: readers count from the end.
    fn subtask_problem(&self, run: &Run, source: &PlainSource) -> Option<(usize, String)> {
        let (numbers, texts) = (self.subtask.as_ref()?, source.subtasks.as_ref()?);
        first_problem(numbers, run, |number| {
            let is_none = number < 0 && crate::dataset::plain::has_programs(source.info.root());
            let is_known = texts.get(number).is_some() || is_none;
            (!is_known)
                .then(|| format!("subtask_index is {number}, but there are {}", counted(texts.rows.len(), "sub-task")))
        })
    }
}

/// The first row of a run with something wrong; equal numbers in a row are looked at once.
fn first_problem(numbers: &[i64], run: &Run, problem: impl Fn(i64) -> Option<String>) -> Option<(usize, String)> {
    let mut last = None;
    for row in run.rows.clone() {
        if last != Some(numbers[row]) {
            last = Some(numbers[row]);
            if let Some(problem) = problem(numbers[row]) {
                return Some((row, problem));
            }
        }
    }
    None
}
