//! States to recover from: part of what was built lies on the table again.
//!
//! # Input and output
//!
//! A decision of the root program while it builds towers. Some of what stands is scattered, and the label becomes what
//! an expert would do there: the first demonstrated sub-task whose relation does not hold.
//!
//! # Invariants
//!
//! Nothing is known here of sizes and tables but what observations show: a relation holds when two slots are to each
//! other as the demonstration leaves them, and the table is where the lowest slot stands.

use rand::Rng;

use crate::robot::{GRASP_M, HOVER_M};
use crate::scene::SlotIndex;
use crate::trace::{ObservationRowMut, Span};
use crate::training::examples::Example;
use crate::training::sub_task::SubTask;

/// How far from its place, in x and in y, what falls comes to lie, in metres.
const FALL_M: f32 = 0.25;
/// Least distance between the centres of what lies, in metres.
const APART_M: f32 = 0.055;
/// Places that are tried for what falls.
const MAX_TRIES: usize = 16;
/// How often the gripper has given way to what toppled the tower: it hovers then.
const GIVES_WAY: f32 = 0.75;

/// Topples what rests on one of the finished sub-tasks' targets and labels the decision anew. Nothing happens while
/// nothing is built, or while something is held.
pub(super) fn knock_over(
    sub_tasks: &[SubTask],
    example: &mut Example,
    state: &mut ObservationRowMut<'_>,
    rng: &mut impl Rng,
) {
    let done: Vec<&SubTask> = sub_tasks.iter().filter(|sub_task| sub_task.holds(state.as_row())).collect();
    if done.is_empty() || !state.as_row().is_open() {
        return;
    }
    let lowest = done[rng.random_range(0..done.len())];
    for slot in resting_on(lowest.source, &done) {
        scatter(slot, state, rng);
    }
    if rng.random::<f32>() < GIVES_WAY {
        state.positions.iter_mut().for_each(|position| position[2] -= HOVER_M - GRASP_M);
    }
    let Some(next) = sub_tasks.iter().find(|sub_task| !sub_task.holds(state.as_row())) else { return };
    example.callee = next.program;
    example.end_of_program = false;
    example.scope =
        Some(Span { begin: next.part.begin - example.window.begin, end: next.part.end - example.window.begin });
    example.next_move = Some(next.source);
    example.last_decision = false;
}

/// A slot and all that rests on it, from below.
fn resting_on(slot: SlotIndex, done: &[&SubTask]) -> Vec<SlotIndex> {
    let mut toppled = vec![slot];
    for sub_task in done {
        if toppled.contains(&sub_task.target) && !toppled.contains(&sub_task.source) {
            toppled.push(sub_task.source);
        }
    }
    toppled
}

/// Puts a slot on the table beside where it was, apart from all others where there is room.
fn scatter(slot: SlotIndex, state: &mut ObservationRowMut<'_>, rng: &mut impl Rng) {
    let slot = usize::from(slot.0);
    let [x, y, _] = state.positions[slot];
    let others: Vec<[f32; 3]> =
        state.positions.iter().enumerate().filter(|&(other, _)| other != slot).map(|(_, at)| *at).collect();
    let table_z = others.iter().map(|other| other[2]).fold(f32::MAX, f32::min);
    let mut place = [x, y];
    for _ in 0..MAX_TRIES {
        place = [x, y].map(|middle| middle + rng.random_range(-FALL_M..FALL_M));
        if others.iter().all(|other| (other[0] - place[0]).hypot(other[1] - place[1]) >= APART_M) {
            break;
        }
    }
    let [x, y] = place;
    state.positions[slot] = [x, y, table_z];
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::Program;
    use crate::seed::Seed;
    use crate::trace::{Observation, ObservationRows};

    /// Slots 0, 1 and 2 as a tower from below, 3 on the table; the gripper is open.
    fn tower() -> Observation {
        Observation { slots_m: vec![[0.0; 3], [0.0, 0.0, 0.05], [0.0, 0.0, 0.1], [0.2, 0.0, 0.0]], closed: false }
    }

    /// What becomes of a state and its decision.
    fn knocked_over(sub_tasks: &[SubTask], state: &Observation, seed: u64) -> (Example, ObservationRows) {
        let (mut example, mut state) = (decision(), ObservationRows::of(4, [state]));
        for mut row in state.iter_mut() {
            knock_over(sub_tasks, &mut example, &mut row, &mut Seed(seed).rng());
        }
        (example, state)
    }

    /// 1 on 0, 2 on 1, 3 on 2: the last is not done.
    fn sub_tasks() -> Vec<SubTask> {
        let sub_task = |number: u16| SubTask {
            program: Program::PickAndPlace,
            source: SlotIndex(number),
            target: SlotIndex(number - 1),
            part: Span { begin: 4 * u32::from(number) - 4, end: 4 * u32::from(number) + 1 },
            offset_m: [0.0, 0.0, 0.05],
        };
        (1..4).map(sub_task).collect()
    }

    fn decision() -> Example {
        Example {
            demonstration: 0,
            window: Span { begin: 0, end: 13 },
            trial: 1,
            frame: 8,
            callee: Program::PickAndPlace,
            end_of_program: false,
            scope: Some(Span { begin: 8, end: 13 }),
            arguments: Vec::new(),
            called_with: crate::model::CalledWith::default(),
            next_move: Some(SlotIndex(3)),
            involved: (0..4).map(SlotIndex).collect(),
            last_decision: false,
        }
    }

    #[test]
    fn what_is_knocked_over_lies_apart_on_the_table_and_is_built_again_from_below() {
        let sub_tasks = sub_tasks();
        let mut first = [false; 3];
        for seed in 0..50 {
            let (example, state) = knocked_over(&sub_tasks, &tower(), seed);
            let state = state.get(0).unwrap();
            let table_z = state.positions[0][2];
            let next = example.next_move.unwrap();
            assert!(next.0 == 1 || next.0 == 2, "3 was next before");
            first[usize::from(next.0)] = true;
            assert_eq!(example.scope, Some(sub_tasks[usize::from(next.0) - 1].part));
            for toppled in next.0..3 {
                let [x, y, z] = state.position(SlotIndex(toppled));
                assert!((z - table_z).abs() < 1e-6, "it lies on the table");
                assert!(x.hypot(y) >= APART_M - 1e-6, "apart from what still stands");
            }
        }
        assert_eq!(first, [false, true, true], "towers are knocked over at any height");
    }

    #[test]
    fn an_end_becomes_a_repair() {
        let sub_tasks = &sub_tasks()[..2];
        let mut example = Example {
            callee: Program::None,
            end_of_program: true,
            scope: None,
            next_move: None,
            last_decision: true,
            ..decision()
        };
        for mut row in ObservationRows::of(4, [&tower()]).iter_mut() {
            knock_over(sub_tasks, &mut example, &mut row, &mut Seed(3).rng());
        }
        assert_eq!((example.callee, example.end_of_program), (Program::PickAndPlace, false));
        assert!(example.scope.is_some() && !example.last_decision);
    }

    #[test]
    fn nothing_is_knocked_over_where_nothing_is_built_or_something_is_held() {
        let mut flat = tower();
        flat.slots_m[1][0] = 0.1;
        flat.slots_m[2][0] = -0.1;
        let holding = Observation { closed: true, ..tower() };
        for before in [flat, holding] {
            assert_eq!(knocked_over(&sub_tasks(), &before, 1), (decision(), ObservationRows::of(4, [&before])));
        }
    }
}
