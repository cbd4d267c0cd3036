//! The rules of a task set, one function a rule.

use std::collections::BTreeMap;

use crate::scene::SlotIndex;
use crate::task::{Condition, Family, Goal, Room, SlotKind, Split, Task, TaskSet, TaskSetError};

/// See [`TaskSet::validate`].
pub(super) fn check(set: &TaskSet) -> Result<(), TaskSetError> {
    check_ids(&set.tasks)?;
    for (task_idx, task) in set.tasks.iter().enumerate() {
        if task.family != set.family {
            return Err(TaskSetError::OtherFamily { task: task_idx, found: task.family, expected: set.family });
        }
        check_task(task_idx, task)?;
    }
    check_split(&set.tasks)
}

fn check_ids(tasks: &[Task]) -> Result<(), TaskSetError> {
    let mut places = BTreeMap::new();
    for (second, task) in tasks.iter().enumerate() {
        if let Some(first) = places.insert(&task.id, second) {
            return Err(TaskSetError::DuplicateId { id: task.id.clone(), first, second });
        }
    }
    Ok(())
}

fn check_task(task_idx: usize, task: &Task) -> Result<(), TaskSetError> {
    for (what, is_empty) in [("goals", task.goals.is_empty()), ("conditions", task.conditions.is_empty())] {
        if is_empty {
            return Err(TaskSetError::Empty { task: task_idx, what });
        }
    }
    check_slots(task_idx, task)?;
    check_blocks(task_idx, task)?;
    check_moves(task_idx, task)?;
    check_towers(task_idx, task)?;
    let brought: Vec<Condition> = task.goals.iter().map(|&goal| goal.brings_about(task.family)).collect();
    match task.conditions.iter().position(|condition| !brought.contains(condition)) {
        Some(at) => Err(TaskSetError::ConditionWithoutGoal { place: format!("tasks[{task_idx}].conditions[{at}]") }),
        None => Ok(()),
    }
}

fn goal_place(task_idx: usize, goal_idx: usize) -> String {
    format!("tasks[{task_idx}].goals[{goal_idx}]")
}

fn check_slots(task_idx: usize, task: &Task) -> Result<(), TaskSetError> {
    for (goal_idx, goal) in task.goals.iter().enumerate() {
        let place = goal_place(task_idx, goal_idx);
        let place_of = |part| format!("{place}.{part}");
        check_slot(task.family, place_of("source"), goal.source, |kind| kind.brings_about.is_some())?;
        check_slot(task.family, place_of("target"), goal.target, |kind| kind.room != Room::Nothing)?;
        if goal.source == goal.target {
            let slot = task.family.slot_name(goal.source).to_owned();
            return Err(TaskSetError::OwnTarget { place, slot });
        }
    }
    Ok(())
}

fn check_slot(family: Family, place: String, slot: SlotIndex, fits: fn(&SlotKind) -> bool) -> Result<(), TaskSetError> {
    let Some(kind) = family.kind(slot) else {
        return Err(TaskSetError::SlotOutOfRange { place, slot, n_slots: family.n_slots() });
    };
    if fits(kind) {
        return Ok(());
    }
    let fitting: Vec<&str> = family.kinds().iter().filter(|kind| fits(kind)).map(|kind| kind.name).collect();
    let (slot, expected) = (family.slot_name(slot).to_owned(), fitting.join(" or "));
    Err(TaskSetError::WrongKind { place, slot, expected })
}

/// What a task moves must be within reach.
fn check_blocks(task_idx: usize, task: &Task) -> Result<(), TaskSetError> {
    let Some(blocks) = task.blocks else { return Ok(()) };
    let most = task.family.max_blocks().unwrap_or(0);
    if !(2..most).contains(&blocks) {
        return Err(TaskSetError::Blocks { task: task_idx, blocks, family: task.family });
    }
    for (goal_idx, goal) in task.goals.iter().enumerate() {
        if let Some(slot) = [goal.source, goal.target].into_iter().find(|slot| slot.0 >= blocks) {
            let slot = task.family.slot_name(slot).to_owned();
            return Err(TaskSetError::Aside { place: goal_place(task_idx, goal_idx), slot, blocks });
        }
    }
    Ok(())
}

fn check_moves(task_idx: usize, task: &Task) -> Result<(), TaskSetError> {
    for (goal_idx, goal) in task.goals.iter().enumerate() {
        if let Some(first) = task.goals[..goal_idx].iter().position(|earlier| earlier.source == goal.source) {
            let slot = task.family.slot_name(goal.source).to_owned();
            return Err(TaskSetError::MovedTwice { place: goal_place(task_idx, goal_idx), slot, first });
        }
    }
    Ok(())
}

fn check_towers(task_idx: usize, task: &Task) -> Result<(), TaskSetError> {
    let name = |slot: SlotIndex| task.family.slot_name(slot).to_owned();
    for (goal_idx, goal) in task.goals.iter().enumerate() {
        if task.family.kind(goal.target).is_some_and(|kind| matches!(kind.room, Room::Many { .. })) {
            continue;
        }
        let place = || goal_place(task_idx, goal_idx);
        if let Some(first) = task.goals[..goal_idx].iter().position(|earlier| earlier.target == goal.target) {
            return Err(TaskSetError::TargetTaken { place: place(), slot: name(goal.target), first });
        }
    }
    if let Some(ring) = ring(&task.goals) {
        return Err(TaskSetError::Cycle { task: task_idx, slots: ring.into_iter().map(name).collect() });
    }
    for (goal_idx, goal) in task.goals.iter().enumerate() {
        if let Some(offset) = task.goals[goal_idx..].iter().position(|later| later.source == goal.target) {
            let place = goal_place(task_idx, goal_idx);
            return Err(TaskSetError::TargetMovedLater { place, slot: name(goal.target), later: goal_idx + offset });
        }
    }
    Ok(())
}

/// The first ring of bodies that stand on each other. Each stands on one at most, so walking down ends on the
/// table or in a ring.
fn ring(goals: &[Goal]) -> Option<Vec<SlotIndex>> {
    let below = |slot: SlotIndex| goals.iter().find(|goal| goal.source == slot).map(|goal| goal.target);
    goals.iter().find_map(|goal| {
        let walk: Vec<SlotIndex> =
            std::iter::successors(Some(goal.source), |&slot| below(slot)).take(goals.len() + 1).collect();
        let length = walk.iter().skip(1).position(|&slot| slot == goal.source)? + 1;
        Some(walk[..length].to_vec())
    })
}

fn check_split(tasks: &[Task]) -> Result<(), TaskSetError> {
    let mut seen: BTreeMap<Vec<Condition>, usize> = BTreeMap::new();
    let mut met_unseen = false;
    for (task_idx, task) in tasks.iter().enumerate() {
        match task.split {
            Split::Seen if met_unseen => return Err(TaskSetError::SeenAfterUnseen { task: task_idx }),
            Split::Seen => {
                seen.entry(task.canonical_goal()).or_insert(task_idx);
            }
            Split::Unseen => {
                met_unseen = true;
                if let Some(&twin) = seen.get(&task.canonical_goal()) {
                    let (unseen_id, seen_id) = (task.id.clone(), tasks[twin].id.clone());
                    return Err(TaskSetError::SplitLeak { unseen: task_idx, unseen_id, seen: twin, seen_id });
                }
            }
        }
    }
    Ok(())
}
