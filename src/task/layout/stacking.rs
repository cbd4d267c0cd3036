//! The table of Block Stacking: eight lettered blocks.
//!
//! Blocks that a task leaves out stand aside, where nothing reaches them and no usual camera sees them, so that every
//! scene has the same slots.

use rand::seq::SliceRandom as _;

use crate::geometry::{Vec3, horizontal_distance};
use crate::scene::{Body, Mobility, Scene, Shape};
use crate::task::layout::single_slot;

/// How many blocks there are, left out or not.
pub(in crate::task) const N_BLOCKS: u16 = 8;

/// Edge of a stacking block.
const BLOCK_M: f32 = 0.05;
/// Distance between the cells of the 4x4 grid that blocks start on.
const BLOCK_PITCH_M: f32 = 0.1;
/// How far a block may start from its cell's middle, in x and in y.
const BLOCK_JITTER_M: f32 = 0.03;
/// Least distance between two blocks' centres at the start: fingers must fit between neighbours.
const BLOCK_SPACING_M: f32 = 0.08;
/// Positions that are tried for a block before all are scattered anew: its neighbours may leave it no room.
const MAX_TRIES: usize = 64;
/// Scatterings that are tried before blocks start in the middles of their cells.
const MAX_LAYOUTS: usize = 1000;
/// Where blocks stand aside, from the table's middle, in x and in y, and their distance: in the corner that is below
/// the picture of the camera in front and behind that of the camera on the gripper.
const ASIDE_CORNER_M: f32 = -0.57;
const ASIDE_PITCH_M: f32 = 0.06;

const BLOCK_LETTERS: [&str; N_BLOCKS as usize] = ["A", "B", "C", "D", "E", "F", "G", "H"];
const BLOCK_COLORS: [[u8; 3]; N_BLOCKS as usize] = [
    [230, 57, 70],
    [244, 140, 6],
    [255, 209, 64],
    [82, 183, 78],
    [42, 157, 190],
    [58, 90, 200],
    [144, 80, 190],
    [236, 120, 180],
];

/// 1 for each of the first `n_blocks` blocks, 0 for the others.
pub(in crate::task) fn counts(n_blocks: u16) -> Vec<u16> {
    (0..N_BLOCKS).map(|block| u16::from(block < n_blocks)).collect()
}

pub(super) fn slot_name(block: usize) -> String {
    format!("block_{}", BLOCK_LETTERS[block % BLOCK_LETTERS.len()])
}

/// The scene for 1 or 0 of each block (0 when it stands aside); what is left out is 1.
pub(super) fn scene(counts: &[u16]) -> Scene {
    let is_aside = |block: usize| counts.get(block).is_some_and(|&count| count == 0);
    let body = |(block, &color): (usize, &[u8; 3])| Body {
        name: slot_name(block),
        shape: Shape::Cuboid { half_extents_m: [BLOCK_M / 2.0; 3] },
        mobility: if is_aside(block) { Mobility::Fixed } else { Mobility::Movable },
        color,
    };
    let bodies: Vec<Body> = BLOCK_COLORS.iter().enumerate().map(body).collect();
    let slots = bodies.iter().enumerate().map(|(block, body)| single_slot(block, body.name.clone())).collect();
    Scene { bodies, slots, table_half_m: [0.6, 0.6] }
}

/// Random positions of the blocks within reach, then those of the blocks that stand aside.
pub(super) fn positions(scene: &Scene, rng: &mut impl rand::Rng) -> Vec<Vec3> {
    let n_movable = scene.bodies.iter().filter(|body| body.mobility == Mobility::Movable).count();
    let mut cells: Vec<(usize, usize)> = (0..16).map(|cell| (cell % 4, cell / 4)).collect();
    let scattered = (0..MAX_LAYOUTS).find_map(|_| {
        cells.shuffle(rng);
        scatter_blocks(&cells[..n_movable], rng)
    });
    let scattered = scattered.unwrap_or_else(|| cells.iter().take(n_movable).map(|&cell| cell_middle(cell)).collect());
    scattered.into_iter().chain((n_movable..scene.bodies.len()).map(aside)).collect()
}

/// Where a block stands that a task leaves out: two columns in the corner, counted from the last block.
fn aside(block: usize) -> Vec3 {
    let place = usize::from(N_BLOCKS - 1).saturating_sub(block);
    let [x, y] = [place % 2, place / 2].map(|step| step as f32 * ASIDE_PITCH_M);
    Vec3::new(ASIDE_CORNER_M + x, ASIDE_CORNER_M + y, BLOCK_M / 2.0)
}

/// The middle of a cell of the grid that blocks start on.
fn cell_middle((column, row): (usize, usize)) -> Vec3 {
    let middle = |cell: usize| (cell as f32 - 1.5) * BLOCK_PITCH_M;
    Vec3::new(middle(column), middle(row), BLOCK_M / 2.0)
}

/// One block a cell; nothing when the blocks before leave no room in a cell.
fn scatter_blocks(cells: &[(usize, usize)], rng: &mut impl rand::Rng) -> Option<Vec<Vec3>> {
    let mut positions: Vec<Vec3> = Vec::new();
    for &cell in cells {
        let free = (0..MAX_TRIES).find_map(|_| {
            let mut jitter = || rng.random_range(-BLOCK_JITTER_M..BLOCK_JITTER_M);
            let position = cell_middle(cell) + Vec3::new(jitter(), jitter(), 0.0);
            let apart = |other: &Vec3| horizontal_distance(other, &position) >= BLOCK_SPACING_M;
            positions.iter().all(apart).then_some(position)
        });
        positions.push(free?);
    }
    Some(positions)
}
