//! The numeric inverse, for any pose of the gripper: damped least squares within the joints' limits.

use nalgebra::{Matrix6, SVector, Vector6};
use rand::Rng as _;

use crate::arm::kinematics::{Frame, forward, jacobian};
use crate::arm::sawyer::{JOINTS, Joint, N_JOINTS};
use crate::arm::upright::{Upright, solutions};
use crate::arm::{ArmError, Posture, Vector};
use crate::seed::Seed;

/// Damping, in metres and radians alike: small steps near postures in which the arm is stretched.
const DAMPING: f64 = 0.03;
/// The longest step of a joint, in radians.
const MOST_STEP_RAD: f64 = 0.5;
const MOST_STEPS: usize = 60;
/// The gripper is there when it is no farther away, in metres and in radians.
const EXACT: f64 = 1e-7;
/// How often it is tried from another posture.
const MOST_STARTS: usize = 40;

/// The posture near `start` that holds the gripper at a pose, found by descent.
///
/// # Errors
///
/// [`ArmError::Unreachable`] when the descent ends elsewhere: from another start it may not.
pub fn closest(target: &Frame, start: &Posture) -> Result<Posture, ArmError> {
    let mut posture = *start;
    for _ in 0..MOST_STEPS {
        let error = error(target, &forward(&posture));
        if error.norm() <= EXACT {
            return Ok(posture);
        }
        posture = step(&posture, &error).ok_or(ArmError::Unreachable)?;
    }
    Err(ArmError::Unreachable)
}

/// A posture that holds the gripper at a pose and passes `accept`: from `now`, from those of an upright gripper there,
/// then from postures drawn on a seed.
///
/// # Errors
///
/// [`ArmError::Unreachable`] when no start leads to one.
pub fn inverse(
    target: &Frame,
    now: &Posture,
    seed: Seed,
    accept: impl Fn(&Posture) -> bool,
) -> Result<Posture, ArmError> {
    let mut rng = seed.derive("inverse", &[]).rng();
    let x_axis = target.rotation.column(0);
    let upright = Upright { position: target.position, yaw_rad: libm::atan2(x_axis[1], x_axis[0]) };
    let planar: Vec<Posture> = solutions(&upright).map(|(_, posture)| posture).collect();
    let drawn = std::iter::repeat_with(|| {
        Posture(std::array::from_fn(|joint| {
            let joint = &JOINTS[joint];
            joint.least_rad + (joint.most_rad - joint.least_rad) * rng.random::<f64>()
        }))
    });
    let starts = std::iter::once(*now).chain(planar).chain(drawn).take(MOST_STARTS);
    starts.filter_map(|start| closest(target, &start).ok()).find(accept).ok_or(ArmError::Unreachable)
}

/// What is missing to the target: a displacement, and the turn about each axis where it is small.
fn error(target: &Frame, now: &Frame) -> Vector6<f64> {
    let moved = target.position - now.position;
    let turned = (0..3)
        .fold(Vector::zeros(), |sum, axis| sum + now.rotation.column(axis).cross(&target.rotation.column(axis)) / 2.0);
    Vector6::new(moved.x, moved.y, moved.z, turned.x, turned.y, turned.z)
}

/// Δq = Jᵀ (J Jᵀ + λ² I)⁻¹ e, held within the limits. `None` where the matrix cannot be inverted.
fn step(posture: &Posture, error: &Vector6<f64>) -> Option<Posture> {
    let jacobian = jacobian(posture);
    // Far away it is held back, near by it runs to the end.
    let damping = DAMPING * error.norm().min(1.0);
    let damped = jacobian * jacobian.transpose() + Matrix6::identity() * (damping * damping + 1e-12);
    let delta: SVector<f64, N_JOINTS> = jacobian.transpose() * damped.cholesky()?.solve(error);
    let longest = delta.iter().fold(MOST_STEP_RAD, |longest, step| longest.max(step.abs()));
    let scale = MOST_STEP_RAD / longest;
    Some(Posture(std::array::from_fn(|joint| {
        let Joint { least_rad, most_rad, .. } = &JOINTS[joint];
        (posture.0[joint] + delta[joint] * scale).clamp(*least_rad, *most_rad)
    })))
}
