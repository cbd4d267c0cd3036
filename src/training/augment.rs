//! Augmentations: what may be changed about an example without changing what is right.

mod containers;

use rand::Rng;
use rand::seq::SliceRandom as _;

use crate::model::{SpecificationRows, States};
use crate::robot::{GRASP_M, HOVER_M};
use crate::scene::SlotIndex;
use crate::seed::Seed;
use crate::task::Family;
use crate::trace::{ObservationNoise, ObservationRow, ObservationRowMut};
use crate::training::augment::containers::{Aside, Merge};
use crate::training::config::TrainConfig;
use crate::training::examples::Example;

/// How far a jittered gripper is moved, in x, y and z, in metres.
const JITTER_M: [f32; 3] = [0.25, 0.25, 0.1];
/// How far from what it is put beside a scattered bystander lies, in x, y and z, in metres.
const SCATTER_M: [f32; 3] = [0.08, 0.08, 0.04];

/// An example's own copies of what augmentations change.
pub(super) struct Views {
    pub(super) n_slots: usize,
    /// The window of the task specification.
    pub(super) window: SpecificationRows,
    /// What is seen now.
    pub(super) state: States,
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
            let seed = Seed(u64::from(merged.to_bits()) << 32 | u64::from(jittered.to_bits()));
            let Aside { demonstrated, seen } = Aside::draw(config.merge_aside_m, self.n_slots, seed);
            self.window.iter_mut().for_each(|row| merge.apply_to_row(row, &demonstrated));
            self.state.iter_mut().for_each(|row| merge.apply_to_row(row, &seen));
            merge.apply_to_slots(&mut self.example);
        }
        if scattered < config.scatter_bystanders {
            self.scatter(rng);
        }
        if jittered < config.gripper_jitter.unwrap_or_default() {
            self.state.iter_mut().for_each(|state| place.put_gripper(state, &self.example));
        }
        if relabelled < config.relabel_slots.unwrap_or_default() {
            self.rows_mut().for_each(|row| relabel(row.positions, &order));
            let called_with = self.example.called_with.arguments.iter_mut().flatten();
            self.example.arguments.iter_mut().chain(called_with).for_each(|slot| *slot = label(&order, *slot));
        }
        let seed = Seed(u64::from(scattered.to_bits()) << 32 | u64::from(relabelled.to_bits()));
        self.put_off(config.noise, seed);
    }

    /// Puts all positions off, apart in demonstration and state.
    fn put_off(&mut self, noise: ObservationNoise, seed: Seed) {
        let [demonstration, world] = ["demonstration", "world"].map(|part| seed.derive(part, &[]));
        let frames = self.window.iter_mut().enumerate();
        frames.for_each(|(frame, row)| noise.put_off(row.positions, frame as u64, demonstration));
        self.state.iter_mut().for_each(|row| noise.put_off(row.positions, self.example.frame as u64, world));
    }

    /// The observations that are read: those of the window, where it has some, and what is seen now.
    fn rows_mut(&mut self) -> impl Iterator<Item = ObservationRowMut<'_>> {
        self.window.iter_mut().chain(self.state.iter_mut())
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
            if demonstrated > 0.25 {
                put_beside(self.window.iter_mut(), slot, beside, offset);
            }
            if seen > 0.25 {
                put_beside(self.state.iter_mut(), slot, beside, offset);
            }
        }
    }
}

/// Shifts a slot in all rows, so that in the first it lies beside another.
fn put_beside<'r>(rows: impl Iterator<Item = ObservationRowMut<'r>>, slot: usize, other: usize, offset: [f32; 3]) {
    let mut shift = None;
    for row in rows {
        let positions = row.positions;
        let shift = *shift.get_or_insert_with(|| -> [f32; 3] {
            std::array::from_fn(|axis| positions[other][axis] + offset[axis] - positions[slot][axis])
        });
        positions[slot].iter_mut().zip(shift).for_each(|(coordinate, shift)| *coordinate += shift);
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

fn relabel(positions: &mut [[f32; 3]], order: &[usize]) {
    let shown = positions.to_vec();
    positions.iter_mut().zip(order).for_each(|(position, &slot)| *position = shown[slot]);
}

/// Under which label a slot is shown.
fn label(order: &[usize], slot: SlotIndex) -> SlotIndex {
    let shown = order.iter().position(|&shown| shown == usize::from(slot.0));
    shown.map_or(slot, |label| SlotIndex(label as u16))
}

/// Whether the decision stays right wherever the gripper is: it is empty, and the next primitive moves it (or none
/// comes).
fn may_jitter(example: &Example, state: ObservationRow<'_>) -> bool {
    state.is_open() && (example.next_move.is_some() || example.last_decision)
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
    fn put_gripper(&self, state: ObservationRowMut<'_>, example: &Example) {
        if !may_jitter(example, state.as_row()) {
            return;
        }
        let offset = match *self {
            Self::Offset(offset) => offset,
            Self::Above { slot, .. } if example.next_move.is_some_and(|next| usize::from(next.0) == slot) => return,
            Self::Above { slot, height_m } => {
                let [x, y, z] = state.positions[slot];
                [x, y, z + height_m]
            }
        };
        for position in state.positions {
            position.iter_mut().zip(offset).for_each(|(coordinate, offset)| *coordinate -= offset);
        }
    }
}
