//! The table of Table Clean-up: four bowls, forks and a tray.
//!
//! Bowls that a task does not ask for stand aside, where nothing reaches them, so that every scene has the same slots.

use rand::seq::SliceRandom as _;

use crate::geometry::{Pose, Vec3, upright};
use crate::scene::{Body, BodyIndex, Bowl, Mobility, Scene, Shape, Slot, SlotIndex};

/// How many bowls there are, asked for or not.
pub(in crate::task) const N_BOWLS: u16 = 4;
/// The slot of the forks.
pub(in crate::task) const FORK: SlotIndex = SlotIndex(N_BOWLS);
/// The slot of the tray.
pub(in crate::task) const TRAY: SlotIndex = SlotIndex(N_BOWLS + 1);
/// The most forks: as many as a bowl holds.
pub(in crate::task) const MAX_FORKS: u16 = 20;

/// The names of the slots.
pub(super) const SLOT_NAMES: [&str; 6] = ["bowl_1", "bowl_2", "bowl_3", "bowl_4", "fork", "tray"];

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

/// The scene for 1 or 0 of each bowl (1 when it is asked for) and a number of forks; what is left out is 1.
pub(super) fn scene(counts: &[u16]) -> Scene {
    let count = |slot: SlotIndex| counts.get(usize::from(slot.0)).copied().unwrap_or(1);
    let bowl = |index: u16| Body {
        name: SLOT_NAMES[usize::from(index)].to_owned(),
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
        slots: SLOT_NAMES.into_iter().zip(bodies_of_slots).map(slot).collect(),
        table_half_m: TABLE_HALF_M,
    }
}

/// Random poses: bowls in cells of their own, forks four in a cell, the tray behind them.
pub(super) fn poses(scene: &Scene, rng: &mut impl rand::Rng) -> Vec<Pose> {
    let [columns, rows] = CELLS;
    let mut cells: Vec<[f32; 2]> =
        (0..columns * rows).map(|cell| cell_middle([cell % columns, cell / columns])).collect();
    cells.shuffle(rng);
    let (bowl_cells, fork_cells) = cells.split_at(usize::from(N_BOWLS));
    let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0_f32]];
    let in_cell = |&[x, y]: &[f32; 2]| corners.map(|[a, b]| [x + FORK_PLACE_M * a, y + FORK_PLACE_M * b]);
    let mut fork_places: Vec<[f32; 2]> = fork_cells.iter().flat_map(in_cell).collect();
    fork_places.shuffle(rng);
    let mut free_cells = bowl_cells.iter();
    let mut free_places = fork_places.iter();
    let mut place = |(index, body): (usize, &Body)| {
        let z = body.shape.foot_m();
        match (body.shape, body.mobility) {
            (Shape::Bowl(_), mobility) => {
                let cell = free_cells.next().copied().unwrap_or_default();
                let drawn = scattered(cell, z, BOWL_JITTER_M, BOWL_TURN_RAD, rng);
                let aside = upright(Vec3::new(ASIDE_X_M, ASIDE_PITCH_M * (index as f32 - 2.0), z), 0.0);
                if mobility == Mobility::Fixed { aside } else { drawn }
            }
            (_, Mobility::Movable) => {
                let place = free_places.next().copied().unwrap_or_default();
                scattered(place, z, FORK_JITTER_M, std::f32::consts::FRAC_PI_2, rng)
            }
            (_, Mobility::Fixed) => {
                let [x, y] = TRAY_JITTER_M.map(|reach| rng.random_range(-reach..reach));
                upright(Vec3::new(x, TRAY_Y_M + y, z), 0.0)
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

fn scattered([x, y]: [f32; 2], z: f32, jitter_m: f32, turn_rad: f32, rng: &mut impl rand::Rng) -> Pose {
    let mut jitter = || rng.random_range(-jitter_m..jitter_m);
    let position = Vec3::new(x + jitter(), y + jitter(), z);
    upright(position, rng.random_range(-turn_rad..turn_rad))
}
