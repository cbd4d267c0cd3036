//! Whether a scene and a start make sense, before the engine sees them.

use rapier3d::math::Pose as EnginePose;
use rapier3d::parry::bounding_volume::BoundingVolume as _;
use rapier3d::parry::query::contact;

use crate::geometry::Pose;
use crate::scene::{BodyIndex, Scene, SceneState};
use crate::sim::SimError;
use crate::sim::engine_shape::{Part, parts, sizes_m, to_engine};
use crate::sim::gripper::{MAX_OPENING_M, hull};
use crate::sim::motion::Tool;

/// How far two bodies may overlap: a recorded rest has contacts a little compressed.
const MAX_OVERLAP_M: f32 = 0.001;

/// Checks scene, poses and gripper.
pub(super) fn check(scene: &Scene, initial: &SceneState, tool: &Tool) -> Result<(), SimError> {
    check_scene(scene)?;
    check_gripper(scene, initial)?;
    check_poses(scene, initial)?;
    check_overlaps(scene, initial, tool)
}

fn check_scene(scene: &Scene) -> Result<(), SimError> {
    let positive = |size: &f32| size.is_finite() && *size > 0.0;
    if !scene.table_half_m.iter().all(positive) {
        return Err(SimError::Size { name: "table".to_owned() });
    }
    if let Some(body) = scene.bodies.iter().find(|body| !sizes_m(&body.shape).iter().all(positive)) {
        return Err(SimError::Size { name: body.name.clone() });
    }
    let n_bodies = scene.bodies.len();
    let wrong = |bodies: &[BodyIndex]| bodies.is_empty() || bodies.iter().any(|body| usize::from(body.0) >= n_bodies);
    match scene.slots.iter().find(|slot| wrong(&slot.bodies)) {
        None => Ok(()),
        Some(slot) => {
            let bodies = slot.bodies.iter().map(|body| body.0).collect();
            Err(SimError::Slot { name: slot.name.clone(), bodies })
        }
    }
}

fn check_gripper(scene: &Scene, initial: &SceneState) -> Result<(), SimError> {
    if let Some(held) = initial.held {
        let name = scene.bodies.get(usize::from(held.0)).map_or_else(|| format!("body {}", held.0), |b| b.name.clone());
        return Err(SimError::HeldAtStart { name });
    }
    if !(0.0..=MAX_OPENING_M).contains(&initial.opening_m) {
        return Err(SimError::Opening { found_m: initial.opening_m, allowed_m: MAX_OPENING_M });
    }
    if !is_finite(&initial.gripper_in_world) {
        return Err(SimError::NotFinite { name: "gripper".to_owned() });
    }
    Ok(())
}

fn is_finite(pose: &Pose) -> bool {
    let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
    numbers.copied().all(f32::is_finite)
}

fn check_poses(scene: &Scene, initial: &SceneState) -> Result<(), SimError> {
    let (found, expected) = (initial.bodies_in_world.len(), scene.bodies.len());
    if found != expected {
        return Err(SimError::BodyCount { found, expected });
    }
    for (body, pose) in scene.bodies.iter().zip(&initial.bodies_in_world) {
        if !is_finite(pose) {
            return Err(SimError::NotFinite { name: body.name.clone() });
        }
        if !is_on_table(scene, pose) {
            let position_m = pose.translation.vector.into();
            let table_half_m = scene.table_half_m;
            return Err(SimError::OffTable { name: body.name.clone(), position_m, table_half_m });
        }
    }
    Ok(())
}

/// Whether a body's centre is above the table.
pub(super) fn is_on_table(scene: &Scene, in_world: &Pose) -> bool {
    let [half_x, half_y] = scene.table_half_m;
    let position = in_world.translation.vector;
    position.x.abs() <= half_x && position.y.abs() <= half_y && position.z >= 0.0
}

/// A named thing as convex parts in the world.
struct Solid<'s> {
    name: &'s str,
    parts: Vec<(Part, EnginePose)>,
}

fn check_overlaps(scene: &Scene, initial: &SceneState, tool: &Tool) -> Result<(), SimError> {
    let in_world = |parts: Vec<Part>, pose: EnginePose| {
        parts.into_iter().map(|part| (part.clone(), pose * part.in_body)).collect::<Vec<_>>()
    };
    let gripper = hull(tool, MAX_OPENING_M)
        .into_iter()
        .map(|(shape, pose)| (Part { in_body: EnginePose::IDENTITY, shape }, pose));
    let mut solids = vec![Solid { name: "gripper", parts: gripper.collect() }];
    for (body, pose) in scene.bodies.iter().zip(&initial.bodies_in_world) {
        solids.push(Solid { name: &body.name, parts: in_world(parts(&body.shape), to_engine(pose)) });
    }
    for (index, second) in solids.iter().enumerate() {
        let depth_m = depth_below_table_m(second);
        if depth_m > MAX_OVERLAP_M {
            return Err(SimError::Overlap { first: "table".to_owned(), second: second.name.to_owned(), depth_m });
        }
        for first in &solids[..index] {
            let depth_m = overlap_m(first, second);
            if depth_m > MAX_OVERLAP_M {
                let (first, second) = (first.name.to_owned(), second.name.to_owned());
                return Err(SimError::Overlap { first, second, depth_m });
            }
        }
    }
    Ok(())
}

fn depth_below_table_m(solid: &Solid<'_>) -> f32 {
    solid.parts.iter().map(|(part, pose)| -part.shape.compute_aabb(pose).mins.z).fold(f32::MIN, f32::max)
}

fn overlap_m(first: &Solid<'_>, second: &Solid<'_>) -> f32 {
    let pairs = first.parts.iter().flat_map(|a| second.parts.iter().map(move |b| (a, b)));
    let near = pairs
        .filter(|((a, pose_a), (b, pose_b))| a.shape.compute_aabb(pose_a).intersects(&b.shape.compute_aabb(pose_b)));
    near.filter_map(|((a, pose_a), (b, pose_b))| contact(pose_a, &*a.shape, pose_b, &*b.shape, 0.0).ok().flatten())
        .fold(0.0, |deepest: f32, contact| deepest.max(-contact.dist))
}
