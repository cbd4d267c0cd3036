//! Where the gripper is to be at each step of a motion.
//!
//! A motion is a straight segment with the minimum-jerk profile: it starts and ends at rest, so that segments may
//! follow each other in any direction. No trigonometry here: the same bits on every platform.

use std::f32::consts::{PI, TAU};

use rapier3d::math::{Pose as EnginePose, Rotation, Vector};

use crate::sim::SimulationConfig;

/// Greatest turn rate of the gripper about the vertical, in radians per second.
const TURN_RAD_PER_SEC: f32 = 6.0;
/// Speed at which the distance between the fingers changes, in metres per second.
const FINGER_M_PER_S: f32 = 0.5;
/// Peak speed and peak acceleration of a minimum-jerk motion of length 1 and duration 1.
const PEAK_SPEED: f32 = 1.875;
const PEAK_ACCELERATION: f32 = 5.773_503;

/// Where the gripper is and how far it is open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tool {
    /// The gripper's reference point in the world.
    pub(super) position: Vector,
    /// Its turn about the vertical.
    pub(super) yaw_rad: f32,
    /// Distance between the fingers.
    pub(super) opening_m: f32,
}

impl Tool {
    /// The gripper's pose.
    pub(super) fn in_world(&self) -> EnginePose {
        EnginePose::from_parts(self.position, Rotation::from_rotation_z(self.yaw_rad))
    }

    /// The same at its own height over a place.
    pub(super) fn over(self, place: Vector) -> Self {
        Self { position: Vector::new(place.x, place.y, self.position.z), ..self }
    }

    /// The same at another height.
    pub(super) fn at_height(self, z: f32) -> Self {
        Self { position: Vector::new(self.position.x, self.position.y, z), ..self }
    }
}

/// A straight segment of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    from: Tool,
    to: Tool,
    /// How many steps it takes; 0 when there is nothing to do.
    pub(super) n_steps: u32,
}

impl Motion {
    /// The fastest allowed motion.
    pub(super) fn new(from: Tool, to: Tool, config: &SimulationConfig) -> Self {
        let length = (to.position - from.position).length();
        let by_speed = PEAK_SPEED * length / config.speed_m_per_s;
        let by_acceleration = (PEAK_ACCELERATION * length / config.acceleration_m_per_s2).sqrt();
        let by_turn = PEAK_SPEED * turn_rad(from.yaw_rad, to.yaw_rad).abs() / TURN_RAD_PER_SEC;
        let by_fingers = PEAK_SPEED * (to.opening_m - from.opening_m).abs() / FINGER_M_PER_S;
        let duration_secs = by_speed.max(by_acceleration).max(by_turn).max(by_fingers);
        Self { from, to, n_steps: (duration_secs * config.step_hz as f32).ceil() as u32 }
    }

    /// The same motion in so many steps.
    pub(super) fn in_steps(self, n_steps: u32) -> Self {
        Self { n_steps, ..self }
    }

    /// Where the gripper is after `step` of the `n_steps` steps.
    pub(super) fn at(&self, step: u32) -> Tool {
        if step >= self.n_steps {
            return self.to;
        }
        let u = step as f32 / self.n_steps as f32;
        let s = u * u * u * (10.0 + u * (6.0 * u - 15.0));
        Tool {
            position: self.from.position + (self.to.position - self.from.position) * s,
            yaw_rad: self.from.yaw_rad + turn_rad(self.from.yaw_rad, self.to.yaw_rad) * s,
            opening_m: self.from.opening_m + (self.to.opening_m - self.from.opening_m) * s,
        }
    }
}

/// The shortest turn from one yaw to another, in [-pi, pi].
pub(super) fn turn_rad(from: f32, to: f32) -> f32 {
    let turn = (to - from) % TAU;
    if turn > PI {
        turn - TAU
    } else if turn < -PI {
        turn + TAU
    } else {
        turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tool(z: f32) -> Tool {
        Tool { position: Vector::new(0.0, 0.0, z), yaw_rad: 0.0, opening_m: 0.07 }
    }

    #[test]
    fn a_motion_ends_exactly_at_its_goal_and_never_exceeds_its_speed() {
        let config = SimulationConfig::default();
        let motion = Motion::new(tool(0.0), tool(0.4), &config);
        assert_eq!(motion.at(motion.n_steps), tool(0.4));
        for step in 1..=motion.n_steps {
            let rise = motion.at(step).position.z - motion.at(step - 1).position.z;
            assert!(rise >= 0.0 && rise * config.step_hz as f32 <= 1.01 * config.speed_m_per_s);
        }
    }

    #[test]
    fn a_turn_takes_the_short_way() {
        assert!((turn_rad(3.0, -3.0) - (TAU - 6.0)).abs() < 1e-5);
        assert!((turn_rad(-3.0, 3.0) + (TAU - 6.0)).abs() < 1e-5);
        assert!(turn_rad(0.5, 0.5).abs() < 1e-6);
    }
}
