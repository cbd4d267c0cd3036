//! Checks a dataset whose programs were annotated elsewhere: a root, and below it runs of frames.
//!
//! Its programs are texts and its observations are anyone's, so that the rules of our own programs and worlds do not
//! hold; counts, order, spans, labels and texts do.

use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::tables::annotated::ROOT;
use crate::dataset::tables::calls::facts::{CallFacts, CallFactsBatch, read_call_facts};
use crate::dataset::tables::episodes::read::{EpisodeRow, EpisodeRows};
use crate::dataset::tables::frames;
use crate::dataset::tables::scopes::check::{self as scopes, Labelled, ScopeBatch};
use crate::dataset::tables::texts::read::Texts;
use crate::table::batch;
use crate::trace::Span;

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
        call_id,
        program,
    }
}

/// Checks the episodes.
pub(super) fn check(root: &Path, texts: &Texts, validation: &mut Validation) -> Result<(), DatasetError> {
    let (info, rows) = EpisodeRows::open(root)?;
    let mut calls = Cursor::<CallFactsBatch>::new(root, layout::CALLS);
    let mut frames = Cursor::<FrameBatch>::new(root, layout::DATA);
    let mut labels = Cursor::<ScopeBatch>::new(root, layout::SCOPES);
    for row in rows {
        let row = row?;
        validation.episodes += 1;
        let tree = read_calls(&mut calls, &row, validation)?;
        check_frames(&mut frames, &row, &tree, (texts, info.fps), validation)?;
        scopes::check(&mut labels, &row, tree.iter().map(labelled), validation)?;
    }
    calls.finish()?;
    frames.finish()?;
    labels.finish()
}

/// Reads the calls of an episode and holds the rules of a tree of two levels.
fn read_calls(
    cursor: &mut Cursor<CallFactsBatch>,
    row: &EpisodeRow,
    validation: &mut Validation,
) -> Result<Vec<CallFacts>, DatasetError> {
    let calls = read_call_facts(cursor, row)?;
    let whole = [0, u32::try_from(row.n_frames).unwrap_or(u32::MAX)];
    let mut before = 0;
    for call in &calls {
        let [begin, end] = call.frames;
        let is_in_place = if call.call_id == 0 {
            (call.frames, call.caller_id, call.depth) == (whole, None, 0) && call.program == ROOT
        } else {
            let lies_behind = before <= begin && begin < end && end <= whole[1];
            before = end;
            lies_behind && (call.caller_id, call.depth) == (Some(0), 1)
        };
        if !(is_in_place && call.input == whole && call.output == Some(call.frames)) {
            let problem = format!(
                "frames {:?}, caller or spans are not those of a root and its sub-tasks in order",
                (begin, end)
            );
            let (path, call) = (cursor.path(), call.call_id);
            return Err(DatasetError::Call { path, episode: row.episode_index, call, problem });
        }
    }
    validation.calls += calls.len() as u64;
    Ok(calls)
}

fn check_frames(
    cursor: &mut Cursor<FrameBatch>,
    row: &EpisodeRow,
    calls: &[CallFacts],
    (texts, fps): (&Texts, u32),
    validation: &mut Validation,
) -> Result<(), DatasetError> {
    let mut next = 1;
    for frame in 0..row.n_frames {
        while calls.get(next).is_some_and(|call| i64::from(call.frames[1]) <= frame) {
            next += 1;
        }
        let running = calls.get(next).filter(|call| i64::from(call.frames[0]) <= frame);
        let (batch, at) = cursor.next(row.data)?;
        let found = [batch.index[at], batch.episode_index[at], batch.frame_index[at]];
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
            label_problem((batch.call_id[at], batch.program.row(at)), call_id, text),
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

/// A call's frames are its output, and it sees all frames of its episode.
fn labelled(call: &CallFacts) -> Labelled {
    let span = |[begin, end]: [u32; 2]| Span { begin, end };
    Labelled { call: call.call_id, input: span(call.input), output: span(call.frames) }
}
