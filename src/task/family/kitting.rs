//! Kitting: parts are put on the marked places of two trays, as a kit asks for.
//!
//! Six parts of four kinds lie on the table: two pegs, two nuts, a gear and a bar. Each tray has three places. A kit says
//! for two to six of the places which kind of part belongs there; parts of one kind are alike, so either of them will do.
//!
//! # Invariants
//!
//! There are 3840 kits, in one order a seed. Training takes them from the front, the unseen split from the end; so
//! neither depends on how many the other takes, and no leak is possible.

use rand::Rng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use crate::geometry::{Pose, Vec3, upright};
use crate::program::Program;
use crate::scene::{Body, Mobility, Scene, Shape, Slot, SlotIndex};
use crate::seed::Seed;
use crate::task::family::spec::{Bench, Bodies, FamilySpec, FrontView, Room, Sampler, SlotKind};
use crate::task::{Condition, Family, Goal, Split, Task, TaskPool};

pub(super) static SPEC: FamilySpec = FamilySpec {
    name: "kitting",
    short_name: "kitting",
    title: "Kitting",
    root: Program::Kitting,
    kinds: &[
        SlotKind {
            name: "part",
            slots: &PART_NAMES,
            brings_about: Some(filled),
            room: Room::Nothing,
            bodies: Bodies::One,
        },
        SlotKind { name: "place", slots: &PLACE_NAMES, brings_about: None, room: Room::One, bodies: Bodies::One },
    ],
    builds_towers: false,
    tray: None,
    imported_as: None,
    front_view: FrontView { eye_m: [0.0, -0.88, 1.0], target_m: [0.0, 0.02, 0.02] },
    sampler: Sampler {
        limits: |_pool, train| {
            let all = all_kits().len() as u32;
            (all, all.saturating_sub(train))
        },
        all_seen: None,
        sample,
    },
    scene,
    poses,
    bench: BENCH,
};

const N_PARTS: usize = 6;
const N_PLACES: usize = 6;
const PART_NAMES: [&str; N_PARTS] = ["peg_1", "peg_2", "nut_1", "nut_2", "gear", "bar"];
const PLACE_NAMES: [&str; N_PLACES] = ["place_A", "place_B", "place_C", "place_D", "place_E", "place_F"];
const TRAY_NAMES: [&str; 2] = ["tray_1", "tray_2"];

/// Parts that are alike.
struct PartKind {
    /// Slot of the first of them.
    first: u16,
    /// How many there are.
    count: u16,
    shape: Shape,
    color: [u8; 3],
}

const PART_KINDS: [PartKind; 4] = [
    PartKind {
        first: 0,
        count: 2,
        shape: Shape::Cylinder { radius_m: 0.014, half_height_m: 0.024 },
        color: [70, 120, 190],
    },
    PartKind {
        first: 2,
        count: 2,
        shape: Shape::Cuboid { half_extents_m: [0.019, 0.019, 0.012] },
        color: [214, 168, 62],
    },
    PartKind {
        first: 4,
        count: 1,
        shape: Shape::Cylinder { radius_m: 0.024, half_height_m: 0.012 },
        color: [206, 72, 66],
    },
    PartKind {
        first: 5,
        count: 1,
        shape: Shape::Cuboid { half_extents_m: [0.03, 0.013, 0.013] },
        color: [84, 168, 96],
    },
];

/// Half of a marked place, and of the board that it lies on.
const PLACE_HALF_M: [f32; 3] = [0.035, 0.035, 0.003];
const TRAY_HALF_M: [f32; 3] = [0.16, 0.055, 0.006];
const PLACE_COLOR: [u8; 3] = [236, 232, 220];
const TRAY_COLORS: [[u8; 3]; 2] = [[92, 104, 122], [122, 98, 84]];
/// Distance between places of a tray.
const PLACE_PITCH_M: f32 = 0.1;

/// Middles of the trays: beside each other, behind the parts.
const TRAY_X_M: f32 = 0.21;
const TRAY_Y_M: f32 = 0.25;
/// How far a tray may lie from there, in x and in y, and be turned.
const TRAY_JITTER_M: f32 = 0.025;
const TRAY_TURN_RAD: f32 = 0.15;
/// Cells that parts start in: fingers fit between neighbours, whatever their turn.
const CELLS: [usize; 2] = [5, 3];
const CELL_M: f32 = 0.12;
const CELLS_CENTER_Y_M: f32 = -0.2;
const PART_JITTER_M: f32 = 0.012;

/// Before the arm, whose base is at x = -0.62: parts in a field, a tray at either side.
const BENCH: Bench = Bench {
    table_half_m: [0.8, 0.65],
    poses: bench_poses,
    front_view: FrontView { eye_m: [0.1, -1.95, 1.5], target_m: [-0.22, 0.0, 0.2] },
};
const BENCH_CELLS: [usize; 2] = [3, 5];
const BENCH_CENTER_X_M: f32 = -0.02;
const BENCH_TRAY_X_M: f32 = -0.32;
const BENCH_TRAY_Y_M: f32 = 0.47;

/// The kind of part on each place, counted from 1; 0 where the kit leaves the place free.
type Kit = [u16; N_PLACES];

/// The first of the parts that are like one.
fn first_like(part: SlotIndex) -> SlotIndex {
    let kind = PART_KINDS.iter().rfind(|kind| kind.first <= part.0);
    kind.map_or(part, |kind| SlotIndex(kind.first))
}

/// Kits that differ in which of two like parts lies where are the same kit.
fn filled(part: SlotIndex, place: SlotIndex) -> Condition {
    Condition::Filled { part: first_like(part), place }
}

/// Every kit of two to six parts.
fn all_kits() -> Vec<Kit> {
    let n_choices = PART_KINDS.len() as u16 + 1;
    let kit = |code: u16| -> Kit { std::array::from_fn(|place| code / n_choices.pow(place as u32) % n_choices) };
    let used = |kit: &Kit, number: usize| kit.iter().filter(|&&kind| usize::from(kind) == number).count();
    let is_there = |kit: &Kit| {
        PART_KINDS.iter().enumerate().all(|(kind, of_kind)| used(kit, kind + 1) <= usize::from(of_kind.count))
    };
    let kits = (0..n_choices.pow(N_PLACES as u32)).map(kit);
    kits.filter(|kit| is_there(kit) && used(kit, 0) <= N_PLACES - 2).collect()
}

/// Training tasks, then unseen ones.
fn sample(_pool: TaskPool, train: usize, unseen: usize, seed: Seed) -> Vec<Task> {
    let mut kits = all_kits();
    kits.shuffle(&mut seed.derive("kitting_kits", &[]).rng());
    let seen = kits.iter().take(train).map(|kit| kit_task(kit, Split::Seen, seed));
    seen.chain(kits.iter().rev().take(unseen).map(|kit| kit_task(kit, Split::Unseen, seed))).collect()
}

/// The id names the kit: `kit_130020` has a peg on `place_A`, a gear on `place_B` and a nut on `place_E`. Places are
/// filled in any order, with any of the parts that are alike.
fn kit_task(kit: &Kit, split: Split, seed: Seed) -> Task {
    let mut rng = seed.derive("kitting_order", &kit.map(u64::from)).rng();
    let mut parts: Vec<Vec<u16>> =
        PART_KINDS.iter().map(|kind| (kind.first..kind.first + kind.count).collect()).collect();
    parts.iter_mut().for_each(|alike| alike.shuffle(&mut rng));
    let mut goal = |(place, &kind): (usize, &u16)| {
        let part = parts.get_mut(usize::from(kind).checked_sub(1)?)?.pop()?;
        Some(Goal { source: SlotIndex(part), target: SlotIndex((N_PARTS + place) as u16) })
    };
    let mut goals: Vec<Goal> = kit.iter().enumerate().filter_map(&mut goal).collect();
    goals.shuffle(&mut rng);
    let digits: String = kit.iter().map(u16::to_string).collect();
    Task::of_goals(format!("kit_{digits}"), Family::Kitting, goals, split)
}

/// Parts, then places, then the boards that these lie on, which no program names.
fn scene(_counts: &[u16]) -> Scene {
    let body = |name: &str, shape, mobility, color| Body { name: name.to_owned(), shape, mobility, color };
    let parts = PART_KINDS.iter().flat_map(|kind| {
        let names = PART_NAMES[usize::from(kind.first)..].iter().take(usize::from(kind.count));
        names.map(move |name| body(name, kind.shape, Mobility::Movable, kind.color))
    });
    let place = Shape::Cuboid { half_extents_m: PLACE_HALF_M };
    let tray = Shape::Cuboid { half_extents_m: TRAY_HALF_M };
    let places = PLACE_NAMES.iter().map(|name| body(name, place, Mobility::Fixed, PLACE_COLOR));
    let trays = TRAY_NAMES.iter().zip(TRAY_COLORS).map(|(name, color)| body(name, tray, Mobility::Fixed, color));
    let bodies: Vec<Body> = parts.chain(places).chain(trays).collect();
    let named = bodies.iter().take(N_PARTS + N_PLACES).enumerate();
    let slots = named.map(|(number, body)| Slot::single(body.name.clone(), number)).collect();
    Scene { bodies, slots, table_half_m: [0.6, 0.6] }
}

/// Random poses: parts in cells of their own, with any turn; either tray on either side.
fn poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let trays_m = [-TRAY_X_M, TRAY_X_M].map(|x| [x, TRAY_Y_M]);
    scattered(scene, CELLS, [0.0, CELLS_CENTER_Y_M], trays_m, rng)
}

/// The same before an arm.
fn bench_poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let trays_m = [-BENCH_TRAY_Y_M, BENCH_TRAY_Y_M].map(|y| [BENCH_TRAY_X_M, y]);
    scattered(scene, BENCH_CELLS, [BENCH_CENTER_X_M, 0.0], trays_m, rng)
}

fn scattered(
    scene: &Scene,
    [columns, rows]: [usize; 2],
    [center_x, center_y]: [f32; 2],
    trays_m: [[f32; 2]; 2],
    rng: &mut ChaCha8Rng,
) -> Vec<Pose> {
    let mut cells: Vec<[usize; 2]> = (0..columns * rows).map(|cell| [cell % columns, cell / columns]).collect();
    cells.shuffle(rng);
    let mut parts: Vec<Pose> = Vec::new();
    for (part, [column, row]) in scene.bodies.iter().take(N_PARTS).zip(cells) {
        let middle = |cell: usize, n_cells: usize| (cell as f32 - (n_cells - 1) as f32 / 2.0) * CELL_M;
        let mut jitter = || rng.random_range(-PART_JITTER_M..PART_JITTER_M);
        let (x, y) = (middle(column, columns) + center_x + jitter(), middle(row, rows) + center_y + jitter());
        let turn_rad = rng.random_range(-std::f32::consts::FRAC_PI_2..std::f32::consts::FRAC_PI_2);
        parts.push(upright(Vec3::new(x, y, part.shape.foot_m()), turn_rad));
    }
    let mut sides = trays_m;
    sides.shuffle(rng);
    let trays = sides.map(|side| {
        let [x, y] = side.map(|middle| middle + rng.random_range(-TRAY_JITTER_M..TRAY_JITTER_M));
        upright(Vec3::new(x, y, TRAY_HALF_M[2]), rng.random_range(-TRAY_TURN_RAD..TRAY_TURN_RAD))
    });
    let places = trays.iter().flat_map(|tray| {
        [-1.0, 0.0, 1.0]
            .map(|number| tray * Pose::translation(number * PLACE_PITCH_M, 0.0, TRAY_HALF_M[2] + PLACE_HALF_M[2]))
    });
    parts.into_iter().chain(places.collect::<Vec<_>>()).chain(trays).collect()
}
