//! The scene of a task family and the random initial positions of a trial.
//!
//! # Units and frames
//!
//! Metres; world frame, the table's surface at z = 0.

pub(super) mod cleanup;
pub(super) mod stacking;

use rand::Rng as _;
use rand::seq::SliceRandom as _;

use crate::geometry::{Pose, Vec3, upright};
use crate::scene::{Body, BodyIndex, Mobility, Scene, SceneState, Shape, Slot, SlotIndex};
use crate::seed::Seed;
use crate::task::Family;

/// Cells that sorting objects start on, and their pitch.
const SORTING_CELLS: [usize; 2] = [9, 7];
const SORTING_PITCH_M: f32 = 0.085;
/// Keeps any two objects at least 7 cm apart.
const SORTING_JITTER_M: f32 = 0.0075;
const SORTING_CENTER_Y_M: f32 = -0.15;
const CONTAINER_Y_M: f32 = 0.34;
const CONTAINER_PITCH_M: f32 = 0.26;
const CONTAINER_INNER_M: [f32; 3] = [0.1, 0.1, 0.12];
const CONTAINER_WALL_M: f32 = 0.005;
/// Half of a container's outer width and depth.
pub const CONTAINER_HALF_M: f32 = CONTAINER_INNER_M[0] + CONTAINER_WALL_M;

/// The most instances of one category.
pub(super) const MAX_INSTANCES: u16 = 10;

const CATEGORY_NAMES: [&str; 4] = ["cube", "can", "ball", "brick"];
const CATEGORY_COLORS: [[u8; 3]; 4] = [[214, 64, 69], [48, 128, 200], [240, 176, 32], [84, 168, 88]];
const CONTAINER_NAMES: [&str; 4] = ["bin_1", "bin_2", "bin_3", "bin_4"];
const CONTAINER_COLORS: [[u8; 3]; 4] = [[150, 130, 110], [110, 130, 150], [130, 150, 110], [150, 110, 140]];

/// One acting-out of a task: its own initial positions and, where the family has categories, its own counts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trial {
    /// Number among the task's trials.
    pub index: u32,
    /// Instances of each category; empty for Block Stacking with all blocks. See [`Task::counts`](crate::task::Task::counts).
    pub counts: Vec<u16>,
    /// What the initial positions are drawn from.
    pub seed: Seed,
}

/// What stands on the table in a trial of a family.
pub fn scene(family: Family, counts: &[u16]) -> Scene {
    match family {
        Family::BlockStacking => stacking::scene(counts),
        Family::ObjectSorting => sorting_scene(counts),
        Family::TableCleanup => cleanup::scene(counts),
    }
}

/// The name of a slot, which does not depend on the trial.
pub(crate) fn slot_name(family: Family, slot: SlotIndex) -> String {
    let index = usize::from(slot.0);
    match family {
        Family::BlockStacking => stacking::slot_name(index),
        Family::ObjectSorting => [CATEGORY_NAMES, CONTAINER_NAMES].concat()[index % 8].to_owned(),
        Family::TableCleanup => cleanup::SLOT_NAMES[index % 6].to_owned(),
    }
}

fn single_slot(index: usize, name: String) -> Slot {
    Slot { name, bodies: vec![BodyIndex(index as u16)] }
}

fn category_shape(category: usize) -> Shape {
    match category {
        0 => Shape::Cuboid { half_extents_m: [0.0175; 3] },
        1 => Shape::Cylinder { radius_m: 0.0175, half_height_m: 0.02 },
        2 => Shape::Ball { radius_m: 0.018 },
        _ => Shape::Cuboid { half_extents_m: [0.028, 0.015, 0.015] },
    }
}

fn sorting_scene(counts: &[u16]) -> Scene {
    let mut bodies = Vec::new();
    let mut slots = Vec::new();
    for (category, name) in CATEGORY_NAMES.iter().enumerate() {
        let count = counts.get(category).copied().unwrap_or(1);
        let first = bodies.len() as u16;
        bodies.extend((0..count).map(|instance| Body {
            name: format!("{name}_{}", instance + 1),
            shape: category_shape(category),
            mobility: Mobility::Movable,
            color: CATEGORY_COLORS[category],
        }));
        slots.push(Slot { name: (*name).to_owned(), bodies: (first..first + count).map(BodyIndex).collect() });
    }
    for (name, color) in CONTAINER_NAMES.iter().zip(CONTAINER_COLORS) {
        slots.push(single_slot(bodies.len(), (*name).to_owned()));
        bodies.push(Body {
            name: (*name).to_owned(),
            shape: Shape::OpenBox { inner_m: CONTAINER_INNER_M, wall_m: CONTAINER_WALL_M },
            mobility: Mobility::Fixed,
            color,
        });
    }
    Scene { bodies, slots, table_half_m: [0.6, 0.6] }
}

/// Random initial positions, without overlap, and the gripper open somewhere above.
pub fn initial_state(family: Family, scene: &Scene, seed: Seed) -> SceneState {
    let mut rng = seed.derive("initial_state", &[]).rng();
    let all_upright =
        |positions: Vec<Vec3>| -> Vec<Pose> { positions.into_iter().map(|position| upright(position, 0.0)).collect() };
    let bodies_in_world = match family {
        Family::BlockStacking => all_upright(stacking::positions(scene, &mut rng)),
        Family::ObjectSorting => all_upright(sorting_positions(scene, &mut rng)),
        Family::TableCleanup => cleanup::poses(scene, &mut rng),
    };
    let reach = scene.table_half_m.map(|half| 0.5 * half);
    let gripper = Vec3::new(rng.random_range(-reach[0]..reach[0]), rng.random_range(-reach[1]..reach[1]), 0.3);
    SceneState { gripper_in_world: upright(gripper, 0.0), opening_m: 0.07, held: None, bodies_in_world }
}

fn sorting_positions(scene: &Scene, rng: &mut impl rand::Rng) -> Vec<Vec3> {
    let [columns, rows] = SORTING_CELLS;
    let mut cells: Vec<(usize, usize)> = (0..columns * rows).map(|cell| (cell % columns, cell / columns)).collect();
    cells.shuffle(rng);
    let mut places = [0_usize, 1, 2, 3];
    places.shuffle(rng);
    let mut free_cells = cells.into_iter();
    let mut free_places = places.into_iter();
    let middle = |cell: usize, n_cells: usize| (cell as f32 - (n_cells - 1) as f32 / 2.0) * SORTING_PITCH_M;
    let mut place = |body: &Body| match body.mobility {
        Mobility::Fixed => {
            let column = free_places.next().unwrap_or(0) as f32 - 1.5;
            Vec3::new(column * CONTAINER_PITCH_M, CONTAINER_Y_M, CONTAINER_WALL_M)
        }
        Mobility::Movable => {
            let (column, row) = free_cells.next().unwrap_or((0, 0));
            let mut jitter = || rng.random_range(-SORTING_JITTER_M..SORTING_JITTER_M);
            let (x, y) = (middle(column, columns) + jitter(), middle(row, rows) + SORTING_CENTER_Y_M + jitter());
            Vec3::new(x, y, body.shape.half_extents_m().z)
        }
    };
    scene.bodies.iter().map(&mut place).collect()
}
