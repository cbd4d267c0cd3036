//! Augmentations: what may be changed about an example without changing what is right.
//!
//! # Shapes
//!
//! Rows are [`crate::trace::Observation::to_flat`]: positions relative to the gripper, then (open, closed).

mod containers;

use rand::Rng;
use rand::seq::SliceRandom as _;

use crate::robot::{GRASP_M, HOVER_M};
use crate::scene::SlotIndex;
use crate::task::Family;
use crate::trace::{Observation, SpecificationForm};
use crate::training::augment::containers::Merge;
use crate::training::config::TrainConfig;
use crate::training::examples::Example;

/// How far a jittered gripper is moved, in x, y and z, in metres.
const JITTER_M: [f32; 3] = [0.25, 0.25, 0.1];
/// How far from what it is put beside a scattered bystander lies, in x, y and z, in metres.
const SCATTER_M: [f32; 3] = [0.08, 0.08, 0.04];

/// An example's own copies of what augmentations change.
pub(super) struct Views {
    pub(super) n_slots: usize,
    pub(super) specification: SpecificationForm,
    /// Rows of the window of the task specification.
    pub(super) window: Vec<f32>,
    /// The row that is seen now.
    pub(super) state: Vec<f32>,
    /// The decision; its labels change with what is seen.
    pub(super) example: Example,
}

impl Views {
    /// Applies what the settings ask for. The number of draws before an augmentation does not depend on the settings:
    /// one that is switched off changes no other.
    pub(super) fn augment(&mut self, family: Family, config: &TrainConfig, rng: &mut impl Rng) {
        let [merged, scattered, jittered, relabelled]: [f32; 4] = rng.random();
        let merge = Merge::draw(family, rng);
        let place = Place::draw(self.n_slots, rng);
        let order = relabelling(family, self.n_slots, rng);
        if let Some(merge) = merge.filter(|_| merged < config.merge_containers) {
            merge.apply(self);
        }
        if scattered < config.scatter_bystanders {
            self.scatter(rng);
        }
        if jittered < config.gripper_jitter.unwrap_or_default() && may_jitter(&self.example, &self.state) {
            place.put_gripper(&mut self.state, self.example.next_move);
        }
        if relabelled < config.relabel_slots.unwrap_or_default() {
            self.window.chunks_exact_mut(Observation::width(self.n_slots)).for_each(|row| relabel(row, &order));
            relabel(&mut self.state, &order);
            let given = self.example.given.arguments.iter_mut().flatten();
            self.example.arguments.iter_mut().chain(given).for_each(|slot| *slot = label(&order, *slot));
        }
    }

    /// Puts about half of the slots that the running program has nothing to do with beside other slots: in the
    /// demonstration, now, or in both.
    fn scatter(&mut self, rng: &mut impl Rng) {
        for slot in 0..self.n_slots {
            let beside = rng.random_range(0..self.n_slots);
            let offset = SCATTER_M.map(|reach| rng.random_range(-reach..reach));
            let [moved, demonstrated, seen]: [f32; 3] = rng.random();
            let involved = self.example.involved.iter().any(|&other| usize::from(other.0) == slot);
            if involved || beside == slot || moved < 0.5 {
                continue;
            }
            let demonstrated = demonstrated > 0.25 && self.specification == SpecificationForm::Trajectories;
            for (rows, is_put) in [(&mut self.window, demonstrated), (&mut self.state, seen > 0.25)] {
                if is_put {
                    put_beside(rows, self.n_slots, slot, beside, offset);
                }
            }
        }
    }
}

/// Shifts a slot in all rows, so that in the first it lies beside another.
fn put_beside(rows: &mut [f32], n_slots: usize, slot: usize, other: usize, offset: [f32; 3]) {
    let shift: [f32; 3] = std::array::from_fn(|axis| rows[3 * other + axis] + offset[axis] - rows[3 * slot + axis]);
    for row in rows.chunks_exact_mut(Observation::width(n_slots)) {
        row[3 * slot..].iter_mut().zip(shift).for_each(|(coordinate, shift)| *coordinate += shift);
    }
}

/// Which slot each label shows: those of one kind in any order among themselves.
fn relabelling(family: Family, n_slots: usize, rng: &mut impl Rng) -> Vec<usize> {
    let mut slots: Vec<usize> = (0..n_slots).collect();
    for (_, of_kind) in family.kinds_with_slots() {
        if let Some(of_kind) = slots.get_mut(of_kind) {
            of_kind.shuffle(rng);
        }
    }
    slots
}

fn relabel(row: &mut [f32], order: &[usize]) {
    let shown = row.to_vec();
    for (position, &slot) in row.chunks_exact_mut(3).zip(order) {
        position.copy_from_slice(&shown[3 * slot..3 * slot + 3]);
    }
}

/// Under which label a slot is shown.
fn label(order: &[usize], slot: SlotIndex) -> SlotIndex {
    let shown = order.iter().position(|&shown| shown == usize::from(slot.0));
    shown.map_or(slot, |label| SlotIndex(label as u16))
}

/// Whether the decision stays right wherever the gripper is: it is empty, and the next primitive moves it (or none
/// comes).
fn may_jitter(example: &Example, state: &[f32]) -> bool {
    let open = state[state.len() - 2] > 0.5;
    open && (example.next_move.is_some() || example.last_decision)
}

/// Where a jittered gripper is put.
enum Place {
    /// So far from where it was.
    Offset([f32; 3]),
    /// So high above what a slot shows.
    Above { slot: usize, height_m: f32 },
}

impl Place {
    fn draw(n_slots: usize, rng: &mut impl Rng) -> Self {
        if rng.random::<bool>() {
            return Self::Offset(JITTER_M.map(|reach| rng.random_range(-reach..reach)));
        }
        let height_m = if rng.random::<bool>() { HOVER_M } else { GRASP_M };
        Self::Above { slot: rng.random_range(0..n_slots), height_m }
    }

    /// Positions are relative to the gripper: moving it moves everything else. It is never put above what it shall
    /// move to next, since there the move would be done.
    fn put_gripper(&self, state: &mut [f32], next_move: Option<SlotIndex>) {
        let offset = match *self {
            Self::Offset(offset) => offset,
            Self::Above { slot, .. } if next_move.is_some_and(|next| usize::from(next.0) == slot) => return,
            Self::Above { slot, height_m } => [state[3 * slot], state[3 * slot + 1], state[3 * slot + 2] + height_m],
        };
        let n_coordinates = state.len() - 2;
        for position in state[..n_coordinates].chunks_exact_mut(3) {
            position.iter_mut().zip(offset).for_each(|(coordinate, offset)| *coordinate -= offset);
        }
    }
}
