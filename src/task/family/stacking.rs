//! Block Stacking: towers of two to four out of eight lettered blocks, or of the first few of them.
//!
//! Blocks that a task leaves out stand aside, where nothing reaches them and no usual camera sees them, so that every
//! scene has the same slots.
//!
//! # Source
//!
//! The 2000 tasks that the authors released. What is known of them is counts: of tasks by goals, of tasks by towers, of
//! towers by height. [`SHAPES`] is the table with just these counts that is nearest (in relative entropy) to drawing
//! every order of heights equally often.
//!
//! # Invariants
//!
//! There is one stream of tasks a seed, all with different end configurations. Training takes the even places of the
//! stream, the unseen split the odd ones; a split that needs more goes on with the other's places from the stream's end.
//! So neither depends on how many the other takes, and no leak is possible. A task's id is its place in the stream.
//!
//! # Shapes
//!
//! Fewer blocks leave the shapes that need no more than there are, in the same proportions until one is used up: four
//! blocks have 72 end configurations, three 12, two 2.

use std::collections::BTreeSet;

use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use crate::geometry::{Pose, Vec3, horizontal_distance, upright};
use crate::program::Program;
use crate::scene::{Body, Mobility, Scene, Shape, Slot, SlotIndex};
use crate::seed::Seed;
use crate::task::family::spec::{Bench, Bodies, FamilySpec, FrontView, Room, Sampler, SlotKind};
use crate::task::{Condition, Family, Goal, Split, Task, TaskPool};

pub(super) static SPEC: FamilySpec = FamilySpec {
    name: "block_stacking",
    short_name: "stacking",
    title: "Block Stacking",
    root: Program::BlockStacking,
    kinds: &[SlotKind {
        name: "block",
        slots: &BLOCK_NAMES,
        brings_about: Some(Condition::on_top),
        room: Room::One,
        bodies: Bodies::OneWithinReach,
    }],
    builds_towers: true,
    tray: None,
    imported_as: Some("pick_place"),
    front_view: FrontView { eye_m: [0.0, -0.80, 0.86], target_m: [0.0, 0.015, 0.075] },
    sampler: Sampler {
        limits: |pool, train| {
            let all = n_tasks(pool.blocks);
            (all, all.saturating_sub(train))
        },
        all_seen: None,
        sample,
    },
    scene,
    poses,
    bench: BENCH,
};

/// The middle of the blocks is 0.62 m before the arm's base.
const BENCH: Bench = Bench {
    table_half_m: [0.8, 0.6],
    poses,
    front_view: FrontView { eye_m: [0.1, -1.8, 1.25], target_m: [-0.2, 0.0, 0.28] },
};

/// How many blocks there are, left out or not.
const N_BLOCKS: u16 = 8;

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

const BLOCK_NAMES: [&str; N_BLOCKS as usize] =
    ["block_A", "block_B", "block_C", "block_D", "block_E", "block_F", "block_G", "block_H"];
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

/// The scene for 1 or 0 of each block (0 when it stands aside); what is left out is 1.
fn scene(counts: &[u16]) -> Scene {
    let is_aside = |block: usize| counts.get(block).is_some_and(|&count| count == 0);
    let body = |(block, &color): (usize, &[u8; 3])| Body {
        name: BLOCK_NAMES[block].to_owned(),
        shape: Shape::Cuboid { half_extents_m: [BLOCK_M / 2.0; 3] },
        mobility: if is_aside(block) { Mobility::Fixed } else { Mobility::Movable },
        color,
    };
    let bodies: Vec<Body> = BLOCK_COLORS.iter().enumerate().map(body).collect();
    let slots = bodies.iter().enumerate().map(|(block, body)| Slot::single(body.name.clone(), block)).collect();
    Scene { bodies, slots, table_half_m: [0.6, 0.6] }
}

/// Random positions of the blocks within reach, then those of the blocks that stand aside.
fn poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    let n_movable = scene.bodies.iter().filter(|body| body.mobility == Mobility::Movable).count();
    let mut cells: Vec<(usize, usize)> = (0..16).map(|cell| (cell % 4, cell / 4)).collect();
    let scattered = (0..MAX_LAYOUTS).find_map(|_| {
        cells.shuffle(rng);
        scatter_blocks(&cells[..n_movable], rng)
    });
    let scattered = scattered.unwrap_or_else(|| cells.iter().take(n_movable).map(|&cell| cell_middle(cell)).collect());
    let aside = (n_movable..scene.bodies.len()).map(aside);
    scattered.into_iter().chain(aside).map(|position| upright(position, 0.0)).collect()
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

/// The heights of a task's towers, and how many of 2000 tasks have them.
const SHAPES: [(&[usize], u32); 14] = [
    (&[2], 4),
    (&[3], 11),
    (&[4], 32),
    (&[2, 2], 32),
    (&[2, 3], 167),
    (&[2, 4], 309),
    (&[3, 3], 146),
    (&[3, 4], 373),
    (&[4, 4], 121),
    (&[2, 2, 2], 40),
    (&[2, 2, 3], 214),
    (&[2, 2, 4], 273),
    (&[2, 3, 3], 258),
    (&[2, 2, 2, 2], 20),
];

/// The blocks that there are.
#[derive(Clone, Copy)]
struct Blocks(u16);

impl Blocks {
    /// How many different end configurations there are with towers of these heights.
    fn n_configurations(self, heights: &[usize]) -> u32 {
        let n_used = heights.iter().sum::<usize>() as u32;
        let placings: u32 = (0..n_used).map(|placed| u32::from(self.0).saturating_sub(placed)).product();
        let interchangeable = |height: usize| heights.iter().filter(|&&other| other == height).count() as u32;
        let orders: u32 = (2..=4).map(|height| (1..=interchangeable(height)).product::<u32>()).product();
        placings / orders
    }
}

/// How many tasks there are, with different end configurations.
fn n_tasks(blocks: Option<u16>) -> u32 {
    let blocks = Blocks(blocks.unwrap_or(N_BLOCKS));
    SHAPES.iter().map(|(heights, _)| blocks.n_configurations(heights)).sum()
}

/// Training tasks, then unseen ones, at most [`n_tasks`] together.
fn sample(TaskPool { blocks, .. }: TaskPool, train: usize, unseen: usize, seed: Seed) -> Vec<Task> {
    let all = n_tasks(blocks) as usize;
    let length = if train.max(unseen) > all / 2 { all } else { 2 * train.max(unseen) };
    let stream = stream(Blocks(blocks.unwrap_or(N_BLOCKS)), length, seed);
    let place = |id: usize, split| {
        let task = Task::of_goals(format!("stack_{id:04}"), Family::BlockStacking, stream[id].clone(), split);
        Task { blocks, ..task }
    };
    let even = || (0..length).step_by(2);
    let odd = || (1..length).step_by(2);
    let seen = even().chain(odd().rev()).take(train).map(|id| place(id, Split::Seen));
    seen.chain(odd().chain(even().rev()).take(unseen).map(|id| place(id, Split::Unseen))).collect()
}

/// The goals of the stream's first tasks. Shapes come from shuffled decks of 2000 (fewer with fewer blocks), so that the
/// counts are exact after each deck; a shape whose configurations are used up is passed over.
fn stream(blocks: Blocks, length: usize, seed: Seed) -> Vec<Vec<Goal>> {
    let mut drawn: BTreeSet<Vec<Goal>> = BTreeSet::new();
    let mut n_drawn = [0_u32; SHAPES.len()];
    let mut tasks = Vec::with_capacity(length);
    let mut deck_idx = 0;
    while tasks.len() < length {
        for (card_idx, shape) in deck(blocks, seed, deck_idx).into_iter().enumerate() {
            if tasks.len() == length {
                break;
            }
            let heights = SHAPES[shape].0;
            if n_drawn[shape] < blocks.n_configurations(heights) {
                n_drawn[shape] += 1;
                let mut rng = seed.derive("stacking_blocks", &[deck_idx, card_idx as u64]).rng();
                tasks.push(new_goals(blocks, heights, &mut drawn, &mut rng));
            }
        }
        deck_idx += 1;
    }
    tasks
}

fn deck(blocks: Blocks, seed: Seed, deck_idx: u64) -> Vec<usize> {
    let cards = |(shape, &(_, count)): (usize, &(&[usize], u32))| std::iter::repeat_n(shape, count as usize);
    let fits = |&(_, &(heights, _)): &(usize, &(&[usize], u32))| blocks.n_configurations(heights) > 0;
    let mut deck: Vec<usize> = SHAPES.iter().enumerate().filter(fits).flat_map(cards).collect();
    deck.shuffle(&mut seed.derive("stacking_shapes", &[deck_idx]).rng());
    deck
}

/// Draws blocks and tower order until the end configuration is new.
fn new_goals(
    blocks: Blocks,
    heights: &[usize],
    drawn: &mut BTreeSet<Vec<Goal>>,
    rng: &mut impl rand::Rng,
) -> Vec<Goal> {
    loop {
        let goals = random_goals(blocks, heights, rng);
        let mut configuration = goals.clone();
        configuration.sort_unstable();
        if drawn.insert(configuration) {
            return goals;
        }
    }
}

/// Bottom-up, one tower finished before the next, towers in any order.
fn random_goals(Blocks(n_blocks): Blocks, heights: &[usize], rng: &mut impl rand::Rng) -> Vec<Goal> {
    let mut heights = heights.to_vec();
    heights.shuffle(rng);
    let mut blocks: Vec<SlotIndex> = (0..n_blocks).map(SlotIndex).collect();
    blocks.shuffle(rng);
    let mut rest = blocks.as_slice();
    let mut goals = Vec::new();
    for height in heights {
        let (tower, others) = rest.split_at(height);
        goals.extend(tower.windows(2).map(|pair| Goal { source: pair[1], target: pair[0] }));
        rest = others;
    }
    goals
}
