//! Rethink Robotics' Sawyer, an arm of seven joints: where it reaches, what it touches, how it moves within its limits.
//!
//! # Input and output
//!
//! Postures and places; postures, lines and paths. [`upright`] is the inverse in closed form for a gripper that points
//! down, [`inverse`] the numeric one for any pose, [`planner`] a way round what stands there.
//!
//! # Units and frames
//!
//! Metres, radians, seconds, in double precision. The base's frame: z up along the first joint's axis, x to where the
//! arm looks, the origin where it is bolted on. The gripper's reference point is that of simulation.
//!
//! # Invariants
//!
//! Functions alone: nothing here knows physics, pictures or files. The same input gives the same bits on every platform:
//! angles come from the crate `libm` and never from the platform.

mod clearance;
mod inverse;
mod kinematics;
mod line;
mod planner;
mod sawyer;
mod shape;
mod upright;

pub use clearance::{Load, Obstacles, Solid};
pub use inverse::{closest, inverse};
pub use kinematics::{Frame, forward, jacobian, links, links_in_world};
pub use line::{Line, PEAK_ACCELERATION, PEAK_SPEED, duration_through_secs, min_jerk};
pub use planner::{Plan, PlannerConfig, plan};
pub use sawyer::{BASE_IN_WORLD_M, HOME, JOINT_NAMES, N_JOINTS, NAME};
pub use shape::{Capsule, PlacedCapsule, capsules, placed, self_clearance};
pub use upright::{Bend, Branch, Shoulder, Upright, on_branch, solutions};

/// A position or displacement, in metres.
pub type Vector = nalgebra::Vector3<f64>;

/// The angles of the seven joints, from the base on, in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Posture(pub [f64; N_JOINTS]);

/// Why the arm does not get somewhere.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArmError {
    /// No posture holds the gripper there.
    #[error("no posture within the joints' limits holds the gripper there")]
    Unreachable,
    /// No free way was found.
    #[error("no free way there was found")]
    NoPath,
}

impl Posture {
    /// Whether every joint is within its limits.
    pub fn is_within_limits(&self) -> bool {
        self.0.iter().zip(&sawyer::JOINTS).all(|(angle, joint)| (joint.least_rad..=joint.most_rad).contains(angle))
    }

    /// How long the joint that takes longest needs to another posture at its greatest speed, in seconds.
    pub fn secs_to(&self, other: &Self) -> f64 {
        let pairs = self.0.iter().zip(&other.0).zip(&sawyer::JOINTS);
        pairs.map(|((from, to), joint)| (to - from).abs() / joint.rad_per_s).fold(0.0, f64::max)
    }

    /// The posture at a share of the straight way between two, in the space of joints.
    #[must_use]
    pub fn between(&self, other: &Self, share: f64) -> Self {
        Self(std::array::from_fn(|joint| self.0[joint] + (other.0[joint] - self.0[joint]) * share))
    }
}

/// The greatest speed and acceleration of a joint, in rad/s and rad/s².
pub fn limits(joint: usize) -> (f64, f64) {
    let joint = &sawyer::JOINTS[joint];
    (joint.rad_per_s, joint.rad_per_s2)
}
