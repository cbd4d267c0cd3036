//! `foxglove.JointStates` to and from the angles of an arm's joints. f32 to f64 and back is exact.

use super::error::MessageProblem;
use super::schema::{foxglove, timestamp};
use crate::arm::{JOINT_NAMES, N_JOINTS};

/// The angles of all joints, named as their maker has them.
pub(super) fn encode(log_time_nanos: u64, joints_rad: &[f32; N_JOINTS]) -> foxglove::JointStates {
    let joint = |(name, angle): (&str, &f32)| foxglove::JointState {
        name: name.to_owned(),
        position: Some(f64::from(*angle)),
        ..foxglove::JointState::default()
    };
    let joints = JOINT_NAMES.into_iter().zip(joints_rad).map(joint).collect();
    foxglove::JointStates { timestamp: Some(timestamp(log_time_nanos)), joints }
}

/// The angles, whatever the order of the joints.
pub(super) fn decode(message: &foxglove::JointStates) -> Result<[f32; N_JOINTS], MessageProblem> {
    let mut joints_rad = [0.0; N_JOINTS];
    for (name, angle) in JOINT_NAMES.into_iter().zip(&mut joints_rad) {
        let joint = message.joints.iter().find(|joint| joint.name == name);
        let position = joint.and_then(|joint| joint.position);
        *angle = position.ok_or(MessageProblem::Missing { field: "position of a joint" })? as f32;
    }
    Ok(joints_rad)
}
