//! Object Sorting: which of four containers each of four categories goes to.
//!
//! # Source
//!
//! Paper, experiment 1: of the 4^4 mappings, four that cover every category-container pair are trained on, the other
//! 252 are unseen. The four are the rows of a Latin square, drawn uniformly.

use rand::seq::SliceRandom as _;

use crate::scene::SlotIndex;
use crate::seed::Seed;
use crate::task::check::N_CATEGORIES;
use crate::task::sampler::task;
use crate::task::{Family, Goal, Split, Task};

/// The container, counted from 0, of each category.
type Mapping = [u16; N_CATEGORIES as usize];

const N_CONTAINERS: u16 = 4;

/// How many mappings are trained on.
pub(super) const N_TRAINING: u32 = 4;
/// How many mappings are held out.
pub(super) const N_UNSEEN: u32 = 252;

/// Training tasks, then unseen ones.
pub(super) fn sample(train: usize, unseen: usize, seed: Seed) -> Vec<Task> {
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
    task(format!("sort_{cube}{can}{ball}{brick}"), Family::ObjectSorting, goals, split)
}
