//! Where in a container to drop: a pile at its middle would spill, so what is held goes where it lands lowest.

use rapier3d::math::Vector;

use crate::geometry::Vec3;
use crate::scene::{BodyIndex, Scene, Shape};
use crate::sim::gripper::{Gripper, OPEN_REACH_M, PALM_HALF_X_M};
use crate::sim::motion::Tool;
use crate::sim::sweep::AtStart;
use crate::sim::world::World;

/// Least distance of gripper and load from the walls, in metres.
const WALL_MARGIN_M: f32 = 0.006;
/// A spot must be this much lower than one nearer to the middle, in metres.
const LOWER_M: f32 = 0.003;
/// The spots, as parts of the free half widths, nearest to the middle first.
const SPOTS: [[f32; 2]; 9] =
    [[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];

/// The open box that the gripper is over or in, if any.
pub(super) fn container_below(scene: &Scene, world: &World, tool: &Tool) -> Option<BodyIndex> {
    scene.body_indices().find(|&body| {
        let Shape::OpenBox { inner_m: [x, y, _], .. } = scene.body(body).shape else {
            return false;
        };
        let tool_in_box = world.in_world(body).inverse_transform_point(tool.position);
        tool_in_box.x.abs() <= x && tool_in_box.y.abs() <= y && tool_in_box.z > 0.0
    })
}

/// Where to hold the gripper, at its present height, before it goes down into the container.
pub(super) fn choose(scene: &Scene, world: &World, gripper: &Gripper, container: BodyIndex) -> Vector {
    let tool = gripper.tool;
    let (Some(held), Shape::OpenBox { inner_m: [x, y, height], .. }) = (gripper.held, scene.body(container).shape)
    else {
        return tool.position;
    };
    let box_in_world = world.in_world(container);
    if box_in_world.inverse_transform_point(tool.position).z < height {
        return tool.position;
    }
    let load = scene.body(held.body).shape.half_extents_m();
    let room = free_half_widths_m([x, y], &load);
    let spots = SPOTS.map(|[part_x, part_y]| {
        let spot = box_in_world.transform_point(Vector::new(part_x * room[0], part_y * room[1], 0.0));
        Vector::new(spot.x, spot.y, tool.position.z)
    });
    let mut best = (spots[0], fall_m(world, gripper, spots[0]));
    for spot in &spots[1..] {
        let fall = fall_m(world, gripper, *spot);
        if fall > best.1 + LOWER_M {
            best = (*spot, fall);
        }
    }
    best.0
}

fn free_half_widths_m([x, y]: [f32; 2], load: &Vec3) -> [f32; 2] {
    let side = load.x.max(load.y);
    [x - side.max(PALM_HALF_X_M) - WALL_MARGIN_M, y - side.max(OPEN_REACH_M) - WALL_MARGIN_M].map(|room| room.max(0.0))
}

/// How far what is held can go down from a spot.
fn fall_m(world: &World, gripper: &Gripper, spot: Vector) -> f32 {
    let down = Vector::new(0.0, 0.0, -1.0);
    let Some((shape, in_world)) = gripper.carried(world, &Tool { position: spot, ..gripper.tool }) else {
        return 0.0;
    };
    let hit = world.cast(&*shape, &in_world, down, AtStart::Stops, gripper.held_handle());
    hit.unwrap_or(down.length())
}
