//! Episodes to rows of `data/`.

use crate::arm::N_JOINTS;
use crate::dataset::config::ActionChoice;
use crate::dataset::files::info::FeatureInfo;
use crate::dataset::tables::frames::feature::{JOINTS, POSITION_NAMES, Width, action_width, known};
use crate::dataset::tables::frames::paths::ProgramPaths;
use crate::dataset::tables::frames::{Rows, SCHEMA};
use crate::dataset::tables::texts::subtask::subtask_text;
use crate::dataset::tables::view::EpisodeView;
use crate::table::{TableRows as _, TextTable, Values, WriteOptions};
use crate::trace::{Episode, Frame, Observation};

const POSITION_WIDTH: usize = POSITION_NAMES.len();

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
    rows: Rows,
    action: ActionChoice,
    /// Of an arm's joints; `None` without an arm.
    joints_rad: Option<Vec<f32>>,
    paths: ProgramPaths,
    subtasks: TextTable,
}

impl FrameRows {
    /// None yet, of scenes with so many slots, with or without an arm.
    pub(crate) fn new(n_slots: usize, action: ActionChoice, has_joints: bool) -> Self {
        let mut rows = Rows::default();
        rows.state.width = Observation::width(n_slots);
        rows.action.width = action_width(action);
        rows.gripper.width = POSITION_WIDTH;
        let (paths, subtasks) = (ProgramPaths::default(), TextTable::default());
        Self { rows, action, joints_rad: has_joints.then(Vec::new), paths, subtasks }
    }

    /// Whether an episode can be added: its robot has an arm if those before had one, and none if not.
    pub(crate) fn fits(&self, episode: &Episode) -> bool {
        has_joints(episode) == self.joints_rad.is_some()
    }

    /// Whether its robots have an arm.
    pub(crate) fn has_joints(&self) -> bool {
        self.joints_rad.is_some()
    }

    /// Further columns of `data/`, as lines of the schema's text.
    pub(crate) fn further(&self) -> Vec<String> {
        let column = format!(
            "  required group {} (LIST) {{ repeated group list {{ required float element; }} }}\n",
            JOINTS.name
        );
        self.joints_rad.iter().map(|_| column.clone()).collect()
    }

    /// As `meta/info.json` declares them.
    pub(crate) fn declared_further(&self, slots: &[String]) -> Vec<(String, FeatureInfo)> {
        self.joints_rad.iter().map(|_| JOINTS.declared(slots)).collect()
    }

    pub(crate) fn n_rows(&self) -> usize {
        self.rows.index.len()
    }

    /// Texts of `subtask_index`, in order.
    pub(crate) fn subtasks(&self) -> &[String] {
        self.subtasks.texts()
    }

    /// How the table is written where scenes have so many slots.
    pub(crate) fn options(n_slots: usize, action: ActionChoice) -> WriteOptions {
        let vectors = known().filter(|feature| feature.width != Width::Scalar).map(|feature| feature.of_action(action));
        let list_lengths = vectors.map(|feature| (feature.name, feature.width(n_slots) as i32)).collect();
        WriteOptions { list_lengths, ..SCHEMA.options() }
    }

    /// Adds an episode's rows.
    pub(crate) fn append(&mut self, view: &EpisodeView<'_>, ids: EpisodeIds) {
        let n_rows = view.n_rows();
        let is_success = view.episode.outcome.is_success();
        for (row, (recorded, frame)) in view.frames().enumerate() {
            let is_last = row + 1 == n_rows;
            append_state(&mut self.rows.state.values, frame);
            self.rows.timestamp.push((row as f64 / f64::from(ids.fps)) as f32);
            self.rows.frame_index.push(row as i64);
            self.rows.index.push(ids.first_index + row as i64);
            self.rows.done.push(is_last);
            self.rows.success.push(is_last && is_success);
            self.rows.time_secs.push(frame.time_nanos as f64 / 1e9);
            self.rows.boundary.push(frame.boundary);
            self.rows.recording_frame.push(i64::from(recorded));
            let gripper = frame.state.gripper_in_world.translation.vector;
            self.rows.gripper.values.extend_from_slice(&[gripper.x, gripper.y, gripper.z]);
            if let (Some(joints_rad), Some(now)) = (&mut self.joints_rad, &frame.state.joints_rad) {
                joints_rad.extend_from_slice(now);
            }
        }
        let n_after = self.rows.index.len();
        self.rows.episode_index.resize(n_after, ids.episode_index);
        self.rows.task_index.resize(n_after, ids.task_index);
        self.append_actions(n_rows);
        self.append_calls(view);
    }

    fn append_actions(&mut self, n_rows: usize) {
        let first = self.rows.index.len() - n_rows;
        let closed_at = |row: usize| (row + 1) * self.rows.state.width - 1;
        for row in first..first + n_rows {
            let next = (row + 1).min(first + n_rows - 1);
            if let (ActionChoice::Joints, Some(joints_rad)) = (self.action, &self.joints_rad) {
                self.rows.action.values.extend_from_slice(&joints_rad[N_JOINTS * next..N_JOINTS * (next + 1)]);
                self.rows.action.values.push(self.rows.state.values[closed_at(next)]);
                continue;
            }
            let (here, there) = (POSITION_WIDTH * row, POSITION_WIDTH * next);
            let [from, to] = [here, there].map(|at| &self.rows.gripper.values[at..at + POSITION_WIDTH]);
            let closed = self.rows.state.values[closed_at(next)];
            self.rows.action.values.extend_from_slice(&[to[0] - from[0], to[1] - from[1], to[2] - from[2], closed]);
        }
    }

    /// Labels each row with the deepest call that goes on from it to the next row. The root goes on from every row.
    fn append_calls(&mut self, view: &EpisodeView<'_>) {
        let first = self.rows.call_id.len();
        let calls = &view.episode.calls;
        let root = calls[0].program;
        self.paths.note(calls, &mut self.rows.program.texts);
        let root_text = i64::from(self.subtasks.key(root.name()));
        self.rows.call_id.resize(first + view.n_rows(), 0);
        self.rows.program.keys.resize(first + view.n_rows(), self.paths.key(0));
        self.rows.subtask_index.resize(first + view.n_rows(), root_text);
        for (position, (call, spans)) in calls.iter().zip(view.spans).enumerate() {
            let rows = first + spans.frames.begin as usize..first + spans.frames.last() as usize;
            if call.depth > 0 && !rows.is_empty() {
                self.rows.call_id[rows.clone()].fill(position as i64);
                self.rows.program.keys[rows.clone()].fill(self.paths.key(position));
            }
            if call.depth == 1 && !rows.is_empty() {
                let name = |slot: usize| view.episode.scene.slots[slot].name.as_str();
                let text = subtask_text(calls, position, name);
                self.rows.subtask_index[rows].fill(i64::from(self.subtasks.key(&text)));
            }
        }
    }

    /// The columns of all rows.
    pub(crate) fn columns(&self) -> Vec<(&'static str, Values<'_>)> {
        let joints = self.joints_rad.as_ref().map(|values| (JOINTS.name, Values::Float32Vector(values, N_JOINTS)));
        self.rows.columns().into_iter().chain(joints).collect()
    }

    /// The columns that have statistics, in the order of the features that have some.
    pub(crate) fn numbers(&self) -> Vec<(&'static str, Values<'_>)> {
        self.columns().into_iter().filter(|(_, values)| !matches!(values, Values::Word(..))).collect()
    }

    /// Forgets all rows, but not the texts.
    pub(crate) fn clear(&mut self) {
        self.rows.clear();
        self.joints_rad.iter_mut().for_each(Vec::clear);
    }
}

/// Whether an episode's robot has an arm.
pub(crate) fn has_joints(episode: &Episode) -> bool {
    episode.frames.first().is_some_and(|frame| frame.state.joints_rad.is_some())
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
