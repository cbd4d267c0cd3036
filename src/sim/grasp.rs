//! How the gripper turns to a body, and whether it has it.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use rapier3d::math::{Pose as EnginePose, Rotation, Vector};

use crate::robot::GRASP_M;
use crate::scene::{Bowl, Shape};
use crate::sim::gripper::TIP_M;
use crate::sim::motion::{Tool, turn_rad};

/// Fingers must be this much wider open than the body, in metres.
const FINGER_ROOM_M: f32 = 0.004;
/// A turn below this is not worth making, in radians.
const MIN_TURN_RAD: f32 = 0.01;
/// Extents that differ by less count as equal, in metres.
const EQUAL_M: f32 = 0.001;
/// How far from the fingers' middle a body's centre may be, along their flat sides and in height, in metres.
const MAX_OFFSET_M: f32 = 0.015;

/// How far the fingers reach down beside a bowl's rim, in metres.
const RIM_DEPTH_M: f32 = 0.02;

/// Where the gripper closes on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grasp {
    /// The gripper's reference point.
    pub(super) position: Vector,
    /// Its turn.
    pub(super) yaw_rad: f32,
}

impl Grasp {
    /// Ways to close on a body with fingers that open so far, at least one, the one with the least turn first: at its
    /// middle, with the yaws of [`yaws_rad`]; at the wall of a bowl.
    pub(super) fn plans(shape: &Shape, in_world: &EnginePose, tool: &Tool, jaw_m: f32) -> Vec<Self> {
        if let Shape::Bowl(bowl) = shape {
            return vec![Self::rim(bowl, in_world, tool.yaw_rad)];
        }
        let position = Vector::new(tool.position.x, tool.position.y, in_world.translation.z + GRASP_M);
        let yaws = yaws_rad(shape, in_world, tool.yaw_rad, jaw_m);
        yaws.into_iter().map(|yaw_rad| Self { position, yaw_rad }).collect()
    }

    /// One finger inside the wall and one outside, at the side whose middle is nearest to the gripper's y. Upright
    /// fingers meet the sloping wall outside at its rim and inside where they end.
    fn rim(bowl: &Bowl, in_world: &EnginePose, now_rad: f32) -> Self {
        let inner_m = bowl.radius_at_m(bowl.height_m - RIM_DEPTH_M);
        let radius_m = (inner_m + bowl.rim_radius_m + bowl.wall_m) / 2.0;
        let first = in_world.rotation * Vector::X;
        let side_rad = |side: u32| first.y.atan2(first.x) + side as f32 * FRAC_PI_4;
        let turns = (0..8).map(|side| turn_rad(now_rad + FRAC_PI_2, side_rad(side)));
        let yaw_rad = now_rad + turns.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0);
        let height_m = bowl.height_m - RIM_DEPTH_M + TIP_M;
        let out = Rotation::from_rotation_z(yaw_rad) * Vector::new(0.0, radius_m, height_m);
        Self { position: in_world.translation + out, yaw_rad }
    }
}

/// The yaws with which the fingers, which close along the gripper's y, meet a body's nearest parallel sides: across its
/// shorter side, and of equal sides the one that is nearest to the present yaw first. The present one alone where no
/// turn is needed or helps.
fn yaws_rad(shape: &Shape, in_world: &EnginePose, now_rad: f32, jaw_m: f32) -> Vec<f32> {
    let sides = sides(shape, in_world);
    let fits = sides.iter().filter(|side| 2.0 * side.half_m + FINGER_ROOM_M <= jaw_m);
    let shortest_m = fits.clone().map(|side| side.half_m).fold(f32::MAX, f32::min);
    let mut turns: Vec<f32> = fits
        .filter(|side| side.half_m <= shortest_m + EQUAL_M)
        .map(|side| half_turn_rad(now_rad, side.across.y.atan2(side.across.x) - FRAC_PI_2))
        .collect();
    turns.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let yaw = |turn: &f32| if turn.abs() >= MIN_TURN_RAD { now_rad + turn } else { now_rad };
    if turns.is_empty() { vec![now_rad] } else { turns.iter().map(yaw).collect() }
}

/// A pair of parallel upright sides.
struct Side {
    /// Their normal.
    across: Vector,
    /// Half of their distance.
    half_m: f32,
}

fn sides(shape: &Shape, in_world: &EnginePose) -> Vec<Side> {
    let axis = |axis: Vector, half_m: f32| Side { across: in_world.rotation * axis, half_m };
    match *shape {
        Shape::Cuboid { half_extents_m: [x, y, z] } => {
            let mut all = vec![axis(Vector::X, x), axis(Vector::Y, y), axis(Vector::Z, z)];
            all.sort_by(|a, b| a.across.z.abs().total_cmp(&b.across.z.abs()));
            all.truncate(2);
            all
        }
        // Upright it is the same from every side; lying, its round side is across its axis.
        Shape::Cylinder { radius_m, .. } => {
            let along = in_world.rotation * Vector::Z;
            let lies = along.z.abs() < 0.5;
            lies.then(|| Side { across: Vector::new(-along.y, along.x, 0.0), half_m: radius_m }).into_iter().collect()
        }
        Shape::Ball { .. } | Shape::OpenBox { .. } | Shape::Bowl(_) => Vec::new(),
    }
}

/// The shortest turn to a direction or its opposite.
fn half_turn_rad(from: f32, to: f32) -> f32 {
    let turn = turn_rad(from, to);
    if turn > FRAC_PI_2 {
        turn - PI
    } else if turn < -FRAC_PI_2 {
        turn + PI
    } else {
        turn
    }
}

/// Whether a body that both fingers touch is well between them.
pub(super) fn is_between_fingers(shape: &Shape, tool: &Tool, in_world: &EnginePose) -> bool {
    let center = tool.in_world().inv_mul(in_world).translation;
    let wanted = match shape {
        Shape::Bowl(bowl) => {
            let rim = Grasp::rim(bowl, in_world, tool.yaw_rad);
            tool.in_world().inverse_transform_point(rim.position)
        }
        _ => Vector::new(center.x, 0.0, center.z + GRASP_M),
    };
    wanted.x.abs() <= MAX_OFFSET_M && wanted.z.abs() <= MAX_OFFSET_M
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(yaw_rad: f32) -> EnginePose {
        EnginePose::from_rotation(Rotation::from_rotation_z(yaw_rad))
    }

    #[track_caller]
    fn check(half_extents_m: [f32; 3], body_yaw_rad: f32, expected_rad: f32) {
        let found = yaws_rad(&Shape::Cuboid { half_extents_m }, &turned(body_yaw_rad), 0.0, 0.07)[0];
        // The two fingers are alike: half a turn is no difference.
        let difference = (found - expected_rad).rem_euclid(PI);
        assert!(difference.min(PI - difference) < 1e-3, "{found} instead of {expected_rad}");
    }

    #[test]
    fn a_cube_is_met_at_its_nearest_sides() {
        check([0.025; 3], 0.3, 0.3);
        check([0.025; 3], 1.5, 1.5 - FRAC_PI_2);
        check([0.025; 3], -1.0, FRAC_PI_2 - 1.0);
    }

    #[test]
    fn a_brick_is_met_across_its_shorter_side() {
        check([0.028, 0.015, 0.015], 0.3, 0.3);
        check([0.015, 0.028, 0.015], 0.3, 0.3 - FRAC_PI_2);
        check([0.025, 0.06, 0.015], 0.0, FRAC_PI_2);
    }
}
