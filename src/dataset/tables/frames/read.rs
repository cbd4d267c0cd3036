//! Reads the rows of `data/` back.

use crate::dataset::DatasetError;
use crate::dataset::files::cursor::Cursor;
use crate::dataset::tables::episodes::read::EpisodeRow;
use crate::dataset::tables::frames;
use crate::table::batch;
use crate::trace::GripperState;

batch! {
    /// The columns that a learner of programs needs.
    pub(crate) struct FrameBatch of frames {
        state,
        frame_index,
        episode_index,
        index,
        boundary,
        gripper,
    }
}

impl FrameBatch {
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

/// What is wrong with a row that should be frame `frame` of an episode; `found` are its `index`, `episode_index` and
/// `frame_index`.
pub(crate) fn row_problem(
    found: [i64; 3],
    state: &[f32],
    row: &EpisodeRow,
    frame: i64,
    width: usize,
) -> Option<String> {
    let [index, episode_index, frame_index] = found;
    let numbers = [
        ("index", index, row.first_index + frame),
        ("episode_index", episode_index, row.episode_index),
        ("frame_index", frame_index, frame),
        ("the length of observation.state", state.len() as i64, width as i64),
    ];
    let wrong = numbers.into_iter().find(|(_, found, expected)| found != expected);
    let wrong = wrong.map(|(name, found, expected)| format!("{name} is {found}, but should be {expected}"));
    let finite = state.iter().all(|value| value.is_finite());
    wrong.or_else(|| (!finite).then(|| "observation.state is not finite".to_owned()))
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
        let found = [batch.index[at], batch.episode_index[at], batch.frame_index[at]];
        if let Some(problem) = row_problem(found, batch.state.row(at), row, frame, width) {
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
