//! The inverse in closed form, for a gripper that points down.
//!
//! With the third and the fifth joint at 0 the arm is one of three joints in a plane, on a turntable. Where the second,
//! fourth and sixth joint add up to a right angle the gripper points down. Both are linear in the joints: so a straight
//! line between two such postures keeps the gripper upright all the way.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::arm::sawyer::{BESIDE_M, JOINTS, PART_M, SHOULDER_M, WRIST_M, YAW_RAD};
use crate::arm::{Posture, Vector};

/// How far from its limits a joint stays, in radians: what rounds must not lie beyond.
const MARGIN_RAD: f64 = 1e-3;

/// A gripper that points down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Upright {
    /// Its reference point in the base's frame.
    pub position: Vector,
    /// Its turn about the vertical: 0 where the fingers close along y.
    pub yaw_rad: f64,
}

/// The side of the first joint's axis that the arm is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shoulder {
    /// It looks at the gripper.
    Front,
    /// It reaches back over its base.
    Back,
}

/// How the elbow is bent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bend {
    /// The elbow is up.
    Up,
    /// The elbow is down.
    Down,
}

/// Which of the four ways to get to a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Side of the first joint's axis.
    pub shoulder: Shoulder,
    /// Bend of the elbow.
    pub bend: Bend,
}

impl Branch {
    /// All four, the usual one first.
    pub const ALL: [Self; 4] = [
        Self { shoulder: Shoulder::Front, bend: Bend::Up },
        Self { shoulder: Shoulder::Front, bend: Bend::Down },
        Self { shoulder: Shoulder::Back, bend: Bend::Up },
        Self { shoulder: Shoulder::Back, bend: Bend::Down },
    ];
}

/// An angle within a joint's limits that is the same; `None` where there is none.
fn within(joint: usize, angle: f64) -> Option<f64> {
    let [least, most] = [JOINTS[joint].least_rad + MARGIN_RAD, JOINTS[joint].most_rad - MARGIN_RAD];
    [angle, angle - TAU, angle + TAU].into_iter().find(|angle| (least..=most).contains(angle))
}

/// The posture of one branch, with the last joint's turn as it comes out; the last joint alone may be beyond its limits.
/// `None` where the gripper is out of reach of this branch.
pub fn on_branch(upright: &Upright, branch: Branch) -> Option<Posture> {
    let [x, y, z] = upright.position.into();
    let reach = x * x + y * y - BESIDE_M * BESIDE_M;
    if reach <= 0.0 {
        return None;
    }
    let radius = match branch.shoulder {
        Shoulder::Front => libm::sqrt(reach),
        Shoulder::Back => -libm::sqrt(reach),
    };
    let first = within(0, libm::atan2(y, x) - libm::atan2(BESIDE_M, radius))?;
    let (out, up) = (radius - SHOULDER_M[0], z + WRIST_M - SHOULDER_M[1]);
    let bent = (out * out + up * up) / (2.0 * PART_M * PART_M) - 1.0;
    if !(-1.0..=1.0).contains(&bent) {
        return None;
    }
    let elbow = match branch.bend {
        Bend::Up => libm::acos(bent),
        Bend::Down => -libm::acos(bent),
    };
    // Both parts are alike: each is half of the elbow's angle off the line to the wrist.
    let second = within(1, -libm::atan2(up, out) - elbow / 2.0)?;
    let fourth = within(3, elbow)?;
    let sixth = within(5, FRAC_PI_2 - second - fourth)?;
    let last = YAW_RAD + first - upright.yaw_rad;
    Some(Posture([first, second, 0.0, fourth, 0.0, sixth, last]))
}

/// All postures within the limits: each branch with each turn of the last joint that holds the gripper so, or turned by
/// half a turn, since the fingers are alike.
pub fn solutions(upright: &Upright) -> impl Iterator<Item = (Branch, Posture)> + use<'_> {
    Branch::ALL.into_iter().filter_map(|branch| Some((branch, on_branch(upright, branch)?))).flat_map(
        |(branch, Posture(joints))| {
            let most = JOINTS[6].most_rad - MARGIN_RAD;
            let first = joints[6] - PI * libm::floor((joints[6] + most) / PI);
            let turns = (0..4).map(move |half_turns| first + f64::from(half_turns) * PI);
            turns.take_while(move |last| *last <= most).map(move |last| {
                let mut joints = joints;
                joints[6] = last;
                (branch, Posture(joints))
            })
        },
    )
}
