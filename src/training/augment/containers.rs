//! Many categories in one container: mappings that no training task shows.
//!
//! The training tasks of Object Sorting give each category a container of its own; most of the other mappings do not.
//! Here whatever is brought into one container is brought into another, in the demonstration and now: what lies in the
//! first, or hangs above it, keeps its place relative to the container.

use std::ops::Range;

use rand::Rng;

use crate::scene::SlotIndex;
use crate::seed::Seed;
use crate::task::Family;
use crate::trace::ObservationRowMut;
use crate::training::examples::Example;

/// What lies so near to the gripper, across the table and in metres, is held or has just been let go.
const AT_GRIPPER_M: f32 = 0.02;

/// Nothing is put aside farther than this from a container's middle, in metres: there its walls begin.
const MOST_ASIDE_M: f32 = 0.08;

/// How far what is taken over is put aside: for each slot in x and y, apart in demonstration and state.
pub(super) struct Aside {
    pub(super) demonstrated: Vec<[f32; 2]>,
    pub(super) seen: Vec<[f32; 2]>,
}

impl Aside {
    /// Draws by a seed of its own, so that no other augmentation draws otherwise with it.
    pub(super) fn draw(reach_m: f32, n_slots: usize, seed: Seed) -> Self {
        let mut rng = seed.derive("aside", &[]).rng();
        let mut draw = || (0..n_slots).map(|_| [(); 2].map(|()| reach_m * rng.random_range(-1.0..1.0))).collect();
        Self { demonstrated: draw(), seen: draw() }
    }
}

/// For each container the one that takes over what is brought there; often itself.
pub(super) struct Merge {
    containers: Range<usize>,
    /// Half of a container's outer width and depth.
    half_m: f32,
    taken_over_by: Vec<usize>,
}

impl Merge {
    /// Draws which containers take over from which. Nothing for a family whose containers take the things of one sub-task each.
    pub(super) fn draw(family: Family, rng: &mut impl Rng) -> Option<Self> {
        let (containers, half_m) = family.shared_containers()?;
        let mut draw = |slot: usize| {
            let other = rng.random_range(containers.clone());
            if rng.random::<bool>() { other } else { slot }
        };
        let taken_over_by = containers.clone().map(&mut draw).collect();
        Some(Self { containers, half_m, taken_over_by })
    }

    /// Changes which container is meant.
    pub(super) fn apply_to_slots(&self, example: &mut Example) {
        let called_with = example.called_with.arguments.iter_mut().flatten();
        let called = example.arguments.iter_mut().chain(&mut example.next_move).chain(&mut example.involved);
        called.chain(called_with).for_each(|slot| *slot = self.meant_instead_of(*slot));
    }

    fn meant_instead_of(&self, slot: SlotIndex) -> SlotIndex {
        let position = usize::from(slot.0).checked_sub(self.containers.start);
        position.and_then(|position| self.taken_over_by.get(position)).map_or(slot, |&other| SlotIndex(other as u16))
    }

    /// Changes what is seen. Positions are relative to the gripper: one that goes along moves everything that stays.
    ///
    /// What is taken over is put `aside` besides, in x and y and in metres for each slot, since the first of a category
    /// that falls into a container in use does not fall into its middle. What was just let go takes the gripper along:
    /// it goes aside between hanging above a container, in the middle, and letting go.
    pub(super) fn apply_to_row(&self, row: ObservationRowMut<'_>, aside: &[[f32; 2]]) {
        let has_let_go = row.as_row().is_open();
        let positions = row.positions;
        let before = positions.to_vec();
        let let_go = self.at_gripper(&before).filter(|_| has_let_go);
        let gripper = self.shift(&before, [0.0; 2], let_go.and_then(|slot| aside.get(slot)));
        for (slot, position) in positions.iter_mut().enumerate() {
            let own = match slot {
                container if self.containers.contains(&container) => [0.0; 3],
                slot if is_at_gripper(&before[slot]) => gripper,
                slot => self.shift(&before, [before[slot][0], before[slot][1]], aside.get(slot)),
            };
            (0..3).for_each(|axis| position[axis] += own[axis] - gripper[axis]);
        }
    }

    /// What is held, or has just been let go.
    fn at_gripper(&self, positions: &[[f32; 3]]) -> Option<usize> {
        let things = (0..positions.len()).filter(|slot| !self.containers.contains(slot));
        let near = things.filter(|&slot| is_at_gripper(&positions[slot]));
        near.min_by(|&a, &b| positions[a][2].abs().total_cmp(&positions[b][2].abs()))
    }

    /// How far what lies at a place goes: from the container that it lies in or above to the one that takes over, and
    /// aside there.
    fn shift(&self, positions: &[[f32; 3]], place: [f32; 2], aside: Option<&[f32; 2]>) -> [f32; 3] {
        let is_over = |slot: &usize| (0..2).all(|axis| (positions[*slot][axis] - place[axis]).abs() <= self.half_m);
        let Some(slot) = self.containers.clone().find(is_over) else { return [0.0; 3] };
        let other = self.taken_over_by[slot - self.containers.start];
        let mut shift: [f32; 3] = std::array::from_fn(|axis| positions[other][axis] - positions[slot][axis]);
        for (axis, aside) in aside.into_iter().flatten().enumerate().filter(|_| other != slot) {
            let within = place[axis] - positions[slot][axis];
            let most = self.half_m.min(MOST_ASIDE_M).max(within.abs());
            shift[axis] += (within + aside).clamp(-most, most) - within;
        }
        shift
    }
}

fn is_at_gripper(position: &[f32; 3]) -> bool {
    position[0].hypot(position[1]) < AT_GRIPPER_M
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::{Observation, ObservationRows};

    fn rounded(positions: &[[f32; 3]]) -> Vec<i32> {
        positions.as_flattened().iter().map(|coordinate| (coordinate * 100.0).round() as i32).collect()
    }

    /// The same positions after a merge, of a gripper that holds something or has just let it go.
    fn merged<const N: usize>(merge: &Merge, seen: [[f32; 3]; N], closed: bool, aside: &[[f32; 2]]) -> Vec<i32> {
        let mut rows = ObservationRows::of(N, [&Observation { slots_m: seen.to_vec(), closed }]);
        rows.iter_mut().for_each(|row| merge.apply_to_row(row, aside));
        rounded(rows.get(0).unwrap().positions)
    }

    /// Two categories and two containers; the second takes over from the first, above which the gripper hangs.
    #[test]
    fn gripper_and_content_go_along_to_the_container_that_takes_over() {
        let merge = Merge { containers: 2..4, half_m: 0.105, taken_over_by: vec![3, 3] };
        let seen = [[0.03, 0.02, -0.28], [-0.1, -0.4, -0.28], [0.0, 0.0, -0.3], [0.26, 0.0, -0.3]];
        assert_eq!(merged(&merge, seen, false, &[]), [3, 2, -28, -36, -40, -28, -26, 0, -30, 0, 0, -30]);
        assert_eq!(merge.meant_instead_of(SlotIndex(2)), SlotIndex(3));
        assert_eq!(merge.meant_instead_of(SlotIndex(1)), SlotIndex(1), "a category stays what it is");
    }

    #[test]
    fn content_goes_alone_where_the_gripper_hangs_elsewhere() {
        let merge = Merge { containers: 2..4, half_m: 0.105, taken_over_by: vec![3, 3] };
        let seen = [[0.53, 0.02, -0.28], [0.7, 0.1, -0.28], [0.5, 0.0, -0.3], [0.76, 0.0, -0.3]];
        assert_eq!(
            merged(&merge, seen, false, &[]),
            [79, 2, -28, 70, 10, -28, 50, 0, -30, 76, 0, -30],
            "what lay in the other stays"
        );
    }

    #[test]
    fn what_is_taken_over_is_put_aside_and_takes_the_gripper_along_once_it_has_let_go() {
        let merge = Merge { containers: 2..4, half_m: 0.105, taken_over_by: vec![3, 3] };
        let aside = [[0.04, -0.03], [0.07, 0.01], [0.0; 2], [0.0; 2]];
        // Both categories are in the first container, the second at the gripper.
        let seen = [[0.03, 0.02, -0.28], [0.0, 0.0, 0.0], [0.0, 0.0, -0.3], [0.26, 0.0, -0.3]];
        let held = merged(&merge, seen, true, &aside);
        assert_eq!(held, [7, -1, -28, 0, 0, 0, -26, 0, -30, 0, 0, -30]);
        let let_go = merged(&merge, seen, false, &aside);
        assert_eq!(let_go, [0, -2, -28, 0, 0, 0, -33, -1, -30, -7, -1, -30]);
        // What lies in the container that takes over stays.
        let stays = [[0.53, 0.02, -0.28], [0.7, 0.1, -0.28], [0.25, 0.0, -0.3], [0.5, 0.0, -0.3]];
        assert_eq!(merged(&merge, stays, true, &aside), rounded(&stays));
    }

    #[test]
    fn nothing_is_put_into_a_wall() {
        let merge = Merge { containers: 1..3, half_m: 0.105, taken_over_by: vec![2, 2] };
        let seen = [[0.55, 0.0, -0.28], [0.5, 0.0, -0.3], [0.76, 0.0, -0.3]];
        let aside = [[0.07, -0.02], [0.0; 2], [0.0; 2]];
        assert_eq!(merged(&merge, seen, true, &aside), [84, -2, -28, 50, 0, -30, 76, 0, -30]);
    }

    #[test]
    fn demonstration_and_state_are_put_aside_apart_and_within_reach() {
        let Aside { demonstrated, seen } = Aside::draw(0.05, 8, Seed(1));
        assert!(demonstrated.iter().chain(&seen).flatten().all(|aside| aside.abs() <= 0.05));
        assert!(demonstrated.iter().zip(&seen).all(|(a, b)| a != b));
    }
}
