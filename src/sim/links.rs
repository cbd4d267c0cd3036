//! The arm's links in the engine: kinematic capsules, which nothing stops.
//!
//! While the gripper flies they stay where they were; they catch up before the engine's next step.

use rapier3d::dynamics::{RigidBodyBuilder, RigidBodyHandle};
use rapier3d::geometry::ColliderBuilder;
use rapier3d::math::{Pose as EnginePose, Rotation, Vector};

use crate::arm::{self, Frame, N_JOINTS, Posture};
use crate::sim::mover::in_world;
use crate::sim::world::{GRIPPER_GROUP, SCENE_GROUP, World, groups};

/// A body a link.
pub(super) struct Links {
    bodies: [RigidBodyHandle; N_JOINTS],
    /// Where the engine has them.
    posture: Posture,
}

impl Links {
    pub(super) fn new(world: &mut World, posture: Posture) -> Self {
        let places = places(&posture);
        let bodies = std::array::from_fn(|link| {
            let body = RigidBodyBuilder::kinematic_position_based().pose(places[link]);
            let handle = world.engine.insert_body(body);
            for capsule in arm::capsules().filter(|capsule| capsule.link == link + 1) {
                let [from, to] = [capsule.from_m, capsule.to_m].map(|end| Vector::from_array(end.map(|x| x as f32)));
                let collider = ColliderBuilder::capsule_from_endpoints(from, to, capsule.radius_m as f32)
                    .collision_groups(groups(GRIPPER_GROUP, SCENE_GROUP));
                world.engine.insert_collider(collider, Some(handle));
            }
            handle
        });
        Self { bodies, posture }
    }

    /// Asks the engine to move the links in its next step, from where the arm was before it.
    pub(super) fn drive(&mut self, world: &mut World, before: Posture, posture: Posture) {
        if self.posture != before {
            for (handle, place) in self.bodies.into_iter().zip(places(&before)) {
                world.engine.bodies[handle].set_position(place, false);
            }
        }
        if before != posture || self.posture != before {
            for (handle, place) in self.bodies.into_iter().zip(places(&posture)) {
                world.engine.bodies[handle].set_next_kinematic_position(place);
            }
        }
        self.posture = posture;
    }

    /// Whether one of them touches something that moves.
    pub(super) fn are_touching(&self, world: &World) -> bool {
        self.bodies.iter().any(|&link| world.is_touching(link))
    }
}

fn places(posture: &Posture) -> [EnginePose; N_JOINTS] {
    arm::links(posture).map(|frame| pose(&frame))
}

fn pose(frame: &Frame) -> EnginePose {
    let rotation = nalgebra::Rotation3::from_matrix_unchecked(frame.rotation);
    let [x, y, z, w] = nalgebra::UnitQuaternion::from_rotation_matrix(&rotation).coords.into();
    let rotation = Rotation::from_xyzw(x as f32, y as f32, z as f32, w as f32);
    EnginePose::from_parts(in_world(&frame.position), rotation)
}
