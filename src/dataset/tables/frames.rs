//! The rows of `data/`: one per frame, a column per feature.
//!
//! Rows of several episodes are gathered until they are worth a row group; then the buffers begin anew.

pub(crate) mod check;
pub(crate) mod feature;
pub(crate) mod paths;
pub(crate) mod read;

use crate::dataset::tables::view::EpisodeView;
use crate::dataset::tables::frames::feature::{ACTION_NAMES, Dtype, FEATURES, Width};
use crate::dataset::tables::frames::paths::ProgramPaths;
use crate::dataset::tables::texts::subtask::subtask_text;
use crate::table::{TextTable, Values, WriteOptions};
use crate::trace::{Frame, Observation};

const POSITION_WIDTH: usize = 3;

/// The numbers that all rows of an episode share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EpisodeIds {
    pub(crate) episode_index: i64,
    pub(crate) first_index: i64,
    pub(crate) task_index: i64,
    pub(crate) fps: u32,
}

/// Rows that are not yet written.
pub(crate) struct FrameRows {
    n_slots: usize,
    state: Vec<f32>,
    action: Vec<f32>,
    timestamp: Vec<f32>,
    frame_index: Vec<i64>,
    episode_index: Vec<i64>,
    index: Vec<i64>,
    task_index: Vec<i64>,
    subtask_index: Vec<i64>,
    done: Vec<bool>,
    success: Vec<bool>,
    time_secs: Vec<f64>,
    boundary: Vec<bool>,
    recording_frame: Vec<i64>,
    gripper: Vec<f32>,
    call_id: Vec<i64>,
    program: Vec<u32>,
    paths: ProgramPaths,
    subtasks: TextTable,
}

impl FrameRows {
    pub(crate) fn new(n_slots: usize) -> Self {
        Self {
            n_slots,
            state: Vec::new(),
            action: Vec::new(),
            timestamp: Vec::new(),
            frame_index: Vec::new(),
            episode_index: Vec::new(),
            index: Vec::new(),
            task_index: Vec::new(),
            subtask_index: Vec::new(),
            done: Vec::new(),
            success: Vec::new(),
            time_secs: Vec::new(),
            boundary: Vec::new(),
            recording_frame: Vec::new(),
            gripper: Vec::new(),
            call_id: Vec::new(),
            program: Vec::new(),
            paths: ProgramPaths::default(),
            subtasks: TextTable::default(),
        }
    }

    pub(crate) fn n_rows(&self) -> usize {
        self.index.len()
    }

    /// Texts of `subtask_index`, in order.
    pub(crate) fn subtasks(&self) -> &[String] {
        self.subtasks.texts()
    }

    /// What the schema text cannot say of this table.
    pub(crate) fn options(n_slots: usize) -> WriteOptions {
        let vectors = FEATURES.iter().filter(|feature| feature.width != Width::Scalar);
        WriteOptions {
            list_lengths: vectors.map(|feature| (feature.name, feature.width(n_slots) as i32)).collect(),
            plain: vec!["timestamp", "ntp.time_secs"],
            delta_encoded: FEATURES.iter().filter(|of| of.dtype == Dtype::Int64).map(|of| of.name).collect(),
            sorted_by: vec!["episode_index", "frame_index"],
            ..WriteOptions::default()
        }
    }

    /// Adds an episode's rows.
    pub(crate) fn append(&mut self, view: &EpisodeView<'_>, ids: EpisodeIds) {
        let n_rows = view.n_rows();
        let is_success = view.episode.outcome.is_success();
        for (row, (recorded, frame)) in view.frames().enumerate() {
            let is_last = row + 1 == n_rows;
            append_state(&mut self.state, frame);
            self.timestamp.push((row as f64 / f64::from(ids.fps)) as f32);
            self.frame_index.push(row as i64);
            self.index.push(ids.first_index + row as i64);
            self.done.push(is_last);
            self.success.push(is_last && is_success);
            self.time_secs.push(frame.time_nanos as f64 / 1e9);
            self.boundary.push(frame.boundary);
            self.recording_frame.push(i64::from(recorded));
            let gripper = frame.state.gripper_in_world.translation.vector;
            self.gripper.extend_from_slice(&[gripper.x, gripper.y, gripper.z]);
        }
        let n_after = self.index.len();
        self.episode_index.resize(n_after, ids.episode_index);
        self.task_index.resize(n_after, ids.task_index);
        self.append_actions(n_rows);
        self.append_calls(view);
    }

    fn append_actions(&mut self, n_rows: usize) {
        let first = self.index.len() - n_rows;
        let closed_at = |row: usize| (row + 1) * Observation::width(self.n_slots) - 1;
        for row in first..first + n_rows {
            let next = (row + 1).min(first + n_rows - 1);
            let (here, there) = (POSITION_WIDTH * row, POSITION_WIDTH * next);
            let [from, to] = [here, there].map(|at| &self.gripper[at..at + POSITION_WIDTH]);
            let closed = self.state[closed_at(next)];
            self.action.extend_from_slice(&[to[0] - from[0], to[1] - from[1], to[2] - from[2], closed]);
        }
    }

    /// Labels each row with the deepest call that goes on from it to the next row. The root goes on from every row.
    fn append_calls(&mut self, view: &EpisodeView<'_>) {
        let first = self.call_id.len();
        let calls = &view.episode.calls;
        let root = calls[0].program;
        self.paths.note(calls);
        let root_text = i64::from(self.subtasks.key(root.name()));
        self.call_id.resize(first + view.n_rows(), 0);
        self.program.resize(first + view.n_rows(), self.paths.key(0));
        self.subtask_index.resize(first + view.n_rows(), root_text);
        for (position, (call, spans)) in calls.iter().zip(view.spans).enumerate() {
            let rows = first + spans.frames.begin as usize..first + spans.frames.last() as usize;
            if call.depth > 0 && !rows.is_empty() {
                self.call_id[rows.clone()].fill(position as i64);
                self.program[rows.clone()].fill(self.paths.key(position));
            }
            if call.depth == 1 && !rows.is_empty() {
                let name = |slot: usize| view.episode.scene.slots[slot].name.as_str();
                let text = subtask_text(calls, position, name);
                self.subtask_index[rows].fill(i64::from(self.subtasks.key(&text)));
            }
        }
    }

    /// The columns of all rows.
    pub(crate) fn columns(&self) -> [(&'static str, Values<'_>); FEATURES.len()] {
        let columns = [
            Values::Float32Vector(&self.state, Observation::width(self.n_slots)),
            Values::Float32Vector(&self.action, ACTION_NAMES.len()),
            Values::Float32(&self.timestamp),
            Values::Int64(&self.frame_index),
            Values::Int64(&self.episode_index),
            Values::Int64(&self.index),
            Values::Int64(&self.task_index),
            Values::Int64(&self.subtask_index),
            Values::Boolean(&self.done),
            Values::Boolean(&self.success),
            Values::Float64(&self.time_secs),
            Values::Boolean(&self.boundary),
            Values::Int64(&self.recording_frame),
            Values::Float32Vector(&self.gripper, POSITION_WIDTH),
            Values::Int64(&self.call_id),
            Values::Word(&self.program, self.paths.texts()),
        ];
        std::array::from_fn(|at| (FEATURES[at].name, columns[at]))
    }

    /// Forgets all rows, but not the texts.
    pub(crate) fn clear(&mut self) {
        [&mut self.state, &mut self.action, &mut self.timestamp, &mut self.gripper].into_iter().for_each(Vec::clear);
        [&mut self.frame_index, &mut self.episode_index, &mut self.index, &mut self.task_index]
            .into_iter()
            .for_each(Vec::clear);
        [&mut self.subtask_index, &mut self.recording_frame, &mut self.call_id].into_iter().for_each(Vec::clear);
        [&mut self.done, &mut self.success, &mut self.boundary].into_iter().for_each(Vec::clear);
        self.time_secs.clear();
        self.program.clear();
    }
}

/// As [`Observation::to_flat`], without an allocation per frame.
fn append_state(flat: &mut Vec<f32>, frame: &Frame) {
    let gripper = frame.state.gripper_in_world.translation.vector;
    for &body in &frame.slots {
        let position = frame.state.body_in_world(body).translation.vector - gripper;
        flat.extend_from_slice(&[position.x, position.y, position.z]);
    }
    let closed = f32::from(u8::from(frame.state.held.is_some()));
    flat.extend_from_slice(&[1.0 - closed, closed]);
}
