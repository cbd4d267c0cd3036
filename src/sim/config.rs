//! How finely and how fast the world is simulated.

use serde::{Deserialize, Serialize};

use crate::robot::RobotKind;
use crate::sim::SimError;
use crate::sim::gripper::MAX_OPENING_M;
use crate::task::Layout;

/// A gripper that opens less grips nothing.
const LEAST_JAW_M: f32 = 0.01;

/// Settings of a simulation. The defaults are what the published figures were measured with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SimulationConfig {
    /// Which robot acts: `gripper`, which flies freely, or the arm `sawyer`.
    #[serde(skip_serializing_if = "RobotKind::is_default")]
    pub robot: RobotKind,
    /// How things are laid out: `table`, or `bench` about an arm; when left out as the robot needs it. An arm has to
    /// have its bench.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layout: Option<Layout>,
    /// How far the gripper opens at most, in metres, 0.01 to 0.07; 0.07 when left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jaw_m: Option<f32>,
    /// Physics steps per simulated second, 120 to 2000. Contacts are tuned for 240.
    pub step_hz: u32,
    /// Recorded frames per simulated second between boundaries, at most `step_hz`; 0 records boundaries alone.
    pub frame_hz: u32,
    /// The gripper's greatest speed in metres per second, above 0 and at most 3.
    pub speed_m_per_s: f32,
    /// The gripper's greatest acceleration in metres per second squared, above 0 and at most 50.
    pub acceleration_m_per_s2: f32,
    /// How long the scene may take to come to rest, in simulated seconds, above 0 and at most 60.
    pub settle_limit_secs: f32,
}

impl Default for SimulationConfig {
    fn default() -> Self {
        Self {
            robot: RobotKind::default(),
            layout: None,
            jaw_m: None,
            step_hz: 240,
            frame_hz: 10,
            speed_m_per_s: 1.25,
            acceleration_m_per_s2: 15.0,
            settle_limit_secs: 3.0,
        }
    }
}

impl SimulationConfig {
    /// Checks every setting; cheap, so that a pipeline can ask before any work.
    ///
    /// # Errors
    ///
    /// [`SimError::Config`] for the first setting that is not allowed.
    pub fn check(&self) -> Result<(), SimError> {
        let Self { robot, layout, jaw_m, step_hz, frame_hz, speed_m_per_s, acceleration_m_per_s2, settle_limit_secs } =
            self;
        let wrong =
            |key, found: String, allowed: &str| Err(SimError::Config { key, found, allowed: allowed.to_owned() });
        let positive = |value: f32, most: f32| value > 0.0 && value <= most;
        if *layout == Some(Layout::Table) && robot.layout() == Layout::Bench {
            return wrong("layout", "table".to_owned(), "bench, where the arm reaches everything");
        }
        if let Some(jaw_m) = jaw_m.filter(|jaw_m| !(LEAST_JAW_M..=MAX_OPENING_M).contains(jaw_m)) {
            return wrong("jaw_m", jaw_m.to_string(), "0.01 to 0.07");
        }
        if !(120..=2000).contains(step_hz) {
            return wrong("step_hz", step_hz.to_string(), "120 to 2000");
        }
        if frame_hz > step_hz {
            return wrong("frame_hz", frame_hz.to_string(), "0 to step_hz");
        }
        if !positive(*speed_m_per_s, 3.0) {
            return wrong("speed_m_per_s", speed_m_per_s.to_string(), "above 0, at most 3");
        }
        if !positive(*acceleration_m_per_s2, 50.0) {
            return wrong("acceleration_m_per_s2", acceleration_m_per_s2.to_string(), "above 0, at most 50");
        }
        if !positive(*settle_limit_secs, 60.0) {
            return wrong("settle_limit_secs", settle_limit_secs.to_string(), "above 0, at most 60");
        }
        Ok(())
    }

    /// How things are laid out.
    pub fn layout(&self) -> Layout {
        self.layout.unwrap_or_else(|| self.robot.layout())
    }

    /// How far the gripper opens at most, in metres.
    pub fn jaw_m(&self) -> f32 {
        self.jaw_m.unwrap_or(MAX_OPENING_M)
    }

    /// The longest wait for rest, in steps.
    pub(super) fn settle_limit_steps(&self) -> u32 {
        (self.settle_limit_secs * self.step_hz as f32) as u32
    }
}
