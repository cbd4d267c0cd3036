//! The frames of an episode: index columns, times, actions, and labels against the calls.

use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::dataset::tables::frames;
use crate::dataset::tables::frames::feature::ACTION_NAMES;
use crate::dataset::tables::frames::paths::ProgramPaths;
use crate::dataset::tables::frames::read::row_problem;
use crate::dataset::tables::texts::read::Texts;
use crate::table::{TextTable, batch};
use crate::trace::{Observation, ProgramCall};

batch! {
    /// Every column.
    pub(crate) struct FullFrameBatch of frames {
        state,
        action,
        timestamp,
        frame_index,
        episode_index,
        index,
        task_index,
        subtask_index,
        done,
        success,
        time_secs,
        boundary,
        recording_frame,
        gripper,
        call_id,
        program,
    }
}

/// What the row before said that the next one must fit.
struct Before {
    action: [f32; ACTION_NAMES.len()],
    gripper: [f32; 3],
    time_secs: f64,
    recording_frame: i64,
}

impl Before {
    fn new(batch: &FullFrameBatch, at: usize) -> Self {
        Self {
            action: first(batch.action.row(at)),
            gripper: first(batch.gripper.row(at)),
            time_secs: batch.time_secs[at],
            recording_frame: batch.recording_frame[at],
        }
    }
}

/// Checks the frames of one episode after another.
pub(crate) struct FrameCheck {
    width: usize,
    fps: u32,
    paths: ProgramPaths,
    path_texts: TextTable,
    range: StateRange,
}

/// Smallest and largest of each dimension of `observation.state`.
#[derive(Default)]
struct StateRange {
    min: Vec<f32>,
    max: Vec<f32>,
}

impl StateRange {
    fn widen(&mut self, state: &[f32]) {
        self.min.resize(state.len(), f32::INFINITY);
        self.max.resize(state.len(), f32::NEG_INFINITY);
        for ((min, max), &value) in self.min.iter_mut().zip(&mut self.max).zip(state) {
            *min = if value < *min { value } else { *min };
            *max = if value > *max { value } else { *max };
        }
    }
}

impl FrameCheck {
    pub(crate) fn new(n_slots: usize, fps: u32) -> Self {
        let (width, fps) = (Observation::width(n_slots), fps.max(1));
        Self {
            width,
            fps,
            paths: ProgramPaths::default(),
            path_texts: TextTable::default(),
            range: StateRange::default(),
        }
    }

    /// Checks the frames of an episode. Labels are checked when its calls are there.
    pub(crate) fn check(
        &mut self,
        cursor: &mut Cursor<FullFrameBatch>,
        row: &EpisodeRow,
        calls: Option<&[ProgramCall]>,
        texts: &Texts,
        validation: &mut Validation,
    ) -> Result<(), DatasetError> {
        self.paths.note(calls.unwrap_or_default(), &mut self.path_texts);
        let mut labels = calls.map(|calls| Labels::new(calls, &self.paths, self.path_texts.texts()));
        let mut before: Option<Before> = None;
        let mut frame = 0;
        while frame < row.n_frames {
            let rows = cursor.next_rows(row.data, usize::try_from(row.n_frames - frame).unwrap_or(1))?;
            for at in rows.range.clone() {
                let batch = rows.batch;
                let found = [batch.index[at], batch.episode_index[at], batch.frame_index[at]];
                if let Some(problem) = row_problem(found, batch.state.row(at), row, frame, self.width) {
                    return Err(rows.problem(at, problem));
                }
                validation.frames += 1;
                self.range.widen(batch.state.row(at));
                let mut problems = self.row_problems(batch, at, row, frame, texts);
                problems.extend(before.as_ref().and_then(|before| step_problem(before, batch, at)));
                problems.extend(labels.as_mut().and_then(|labels| label_problem(labels.at(frame), batch, at)));
                before = Some(Before::new(batch, at));
                for (code, problem) in problems {
                    let place = format!("episode {}, frame {frame}", row.episode_index);
                    validation.error(code, &rows.path(), place, problem);
                }
                frame += 1;
            }
        }
        Ok(())
    }

    fn row_problems(
        &self,
        batch: &FullFrameBatch,
        at: usize,
        row: &EpisodeRow,
        frame: i64,
        texts: &Texts,
    ) -> Vec<(&'static str, String)> {
        let mut problems = Vec::new();
        let timestamp = (frame as f64 / f64::from(self.fps)) as f32;
        if batch.timestamp[at] != timestamp {
            problems.push(("frames.time", format!("timestamp is {}, but should be {timestamp}", batch.timestamp[at])));
        }
        let is_last = frame + 1 == row.n_frames;
        let flags = (batch.done.value(at), batch.success.value(at));
        if flags != (is_last, is_last && row.is_success) {
            problems.push(("frames.done", format!("(next.done, next.success) are {flags:?}")));
        }
        if frame == 0 && !batch.boundary.value(at) {
            problems.push(("frames.boundary", "the first frame is no boundary".to_owned()));
        }
        problems
            .extend(texts.task_problem(batch.task_index[at], &row.task_text).map(|problem| ("frames.task", problem)));
        problems.extend(texts.subtask_problem(batch.subtask_index[at]).map(|problem| ("frames.task", problem)));
        let one_hot = &batch.state.row(at)[self.width - 2..];
        if !matches!(one_hot, [1.0, 0.0] | [0.0, 1.0]) {
            problems.push(("frames.state", format!("(open, closed) are {one_hot:?}")));
        }
        if batch.action.row(at).len() != ACTION_NAMES.len() || batch.gripper.row(at).len() != 3 {
            let lengths = (batch.action.row(at).len(), batch.gripper.row(at).len());
            problems.push(("frames.action", format!("action and gripper position are {lengths:?} wide, not (4, 3)")));
        } else if is_last && batch.action.row(at) != [0.0, 0.0, 0.0, one_hot[1]] {
            problems.push(("frames.action", format!("the last action is {:?}", batch.action.row(at))));
        }
        problems
    }

    /// Compares what was seen with `meta/stats.json`.
    pub(crate) fn compare_ranges(&self, root: &Path, texts: &Texts, validation: &mut Validation) {
        let Some((min, max)) = &texts.state_range else { return };
        // As floats: they were, before they became decimals.
        let stated = min.iter().zip(max).map(|(min, max)| (*min as f32, *max as f32));
        let seen = self.range.min.iter().copied().zip(self.range.max.iter().copied());
        let mut pairs = seen.zip(stated).enumerate();
        if let Some((dimension, (seen, stated))) = pairs.find(|(_, (seen, stated))| seen != stated) {
            let message = format!(
                "dimension {dimension} is from {} to {}, but the rows are from {} to {}",
                stated.0, stated.1, seen.0, seen.1
            );
            validation.error("stats.range", &root.join(layout::STATS), "observation.state".to_owned(), message);
        }
    }
}

/// The action of the row before must lead to this one, later in time.
fn step_problem(before: &Before, batch: &FullFrameBatch, at: usize) -> Option<(&'static str, String)> {
    if batch.time_secs[at] <= before.time_secs || batch.recording_frame[at] <= before.recording_frame {
        let found = (batch.time_secs[at], batch.recording_frame[at]);
        return Some((
            "frames.time",
            format!("(ntp.time_secs, ntp.recording_frame) are {found:?}, not after the row before"),
        ));
    }
    let [x, y, z] = first(batch.gripper.row(at));
    let [from_x, from_y, from_z] = before.gripper;
    let closed = batch.state.row(at).last().copied().unwrap_or(f32::NAN);
    let expected = [x - from_x, y - from_y, z - from_z, closed];
    (before.action != expected).then(|| {
        ("frames.action", format!("the action of the row before is {:?}, but leads to {expected:?}", before.action))
    })
}

/// The first values of a vector; nothing but itself equals what is not there.
fn first<const N: usize>(values: &[f32]) -> [f32; N] {
    std::array::from_fn(|at| values.get(at).copied().unwrap_or(f32::NAN))
}

/// The labels that frames should have, in their order.
struct Labels<'c> {
    calls: &'c [ProgramCall],
    /// Stacks of running programs, as texts.
    paths: &'c ProgramPaths,
    texts: &'c [String],
    /// The calls that go on, by position; the root is always there.
    running: Vec<usize>,
    /// Position of the next call that has not begun.
    next: usize,
}

impl<'c> Labels<'c> {
    fn new(calls: &'c [ProgramCall], paths: &'c ProgramPaths, texts: &'c [String]) -> Self {
        Self { calls, paths, texts, running: Vec::new(), next: 1 }
    }

    /// The deepest call that goes on from a frame, and its path. Frames are asked for in order.
    fn at(&mut self, frame: i64) -> (i64, &'c str) {
        let has_ended = |&call: &usize| i64::from(self.calls[call].frames.last()) <= frame;
        while self.running.pop_if(|call| has_ended(call)).is_some() {}
        while let Some(call) = self.calls.get(self.next).filter(|call| i64::from(call.frames.begin) <= frame) {
            if i64::from(call.frames.last()) > frame {
                self.running.push(self.next);
            }
            self.next += 1;
        }
        let deepest = self.running.last().copied().unwrap_or(0);
        (deepest as i64, self.texts.get(self.paths.key(deepest) as usize).map_or("", String::as_str))
    }
}

fn label_problem(expected: (i64, &str), batch: &FullFrameBatch, at: usize) -> Option<(&'static str, String)> {
    let found = (batch.call_id[at], batch.program.row(at));
    (found != expected).then(|| {
        ("frames.label", format!("(ntp.call_id, ntp.program) are {found:?}, but the calls make them {expected:?}"))
    })
}
