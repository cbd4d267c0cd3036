//! One recorded instant, and what a policy may see of it.

use crate::scene::{BodyIndex, SceneState};

/// One recorded instant of an episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Simulated time since the episode began, in nanoseconds.
    pub time_nanos: u64,
    /// Whether a primitive had just ended (or the episode begun): the frames that programs see.
    pub boundary: bool,
    /// Where everything was.
    pub state: SceneState,
    /// The body that each slot showed.
    pub slots: Vec<BodyIndex>,
}

impl Frame {
    /// What a policy may see: positions of the slots' bodies relative to the gripper, and the gripper.
    pub fn observation(&self) -> Observation {
        let gripper = self.state.gripper_in_world.translation.vector;
        let relative = |&body: &BodyIndex| {
            let position = self.state.body_in_world(body).translation.vector - gripper;
            [position.x, position.y, position.z]
        };
        Observation { slots_m: self.slots.iter().map(relative).collect(), closed: self.state.held.is_some() }
    }

    /// What the robot knows of itself without looking.
    pub fn gripper(&self) -> GripperState {
        let position = self.state.gripper_in_world.translation.vector;
        GripperState { in_world_m: [position.x, position.y, position.z], closed: self.state.held.is_some() }
    }
}

/// Where a robot's gripper is, and whether it is closed: its proprioception.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GripperState {
    /// Its reference point in the world, in metres: [`SceneState::gripper_in_world`].
    pub in_world_m: [f32; 3],
    /// Whether it holds something.
    pub closed: bool,
}

/// The paper's full state: "object position trajectories relative to the gripper frame" (section V).
#[derive(Clone, Debug, PartialEq)]
pub struct Observation {
    /// Position of each slot's body minus the gripper's, in metres, along the world's axes.
    pub slots_m: Vec<[f32; 3]>,
    /// Whether the gripper holds something.
    pub closed: bool,
}

impl Observation {
    /// Width of the flat form for `n_slots` slots.
    pub fn width(n_slots: usize) -> usize {
        3 * n_slots + 2
    }

    /// The flat form: x, y, z of each slot, then one-hot (open, closed).
    pub fn to_flat(&self) -> Vec<f32> {
        let closed = f32::from(u8::from(self.closed));
        self.slots_m.iter().flatten().copied().chain([1.0 - closed, closed]).collect()
    }
}
