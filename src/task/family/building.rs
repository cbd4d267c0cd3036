//! Tower Building: towers of two to six out of sixteen lettered blocks, or of the first few of them: more than Block
//! Stacking has, for models that learned there.
//!
//! # Invariants
//!
//! There is one stream of tasks a seed, all with different end configurations. Training takes its even places, the unseen
//! split the odd ones. A task's id is its place.

use std::collections::BTreeSet;

use rand::Rng;
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
    name: "tower_building",
    short_name: "building",
    title: "Tower Building",
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
    imported_as: None,
    front_view: FrontView { eye_m: [0.0, -1.0, 1.05], target_m: [0.0, 0.015, 0.09] },
    sampler: Sampler {
        limits: |pool, _train| {
            let most = MOST_TASKS.min(Blocks(pool.blocks.unwrap_or(N_BLOCKS)).fewest_tasks() / 2);
            (most, most)
        },
        all_seen: None,
        sample,
    },
    scene: |counts| blocks::scene(&BLOCK_NAMES, &BLOCK_COLORS, counts),
    poses,
    bench: BENCH,
};

/// The middle of the blocks is as far before the arm's base as in Block Stacking.
const BENCH: Bench = Bench {
    table_half_m: [0.8, 0.6],
    poses,
    front_view: FrontView { eye_m: [0.1, -1.62, 1.2], target_m: [-0.2, 0.0, 0.22] },
};

/// How many blocks there are, left out or not.
const N_BLOCKS: u16 = 16;
/// Cells a side of the grid that blocks start on.
const SIDE: usize = 5;
/// The most towers of a task, and the highest.
const MOST_TOWERS: usize = 4;
const HIGHEST: usize = 6;
/// As many tasks are drawn from each split at most.
const MOST_TASKS: u32 = 10_000;

const BLOCK_NAMES: [&str; N_BLOCKS as usize] = [
    "block_A", "block_B", "block_C", "block_D", "block_E", "block_F", "block_G", "block_H", "block_I", "block_J",
    "block_K", "block_L", "block_M", "block_N", "block_O", "block_P",
];
const BLOCK_COLORS: [[u8; 3]; N_BLOCKS as usize] = [
    [230, 57, 70],
    [244, 140, 6],
    [255, 209, 64],
    [82, 183, 78],
    [42, 157, 190],
    [58, 90, 200],
    [144, 80, 190],
    [236, 120, 180],
    [150, 40, 40],
    [160, 100, 50],
    [190, 200, 60],
    [30, 110, 70],
    [120, 210, 210],
    [120, 140, 170],
    [230, 200, 170],
    [70, 60, 80],
];

/// Random poses of the blocks.
fn poses(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<Pose> {
    blocks::positions(scene, SIDE, rng).into_iter().map(|position| upright(position, 0.0)).collect()
}

/// The blocks that there are.
#[derive(Clone, Copy)]
struct Blocks(u16);

impl Blocks {
    /// Fewer tasks than there are: those of a single tower of two, and of two such.
    fn fewest_tasks(self) -> u32 {
        let pairs = |blocks: u32| blocks * blocks.saturating_sub(1);
        let n = u32::from(self.0);
        pairs(n) + pairs(n) * pairs(n.saturating_sub(2)) / 2
    }

    /// Heights of up to [`MOST_TOWERS`] towers, as far as blocks go.
    fn heights(self, rng: &mut impl Rng) -> Vec<usize> {
        let mut left = usize::from(self.0);
        let mut heights = Vec::new();
        for _ in 0..rng.random_range(1..=MOST_TOWERS) {
            if left >= 2 {
                let height = rng.random_range(2..=HIGHEST.min(left));
                heights.push(height);
                left -= height;
            }
        }
        heights
    }

    /// Bottom-up, one tower finished before the next.
    fn goals(self, rng: &mut impl Rng) -> Vec<Goal> {
        let heights = self.heights(rng);
        let mut blocks: Vec<SlotIndex> = (0..self.0).map(SlotIndex).collect();
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
}

/// Training tasks, then unseen ones.
fn sample(TaskPool { blocks, .. }: TaskPool, train: usize, unseen: usize, seed: Seed) -> Vec<Task> {
    let within_reach = Blocks(blocks.unwrap_or(N_BLOCKS));
    let mut drawn: BTreeSet<Vec<Goal>> = BTreeSet::new();
    let mut rng = seed.derive("building", &[u64::from(within_reach.0)]).rng();
    let mut stream = Vec::new();
    while stream.len() < 2 * train.max(unseen) {
        let goals = within_reach.goals(&mut rng);
        let mut configuration = goals.clone();
        configuration.sort_unstable();
        if drawn.insert(configuration) {
            stream.push(goals);
        }
    }
    let place = |(place, goals): (usize, &Vec<Goal>), split| {
        let task = Task::of_goals(format!("build_{place:05}"), Family::TowerBuilding, goals.clone(), split);
        Task { blocks, ..task }
    };
    let all = || stream.iter().enumerate();
    let seen = all().step_by(2).take(train).map(|found| place(found, Split::Seen));
    seen.chain(all().skip(1).step_by(2).take(unseen).map(|found| place(found, Split::Unseen))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn towers_reach_up_to_six_and_no_configuration_comes_twice() {
        let pool = TaskPool { family: Family::TowerBuilding, blocks: None };
        let tasks = sample(pool, 200, 200, Seed(1));
        let configurations: BTreeSet<_> = tasks.iter().map(Task::canonical_goal).collect();
        assert_eq!((tasks.len(), configurations.len()), (400, 400));
        let tallest: BTreeSet<u16> = tasks.iter().map(Task::tallest).collect();
        assert_eq!(tallest, (2..=6).collect());
        assert_eq!(tasks[..20], sample(pool, 20, 0, Seed(1))[..], "a task depends on its place alone");
    }
}
