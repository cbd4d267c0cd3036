//! Object Sorting: which of four containers each of four categories goes to.
//!
//! # Source
//!
//! Paper, experiment 1: of the 4^4 mappings, four that cover every category-container pair are trained on, the other
//! 252 are unseen. The four are the rows of a Latin square, drawn uniformly.

use rand::Rng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use crate::geometry::{Pose, Vec3, upright};
use crate::program::Program;
use crate::scene::{Body, BodyIndex, Mobility, Scene, Shape, Slot, SlotIndex};
use crate::seed::Seed;
use crate::task::family::spec::{Bench, Bodies, FamilySpec, FrontView, Room, Sampler, SlotKind};
use crate::task::{Condition, Family, Goal, Split, Task, TaskPool};

pub(super) static SPEC: FamilySpec = FamilySpec {
    name: "object_sorting",
    short_name: "sorting",
    title: "Object Sorting",
    root: Program::ObjectSorting,
    kinds: &[
        SlotKind {
            name: "category",
            slots: &CATEGORY_NAMES,
            brings_about: Some(Condition::inside),
            room: Room::Nothing,
            bodies: Bodies::Many { most: MAX_INSTANCES, most_on_bench: MAX_ON_BENCH },
        },
        SlotKind {
            name: "container",
            slots: &CONTAINER_NAMES,
            brings_about: None,
            room: Room::Many { half_m: CONTAINER_INNER_M[0] + CONTAINER_WALL_M },
            bodies: Bodies::One,
        },
    ],
    builds_towers: false,
    tray: None,
    imported_as: Some("pick_release"),
    front_view: FrontView { eye_m: [0.0, -1.16, 1.34], target_m: [0.0, 0.03, 0.02] },
    sampler: Sampler { limits: |_pool, _train| (N_TRAINING, N_UNSEEN), all_seen: Some("training mappings"), sample },
    scene,
    poses,
    bench: BENCH,
};

/// Cells that sorting objects start on, and their pitch.
const OBJECT_CELLS: [usize; 2] = [9, 7];
const OBJECT_PITCH_M: f32 = 0.085;
/// Keeps any two objects at least 7 cm apart, as all jitters here do.
const OBJECT_JITTER_M: f32 = 0.0075;
const OBJECT_CENTER_Y_M: f32 = -0.15;
const CONTAINER_Y_M: f32 = 0.34;
const CONTAINER_PITCH_M: f32 = 0.26;
const CONTAINER_INNER_M: [f32; 3] = [0.1, 0.1, 0.12];
const CONTAINER_WALL_M: f32 = 0.005;

/// From more objects on they lie closer, in more cells, and containers are larger.
const MANY: usize = 40;
const MANY_CELLS: [usize; 2] = [10, 8];
const MANY_PITCH_M: f32 = 0.08;
const MANY_JITTER_M: f32 = 0.005;
const MANY_CENTER_Y_M: f32 = -0.16;
const MANY_INNER_M: [f32; 3] = [0.12, 0.13, 0.15];
const MANY_CONTAINER_Y_M: f32 = 0.37;

/// Before the arm, whose base is at x = -0.62: objects in a field, containers at both sides, 0.6 m from the base's axis
/// and 62 and 95 degrees off the way that it looks.
const BENCH: Bench = Bench {
    table_half_m: [0.85, 0.75],
    poses: bench_poses,
    front_view: FrontView { eye_m: [0.1, -1.95, 1.65], target_m: [-0.22, 0.0, 0.14] },
};
const BENCH_CELLS: [usize; 2] = [5, 8];
const BENCH_PITCH_M: f32 = 0.075;
const BENCH_CENTER_X_M: f32 = -0.015;
/// Keeps any two objects at least 7 cm apart.
const BENCH_JITTER_M: f32 = 0.0025;
const BENCH_CONTAINERS_M: [[f32; 2]; 4] = [[-0.338, -0.53], [-0.672, -0.598], [-0.338, 0.53], [-0.672, 0.598]];

/// The most instances of one category.
const MAX_INSTANCES: u16 = 20;
/// The same on a bench.
const MAX_ON_BENCH: u16 = 10;

const CATEGORY_NAMES: [&str; 4] = ["cube", "can", "ball", "brick"];
const CATEGORY_COLORS: [[u8; 3]; 4] = [[214, 64, 69], [48, 128, 200], [240, 176, 32], [84, 168, 88]];
const CONTAINER_NAMES: [&str; 4] = ["bin_1", "bin_2", "bin_3", "bin_4"];
const CONTAINER_COLORS: [[u8; 3]; 4] = [[150, 130, 110], [110, 130, 150], [130, 150, 110], [150, 110, 140]];

fn category_shape(category: usize) -> Shape {
    match category {
        0 => Shape::Cuboid { half_extents_m: [0.0175; 3] },
        1 => Shape::Cylinder { radius_m: 0.0175, half_height_m: 0.02 },
        2 => Shape::Ball { radius_m: 0.018 },
        _ => Shape::Cuboid { half_extents_m: [0.028, 0.015, 0.015] },
    }
}

/// The scene for a number of instances of each category; what is left out is 1.
fn scene(counts: &[u16]) -> Scene {
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
    let inner_m = if bodies.len() > MANY { MANY_INNER_M } else { CONTAINER_INNER_M };
    for (name, color) in CONTAINER_NAMES.iter().zip(CONTAINER_COLORS) {
        slots.push(Slot::single((*name).to_owned(), bodies.len()));
        bodies.push(Body {
            name: (*name).to_owned(),
            shape: Shape::OpenBox { inner_m, wall_m: CONTAINER_WALL_M },
            mobility: Mobility::Fixed,
            color,
        });
    }
    Scene { bodies, slots, table_half_m: [0.6, 0.6] }
}

/// A field of cells that objects start in, and where containers stand.
struct Field {
    cells: [usize; 2],
    pitch_m: f32,
    center_m: [f32; 2],
    jitter_m: f32,
    containers_m: [[f32; 2]; 4],
}

/// Random poses: objects in cells of their own, containers in any order behind them.
fn poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let n_objects = scene.bodies.iter().filter(|body| body.mobility == Mobility::Movable).count();
    let containers = |y_m: f32| [-1.5, -0.5, 0.5, 1.5].map(|column: f32| [column * CONTAINER_PITCH_M, y_m]);
    let field = if n_objects > MANY {
        Field {
            cells: MANY_CELLS,
            pitch_m: MANY_PITCH_M,
            center_m: [0.0, MANY_CENTER_Y_M],
            jitter_m: MANY_JITTER_M,
            containers_m: containers(MANY_CONTAINER_Y_M),
        }
    } else {
        Field {
            cells: OBJECT_CELLS,
            pitch_m: OBJECT_PITCH_M,
            center_m: [0.0, OBJECT_CENTER_Y_M],
            jitter_m: OBJECT_JITTER_M,
            containers_m: containers(CONTAINER_Y_M),
        }
    };
    scattered(scene, &field, rng)
}

/// Random poses before an arm: objects in cells of their own, containers in any order at both sides.
fn bench_poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let field = Field {
        cells: BENCH_CELLS,
        pitch_m: BENCH_PITCH_M,
        center_m: [BENCH_CENTER_X_M, 0.0],
        jitter_m: BENCH_JITTER_M,
        containers_m: BENCH_CONTAINERS_M,
    };
    scattered(scene, &field, rng)
}

fn scattered(scene: &Scene, field: &Field, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let [columns, rows] = field.cells;
    let mut cells: Vec<(usize, usize)> = (0..columns * rows).map(|cell| (cell % columns, cell / columns)).collect();
    cells.shuffle(rng);
    let mut places = [0_usize, 1, 2, 3];
    places.shuffle(rng);
    let mut free_cells = cells.into_iter();
    let mut free_places = places.into_iter();
    let middle = |cell: usize, n_cells: usize| (cell as f32 - (n_cells - 1) as f32 / 2.0) * field.pitch_m;
    let mut place = |body: &Body| match body.mobility {
        Mobility::Fixed => {
            let [x, y] = field.containers_m[free_places.next().unwrap_or(0)];
            Vec3::new(x, y, CONTAINER_WALL_M)
        }
        Mobility::Movable => {
            let (column, row) = free_cells.next().unwrap_or((0, 0));
            let mut jitter = || rng.random_range(-field.jitter_m..field.jitter_m);
            let [center_x, center_y] = field.center_m;
            let (x, y) = (middle(column, columns) + center_x + jitter(), middle(row, rows) + center_y + jitter());
            Vec3::new(x, y, body.shape.half_extents_m().z)
        }
    };
    scene.bodies.iter().map(&mut place).map(|position| upright(position, 0.0)).collect()
}

/// How many categories there are; their slots come before those of the containers.
const N_CATEGORIES: u16 = 4;
const N_CONTAINERS: u16 = 4;

/// The container, counted from 0, of each category.
type Mapping = [u16; N_CATEGORIES as usize];

/// How many mappings are trained on.
const N_TRAINING: u32 = 4;
/// How many mappings are held out.
const N_UNSEEN: u32 = 252;

/// Training tasks, then unseen ones.
fn sample(_pool: TaskPool, train: usize, unseen: usize, seed: Seed) -> Vec<Task> {
    let square = latin_square(seed);
    let mut held_out: Vec<Mapping> = all_mappings().filter(|mapping| !square.contains(mapping)).collect();
    held_out.shuffle(&mut seed.derive("sorting_unseen", &[]).rng());
    let seen = square.iter().take(train).map(|mapping| mapping_task(mapping, Split::Seen, seed));
    seen.chain(held_out.iter().take(unseen).map(|mapping| mapping_task(mapping, Split::Unseen, seed))).collect()
}

fn all_mappings() -> impl Iterator<Item = Mapping> {
    let digit = |code: u16, category: u32| code / N_CONTAINERS.pow(3 - category) % N_CONTAINERS;
    (0..N_CONTAINERS.pow(4)).map(move |code| [0, 1, 2, 3].map(|category| digit(code, category)))
}

/// Four permutations that differ in every column. One draw in 576 does, so this ends soon.
fn latin_square(seed: Seed) -> [Mapping; N_TRAINING as usize] {
    let mut rng = seed.derive("sorting_training", &[]).rng();
    loop {
        let mut rows = [[0, 1, 2, 3]; N_TRAINING as usize];
        rows.iter_mut().for_each(|row| row.shuffle(&mut rng));
        let differs = |category: usize| {
            let column = rows.map(|row| row[category]);
            (0..N_CONTAINERS).all(|container| column.contains(&container))
        };
        if (0..4).all(differs) {
            return rows;
        }
    }
}

/// The id names the mapping: `sort_3142` brings the first category to `bin_3`, and so on.
fn mapping_task(mapping: &Mapping, split: Split, seed: Seed) -> Task {
    let goal = |(category, &container): (usize, &u16)| Goal {
        source: SlotIndex(category as u16),
        target: SlotIndex(N_CATEGORIES + container),
    };
    let mut goals: Vec<Goal> = mapping.iter().enumerate().map(goal).collect();
    let path = mapping.map(u64::from);
    goals.shuffle(&mut seed.derive("sorting_order", &path).rng());
    let [cube, can, ball, brick] = mapping.map(|container| container + 1);
    Task::of_goals(format!("sort_{cube}{can}{ball}{brick}"), Family::ObjectSorting, goals, split)
}
