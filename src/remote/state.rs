//! Scenes and their states to and from messages. Nothing that a robot reports is taken before it was checked here.

use std::collections::BTreeMap;

use crate::arm::N_JOINTS;
use crate::geometry::{Pose, Rotation, Vec3};
use crate::remote::error::RemoteProblem;
use crate::remote::message::{
    BodyMessage, CAUSES, GripperMessage, Observation, PoseMessage, SceneMessage, SlotMessage, StateMessage,
};
use crate::scene::{Body, BodyIndex, Bowl, Mobility, Scene, SceneState, Shape, Slot};
use crate::trace::Cause;

/// Nothing on or about a table is farther away, in metres.
const FAR_M: f32 = 100.0;
/// No body or table is larger than this, in metres.
const LARGE_M: f32 = 10.0;
/// No gripper opens wider than this, in metres.
const WIDE_M: f32 = 1.0;
/// A length of an orientation that differs from 1 by more than this is no orientation; by less than the second it is
/// what rounding makes, and the orientation is taken as it is.
const CROOKED: f32 = 0.01;
const ROUNDED: f32 = 1e-5;
/// No joint is turned further, in radians.
const MOST_ANGLE_RAD: f32 = 100.0;
/// Most bodies and slots of a scene.
const MOST_BODIES: usize = 1000;

/// A scene as a message.
pub(super) fn scene_message(scene: &Scene) -> SceneMessage {
    let Scene { bodies, slots, table_half_m } = scene;
    let body = |Body { name, shape, mobility, color }: &Body| BodyMessage {
        name: name.clone(),
        shape: *shape,
        fixed: *mobility == Mobility::Fixed,
        color: *color,
    };
    let slot = |slot: &Slot| SlotMessage {
        name: slot.name.clone(),
        bodies: slot.bodies.iter().map(|&body| scene.body(body).name.clone()).collect(),
    };
    SceneMessage {
        table_half_m: *table_half_m,
        bodies: bodies.iter().map(body).collect(),
        slots: slots.iter().map(slot).collect(),
    }
}

/// Joints that are told; an angle is a number, and no joint turns round and round.
pub(super) fn read_joints(joints_rad: Option<[f32; N_JOINTS]>) -> Result<Option<[f32; N_JOINTS]>, RemoteProblem> {
    let wrong = joints_rad.iter().flatten().find(|angle| !(-MOST_ANGLE_RAD..=MOST_ANGLE_RAD).contains(*angle));
    match wrong {
        None => Ok(joints_rad),
        Some(found) => {
            let (what, found) = ("joint's angle".to_owned(), found.to_string());
            Err(RemoteProblem::Value { what, found, allowed: "-100 to 100 rad" })
        }
    }
}

/// The scene that is announced or asked for.
pub(super) fn read_scene(message: SceneMessage) -> Result<Scene, RemoteProblem> {
    let SceneMessage { table_half_m, bodies, slots } = message;
    check_sizes("table_half_m", &table_half_m)?;
    for (what, found) in [("bodies", bodies.len()), ("slots", slots.len())] {
        if !(1..=MOST_BODIES).contains(&found) {
            let what = format!("number of {what}");
            return Err(RemoteProblem::Value { what, found: found.to_string(), allowed: "1 to 1000" });
        }
    }
    let mut positions = BTreeMap::new();
    for (position, body) in bodies.iter().enumerate() {
        check_sizes(&format!("size of {}", body.name), &sizes(&body.shape))?;
        if body.name.is_empty() || positions.insert(body.name.clone(), BodyIndex(position as u16)).is_some() {
            let (what, found) = ("body's name".to_owned(), format!("{:?}", body.name));
            return Err(RemoteProblem::Value { what, found, allowed: "each name once, and none empty" });
        }
    }
    let bodies = bodies.into_iter().map(read_body).collect();
    let slots = slots.into_iter().map(|slot| read_slot(slot, &positions)).collect::<Result<Vec<_>, _>>()?;
    Ok(Scene { bodies, slots, table_half_m })
}

fn read_body(message: BodyMessage) -> Body {
    let BodyMessage { name, shape, fixed, color } = message;
    Body { name, shape, mobility: if fixed { Mobility::Fixed } else { Mobility::Movable }, color }
}

fn read_slot(message: SlotMessage, positions: &BTreeMap<String, BodyIndex>) -> Result<Slot, RemoteProblem> {
    let body = |name: String| positions.get(&name).copied().ok_or_else(|| unknown("body", &name, positions.keys()));
    let SlotMessage { name, bodies } = message;
    if bodies.is_empty() {
        return Err(RemoteProblem::Value {
            what: format!("slot {name}"),
            found: "empty".into(),
            allowed: "some bodies",
        });
    }
    Ok(Slot { name, bodies: bodies.into_iter().map(body).collect::<Result<_, _>>()? })
}

/// Holds a scene against the one that was asked for: sizes, colours and mobility may differ, names and slots may not.
pub(super) fn check_names(found: &Scene, expected: &Scene) -> Result<(), RemoteProblem> {
    let body = |body: &Body| body.name.clone();
    let slot = |scene: &Scene, slot: &Slot| {
        let bodies: Vec<&str> = slot.bodies.iter().map(|&body| scene.body(body).name.as_str()).collect();
        format!("{} ({})", slot.name, bodies.join(", "))
    };
    check_list("body", found.bodies.iter().map(body), expected.bodies.iter().map(body))?;
    let slots = |scene: &Scene| scene.slots.iter().map(|of| slot(scene, of)).collect::<Vec<_>>();
    check_list("slot", slots(found).into_iter(), slots(expected).into_iter())
}

fn check_list(
    what: &'static str,
    mut found: impl Iterator<Item = String>,
    mut expected: impl Iterator<Item = String>,
) -> Result<(), RemoteProblem> {
    for position in 0.. {
        let none = || "none".to_owned();
        match (found.next(), expected.next()) {
            (None, None) => break,
            (Some(found), Some(expected)) if found == expected => {}
            (found, expected) => {
                let (found, expected) = (found.unwrap_or_else(none), expected.unwrap_or_else(none));
                return Err(RemoteProblem::Scene { what, position, found, expected });
            }
        }
    }
    Ok(())
}

fn sizes(shape: &Shape) -> Vec<f32> {
    match *shape {
        Shape::Cuboid { half_extents_m } => half_extents_m.to_vec(),
        Shape::Cylinder { radius_m, half_height_m } => vec![radius_m, half_height_m],
        Shape::Ball { radius_m } => vec![radius_m],
        Shape::OpenBox { inner_m: [x, y, z], wall_m } => vec![x, y, z, wall_m],
        Shape::Bowl(Bowl { floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m }) => {
            vec![floor_radius_m, rim_radius_m, height_m, wall_m, foot_radius_m, foot_height_m]
        }
    }
}

fn check_sizes(what: &str, sizes: &[f32]) -> Result<(), RemoteProblem> {
    let is_size = |size: &f32| *size > 0.0 && *size <= LARGE_M;
    match sizes.iter().find(|size| !is_size(size)) {
        Some(size) => {
            Err(RemoteProblem::Value { what: what.to_owned(), found: size.to_string(), allowed: "above 0, at most 10" })
        }
        None => Ok(()),
    }
}

fn unknown<'n>(what: &'static str, found: &str, names: impl Iterator<Item = &'n String>) -> RemoteProblem {
    let allowed = names.cloned().collect::<Vec<_>>().join(", ");
    RemoteProblem::Name { what, found: found.to_owned(), allowed }
}

/// A state as a message.
pub(super) fn state_message(scene: &Scene, state: &SceneState) -> StateMessage {
    let bodies = scene.bodies.iter().zip(&state.bodies_in_world);
    let PoseMessage { position_m, orientation_xyzw } = pose_message(&state.gripper_in_world);
    let holds = state.held.map(|body| scene.body(body).name.clone());
    StateMessage {
        gripper: GripperMessage { position_m, orientation_xyzw, opening_m: state.opening_m, holds },
        bodies: bodies.map(|(body, pose)| (body.name.clone(), pose_message(pose))).collect(),
    }
}

/// A state and its time as a message.
pub(super) fn observation(scene: &Scene, state: &SceneState, time_ns: u64) -> Observation {
    let StateMessage { gripper, bodies } = state_message(scene, state);
    Observation { time_ns, gripper, bodies, joints_rad: state.joints_rad }
}

fn pose_message(pose: &Pose) -> PoseMessage {
    let rotation = pose.rotation.coords;
    PoseMessage {
        position_m: pose.translation.vector.into(),
        orientation_xyzw: [rotation.x, rotation.y, rotation.z, rotation.w],
    }
}

/// The state that a message tells. What it leaves out is where it was `before`: a robot need not see everything always,
/// but at first.
pub(super) fn read_state(
    scene: &Scene,
    message: StateMessage,
    before: Option<&SceneState>,
) -> Result<SceneState, RemoteProblem> {
    let StateMessage { gripper, mut bodies } = message;
    let names = || scene.bodies.iter().map(|body| &body.name);
    let mut bodies_in_world = Vec::with_capacity(scene.bodies.len());
    for (position, body) in scene.bodies.iter().enumerate() {
        let told = bodies.remove(&body.name).map(|pose| read_pose(&body.name, &pose)).transpose()?;
        let pose = told.or_else(|| before.map(|before| before.bodies_in_world[position]));
        bodies_in_world.push(pose.ok_or_else(|| RemoteProblem::Missing { name: body.name.clone() })?);
    }
    if let Some(found) = bodies.keys().next() {
        return Err(unknown("body", found, names()));
    }
    let GripperMessage { position_m, orientation_xyzw, opening_m, holds } = gripper;
    if !(0.0..=WIDE_M).contains(&opening_m) {
        let (what, found) = ("gripper's opening".to_owned(), opening_m.to_string());
        return Err(RemoteProblem::Value { what, found, allowed: "0 to 1 m" });
    }
    let held = holds.map(|name| {
        let position = scene.bodies.iter().position(|body| body.name == name);
        position.map(|position| BodyIndex(position as u16)).ok_or_else(|| unknown("held body", &name, names()))
    });
    let gripper_in_world = read_pose("gripper", &PoseMessage { position_m, orientation_xyzw })?;
    Ok(SceneState { gripper_in_world, opening_m, held: held.transpose()?, bodies_in_world, joints_rad: None })
}

fn read_pose(name: &str, message: &PoseMessage) -> Result<Pose, RemoteProblem> {
    let PoseMessage { position_m, orientation_xyzw: [x, y, z, w] } = message;
    let wrong = |what: &str, found: String, allowed| {
        Err(RemoteProblem::Value { what: format!("{what} of {name}"), found, allowed })
    };
    if !position_m.iter().all(|part| part.abs() <= FAR_M) {
        return wrong("position", format!("{position_m:?}"), "finite, within 100 m");
    }
    let quaternion = nalgebra::Quaternion::new(*w, *x, *y, *z);
    let off = (quaternion.norm() - 1.0).abs();
    let rotation = match off {
        off if off <= ROUNDED => Rotation::new_unchecked(quaternion),
        off if off <= CROOKED => Rotation::new_normalize(quaternion),
        _ => return wrong("orientation", format!("{:?}", [x, y, z, w]), "x, y, z, w of length 1"),
    };
    Ok(Pose::from_parts(Vec3::from(*position_m).into(), rotation))
}

/// The cause that a robot names.
pub(super) fn read_cause(name: &str) -> Result<Cause, RemoteProblem> {
    CAUSES
        .into_iter()
        .find(|cause| cause.name() == name)
        .ok_or_else(|| RemoteProblem::Cause { found: name.to_owned(), allowed: CAUSES.map(Cause::name).join(", ") })
}
