//! Checks a dataset whose programs were annotated elsewhere: a root, and below it labels, which may lie in others.
//!
//! Its programs are texts and its observations are anyone's, so that the rules of our own programs and worlds do not
//! hold; counts, order, spans, labels and texts do.

use std::path::Path;

use crate::artifact::read_json;
use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::info::NtpInfo;
use crate::dataset::files::layout;
use crate::dataset::plain::LabelsForm;
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
        subtask_index,
        call_id,
        program,
    }
}

/// Checks the episodes.
pub(super) fn check(root: &Path, texts: &Texts, validation: &mut Validation) -> Result<(), DatasetError> {
    let (info, rows) = EpisodeRows::open(root)?;
    let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
    // Beside labels of another form they count texts of their own.
    let texts = (texts, ntp.annotated_by.as_deref() == Some(LabelsForm::SubtaskIndex.name()));
    let mut calls = Cursor::<CallFactsBatch>::new(root, layout::CALLS);
    let mut frames = Cursor::<FrameBatch>::new(root, layout::DATA);
    let mut labels = Cursor::<ScopeBatch>::new(root, layout::SCOPES);
    for row in rows {
        let row = row?;
        validation.episodes += 1;
        let tree = read_calls(&mut calls, &row, validation)?;
        check_frames(&mut frames, &row, &tree, (texts, info.fps), validation)?;
        // Where there are none, spans alone tell them.
        if row.n_scopes > 0 {
            scopes::check(&mut labels, &row, tree.iter().map(labelled), validation)?;
        }
    }
    calls.finish()?;
    frames.finish()?;
    labels.finish()
}

/// Reads the calls of an episode and holds the rules of their tree: a root over all frames, callers before callees, each
/// within its caller and behind those before it.
fn read_calls(
    cursor: &mut Cursor<CallFactsBatch>,
    row: &EpisodeRow,
    validation: &mut Validation,
) -> Result<Vec<CallFacts>, DatasetError> {
    let calls = read_call_facts(cursor, row)?;
    let whole = [0, u32::try_from(row.n_frames).unwrap_or(u32::MAX)];
    // By call, where its last callee ended.
    let mut ends = vec![0; calls.len()];
    for call in &calls {
        let [begin, end] = call.frames;
        let caller =
            call.caller_id.and_then(|caller| calls.get(caller as usize)).filter(|of| of.call_id < call.call_id);
        let is_in_place = match caller {
            None => {
                (call.call_id, call.frames, call.caller_id, call.depth) == (0, whole, None, 0) && call.program == ROOT
            }
            Some(caller) => {
                let before = std::mem::replace(&mut ends[caller.call_id as usize], end);
                let lies_behind = before.max(caller.frames[0]) <= begin && begin < end && end <= caller.frames[1];
                lies_behind && call.depth == caller.depth + 1
            }
        };
        if !(is_in_place && call.input == whole && call.output == Some(call.frames)) {
            let problem = format!(
                "frames {:?}, caller or spans are not those of a root and what it calls in order",
                (begin, end)
            );
            let (path, call) = (cursor.path(), call.call_id);
            return Err(DatasetError::Call { path, episode: row.episode_index, call, problem });
        }
    }
    validation.calls += calls.len() as u64;
    Ok(calls)
}

/// The deepest call that runs at a frame, and that of the first level: callers come before callees.
struct Running<'c> {
    calls: &'c [CallFacts],
    /// The first call that has not begun.
    next: usize,
}

impl Running<'_> {
    fn at(&mut self, frame: i64) -> usize {
        while self.calls.get(self.next).is_some_and(|call| i64::from(call.frames[0]) <= frame) {
            self.next += 1;
        }
        let last = self.next.saturating_sub(1);
        callers(self.calls, last).find(|&at| frame < i64::from(self.calls[at].frames[1])).unwrap_or(0)
    }
}

/// A call, its caller, and so on to the root.
fn callers(calls: &[CallFacts], call: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(call).filter(|&at| at < calls.len()), |&at| {
        calls[at].caller_id.map(|caller| caller as usize).filter(|&caller| caller < at)
    })
}

/// The names of the running programs, the root first.
fn path_of(calls: &[CallFacts], call: usize) -> String {
    let mut names: Vec<&str> = callers(calls, call).map(|at| calls[at].program.as_str()).collect();
    names.reverse();
    names.join("/")
}

fn check_frames(
    cursor: &mut Cursor<FrameBatch>,
    row: &EpisodeRow,
    calls: &[CallFacts],
    ((texts, has_numbers), fps): ((&Texts, bool), f64),
    validation: &mut Validation,
) -> Result<(), DatasetError> {
    let mut running = Running { calls, next: 1 };
    let mut known = (usize::MAX, String::new(), None);
    let numbers = |number: i64, text: Option<&str>| {
        if has_numbers { texts.named_subtask_problem(number, text) } else { None }
    };
    for frame in 0..row.n_frames {
        let deepest = running.at(frame);
        if known.0 != deepest {
            let first = callers(calls, deepest).find(|&at| calls[at].depth == 1);
            known = (deepest, path_of(calls, deepest), first.map(|at| calls[at].program.as_str()));
        }
        let (batch, at) = cursor.next(row.data)?;
        let found = [batch.index[at], batch.episode_index[at], batch.frame_index[at]];
        let expected = [row.first_index + frame, row.episode_index, frame];
        if found != expected {
            let names = "(index, episode_index, frame_index)";
            return Err(cursor.problem(format!("{names} are {found:?}, but should be {expected:?}")));
        }
        validation.frames += 1;
        let label = (batch.call_id[at], batch.program.row(at));
        let problems = [
            time_problem(batch.timestamp[at], frame, fps),
            label_problem(label, deepest as i64, &known.1),
            numbers(batch.subtask_index[at], known.2).map(|problem| ("frames.task", problem)),
        ];
        for (code, problem) in problems.into_iter().flatten() {
            let place = format!("episode {}, frame {frame}", row.episode_index);
            validation.error(code, &cursor.path(), place, problem);
        }
    }
    Ok(())
}

fn time_problem(timestamp: f32, frame: i64, fps: f64) -> Option<(&'static str, String)> {
    let expected = frame as f64 / fps;
    let is_near = (f64::from(timestamp) - expected).abs() <= TOLERANCE_SECS;
    (!is_near).then(|| ("frames.time", format!("timestamp is {timestamp}, but should be {expected}")))
}

fn label_problem(found: (i64, &str), call_id: i64, path: &str) -> Option<(&'static str, String)> {
    let expected = (call_id, path);
    (found != expected).then(|| {
        ("frames.label", format!("(ntp.call_id, ntp.program) are {found:?}, but the calls make them {expected:?}"))
    })
}

/// A call's frames are its output, and it sees all frames of its episode.
fn labelled(call: &CallFacts) -> Labelled {
    let span = |[begin, end]: [u32; 2]| Span { begin, end };
    Labelled { call: call.call_id, input: span(call.input), output: span(call.frames) }
}
