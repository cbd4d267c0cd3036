//! Messages for people: what Foxglove and Rerun show of an episode beside its data. No reader of ours needs them.

use super::schema::foxglove::{
    Color, CubePrimitive, CylinderPrimitive, Event, KeyValuePair, Log, Point3, Pose, Quaternion, SceneEntity,
    SceneEntityDeletion, SceneUpdate, SpherePrimitive, TextPrimitive, TriangleListPrimitive, Vector3, log,
    scene_entity_deletion,
};
use super::schema::{Timestamp, program_to_proto, proto, timestamp};
use super::transform::{GRIPPER, WORLD};
use crate::program::Program;
use crate::scene::{Body, Prism, Scene, Shape};
use crate::trace::{Episode, ProgramCall, Provenance, Push};

const TABLE_COLOR: [u8; 3] = [205, 196, 180];
const TABLE_THICKNESS_M: f32 = 0.02;
const GRIPPER_COLOR: [u8; 3] = [70, 74, 82];
/// Finger pads as they are drawn, opened for a block. Their distance over time is in `ntp.v1.Observation`.
const FINGER_SIZE_M: [f32; 3] = [0.02, 0.008, 0.05];
const FINGER_OFFSET_M: [f32; 2] = [0.034, 0.005];
const PALM_SIZE_M: [f32; 3] = [0.03, 0.09, 0.02];
const PALM_HEIGHT_M: f32 = 0.04;
const LABEL_HEIGHT_M: f64 = 0.02;

/// The scene's bodies in their frames of `/tf`, in place of those of the episode before.
pub(super) fn scene(log_time_nanos: u64, episode: &Episode) -> SceneUpdate {
    let stamp = timestamp(log_time_nanos);
    let deletion = SceneEntityDeletion {
        timestamp: Some(stamp),
        r#type: scene_entity_deletion::Type::All.into(),
        id: String::new(),
    };
    let [half_x, half_y] = episode.scene.table_half_m;
    let table_top =
        cube([2.0 * half_x, 2.0 * half_y, TABLE_THICKNESS_M], [0.0, 0.0, -TABLE_THICKNESS_M / 2.0], TABLE_COLOR);
    let table = SceneEntity { cubes: vec![table_top], ..entity(stamp, WORLD, "table") };
    let gripper = SceneEntity { cubes: gripper_cubes(), ..entity(stamp, GRIPPER, GRIPPER) };
    let labelled = labelled_bodies(&episode.scene);
    let bodies = episode.scene.bodies.iter().zip(labelled).map(|(body, labelled)| body_entity(stamp, body, labelled));
    SceneUpdate { deletions: vec![deletion], entities: [table, gripper].into_iter().chain(bodies).collect() }
}

/// Bodies with a slot of their own are named in the picture; of categories there would be too many.
fn labelled_bodies(scene: &Scene) -> Vec<bool> {
    let is_alone = |body| scene.slots.iter().any(|slot| slot.bodies == [body]);
    scene.body_indices().map(is_alone).collect()
}

fn entity(stamp: Timestamp, frame_id: &str, id: &str) -> SceneEntity {
    SceneEntity {
        timestamp: Some(stamp),
        frame_id: frame_id.to_owned(),
        id: id.to_owned(),
        frame_locked: true,
        ..SceneEntity::default()
    }
}

fn body_entity(stamp: Timestamp, body: &Body, labelled: bool) -> SceneEntity {
    let mut entity = entity(stamp, &body.name, &body.name);
    match body.shape {
        Shape::Cuboid { half_extents_m } => {
            entity.cubes.push(cube(half_extents_m.map(|half| 2.0 * half), [0.0; 3], body.color));
        }
        Shape::Cylinder { radius_m, half_height_m } => entity.cylinders.push(CylinderPrimitive {
            pose: Some(at([0.0; 3])),
            size: Some(vector([2.0 * radius_m, 2.0 * radius_m, 2.0 * half_height_m])),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: Some(color(body.color)),
        }),
        Shape::Ball { radius_m } => entity.spheres.push(SpherePrimitive {
            pose: Some(at([0.0; 3])),
            size: Some(vector([2.0 * radius_m; 3])),
            color: Some(color(body.color)),
        }),
        Shape::OpenBox { inner_m, wall_m } => entity.cubes.extend(box_cubes(inner_m, wall_m, body.color)),
        Shape::Bowl(bowl) => entity.triangles.extend(bowl.prisms().iter().map(|prism| triangles(prism, body.color))),
    }
    if labelled {
        let height = 2.0 * body.shape.half_extents_m().z + 0.01;
        entity.texts.push(TextPrimitive {
            pose: Some(at([0.0, 0.0, height])),
            billboard: true,
            font_size: LABEL_HEIGHT_M,
            scale_invariant: false,
            color: Some(color([30, 30, 30])),
            text: body.name.clone(),
        });
    }
    entity
}

/// Floor and walls.
fn box_cubes([half_x, half_y, height]: [f32; 3], wall: f32, rgb: [u8; 3]) -> [CubePrimitive; 5] {
    let (outer_x, outer_y) = (2.0 * (half_x + wall), 2.0 * (half_y + wall));
    let (wall_x, wall_y, middle) = (half_x + wall / 2.0, half_y + wall / 2.0, height / 2.0);
    [
        cube([outer_x, outer_y, wall], [0.0, 0.0, -wall / 2.0], rgb),
        cube([wall, outer_y, height], [wall_x, 0.0, middle], rgb),
        cube([wall, outer_y, height], [-wall_x, 0.0, middle], rgb),
        cube([outer_x, wall, height], [0.0, wall_y, middle], rgb),
        cube([outer_x, wall, height], [0.0, -wall_y, middle], rgb),
    ]
}

fn triangles(prism: &Prism, rgb: [u8; 3]) -> TriangleListPrimitive {
    let point = |corner: [f32; 3]| {
        let [x, y, z] = corner.map(f64::from);
        Point3 { x, y, z }
    };
    TriangleListPrimitive {
        pose: Some(at([0.0; 3])),
        points: prism.corners().into_iter().map(point).collect(),
        color: Some(color(rgb)),
        colors: Vec::new(),
        indices: prism.triangles().into_iter().flatten().collect(),
    }
}

fn gripper_cubes() -> Vec<CubePrimitive> {
    let [offset, height] = FINGER_OFFSET_M;
    vec![
        cube(PALM_SIZE_M, [0.0, 0.0, PALM_HEIGHT_M], GRIPPER_COLOR),
        cube(FINGER_SIZE_M, [0.0, offset, height], GRIPPER_COLOR),
        cube(FINGER_SIZE_M, [0.0, -offset, height], GRIPPER_COLOR),
    ]
}

fn cube(size: [f32; 3], center: [f32; 3], rgb: [u8; 3]) -> CubePrimitive {
    CubePrimitive { pose: Some(at(center)), size: Some(vector(size)), color: Some(color(rgb)) }
}

fn at(position: [f32; 3]) -> Pose {
    Pose { position: Some(vector(position)), orientation: Some(Quaternion { w: 1.0, ..Quaternion::default() }) }
}

fn vector(numbers: [f32; 3]) -> Vector3 {
    let [x, y, z] = numbers.map(f64::from);
    Vector3 { x, y, z }
}

fn color(rgb: [u8; 3]) -> Color {
    let [r, g, b] = rgb.map(|channel| f64::from(channel) / 255.0);
    Color { r, g, b, a: 1.0 }
}

/// That an episode begins.
pub(super) fn start_log(log_time_nanos: u64, episode: &Episode) -> Log {
    let Provenance { index, task_id, task_text, split, trial, actor, .. } = &episode.provenance;
    let actor = actor.name();
    let message = format!("episode {index}: {task_id} ({split}), trial {trial}, by {actor}: {task_text}");
    text_log(log_time_nanos, log::Level::Info, message)
}

/// How an episode ended.
pub(super) fn end_log(log_time_nanos: u64, episode: &Episode) -> Log {
    let level = if episode.outcome.is_success() { log::Level::Info } else { log::Level::Warning };
    text_log(log_time_nanos, level, format!("episode {}: {}", episode.provenance.index, episode.outcome))
}

/// That an adversary pushes.
pub(super) fn push_log(log_time_nanos: u64, scene: &Scene, push: &Push) -> Log {
    text_log(log_time_nanos, log::Level::Warning, push.in_words(scene))
}

fn text_log(log_time_nanos: u64, level: log::Level, message: String) -> Log {
    Log {
        timestamp: Some(timestamp(log_time_nanos)),
        level: level.into(),
        message,
        name: "ntp".to_owned(),
        ..Log::default()
    }
}

/// A call from its beginning to its return.
pub(super) fn event(begin_nanos: u64, end_nanos: u64, scene: &Scene, call: &ProgramCall) -> Event {
    let pair = |key: &str, value: String| KeyValuePair { key: key.to_owned(), value };
    let mut metadata = vec![
        pair("program", call.program.name().to_owned()),
        pair("call", call.id.0.to_string()),
        pair("depth", call.depth.to_string()),
    ];
    if let Some(slot) = call.argument {
        metadata.push(pair("argument", scene.slot(slot).name.clone()));
    }
    Event { start_time: Some(timestamp(begin_nanos)), end_time: Some(timestamp(end_nanos)), metadata }
}

/// The programs that run, from the root down.
pub(super) fn stack(running: &[Program]) -> proto::ProgramStack {
    let idle = proto::Program::Idle as i32;
    let at = |depth: usize| running.get(depth).map_or(idle, |&program| program_to_proto(program));
    proto::ProgramStack {
        running: running.len() as u32,
        depth_0: at(0),
        depth_1: at(1),
        depth_2: at(2),
        depth_3: at(3),
    }
}
