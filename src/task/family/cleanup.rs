//! Table Clean-up: bowls are stacked on a tray in some order, the forks put into the last, and the tray carried away.
//!
//! Bowls that a task does not ask for stand aside, where nothing reaches them, so that every scene has the same slots.
//!
//! # Source
//!
//! Paper, experiment 3: "up to 4 bowls", "the ordering in which bowls are stacked can vary". There are 64 orders of one
//! to four bowls. [`UNSEEN`] of each length are held out, so that every length is measured on orders never seen.

use rand::Rng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use crate::geometry::{Pose, Vec3, upright};
use crate::program::Program;
use crate::scene::{Body, BodyIndex, Bowl, Mobility, Scene, Shape, Slot, SlotIndex};
use crate::seed::Seed;
use crate::task::family::spec::{Bench, Bodies, FamilySpec, FrontView, Room, Sampler, SlotKind};
use crate::task::{Condition, Family, Goal, Split, Task, TaskPool};

pub(super) static SPEC: FamilySpec = FamilySpec {
    name: "table_cleanup",
    short_name: "cleanup",
    title: "Table Clean-up",
    root: Program::TableCleanup,
    kinds: &[
        SlotKind {
            name: "bowl",
            slots: &BOWL_NAMES,
            brings_about: Some(Condition::on_top),
            room: Room::One,
            bodies: Bodies::OneIfAsked,
        },
        SlotKind {
            name: "fork",
            slots: &["fork"],
            brings_about: Some(Condition::inside),
            room: Room::Nothing,
            bodies: Bodies::Many { most: MAX_FORKS, most_on_bench: MAX_FORKS },
        },
        SlotKind { name: "tray", slots: &["tray"], brings_about: None, room: Room::One, bodies: Bodies::One },
    ],
    builds_towers: false,
    tray: Some(TRAY),
    imported_as: None,
    front_view: FrontView { eye_m: [0.0, -1.40, 1.62], target_m: [0.0, 0.04, 0.02] },
    sampler: Sampler { limits: |_pool, _train| (N_TRAINING, N_UNSEEN), all_seen: None, sample },
    scene,
    poses,
    bench: BENCH,
};

/// How many bowls there are, asked for or not.
const N_BOWLS: u16 = 4;
/// The slot of the forks.
const FORK: SlotIndex = SlotIndex(N_BOWLS);
/// The slot of the tray.
const TRAY: SlotIndex = SlotIndex(N_BOWLS + 1);
/// The most forks: as many as a bowl holds.
const MAX_FORKS: u16 = 20;

const BOWL_NAMES: [&str; N_BOWLS as usize] = ["bowl_1", "bowl_2", "bowl_3", "bowl_4"];

/// Nested walls stay 6.5 mm apart, more than a placing is off.
const BOWL: Bowl = Bowl {
    floor_radius_m: 0.042,
    rim_radius_m: 0.0645,
    height_m: 0.045,
    wall_m: 0.0035,
    foot_radius_m: 0.028,
    foot_height_m: 0.0165,
};
const BOWL_COLORS: [[u8; 3]; N_BOWLS as usize] = [[240, 238, 230], [200, 220, 238], [238, 214, 190], [204, 230, 206]];
/// Short enough to lie on a bowl's floor.
const FORK_HALF_M: [f32; 3] = [0.035, 0.0045, 0.003];
const FORK_COLOR: [u8; 3] = [200, 44, 52];
const TRAY_INNER_M: [f32; 3] = [0.09, 0.09, 0.02];
const TRAY_WALL_M: f32 = 0.005;
const TRAY_COLOR: [u8; 3] = [128, 104, 82];

const TABLE_HALF_M: [f32; 2] = [0.9, 0.6];
/// Cells of the grid that bowls and forks start on: one bowl a cell, or four forks.
const CELLS: [usize; 2] = [6, 3];
const CELL_M: f32 = 0.2;
const CELLS_CENTER_Y_M: f32 = -0.2;
/// A fork's place in its cell, from the cell's middle, in x and in y.
const FORK_PLACE_M: f32 = 0.05;
/// How far a bowl or fork may start from its place, in x and in y: fingers fit between neighbours.
const BOWL_JITTER_M: f32 = 0.01;
const FORK_JITTER_M: f32 = 0.007;
/// An octagon looks the same again after twice this turn.
const BOWL_TURN_RAD: f32 = std::f32::consts::FRAC_PI_8;
const TRAY_Y_M: f32 = 0.4;
const TRAY_JITTER_M: [f32; 2] = [0.25, 0.03];
/// Where bowls stand aside, out of reach of fingers that grip a fork, and their distance.
const ASIDE_X_M: f32 = 0.8;
const ASIDE_PITCH_M: f32 = 0.2;

/// Before the arm, whose base is at x = -0.62: two arcs of cells about the base, each cell as far from the next as on
/// the table, and the tray beside the base.
const BENCH: Bench = Bench {
    table_half_m: [0.95, 0.75],
    poses: bench_poses,
    // From the other side, where the tray is not behind the arm.
    front_view: FrontView { eye_m: [0.05, 2.15, 1.75], target_m: [-0.27, 0.06, 0.12] },
};
const BENCH_BASE_X_M: f32 = -0.62;
/// Of an arc: radius, how many cells, and how far they are apart in degrees.
const BENCH_ARCS: [(f32, u8, f32); 2] = [(0.51, 6, 23.0), (0.71, 9, 16.5)];
const BENCH_TRAY_M: [f32; 2] = [-0.775, 0.58];
const BENCH_TRAY_JITTER_M: [f32; 2] = [0.015, 0.015];
const BENCH_ASIDE_X_M: f32 = 0.75;

/// A cell that a bowl or four forks start in.
#[derive(Clone, Copy, Default)]
struct Cell {
    middle_m: [f32; 2],
    turn_rad: f32,
}

/// The scene for 1 or 0 of each bowl (1 when it is asked for) and a number of forks; what is left out is 1.
fn scene(counts: &[u16]) -> Scene {
    let count = |slot: SlotIndex| counts.get(usize::from(slot.0)).copied().unwrap_or(1);
    let bowl = |index: u16| Body {
        name: BOWL_NAMES[usize::from(index)].to_owned(),
        shape: Shape::Bowl(BOWL),
        mobility: if count(SlotIndex(index)) > 0 { Mobility::Movable } else { Mobility::Fixed },
        color: BOWL_COLORS[usize::from(index)],
    };
    let fork = |index: u16| Body {
        name: format!("fork_{}", index + 1),
        shape: Shape::Cuboid { half_extents_m: FORK_HALF_M },
        mobility: Mobility::Movable,
        color: FORK_COLOR,
    };
    let tray = Body {
        name: "tray".to_owned(),
        shape: Shape::OpenBox { inner_m: TRAY_INNER_M, wall_m: TRAY_WALL_M },
        mobility: Mobility::Fixed,
        color: TRAY_COLOR,
    };
    let n_forks = count(FORK).max(1);
    let slot = |(name, bodies): (&str, std::ops::Range<u16>)| Slot {
        name: name.to_owned(),
        bodies: bodies.map(BodyIndex).collect(),
    };
    let end = N_BOWLS + n_forks;
    let bodies_of_slots = (0..N_BOWLS).map(|bowl| bowl..bowl + 1).chain([N_BOWLS..end, end..end + 1]);
    Scene {
        bodies: (0..N_BOWLS).map(bowl).chain((0..n_forks).map(fork)).chain([tray]).collect(),
        slots: BOWL_NAMES.into_iter().chain(["fork", "tray"]).zip(bodies_of_slots).map(slot).collect(),
        table_half_m: TABLE_HALF_M,
    }
}

/// Random poses: bowls in cells of their own, forks four in a cell, the tray behind them.
fn poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let [columns, rows] = CELLS;
    let cell = |cell| Cell { middle_m: cell_middle([cell % columns, cell / columns]), turn_rad: 0.0 };
    let cells = (0..columns * rows).map(cell).collect();
    scattered_over(scene, cells, ([0.0, TRAY_Y_M], TRAY_JITTER_M), ASIDE_X_M, rng)
}

/// The same before an arm.
fn bench_poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let arc = |(radius_m, count, apart_deg): (f32, u8, f32)| {
        (0..count).map(move |number| {
            let turn_rad = ((f32::from(number) - f32::from(count - 1) / 2.0) * apart_deg).to_radians();
            let (sin, cos) = libm::sincosf(turn_rad);
            Cell { middle_m: [BENCH_BASE_X_M + radius_m * cos, radius_m * sin], turn_rad }
        })
    };
    let cells = BENCH_ARCS.into_iter().flat_map(arc).collect();
    scattered_over(scene, cells, (BENCH_TRAY_M, BENCH_TRAY_JITTER_M), BENCH_ASIDE_X_M, rng)
}

fn scattered_over(
    scene: &Scene,
    mut cells: Vec<Cell>,
    (tray_m, tray_jitter_m): ([f32; 2], [f32; 2]),
    aside_x_m: f32,
    rng: &mut ChaCha8Rng,
) -> Vec<Pose> {
    cells.shuffle(rng);
    let (bowl_cells, fork_cells) = cells.split_at(usize::from(N_BOWLS));
    let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0_f32]];
    let in_cell = |cell: &Cell| {
        let [x, y] = cell.middle_m;
        let (sin, cos) = libm::sincosf(cell.turn_rad);
        corners.map(|[a, b]| [x + FORK_PLACE_M * (a * cos - b * sin), y + FORK_PLACE_M * (a * sin + b * cos)])
    };
    let mut fork_places: Vec<[f32; 2]> = fork_cells.iter().flat_map(in_cell).collect();
    fork_places.shuffle(rng);
    let mut free_cells = bowl_cells.iter();
    let mut free_places = fork_places.iter();
    let mut place = |(index, body): (usize, &Body)| {
        let z = body.shape.foot_m();
        match (body.shape, body.mobility) {
            (Shape::Bowl(_), mobility) => {
                let cell = free_cells.next().copied().unwrap_or_default();
                let drawn = scattered(cell.middle_m, z, BOWL_JITTER_M, BOWL_TURN_RAD, rng);
                let aside = upright(Vec3::new(aside_x_m, ASIDE_PITCH_M * (index as f32 - 2.0), z), 0.0);
                if mobility == Mobility::Fixed { aside } else { drawn }
            }
            (_, Mobility::Movable) => {
                let place = free_places.next().copied().unwrap_or_default();
                scattered(place, z, FORK_JITTER_M, std::f32::consts::FRAC_PI_2, rng)
            }
            (_, Mobility::Fixed) => {
                let [x, y] = tray_jitter_m.map(|reach| rng.random_range(-reach..reach));
                upright(Vec3::new(tray_m[0] + x, tray_m[1] + y, z), 0.0)
            }
        }
    };
    scene.bodies.iter().enumerate().map(&mut place).collect()
}

/// The middle of a cell, given by column and row.
fn cell_middle([column, row]: [usize; 2]) -> [f32; 2] {
    let middle = |cell: usize, n_cells: usize| (cell as f32 - (n_cells - 1) as f32 / 2.0) * CELL_M;
    [middle(column, CELLS[0]), middle(row, CELLS[1]) + CELLS_CENTER_Y_M]
}

fn scattered([x, y]: [f32; 2], z: f32, jitter_m: f32, turn_rad: f32, rng: &mut ChaCha8Rng) -> Pose {
    let mut jitter = || rng.random_range(-jitter_m..jitter_m);
    let position = Vec3::new(x + jitter(), y + jitter(), z);
    upright(position, rng.random_range(-turn_rad..turn_rad))
}

/// How many orders of one, two, three and four bowls are held out.
const UNSEEN: [usize; N_BOWLS as usize] = [2, 4, 8, 10];
/// How many orders may be trained on.
const N_TRAINING: u32 = 40;
/// How many orders are held out.
const N_UNSEEN: u32 = 24;

/// Training tasks, then unseen ones.
fn sample(_pool: TaskPool, train: usize, unseen: usize, seed: Seed) -> Vec<Task> {
    let mut seen_orders = Vec::new();
    let mut unseen_orders = Vec::new();
    for (length, n_unseen) in (1..).zip(UNSEEN) {
        let mut orders = orders(length);
        orders.shuffle(&mut seed.derive("cleanup_orders", &[length as u64]).rng());
        seen_orders.extend(orders.split_off(n_unseen));
        unseen_orders.extend(orders);
    }
    seen_orders.shuffle(&mut seed.derive("cleanup_seen", &[]).rng());
    unseen_orders.shuffle(&mut seed.derive("cleanup_unseen", &[]).rng());
    let seen = seen_orders.iter().take(train).map(|order| order_task(order, Split::Seen));
    seen.chain(unseen_orders.iter().take(unseen).map(|order| order_task(order, Split::Unseen))).collect()
}

/// Every order of so many bowls.
fn orders(length: usize) -> Vec<Vec<u16>> {
    if length == 0 {
        return vec![Vec::new()];
    }
    let longer = |order: Vec<u16>| {
        let others = (0..N_BOWLS).filter(|bowl| !order.contains(bowl)).collect::<Vec<_>>();
        others.into_iter().map(move |bowl| [order.as_slice(), &[bowl]].concat())
    };
    orders(length - 1).into_iter().flat_map(longer).collect()
}

/// The id names the order from below: `clean_31` puts `bowl_3` on the tray, `bowl_1` into it, and the forks into that.
fn order_task(order: &[u16], split: Split) -> Task {
    let bowls = order.iter().copied().map(SlotIndex);
    let below = std::iter::once(TRAY).chain(bowls.clone());
    let goals = bowls.chain([FORK]).zip(below).map(|(source, target)| Goal { source, target }).collect();
    let digits: String = order.iter().map(|bowl| (bowl + 1).to_string()).collect();
    Task::of_goals(format!("clean_{digits}"), Family::TableCleanup, goals, split)
}
