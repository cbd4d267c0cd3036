//! Frames as they should be, told column by column: rows are looked at one by one only where a run of them is not.

use std::ops::Range;

use arrow::buffer::BooleanBuffer;

use crate::dataset::config::ActionChoice;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::dataset::tables::frames::expected::{Before, FullFrameBatch, Labels, are_joints, step_problem};
use crate::dataset::tables::frames::feature::{POSITION_NAMES, action_width};
use crate::dataset::tables::texts::read::Texts;
use crate::table::count_flags;

const POSITION: usize = POSITION_NAMES.len();

/// An action; where the gripper was, and where it is then and whether it is closed.
type Step<'s> = (&'s [f32], ((&'s [f32], &'s [f32]), f32));

/// Rows of a batch that should be frames of an episode, one after another.
pub(crate) struct Run<'r> {
    pub(crate) batch: &'r FullFrameBatch,
    pub(crate) range: Range<usize>,
    pub(crate) row: &'r EpisodeRow,
    /// Which frame the first row should be.
    pub(crate) first: i64,
    /// Of `observation.state`.
    pub(crate) width: usize,
    pub(crate) fps: u32,
    /// What `action` tells.
    pub(crate) action: ActionChoice,
}

impl Run<'_> {
    /// Whether all rows are as they should be. `before` is the row before them.
    pub(crate) fn is_right(&self, texts: &Texts, before: Option<&Before>, labels: Option<&mut Labels<'_>>) -> bool {
        self.has_ids()
            && self.has_vectors()
            && self.has_times()
            && self.has_flags()
            && self.has_tasks(texts)
            && self.has_grippers()
            && self.has_steps(before)
            && labels.is_none_or(|labels| self.has_labels(labels))
    }

    /// The observations of the rows, one after another.
    pub(crate) fn states(&self) -> &[f32] {
        self.batch.state.rows(&self.range)
    }

    /// The row of the episode's last frame, if it is among these.
    fn last(&self) -> Option<usize> {
        (self.first + self.range.len() as i64 == self.row.n_frames).then(|| self.range.end - 1)
    }

    fn has_ids(&self) -> bool {
        let rises = |column: &[i64], first: i64| {
            column[self.range.clone()].iter().zip(first..).fold(0, |found, (a, b)| found | (a ^ b)) == 0
        };
        let episodes = &self.batch.episode_index[self.range.clone()];
        rises(&self.batch.index, self.row.first_index + self.first)
            && rises(&self.batch.frame_index, self.first)
            && episodes.iter().fold(0, |found, id| found | (id ^ self.row.episode_index)) == 0
    }

    fn has_vectors(&self) -> bool {
        self.batch.state.are_of_width(&self.range, self.width)
            && self.batch.action.are_of_width(&self.range, action_width(self.action))
            && self.batch.gripper.are_of_width(&self.range, POSITION)
            && self.states().iter().fold(true, |all, value| all & value.is_finite())
    }

    fn has_times(&self) -> bool {
        let expected = (self.first..).map(|frame| (frame as f64 / f64::from(self.fps)) as f32);
        let found = &self.batch.timestamp[self.range.clone()];
        let grows = |of: &[f64]| of.windows(2).fold(true, |all, pair| all & (pair[0] < pair[1]));
        let recorded = &self.batch.recording_frame[self.range.clone()];
        found.iter().zip(expected).fold(true, |all, (a, b)| all & (*a == b))
            && grows(&self.batch.time_secs[self.range.clone()])
            && recorded.windows(2).fold(true, |all, pair| all & (pair[0] < pair[1]))
    }

    fn has_flags(&self) -> bool {
        let last = self.last();
        let successful = last.filter(|_| self.row.is_success);
        self.is_flagged(&self.batch.done, last)
            && self.is_flagged(&self.batch.success, successful)
            && (self.first > 0 || self.batch.boundary.value(self.range.start))
    }

    /// Whether one row is flagged, or none, and no other.
    fn is_flagged(&self, flags: &BooleanBuffer, row: Option<usize>) -> bool {
        let n_flags = count_flags(flags, &self.range);
        n_flags == usize::from(row.is_some()) && row.is_none_or(|row| flags.value(row))
    }

    fn has_tasks(&self, texts: &Texts) -> bool {
        let tasks = &self.batch.task_index[self.range.clone()];
        let subtasks = &self.batch.subtask_index[self.range.clone()];
        let ends = subtasks.iter().fold([i64::MAX, i64::MIN], |[low, high], &at| [low.min(at), high.max(at)]);
        tasks.iter().fold(0, |found, task| found | (task ^ tasks[0])) == 0
            && texts.task_problem(tasks[0], &self.row.task_text).is_none()
            && ends.iter().all(|&end| texts.subtask_problem(end).is_none())
    }

    /// Whether the gripper is one of open and closed in each row.
    fn has_grippers(&self) -> bool {
        let is_one_hot = |row: &[f32]| {
            let (open, closed) = (row[row.len() - 2], row[row.len() - 1]);
            ((open == 1.0) & (closed == 0.0)) | ((open == 0.0) & (closed == 1.0))
        };
        self.states().chunks_exact(self.width).fold(true, |all, row| all & is_one_hot(row))
    }

    /// Whether each action leads to the next row.
    fn has_steps(&self, before: Option<&Before>) -> bool {
        let (actions, grippers) = (self.batch.action.rows(&self.range), self.batch.gripper.rows(&self.range));
        let closed = self.states().chunks_exact(self.width).map(|row| row[row.len() - 1]);
        let moves = grippers.chunks_exact(POSITION).zip(grippers[POSITION..].chunks_exact(POSITION));
        let leads = |(action, ((from, to), closed)): Step<'_>| {
            let moved = (action[0] == to[0] - from[0]) & (action[1] == to[1] - from[1]);
            moved & (action[2] == to[2] - from[2]) & (action[3] == closed)
        };
        let actions = actions.chunks_exact(action_width(self.action));
        let are_led = match self.action {
            ActionChoice::Gripper => {
                actions.zip(moves.zip(closed.clone().skip(1))).fold(true, |all, step| all & leads(step))
            }
            ActionChoice::Joints => {
                actions.zip(closed.skip(1)).fold(true, |all, (action, closed)| all & are_joints(action, closed))
            }
        };
        let ends_still = |last: usize| {
            let (action, closed) = (self.batch.action.row(last), self.batch.state.row(last)[self.width - 1]);
            match self.action {
                ActionChoice::Gripper => action == [0.0, 0.0, 0.0, closed],
                ActionChoice::Joints => are_joints(action, closed),
            }
        };
        are_led
            && self.last().is_none_or(ends_still)
            && before.is_none_or(|before| step_problem(before, self.batch, self.range.start, self.action).is_none())
    }

    fn has_labels(&self, labels: &mut Labels<'_>) -> bool {
        self.range.clone().zip(self.first..).all(|(at, frame)| {
            let (call_id, path) = labels.at(frame);
            self.batch.call_id[at] == call_id && self.batch.program.row(at) == path
        })
    }
}
