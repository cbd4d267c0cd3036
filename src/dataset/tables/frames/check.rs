//! The frames of an episode: index columns, times, actions, and labels against the calls.

use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::config::ActionChoice;
use crate::dataset::files::cursor::{Cursor, Rows};
use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::dataset::tables::frames::expected::{
    Before, FullFrameBatch, Labels, are_joints, label_problem, step_problem,
};
use crate::dataset::tables::frames::feature::action_width;
use crate::dataset::tables::frames::paths::ProgramPaths;
use crate::dataset::tables::frames::read::row_problem;
use crate::dataset::tables::frames::run::Run;
use crate::dataset::tables::texts::read::Texts;
use crate::table::TextTable;
use crate::trace::{Observation, ProgramCall};

/// Checks the frames of one episode after another.
pub(crate) struct FrameCheck {
    width: usize,
    fps: u32,
    action: ActionChoice,
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
    /// Takes in rows of one width, one after another.
    fn widen(&mut self, states: &[f32], width: usize) {
        self.min.resize(width, f32::INFINITY);
        self.max.resize(width, f32::NEG_INFINITY);
        for state in states.chunks_exact(width) {
            for ((min, max), &value) in self.min.iter_mut().zip(&mut self.max).zip(state) {
                *min = if value < *min { value } else { *min };
                *max = if value > *max { value } else { *max };
            }
        }
    }
}

/// The last value of an action, which may be either there.
fn closing(action: &[f32]) -> f32 {
    action.last().copied().filter(|closed| [0.0, 1.0].contains(closed)).unwrap_or(f32::NAN)
}

impl FrameCheck {
    pub(crate) fn new(n_slots: usize, fps: u32, action: ActionChoice) -> Self {
        let (width, fps) = (Observation::width(n_slots), fps.max(1));
        Self {
            width,
            fps,
            action,
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
        let labels = || calls.map(|calls| Labels::new(calls, &self.paths, self.path_texts.texts()));
        let mut running = labels();
        let mut before: Option<Before> = None;
        let mut first = 0;
        while first < row.n_frames {
            let rows = cursor.next_rows(row.data, usize::try_from(row.n_frames - first).unwrap_or(1))?;
            let (batch, range) = (rows.batch, rows.range.clone());
            let run =
                Run { batch, range: range.clone(), row, first, width: self.width, fps: self.fps, action: self.action };
            if !run.is_right(texts, before.as_ref(), running.as_mut()) {
                self.find(&rows, row, first, (texts, before.take(), labels()), validation)?;
            }
            self.range.widen(run.states(), self.width);
            validation.frames += range.len() as u64;
            before = Some(Before::new(batch, range.end - 1));
            first += range.len() as i64;
        }
        Ok(())
    }

    /// Finds what is wrong with rows of which something is.
    fn find(
        &self,
        rows: &Rows<'_, FullFrameBatch>,
        row: &EpisodeRow,
        first: i64,
        (texts, mut before, mut labels): (&Texts, Option<Before>, Option<Labels<'_>>),
        validation: &mut Validation,
    ) -> Result<(), DatasetError> {
        let batch = rows.batch;
        for (at, frame) in rows.range.clone().zip(first..) {
            let found = [batch.index[at], batch.episode_index[at], batch.frame_index[at]];
            if let Some(problem) = row_problem(found, batch.state.row(at), row, frame, self.width) {
                return Err(rows.problem(at, problem));
            }
            let mut problems = self.row_problems(batch, at, row, frame, texts);
            problems.extend(before.as_ref().and_then(|before| step_problem(before, batch, at, self.action)));
            problems.extend(labels.as_mut().and_then(|labels| label_problem(labels.at(frame), batch, at)));
            before = Some(Before::new(batch, at));
            for (code, problem) in problems {
                let place = format!("episode {}, frame {frame}", row.episode_index);
                validation.error(code, &rows.path(), place, problem);
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
        let (action, width) = (batch.action.row(at), action_width(self.action));
        let is_wrong = match self.action {
            ActionChoice::Gripper => is_last && action != [0.0, 0.0, 0.0, one_hot[1]],
            ActionChoice::Joints => !are_joints(action, if is_last { one_hot[1] } else { closing(action) }),
        };
        if action.len() != width || batch.gripper.row(at).len() != 3 {
            let lengths = (action.len(), batch.gripper.row(at).len());
            let problem = format!("action and gripper position are {lengths:?} wide, not ({width}, 3)");
            problems.push(("frames.action", problem));
        } else if is_wrong && !is_last {
            problems.push(("frames.action", format!("the action is {action:?}")));
        } else if is_wrong {
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
