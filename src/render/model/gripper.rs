//! The gripper: hand, fingers, and the arm above it.
//!
//! # Units and frames
//!
//! Metres in the gripper's frame. Palm and fingers have the extents that they have in simulation.

use crate::render::look::linear;
use crate::render::mesh::{Mesh, Paint, Surface};

/// Half of a finger's width, thickness and length.
const FINGER_HALF_M: [f32; 3] = [0.009, 0.003, 0.0215];
/// From the gripper's reference point down to the finger tips.
const TIP_M: f32 = 0.028;
/// From the gripper's reference point up to the palm's lower side.
const PALM_M: f32 = 0.015;
const PALM_HALF_M: [f32; 3] = [0.013, 0.044, 0.008];
/// Of the ring between hand and arm.
const FLANGE_M: f32 = 0.008;
/// Of the wrist, below and above.
const WRIST_RADIUS_M: [f32; 2] = [0.020, 0.028];
const TUBE_RADIUS_M: f32 = 0.025;
/// Sides of round parts.
const N_SIDES: usize = 24;
/// How far a pad stands out of its finger: sides in one plane would flicker.
const PAD_PROUD_M: f32 = 0.0005;
/// Of the soft pad inside of a finger.
const PAD_HALF_M: [f32; 3] = [0.0075, 0.0006, 0.009];

fn shell() -> Paint {
    Paint { color: linear([232, 234, 236]), gloss: 0.25 }
}

fn dark() -> Paint {
    Paint { color: linear([58, 62, 70]), gloss: 0.2 }
}

fn metal() -> Paint {
    Paint { color: linear([150, 156, 164]), gloss: 0.5 }
}

/// The hand, with an arm of `stem_m` above it.
pub(super) fn hand(stem_m: f32) -> Mesh {
    let mut mesh = Mesh::default();
    let top = PALM_M + 2.0 * PALM_HALF_M[2];
    mesh.plain_cuboid([0.0, 0.0, PALM_M + PALM_HALF_M[2]], PALM_HALF_M, shell());
    let rail = [PALM_HALF_M[0] * 1.04, PALM_HALF_M[1] * 0.92, 0.0022];
    mesh.plain_cuboid([0.0, 0.0, PALM_M + 0.003], rail, dark());
    if stem_m > 0.0 {
        arm(&mut mesh, top, top + stem_m);
    }
    mesh
}

/// A flange, a wrist and a tube between two heights.
fn arm(mesh: &mut Mesh, bottom: f32, top: f32) {
    let smooth = |radial: f32, axial: f32| Surface::Cone { radial, axial };
    let flange = bottom + FLANGE_M.min(top - bottom);
    mesh.cylinder(WRIST_RADIUS_M[0], [bottom, flange], N_SIDES, dark());
    let mut below = [WRIST_RADIUS_M[0], flange];
    for (radius_m, length_m, paint) in
        [(WRIST_RADIUS_M[1], 0.024, shell()), (WRIST_RADIUS_M[1], 0.045, shell()), (TUBE_RADIUS_M, 0.02, shell())]
    {
        let above = [radius_m, (below[1] + length_m).min(top)];
        mesh.lathe(&[below, above], N_SIDES, paint, smooth);
        below = above;
    }
    let joint = (below[1] + 0.012).min(top);
    mesh.lathe(&[[TUBE_RADIUS_M, below[1]], [TUBE_RADIUS_M, joint]], N_SIDES, dark(), smooth);
    mesh.lathe(&[[TUBE_RADIUS_M, joint], [TUBE_RADIUS_M, top]], N_SIDES, shell(), smooth);
    mesh.disk(below[0].max(TUBE_RADIUS_M), top, N_SIDES, shell());
}

/// A finger with a soft pad on its inner side.
pub(super) fn finger() -> Mesh {
    let mut mesh = Mesh::default();
    let center_z = FINGER_HALF_M[2] - TIP_M;
    mesh.plain_cuboid([0.0, FINGER_HALF_M[1], center_z], FINGER_HALF_M, metal());
    let pad_z = PAD_HALF_M[2] - TIP_M + 0.001;
    mesh.plain_cuboid([0.0, PAD_HALF_M[1] - PAD_PROUD_M, pad_z], PAD_HALF_M, dark());
    mesh
}
