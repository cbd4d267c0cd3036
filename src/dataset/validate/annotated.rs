//! Checks a dataset whose programs were annotated elsewhere: a root, and below it runs of frames.
//!
//! Its programs are texts and its observations are anyone's, so that the rules of our own programs and worlds do not
//! hold; counts, order, spans, labels and texts do.

use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::cursor::{Batch, Cursor};
use crate::dataset::episode_rows::{EpisodeRow, EpisodeRows};
use crate::dataset::finding::Validation;
use crate::dataset::import::ROOT;
use crate::dataset::layout;
use crate::dataset::schema::{CALLS, FRAMES, SCOPES};
use crate::dataset::validate::meta::Texts;
use crate::dataset::validate::scopes::{self, ScopeBatch};
use crate::program::Program;
use crate::table::{Columns, TableError};
use crate::trace::{CallId, ProgramCall, Span};

/// How far `timestamp` may be from `frame_index / fps`: what LeRobot allows.
const TOLERANCE_SECS: f64 = 1e-4;

struct CallBatch {
    episode_index: Vec<i64>,
    call_id: Vec<i64>,
    caller_id: Vec<Option<i64>>,
    depth: Vec<i64>,
    program: Vec<String>,
    input: [Vec<i64>; 2],
    output: [Vec<Option<i64>>; 2],
    frames: [Vec<i64>; 2],
}

impl Batch for CallBatch {
    const COLUMNS: &'static [&'static str] = &[
        "episode_index",
        "call_id",
        "caller_id",
        "depth",
        "program",
        "input_begin",
        "input_end",
        "output_begin",
        "output_end",
        "frame_begin",
        "frame_end",
    ];

    fn take(columns: &mut Columns) -> Result<Self, TableError> {
        Ok(Self {
            episode_index: columns.int64("episode_index")?,
            call_id: columns.int64("call_id")?,
            caller_id: columns.optional_int64("caller_id")?,
            depth: columns.int64("depth")?,
            program: columns.text("program")?,
            input: [columns.int64("input_begin")?, columns.int64("input_end")?],
            output: [columns.optional_int64("output_begin")?, columns.optional_int64("output_end")?],
            frames: [columns.int64("frame_begin")?, columns.int64("frame_end")?],
        })
    }
}

struct FrameBatch {
    /// `index`, `episode_index`, `frame_index`.
    numbers: [Vec<i64>; 3],
    timestamp: Vec<f32>,
    task_index: Vec<i64>,
    subtask_index: Vec<i64>,
    call_id: Vec<i64>,
    program: Vec<String>,
}

impl Batch for FrameBatch {
    const COLUMNS: &'static [&'static str] = &[
        "index",
        "episode_index",
        "frame_index",
        "timestamp",
        "task_index",
        "subtask_index",
        "ntp.call_id",
        "ntp.program",
    ];

    fn take(columns: &mut Columns) -> Result<Self, TableError> {
        Ok(Self {
            numbers: [columns.int64("index")?, columns.int64("episode_index")?, columns.int64("frame_index")?],
            timestamp: columns.float32("timestamp")?,
            task_index: columns.int64("task_index")?,
            subtask_index: columns.int64("subtask_index")?,
            call_id: columns.int64("ntp.call_id")?,
            program: columns.text("ntp.program")?,
        })
    }
}

/// A call as it is read.
struct Call {
    program: String,
    frames: (i64, i64),
}

/// Checks the episodes.
pub(super) fn check(root: &Path, texts: &Texts, validation: &mut Validation) -> Result<(), DatasetError> {
    let (info, rows) = EpisodeRows::open(root)?;
    let mut calls = Cursor::<CallBatch>::new(root, layout::CALLS, CALLS);
    let mut frames = Cursor::<FrameBatch>::new(root, layout::DATA, FRAMES);
    let mut labels = Cursor::<ScopeBatch>::new(root, layout::SCOPES, SCOPES);
    for row in rows {
        let row = row?;
        validation.episodes += 1;
        let tree = read_calls(&mut calls, &row, validation)?;
        check_frames(&mut frames, &row, &tree, (texts, info.fps), validation)?;
        scopes::check(&mut labels, &row, &spans(&row, &tree), validation)?;
    }
    calls.finish()?;
    frames.finish()?;
    labels.finish()
}

/// Reads the calls of an episode and holds the rules of a tree of two levels.
fn read_calls(
    cursor: &mut Cursor<CallBatch>,
    row: &EpisodeRow,
    validation: &mut Validation,
) -> Result<Vec<Call>, DatasetError> {
    let mut calls: Vec<Call> = Vec::new();
    for id in 0..row.n_calls {
        let (batch, at) = cursor.next(row.calls)?;
        let ids = (batch.episode_index[at], batch.call_id[at]);
        if ids != (row.episode_index, id) {
            let problem = format!("(episode_index, call_id) are {ids:?}, but should be {:?}", (row.episode_index, id));
            return Err(cursor.problem(problem));
        }
        let frames = (batch.frames[0][at], batch.frames[1][at]);
        let before = calls.last().map_or(0, |before| if id == 1 { 0 } else { before.frames.1 });
        let has_root_s_frames = frames == (0, row.n_frames);
        let lies_behind = before <= frames.0 && frames.0 < frames.1 && frames.1 <= row.n_frames;
        let place = if id == 0 {
            has_root_s_frames && (batch.caller_id[at], batch.depth[at]) == (None, 0) && batch.program[at] == ROOT
        } else {
            lies_behind && (batch.caller_id[at], batch.depth[at]) == (Some(0), 1)
        };
        let sees = (batch.input[0][at], batch.input[1][at]) == (0, row.n_frames);
        let scope = (batch.output[0][at], batch.output[1][at]) == (Some(frames.0), Some(frames.1));
        if !(place && sees && scope) {
            let problem =
                format!("frames {frames:?}, caller or spans are not those of a root and its sub-tasks in order");
            let (path, call) = (cursor.path(), id as u32);
            return Err(DatasetError::Call { path, episode: row.episode_index, call, problem });
        }
        calls.push(Call { program: batch.program[at].clone(), frames });
        validation.calls += 1;
    }
    Ok(calls)
}

fn check_frames(
    cursor: &mut Cursor<FrameBatch>,
    row: &EpisodeRow,
    calls: &[Call],
    (texts, fps): (&Texts, u32),
    validation: &mut Validation,
) -> Result<(), DatasetError> {
    let mut next = 1;
    for frame in 0..row.n_frames {
        while calls.get(next).is_some_and(|call| call.frames.1 <= frame) {
            next += 1;
        }
        let running = calls.get(next).filter(|call| call.frames.0 <= frame);
        let (batch, at) = cursor.next(row.data)?;
        let found = batch.numbers.each_ref().map(|column| column[at]);
        let expected = [row.first_index + frame, row.episode_index, frame];
        if found != expected {
            let names = "(index, episode_index, frame_index)";
            return Err(cursor.problem(format!("{names} are {found:?}, but should be {expected:?}")));
        }
        validation.frames += 1;
        let call_id = if running.is_some() { next as i64 } else { 0 };
        let text = running.map(|call| call.program.as_str());
        let problems = [
            time_problem(batch.timestamp[at], frame, fps),
            label_problem((batch.call_id[at], &batch.program[at]), call_id, text),
            texts.task_problem(batch.task_index[at], &row.task_text).map(|problem| ("frames.task", problem)),
            texts.named_subtask_problem(batch.subtask_index[at], text).map(|problem| ("frames.task", problem)),
        ];
        for (code, problem) in problems.into_iter().flatten() {
            let place = format!("episode {}, frame {frame}", row.episode_index);
            validation.error(code, &cursor.path(), place, problem);
        }
    }
    Ok(())
}

fn time_problem(timestamp: f32, frame: i64, fps: u32) -> Option<(&'static str, String)> {
    let expected = frame as f64 / f64::from(fps.max(1));
    let is_near = (f64::from(timestamp) - expected).abs() <= TOLERANCE_SECS;
    (!is_near).then(|| ("frames.time", format!("timestamp is {timestamp}, but should be {expected}")))
}

fn label_problem(found: (i64, &str), call_id: i64, text: Option<&str>) -> Option<(&'static str, String)> {
    let path = text.map_or(ROOT.to_owned(), |text| format!("{ROOT}/{text}"));
    let expected = (call_id, path.as_str());
    (found != expected).then(|| {
        ("frames.label", format!("(ntp.call_id, ntp.program) are {found:?}, but the calls make them {expected:?}"))
    })
}

/// The spans of the calls, for the check of their labels; programs do not matter there.
fn spans(row: &EpisodeRow, calls: &[Call]) -> Vec<ProgramCall> {
    let small = |frame: i64| u32::try_from(frame).unwrap_or(u32::MAX);
    let window = Span { begin: 0, end: small(row.n_frames) };
    let call = |(id, call): (usize, &Call)| {
        let frames = Span { begin: small(call.frames.0), end: small(call.frames.1) };
        ProgramCall {
            id: CallId(id as u32),
            caller: None,
            depth: 0,
            step: 0,
            program: Program::None,
            argument: None,
            input: window,
            output: Some(frames),
            frames,
            end_of_program: false,
            prediction: None,
        }
    };
    calls.iter().enumerate().map(call).collect()
}
