//! Lettered blocks, of which families build towers: how they look, and where they start.

use rand::Rng;
use rand::seq::SliceRandom as _;

use crate::geometry::{Vec3, horizontal_distance};
use crate::scene::{Body, Mobility, Scene, Shape, Slot};

/// Edge of a block.
const BLOCK_M: f32 = 0.05;
/// Distance between the cells of the grid that blocks start on.
const PITCH_M: f32 = 0.1;
/// How far a block may start from its cell's middle, in x and in y.
const JITTER_M: f32 = 0.03;
/// Least distance between two blocks' centres at the start: fingers must fit between neighbours.
const SPACING_M: f32 = 0.08;
/// Positions that are tried for a block before all are scattered anew: its neighbours may leave it no room.
const MAX_TRIES: usize = 64;
/// Scatterings that are tried before blocks start in the middles of their cells.
const MAX_LAYOUTS: usize = 1000;
/// Where blocks stand aside, from the table's middle, in x and in y, and their distance: in the corner that is below
/// the picture of the camera in front and behind that of the camera on the gripper.
const ASIDE_CORNER_M: f32 = -0.57;
const ASIDE_PITCH_M: f32 = 0.06;

/// The scene of named blocks, for 1 or 0 of each (0 when it stands aside); what is left out is 1.
pub(super) fn scene(names: &[&str], colors: &[[u8; 3]], counts: &[u16]) -> Scene {
    let is_aside = |block: usize| counts.get(block).is_some_and(|&count| count == 0);
    let body = |(block, (name, &color)): (usize, (&&str, &[u8; 3]))| Body {
        name: (*name).to_owned(),
        shape: Shape::Cuboid { half_extents_m: [BLOCK_M / 2.0; 3] },
        mobility: if is_aside(block) { Mobility::Fixed } else { Mobility::Movable },
        color,
    };
    let bodies: Vec<Body> = names.iter().zip(colors).enumerate().map(body).collect();
    let slots = bodies.iter().enumerate().map(|(block, body)| Slot::single(body.name.clone(), block)).collect();
    Scene { bodies, slots, table_half_m: [0.6, 0.6] }
}

/// Random positions of the blocks within reach, each in a cell of its own of a square grid with so many cells a side; then
/// those of the blocks that stand aside.
pub(super) fn positions(scene: &Scene, side: usize, rng: &mut impl Rng) -> Vec<Vec3> {
    let n_movable = scene.bodies.iter().filter(|body| body.mobility == Mobility::Movable).count();
    let mut cells: Vec<(usize, usize)> = (0..side * side).map(|cell| (cell % side, cell / side)).collect();
    let scattered = (0..MAX_LAYOUTS).find_map(|_| {
        cells.shuffle(rng);
        scatter(&cells[..n_movable], side, rng)
    });
    let middles = || cells.iter().take(n_movable).map(|&cell| cell_middle(cell, side)).collect();
    let aside = (n_movable..scene.bodies.len()).map(|block| aside(scene.bodies.len() - 1 - block));
    scattered.unwrap_or_else(middles).into_iter().chain(aside).collect()
}

/// Where a block stands that a task leaves out: two columns in the corner.
fn aside(place: usize) -> Vec3 {
    let [x, y] = [place % 2, place / 2].map(|step| step as f32 * ASIDE_PITCH_M);
    Vec3::new(ASIDE_CORNER_M + x, ASIDE_CORNER_M + y, BLOCK_M / 2.0)
}

/// The middle of a cell of the grid that blocks start on.
fn cell_middle((column, row): (usize, usize), side: usize) -> Vec3 {
    let middle = |cell: usize| (cell as f32 - (side as f32 - 1.0) / 2.0) * PITCH_M;
    Vec3::new(middle(column), middle(row), BLOCK_M / 2.0)
}

/// One block a cell; nothing when the blocks before leave no room in a cell.
fn scatter(cells: &[(usize, usize)], side: usize, rng: &mut impl Rng) -> Option<Vec<Vec3>> {
    let mut positions: Vec<Vec3> = Vec::new();
    for &cell in cells {
        let free = (0..MAX_TRIES).find_map(|_| {
            let mut jitter = || rng.random_range(-JITTER_M..JITTER_M);
            let position = cell_middle(cell, side) + Vec3::new(jitter(), jitter(), 0.0);
            let apart = |other: &Vec3| horizontal_distance(other, &position) >= SPACING_M;
            positions.iter().all(apart).then_some(position)
        });
        positions.push(free?);
    }
    Some(positions)
}
