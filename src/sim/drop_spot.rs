//! Where in a container to drop: a pile at its middle would spill, so what is held goes where it lands lowest.

use rapier3d::math::{Pose as EnginePose, Vector};
use rapier3d::parry::bounding_volume::BoundingVolume as _;

use rapier3d::geometry::SharedShape;

use crate::geometry::Vec3;
use crate::scene::{BodyIndex, Scene, Shape};
use crate::sim::gripper::{Gripper, reach_m};
use crate::sim::motion::Tool;
use crate::sim::sweep::AtStart;
use crate::sim::world::World;

/// Least distance of gripper and load from the walls, in metres.
const WALL_MARGIN_M: f32 = 0.006;
/// How much wider the fingers open in a bowl than what they held, in metres.
const BOWL_OPENING_M: f32 = 0.014;
/// Least distance of open fingers from the edge of a bowl's floor, in metres.
const BOWL_MARGIN_M: f32 = 0.002;
/// A spot must be this much lower than one nearer to the middle, in metres.
const LOWER_M: f32 = 0.003;
/// Least distance of spots in a box, in metres.
const SPOT_PITCH_M: f32 = 0.039;
/// The spots of a box that has room for one at each side of the middle, as parts of the free half widths, nearest to the
/// middle first.
const SPOTS: [[f32; 2]; 9] =
    [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];

/// The open box or bowl that the gripper is over or in, of nested ones the uppermost; none for a bowl in the gripper,
/// which is set down in the middle.
pub(super) fn container_below(
    scene: &Scene,
    in_world: impl Fn(BodyIndex) -> EnginePose,
    gripper: &Gripper,
) -> Option<BodyIndex> {
    if gripper.held.is_some_and(|held| scene.body(held.body).shape.rim_m().is_some()) {
        return None;
    }
    let is_over = |&body: &BodyIndex| {
        let tool = in_world(body).inverse_transform_point(gripper.tool.position);
        let is_between_walls = match scene.body(body).shape {
            Shape::OpenBox { inner_m: [x, y, _], .. } => tool.x.abs() <= x && tool.y.abs() <= y,
            Shape::Bowl(bowl) => Vector::new(tool.x, tool.y, 0.0).length() <= bowl.rim_radius_m,
            Shape::Cuboid { .. } | Shape::Cylinder { .. } | Shape::Ball { .. } => false,
        };
        is_between_walls && tool.z > 0.0
    };
    let floor_z = |body: BodyIndex| in_world(body).translation.z;
    scene.body_indices().filter(is_over).max_by(|&a, &b| floor_z(a).total_cmp(&floor_z(b)))
}

/// How far to open the fingers there: in a bowl they have little room.
pub(super) fn opening_m(scene: &Scene, gripper: &Gripper, container: BodyIndex) -> f32 {
    match scene.body(container).shape {
        Shape::Bowl(_) => (gripper.tool.opening_m + BOWL_OPENING_M).min(gripper.jaw_m),
        _ => gripper.jaw_m,
    }
}

/// Where to hold the gripper, at its present height, before it goes down into a container that stands somewhere;
/// `fall_m` tells how far what is held goes down from a spot.
pub(super) fn choose(
    scene: &Scene,
    world: &World,
    gripper: &Gripper,
    (container, in_world): (BodyIndex, EnginePose),
    fall_m: impl Fn(Vector) -> f32,
) -> Vector {
    let tool = gripper.tool;
    let (Some(held), Some(rim_m)) = (gripper.held, scene.body(container).shape.rim_m()) else {
        return tool.position;
    };
    if in_world.inverse_transform_point(tool.position).z < rim_m {
        return tool.position;
    }
    let spots: Vec<Vector> = match scene.body(container).shape {
        Shape::OpenBox { inner_m: [x, y, _], .. } => {
            let load = scene.body(held.body).shape.half_extents_m();
            let room = free_half_widths_m([x, y], gripper.half_widths_m(), &load);
            let spot = |[part_x, part_y]: [f32; 2]| Vector::new(part_x * room[0], part_y * room[1], 0.0);
            let n_aside = room.map(|room| (room / SPOT_PITCH_M) as i16);
            parts(n_aside).into_iter().map(|parts| over(&in_world, spot(parts), &tool)).collect()
        }
        Shape::Bowl(bowl) => bowl_spots(world, gripper, bowl.floor_radius_m)
            .map(|spot| Vector::new(in_world.translation.x, in_world.translation.y, tool.position.z) + spot)
            .collect(),
        _ => return tool.position,
    };
    let mut best = (spots[0], fall_m(spots[0]));
    for spot in &spots[1..] {
        let fall = fall_m(*spot);
        if fall > best.1 + LOWER_M {
            best = (*spot, fall);
        }
    }
    best.0
}

/// The spots of a box with so many at each side of the middle, one at least.
fn parts([n_x, n_y]: [i16; 2]) -> Vec<[f32; 2]> {
    if n_x <= 1 && n_y <= 1 {
        return SPOTS.to_vec();
    }
    let steps = |n: i16| (-n..=n).map(move |step| f32::from(step) / f32::from(n));
    let mut parts: Vec<[f32; 2]> = steps(n_x.max(1)).flat_map(|x| steps(n_y.max(1)).map(move |y| [x, y])).collect();
    let aside = |[x, y]: &[f32; 2]| x * x + y * y;
    parts.sort_by(|a, b| aside(a).total_cmp(&aside(b)));
    parts
}

fn over(container_in_world: &EnginePose, spot: Vector, tool: &Tool) -> Vector {
    let spot = container_in_world.transform_point(spot);
    Vector::new(spot.x, spot.y, tool.position.z)
}

/// Spots beside each other along the fingers' closing, so that long things come to lie side by side, from the middle
/// of a bowl's floor.
fn bowl_spots(world: &World, gripper: &Gripper, floor_radius_m: f32) -> impl Iterator<Item = Vector> {
    let parts = gripper.carried(world, &gripper.tool);
    let bounds = parts.iter().map(|(shape, pose)| shape.compute_aabb(pose)).reduce(|a, b| a.merged(&b));
    let width_m = bounds.map_or(0.0, |bounds| bounds.extents().y);
    let room_m = (floor_radius_m - reach_m(gripper.opens_to_m) - BOWL_MARGIN_M).max(0.0);
    let across = gripper.tool.in_world().transform_vector(Vector::Y);
    let n_each_side = (room_m / width_m.max(BOWL_MARGIN_M)) as u32;
    let offsets = (1..=n_each_side).flat_map(|number| [1.0, -1.0].map(|side| side * number as f32));
    let spacing_m = room_m / n_each_side.max(1) as f32;
    std::iter::once(0.0).chain(offsets).map(move |number| across * (number * spacing_m))
}

fn free_half_widths_m([x, y]: [f32; 2], [hand_x, hand_y]: [f32; 2], load: &Vec3) -> [f32; 2] {
    let side = load.x.max(load.y);
    [x - side.max(hand_x) - WALL_MARGIN_M, y - side.max(hand_y) - WALL_MARGIN_M].map(|room| room.max(0.0))
}

/// How far what is held can go down from a spot.
pub(super) fn fall_m(world: &World, gripper: &Gripper, spot: Vector) -> f32 {
    let down = Vector::new(0.0, 0.0, -1.0);
    let parts = gripper.carried(world, &Tool { position: spot, ..gripper.tool });
    let fall_m = |(shape, in_world): &(SharedShape, EnginePose)| {
        world.cast(&**shape, in_world, down, AtStart::Stops, gripper.held_handle()).unwrap_or(down.length())
    };
    parts.iter().map(fall_m).reduce(f32::min).unwrap_or(0.0)
}
