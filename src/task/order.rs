//! The same end configuration by another order of sub-tasks.

use rand::seq::SliceRandom as _;

use crate::seed::Seed;
use crate::task::{Goal, Task};

impl Task {
    /// The same task with its towers built in another order, each from below as before. Nothing for a task that has
    /// no other order: of one tower, or of a family without towers.
    pub fn with_towers_shuffled(&self, seed: Seed) -> Option<Self> {
        let towers = if self.family.builds_towers() { towers(&self.goals) } else { Vec::new() };
        if towers.len() < 2 {
            return None;
        }
        let mut order: Vec<usize> = (0..towers.len()).collect();
        let mut rng = seed.rng();
        while order.is_sorted() {
            order.shuffle(&mut rng);
        }
        let goals = order.into_iter().flat_map(|tower| towers[tower].clone()).collect();
        Some(Self { goals, ..self.clone() })
    }
}

/// Goals by tower, in the order in which towers are begun. A goal belongs to the tower whose top or bottom it builds on.
pub(super) fn towers(goals: &[Goal]) -> Vec<Vec<Goal>> {
    let mut towers: Vec<Vec<Goal>> = Vec::new();
    for &goal in goals {
        let own = towers.iter_mut().find(|tower| tower.iter().any(|below| below.source == goal.target));
        match own {
            Some(tower) => tower.push(goal),
            None => towers.push(vec![goal]),
        }
    }
    towers
}
