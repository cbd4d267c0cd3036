//! Checks a dataset whose calls are what a model made of demonstrations.
//!
//! Its calls are of our programs, and the rules of our trees hold. Its frames are anyone's: of these, order, times and
//! labels are checked.

use std::collections::BTreeSet;
use std::path::Path;

use arrow::array::AsArray as _;
use arrow::datatypes::Float32Type;

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::annotation::Told;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::info::Info;
use crate::dataset::files::layout::{self, FilePlace};
use crate::dataset::tables::episodes::check::EpisodeCheck;
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::frames;
use crate::dataset::tables::frames::expected::Labels;
use crate::dataset::tables::frames::feature::n_slots;
use crate::dataset::tables::frames::paths::ProgramPaths;
use crate::dataset::tables::texts::read::Texts;
use crate::dataset::tables::texts::subtask::subtask_text;
use crate::dataset::validate::Tables;
use crate::table::{BatchReader, TextTable, batch};
use crate::trace::ProgramCall;

/// Rows of calls that are read at a time.
const BATCH_ROWS: usize = 8192;
/// How far `timestamp` may be from `frame_index / fps`: what LeRobot allows.
const TOLERANCE_SECS: f64 = 1e-4;

batch! {
    struct FrameBatch of frames {
        index,
        episode_index,
        frame_index,
        timestamp,
        task_index,
        subtask_index,
        boundary,
        call_id,
        program,
    }
}

/// Checks the episodes.
pub(super) fn check(root: &Path, texts: &Texts, validation: &mut Validation) -> Result<(), DatasetError> {
    let (info, mut rows) = EpisodeRows::open(root)?;
    let n_slots = n_slots(root, &info)?;
    let mut tables = Tables {
        frames: None,
        calls: Some(Cursor::new(root, layout::CALLS)),
        arguments: Some(Cursor::new(root, layout::CALLS)),
        scopes: Some(Cursor::new(root, layout::SCOPES)),
    };
    let (mut frames, mut episodes) = (ModelFrames::new(root, &info), EpisodeCheck::default());
    let (mut calls, mut places, mut n_episodes) = (Vec::new(), BTreeSet::new(), 0);
    while let Some(row) = rows.next() {
        let row = row?;
        validation.episodes += 1;
        n_episodes += 1;
        places.insert(row.calls);
        episodes.check(rows.path(), &row, n_slots, validation);
        let calls_are_there = tables.check_calls(&row, n_slots, &mut calls, validation);
        if calls_are_there {
            frames.check(&row, &calls, texts, validation)?;
        }
        tables.check_scopes(&row, calls_are_there.then_some(&calls), validation);
    }
    tables.finish(validation);
    check_annotation(root, n_episodes, validation);
    for place in places {
        check_confidences(root, place, validation)?;
    }
    if tables.calls.is_some() { frames.finish() } else { Ok(()) }
}

/// What is told of the labels.
pub(super) fn check_annotation(root: &Path, n_episodes: u64, validation: &mut Validation) {
    let path = root.join(layout::ANNOTATION);
    match read_json::<Told>(&path) {
        Err(error) => validation.error("file.unreadable", &path, String::new(), error.to_string()),
        Ok(told) => {
            if let Some(problem) = told.problem(n_episodes) {
                validation.error("annotation.value", &path, String::new(), problem);
            }
        }
    }
}

/// How sure the models are of each call of a file, which is a share.
fn check_confidences(root: &Path, place: FilePlace, validation: &mut Validation) -> Result<(), DatasetError> {
    let path = place.in_dataset(root, layout::CALLS);
    let (mut reader, mut row) = (BatchReader::open(&path, BATCH_ROWS)?, 0);
    while let Some(rows) = reader.next_batch()? {
        let column = rows.column_by_name("confidence").and_then(|column| column.as_primitive_opt::<Float32Type>());
        let Some(confidences) = column else {
            let problem = "there is no column confidence of type float; a model says how sure it is".to_owned();
            validation.error("file.columns", &path, String::new(), problem);
            return Ok(());
        };
        if let Some(at) = confidences.values().iter().position(|confidence| !(0.0..=1.0).contains(confidence)) {
            let problem = format!("confidence is {}, but a share is between 0 and 1", confidences.value(at));
            validation.error("calls.row", &path, format!("row {}", row + at), problem);
            return Ok(());
        }
        row += rows.num_rows();
    }
    Ok(())
}

/// Checks the frames of one episode after another.
struct ModelFrames {
    cursor: Cursor<FrameBatch>,
    fps: f64,
    paths: ProgramPaths,
    path_texts: TextTable,
}

impl ModelFrames {
    fn new(root: &Path, info: &Info) -> Self {
        let (cursor, fps) = (Cursor::new(root, layout::DATA), info.fps);
        Self { cursor, fps, paths: ProgramPaths::default(), path_texts: TextTable::default() }
    }

    fn finish(&self) -> Result<(), DatasetError> {
        self.cursor.finish()
    }

    /// Checks the frames of an episode against its calls.
    fn check(
        &mut self,
        row: &EpisodeRow,
        calls: &[ProgramCall],
        texts: &Texts,
        validation: &mut Validation,
    ) -> Result<(), DatasetError> {
        self.paths.note(calls, &mut self.path_texts);
        let mut running = Labels::new(calls, &self.paths, self.path_texts.texts());
        let subtasks = subtasks(calls, row);
        for frame in 0..row.n_frames {
            let (batch, at) = self.cursor.next(row.data)?;
            let found = [batch.index[at], batch.episode_index[at], batch.frame_index[at]];
            let expected = [row.first_index + frame, row.episode_index, frame];
            if found != expected {
                let names = "(index, episode_index, frame_index)";
                let problem = format!("{names} are {found:?}, but should be {expected:?}");
                return Err(self.cursor.problem(problem));
            }
            validation.frames += 1;
            let subtask = subtasks.get(usize::try_from(frame).unwrap_or(0)).map(String::as_str);
            let label = running.at(frame);
            let found = (batch.call_id[at], batch.program.row(at));
            let problems = [
                time_problem(batch.timestamp[at], frame, self.fps).map(|problem| ("frames.time", problem)),
                (found != label).then(|| ("frames.label", label_problem(found, label))),
                texts.task_problem(batch.task_index[at], &row.task_text).map(|problem| ("frames.task", problem)),
                texts.named_subtask_problem(batch.subtask_index[at], subtask).map(|problem| ("frames.task", problem)),
                (frame == 0 && !batch.boundary.value(at))
                    .then(|| ("frames.boundary", "the first frame is no boundary".to_owned())),
            ];
            let problems: Vec<_> = problems.into_iter().flatten().collect();
            for (code, problem) in problems {
                let place = format!("episode {}, frame {frame}", row.episode_index);
                validation.error(code, &self.cursor.path(), place, problem);
            }
        }
        Ok(())
    }
}

fn time_problem(timestamp: f32, frame: i64, fps: f64) -> Option<String> {
    let expected = frame as f64 / fps;
    let is_near = (f64::from(timestamp) - expected).abs() <= TOLERANCE_SECS;
    (!is_near).then(|| format!("timestamp is {timestamp}, but should be {expected}"))
}

/// The sub-task of each frame: the root's callee that goes on from it, else the root.
fn subtasks(calls: &[ProgramCall], row: &EpisodeRow) -> Vec<String> {
    let root = calls.first().map_or("", |root| root.program.name());
    let mut subtasks = vec![root.to_owned(); usize::try_from(row.n_frames).unwrap_or(0)];
    let name = |slot: usize| row.slots.get(slot).map_or("", String::as_str);
    for (position, call) in calls.iter().enumerate().filter(|(_, call)| call.depth == 1) {
        let frames = call.frames.begin as usize..call.frames.last() as usize;
        if let Some(frames) = subtasks.get_mut(frames) {
            frames.fill(subtask_text(calls, position, name));
        }
    }
    subtasks
}

fn label_problem(found: (i64, &str), expected: (i64, &str)) -> String {
    format!("(ntp.call_id, ntp.program) are {found:?}, but the calls make them {expected:?}")
}
