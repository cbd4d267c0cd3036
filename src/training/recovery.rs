//! States to recover from: part of what was built lies on the table again.
//!
//! # Input and output
//!
//! A decision of the root program while it builds towers. Some of what stands is scattered, and the label becomes what
//! an expert would do there: the first demonstrated sub-task whose relation does not hold. Of a whole call, which a network
//! with a memory learns from, one decision is disturbed so; the repairs follow it, and then the rest of the call.
//!
//! # Invariants
//!
//! Nothing is known here of sizes and tables but what observations show: a relation holds when two slots are to each
//! other as the demonstration leaves them, and the table is where the lowest slot stands.

use rand::Rng;

use crate::robot::{GRASP_M, HOVER_M};
use crate::scene::SlotIndex;
use crate::trace::{ObservationRowMut, ObservationRows, Span};
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

/// A decision and what is seen at it, in one row.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Moment {
    pub(super) example: Example,
    pub(super) state: ObservationRows,
}

/// The decisions of a running root, or one of them, with a tower knocked over before one. Nothing happens where nothing
/// is built there.
pub(super) fn disturbed(sub_tasks: &[SubTask], mut moments: Vec<Moment>, rng: &mut impl Rng) -> Vec<Moment> {
    let at = if moments.len() > 1 { rng.random_range(0..moments.len()) } else { 0 };
    let Some(moment) = moments.get_mut(at) else { return moments };
    let before = moment.clone();
    let Moment { example, state } = moment;
    state.iter_mut().for_each(|mut row| knock_over(sub_tasks, example, &mut row, rng));
    if moments.len() > 1 && moments[at] != before {
        let repairs = repairs(sub_tasks, before, &moments[at]);
        moments.splice(at + 1..at + 1, repairs);
    }
    moments
}

/// What follows a repair that a disturbed moment begins: the other repairs, and last the moment before, at which nothing is
/// left to repair.
fn repairs(sub_tasks: &[SubTask], before: Moment, disturbed: &Moment) -> Vec<Moment> {
    let mut repaired = Vec::new();
    let mut state = disturbed.state.clone();
    let holds = |sub_task: &&SubTask, state: &ObservationRows| state.get(0).is_some_and(|row| sub_task.holds(row));
    let broken: Vec<&SubTask> = (sub_tasks.iter())
        .filter(|sub_task| holds(sub_task, &before.state) && !holds(sub_task, &disturbed.state))
        .collect();
    for (number, sub_task) in broken.iter().enumerate() {
        state.iter_mut().for_each(|row| put_back(sub_task, row.positions));
        let Some(next) = broken.get(number + 1) else { break };
        let mut example = before.example.clone();
        call(next, &mut example);
        repaired.push(Moment { example, state: state.clone() });
    }
    repaired.push(Moment { state, ..before });
    repaired
}

/// Puts a sub-task's source where it belongs. The gripper, which positions are relative to, has just let it go.
fn put_back(sub_task: &SubTask, positions: &mut [[f32; 3]]) {
    let [source, target] = [sub_task.source, sub_task.target].map(|slot| usize::from(slot.0));
    let place: [f32; 3] = std::array::from_fn(|axis| positions[target][axis] + sub_task.offset_m[axis]);
    positions[source] = place;
    let [x, y, z] = place;
    let gripper = [x, y, z + GRASP_M];
    positions.iter_mut().for_each(|position| (0..3).for_each(|axis| position[axis] -= gripper[axis]));
}

/// Makes a decision one that begins a sub-task.
fn call(sub_task: &SubTask, example: &mut Example) {
    let SubTask { program, source, part, .. } = sub_task;
    example.callee = *program;
    example.end_of_program = false;
    example.scope = Some(Span { begin: part.begin - example.window.begin, end: part.end - example.window.begin });
    example.next_move = Some(*source);
    example.last_decision = false;
}

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
    if let Some(next) = sub_tasks.iter().find(|sub_task| !sub_task.holds(state.as_row())) {
        call(next, example);
    }
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
    fn a_call_goes_on_where_it_was_disturbed_once_all_is_repaired() {
        let sub_tasks = sub_tasks();
        let flat =
            Observation { slots_m: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.2, 0.0, 0.0]], closed: false };
        let moment =
            |observation: &Observation, example| Moment { example, state: ObservationRows::of(4, [observation]) };
        let before = vec![moment(&flat, decision()), moment(&tower(), decision())];
        let mut lengths = [0; 5];
        for seed in 0..60 {
            let call = disturbed(&sub_tasks, before.clone(), &mut Seed(seed).rng());
            lengths[call.len()] += 1;
            let (last, repairs) = call[1..].split_last().unwrap();
            assert_eq!(call[0], before[0], "what came before stays");
            assert_eq!(last.example, before[1].example, "the call goes on");
            let row = last.state.get(0).unwrap();
            let height = |slot: usize| row.positions[slot][2] - row.positions[0][2];
            assert!((height(1) - 0.05).abs() < 1e-6 && (height(2) - 0.1).abs() < 1e-6, "the tower stands again");
            let repaired: Vec<_> = repairs.iter().map(|repair| repair.example.next_move.unwrap().0).collect();
            assert!([vec![1, 2], vec![2], vec![]].contains(&repaired), "{repaired:?}");
            if !repairs.is_empty() {
                let held = [0.0, 0.0, -GRASP_M];
                assert!((0..3).all(|axis| (row.positions[2][axis] - held[axis]).abs() < 1e-6), "just let go");
            }
        }
        assert!(lengths[2] > 0 && lengths[3] > 0 && lengths[4] > 0, "{lengths:?}");
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
