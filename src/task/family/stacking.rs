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

use crate::geometry::{Pose, upright};
use crate::program::Program;
use crate::scene::{Scene, SlotIndex};
use crate::seed::Seed;
use crate::task::family::blocks;
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
    scene: |counts| blocks::scene(&BLOCK_NAMES, &BLOCK_COLORS, counts),
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

/// Cells a side of the grid that blocks start on.
const SIDE: usize = 4;

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

/// Random poses of the blocks.
fn poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    blocks::positions(scene, SIDE, rng).into_iter().map(|position| upright(position, 0.0)).collect()
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
