//! The gripper: a palm and two fingers that move with its opening.

use rerun::Boxes3D;
use rerun::components::FillMode;

use crate::trace::{Episode, Frame};
use crate::visualize::store::Store;
use crate::visualize::world::put_poses;
use crate::visualize::{VisualizeError, arm, clock, palette};

/// Half of a finger's width, thickness and length, in metres; these and the palm's are the simulated gripper's.
const FINGER_HALF_M: [f32; 3] = [0.009, 0.003, 0.0215];
/// How far the finger tips reach below the gripper's reference point, in metres.
const TIP_M: f32 = 0.028;
/// Half of the palm's edges, in metres.
const PALM_HALF_M: [f32; 3] = [0.013, 0.044, 0.008];
/// Half of the edges of the stem above the palm, in metres. It is only shown.
const STEM_HALF_M: [f32; 3] = [0.01, 0.01, 0.03];

/// Logs the gripper at all frames.
pub(super) fn put(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    put_poses(store, "world/gripper", episode, |frame| frame.state.gripper_in_world)?;
    let palm_z = finger_z() + FINGER_HALF_M[2] + PALM_HALF_M[2];
    let stem_z = palm_z + PALM_HALF_M[2] + STEM_HALF_M[2];
    // Below an arm there is no stem.
    let n_boxes = if arm::is_there(episode) { 1 } else { 2 };
    let centers = [[0.0, 0.0, palm_z], [0.0, 0.0, stem_z]];
    let half_sizes = [PALM_HALF_M, STEM_HALF_M];
    let palm =
        Boxes3D::from_centers_and_half_sizes(centers.into_iter().take(n_boxes), half_sizes.into_iter().take(n_boxes))
            .with_colors([palette::color(palette::GRIPPER)])
            .with_fill_mode(FillMode::Solid);
    store.put_static("world/gripper/palm", &palm)?;
    put_fingers(store, episode)
}

/// Height of the fingers' centres over the gripper's reference point.
fn finger_z() -> f32 {
    FINGER_HALF_M[2] - TIP_M
}

fn put_fingers(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    let path = "world/gripper/fingers";
    let style = Boxes3D::update_fields().with_half_sizes([FINGER_HALF_M; 2]).with_fill_mode(FillMode::Solid);
    store.put_static(path, &style)?;
    let grasp = |frame: &Frame| (frame.state.opening_m, frame.state.held.is_some());
    let positions = clock::changes(&episode.frames, grasp);
    let grasps: Vec<(f32, bool)> = positions.iter().map(|&position| grasp(&episode.frames[position])).collect();
    let centers = grasps.iter().flat_map(|&(opening_m, _)| {
        let beside = opening_m / 2.0 + FINGER_HALF_M[1];
        [[0.0, beside, finger_z()], [0.0, -beside, finger_z()]]
    });
    let colors = grasps.iter().flat_map(|&(_, holds)| {
        let color = palette::color(if holds { palette::HOLDING } else { palette::GRIPPER });
        [color; 2]
    });
    let fingers = Boxes3D::update_fields().with_centers(centers).with_colors(colors);
    store.put_ragged_rows(path, clock::times(&episode.frames, &positions), &fingers, &vec![2; positions.len()])
}
