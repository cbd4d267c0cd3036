//! Reads the rows of `data/` back.

use arrow::buffer::{BooleanBuffer, ScalarBuffer};

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::{Batch, Cursor};
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::table::{Columns, FloatRows, TableError};
use crate::trace::GripperState;

/// The columns of `data/` that a learner of programs needs.
pub(crate) struct FrameBatch {
    pub(crate) state: FloatRows,
    pub(crate) frame_index: ScalarBuffer<i64>,
    pub(crate) episode_index: ScalarBuffer<i64>,
    pub(crate) index: ScalarBuffer<i64>,
    pub(crate) boundary: BooleanBuffer,
    pub(crate) gripper: FloatRows,
}

impl Batch for FrameBatch {
    const COLUMNS: &'static [&'static str] =
        &["observation.state", "frame_index", "episode_index", "index", "ntp.boundary", "ntp.gripper_in_world_m"];

    fn take(columns: &mut Columns) -> Result<Self, TableError> {
        Ok(Self {
            state: columns.float_rows("observation.state")?,
            frame_index: columns.numbers("frame_index")?,
            episode_index: columns.numbers("episode_index")?,
            index: columns.numbers("index")?,
            boundary: columns.flags("ntp.boundary")?,
            gripper: columns.float_rows("ntp.gripper_in_world_m")?,
        })
    }
}

impl FrameBatch {
    /// What is wrong with a row that should be frame `frame` of an episode.
    pub(crate) fn problem(&self, at: usize, row: &EpisodeRow, frame: i64, width: usize) -> Option<String> {
        let numbers = [
            ("index", self.index[at], row.first_index + frame),
            ("episode_index", self.episode_index[at], row.episode_index),
            ("frame_index", self.frame_index[at], frame),
            ("the length of observation.state", self.state.row(at).len() as i64, width as i64),
        ];
        let wrong = numbers.into_iter().find(|(_, found, expected)| found != expected);
        let wrong = wrong.map(|(name, found, expected)| format!("{name} is {found}, but should be {expected}"));
        let finite = self.state.row(at).iter().all(|value| value.is_finite());
        wrong.or_else(|| (!finite).then(|| "observation.state is not finite".to_owned()))
    }

    /// The gripper in a row, or what is wrong with it.
    fn gripper(&self, at: usize) -> Result<GripperState, String> {
        let found = self.gripper.row(at);
        let closed = self.state.row(at).last().is_some_and(|&closed| closed > 0.5);
        match *found {
            [x, y, z] if found.iter().all(|value| value.is_finite()) => {
                Ok(GripperState { in_world_m: [x, y, z], closed })
            }
            _ => Err(format!("ntp.gripper_in_world_m is {found:?}, but should be three finite numbers")),
        }
    }
}

/// The boundary observations of an episode, one after another, the gripper in each, and which rows are boundaries.
#[derive(Debug, Default)]
pub(crate) struct EpisodeFrames {
    pub(crate) observations: Vec<f32>,
    pub(crate) grippers: Vec<GripperState>,
    pub(crate) is_boundary: Vec<bool>,
}

/// Reads the frames of the next episode.
pub(crate) fn read_frames(
    cursor: &mut Cursor<FrameBatch>,
    row: &EpisodeRow,
    width: usize,
) -> Result<EpisodeFrames, DatasetError> {
    let mut frames = EpisodeFrames::default();
    for frame in 0..row.n_frames {
        let (batch, at) = cursor.next(row.data)?;
        if let Some(problem) = batch.problem(at, row, frame, width) {
            return Err(cursor.problem(problem));
        }
        let is_boundary = batch.boundary.value(at);
        frames.is_boundary.push(is_boundary);
        if is_boundary {
            frames.observations.extend_from_slice(batch.state.row(at));
            let gripper = batch.gripper(at);
            frames.grippers.push(gripper.map_err(|problem| cursor.problem(problem))?);
        }
    }
    Ok(frames)
}
