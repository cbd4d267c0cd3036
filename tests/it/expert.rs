//! The expert's call trees.

use ntp::program::Program;
use ntp::task::Split;
use ntp::trace::{Outcome, Span};

use crate::kinematic::{cleanup, demonstration, sorting, tower, trial};

#[test]
fn a_stacking_demonstration_has_four_frames_a_goal_and_one_more() {
    let task = tower("three", &[2, 5, 0], Split::Seen);
    let episode = demonstration(&task, &trial(&task, 0, 1), 0);
    assert_eq!(episode.outcome, Outcome::Success);
    assert_eq!(episode.frames.len(), 4 * 2 + 1);
    assert_eq!(episode.calls.len(), 1 + 7 * 2 + 1);
}

#[test]
fn the_calls_of_one_goal_are_nested_as_in_the_paper() {
    let task = tower("two", &[1, 3], Split::Seen);
    let episode = demonstration(&task, &trial(&task, 0, 1), 0);
    let found: Vec<_> = episode.calls.iter().map(|call| (call.depth, call.program, call.frames)).collect();
    let span = |begin, end| Span { begin, end };
    let expected = [
        (0, Program::BlockStacking, span(0, 5)),
        (1, Program::PickAndPlace, span(0, 5)),
        (2, Program::Pick, span(0, 3)),
        (3, Program::MoveTo, span(0, 2)),
        (3, Program::Grip, span(1, 3)),
        (2, Program::Place, span(2, 5)),
        (3, Program::MoveTo, span(2, 4)),
        (3, Program::Release, span(3, 5)),
        (1, Program::None, span(4, 5)),
    ];
    assert_eq!(found, expected);
}

#[test]
fn sorting_visits_every_instance_of_every_category() {
    let task = sorting("map", [3, 3, 0, 1], Split::Seen);
    let episode = demonstration(&task, &trial(&task, 0, 3), 0);
    assert_eq!(episode.outcome, Outcome::Success);
    let n_drops = episode.calls.iter().filter(|call| call.program == Program::PickAndDrop).count();
    assert_eq!(n_drops, 12);
    assert_eq!(episode.frames.len(), 4 * 12 + 1);
}

#[test]
fn cleaning_up_stacks_the_bowls_in_order_and_puts_every_fork_into_the_last() {
    let task = cleanup("order", &[2, 0, 3], Split::Seen);
    assert_eq!(
        task.text(),
        "put bowl_3 on tray, then put bowl_1 on bowl_3, then put bowl_4 on bowl_1, then put every fork into bowl_4"
    );
    let episode = demonstration(&task, &trial(&task, 0, 5), 0);
    assert_eq!(episode.outcome, Outcome::Success);
    let sub_tasks: Vec<Program> =
        episode.calls.iter().filter(|call| call.depth == 1).map(|call| call.program).collect();
    let expected = [vec![Program::PickAndPlace; 3], vec![Program::PickAndDrop; 5], vec![Program::None]].concat();
    assert_eq!(sub_tasks, expected);
    assert_eq!(episode.calls[0].program, Program::TableCleanup);
    assert_eq!(episode.frames.len(), 4 * (3 + 5) + 1);
}
