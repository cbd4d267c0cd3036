//! Sawyer's numbers.
//!
//! # Source
//!
//! Places, turns, limits and speeds of the joints: Rethink's `sawyer_robot`, `sawyer_base.urdf.xacro` (Apache-2.0,
//! © 2013-2018 Rethink Robotics). Accelerations: the class "Express" of `sawyer_moveit` (Apache-2.0); the maker's data
//! sheet has none. Capsules: `mujoco_menagerie` (Apache-2.0). Numbers are facts; no file of these is here.
//!
//! The gripper is that of simulation under Rethink's body, its tips as far below the hand as the standard narrow
//! fingers reach.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::arm::Posture;

/// The name in files.
pub const NAME: &str = "sawyer";
/// How many joints there are.
pub const N_JOINTS: usize = 7;
/// Names of the joints as their maker has them, from the base on.
pub const JOINT_NAMES: [&str; N_JOINTS] =
    ["right_j0", "right_j1", "right_j2", "right_j3", "right_j4", "right_j5", "right_j6"];

/// A joint, which turns about the z axis of its link.
pub(super) struct Joint {
    /// Where the link is in the one before when the angle is 0.
    pub(super) origin_m: [f64; 3],
    /// Its turn there: about x, then y, then z of the one before.
    pub(super) roll_pitch_yaw: [f64; 3],
    pub(super) least_rad: f64,
    pub(super) most_rad: f64,
    pub(super) rad_per_s: f64,
    pub(super) rad_per_s2: f64,
}

const fn joint(
    origin_m: [f64; 3],
    roll_pitch_yaw: [f64; 3],
    [least_rad, most_rad]: [f64; 2],
    [rad_per_s, rad_per_s2]: [f64; 2],
) -> Joint {
    Joint { origin_m, roll_pitch_yaw, least_rad, most_rad, rad_per_s, rad_per_s2 }
}

/// The tilt of the hand about the last joint's axis.
const HAND_TILT_RAD: f64 = 0.174_53;

pub(super) static JOINTS: [Joint; N_JOINTS] = [
    joint([0.0, 0.0, 0.08], [0.0, 0.0, 0.0], [-3.0503, 3.0503], [1.74, 10.0]),
    joint([0.081, 0.05, 0.237], [-FRAC_PI_2, FRAC_PI_2, 0.0], [-3.8095, 2.2736], [1.328, 8.0]),
    joint([0.0, -0.14, 0.1425], [FRAC_PI_2, 0.0, 0.0], [-3.0426, 3.0426], [1.957, 10.0]),
    joint([0.0, -0.042, 0.26], [-FRAC_PI_2, 0.0, 0.0], [-3.0439, 3.0439], [1.957, 10.0]),
    joint([0.0, -0.125, -0.1265], [FRAC_PI_2, 0.0, 0.0], [-2.9761, 2.9761], [3.485, 12.0]),
    joint([0.0, 0.031, 0.275], [-FRAC_PI_2, 0.0, 0.0], [-2.9761, 2.9761], [3.485, 12.0]),
    joint([0.0, -0.11, 0.1053], [-FRAC_PI_2, -HAND_TILT_RAD, PI], [-4.7124, 4.7124], [4.545, 12.0]),
];

/// From the last link's origin along its z to the hand, which is turned there by a quarter.
pub(super) const HAND_M: f64 = 0.0245;
pub(super) const HAND_TURN_RAD: f64 = FRAC_PI_2;
/// From the hand along its z to the gripper's reference point; the tips are 0.1356 m below the hand.
pub(super) const TOOL_M: f64 = 0.1076;

/// Where the base is bolted on our tables: from here every place of every family's bench is within reach.
pub const BASE_IN_WORLD_M: [f64; 3] = [-0.62, 0.0, 0.1];

/// The arm of three joints that is within, where the third and the fifth joint are at 0: in the plane through the
/// second joint's axis, height against distance from the first joint's axis.
///
/// The second joint.
pub(super) const SHOULDER_M: [f64; 2] = [0.081, 0.08 + 0.237];
/// From the second joint to the fourth, and from that to the sixth: alike.
pub(super) const PART_M: f64 = 0.14 + 0.26;
/// From the sixth joint to the gripper's reference point.
pub(super) const WRIST_M: f64 = 0.11 + HAND_M + TOOL_M;
/// The gripper is so far beside the vertical plane through the first joint's axis.
pub(super) const BESIDE_M: f64 = 0.05 + 0.1425 - 0.042 - 0.1265 + 0.031 + 0.1053;
/// The gripper's turn about the vertical where it points down and the first and the last joint are at 0.
pub(super) const YAW_RAD: f64 = HAND_TILT_RAD - FRAC_PI_2;

/// Where an episode begins: the gripper upright, not turned, 0.52 m before the base and 0.22 m above it.
pub const HOME: Posture = {
    let (first, second, fourth) = (-0.3134, -1.3282, 1.9817);
    Posture([first, second, 0.0, fourth, 0.0, FRAC_PI_2 - second - fourth, YAW_RAD + first])
};

/// A capsule of the arm, in the frame of a link.
pub(super) struct Part {
    /// 0 for the base, then the links in order.
    pub(super) link: usize,
    pub(super) from_m: [f64; 3],
    pub(super) to_m: [f64; 3],
    pub(super) radius_m: f64,
}

const fn part(link: usize, from_m: [f64; 3], to_m: [f64; 3], radius_m: f64) -> Part {
    Part { link, from_m, to_m, radius_m }
}

/// How many capsules there are.
pub(super) const N_PARTS: usize = 14;

pub(super) static PARTS: [Part; N_PARTS] = [
    part(0, [0.0, 0.0, 0.0], [0.0, 0.0, 0.16], 0.08),
    part(1, [0.0, 0.0, -0.005], [0.0, 0.0, 0.25], 0.07),
    part(1, [0.0, 0.0, 0.23], [0.08, 0.0, 0.23], 0.07),
    // The head and its display.
    part(1, [-0.005, 0.0, 0.3165], [-0.005, 0.0, 0.5015], 0.04),
    part(1, [0.025, -0.07, 0.3965], [0.025, 0.07, 0.3965], 0.075),
    part(2, [0.0, 0.0, -0.06], [0.0, 0.0, 0.13], 0.068),
    part(3, [0.0, 0.0, -0.15], [0.0, 0.0, 0.26], 0.055),
    part(4, [0.0, 0.0, -0.115], [0.0, 0.0, 0.03], 0.055),
    part(5, [0.0, 0.0, -0.13], [0.0, 0.0, 0.27], 0.045),
    part(6, [0.0, 0.0, -0.02], [0.0, 0.0, 0.1], 0.045),
    part(6, [0.0, 0.0, 0.105], [0.0, -0.082, 0.105], 0.045),
    part(7, [0.0, 0.0, 0.0], [0.0, 0.0, 0.02], 0.045),
    // The gripper's body, along the fingers' closing.
    part(7, [-0.022, 0.0, 0.062], [0.022, 0.0, 0.062], 0.029),
    // Between wrist and body.
    part(7, [0.0, 0.0, 0.02], [0.0, 0.0, 0.062], 0.03),
];
