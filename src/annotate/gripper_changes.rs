//! Between which key frames the gripper closes and opens, and what programs can be doing there.
//!
//! `grip` and `release` are the only primitives that change the gripper, and each ends the program that calls it. So a
//! demonstration shows where these programs end. What they are, and what they are about, is the policy's to say.

use crate::program::Program;
use crate::rollout::Allowed;
use crate::scene::SlotIndex;
use crate::trace::{ObservationRows, Span};

/// The changes of a demonstration's gripper, by the key frame at which each is done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct GripperChanges {
    changes: Vec<(u32, Program)>,
}

impl GripperChanges {
    /// Those of the states at key frames.
    pub(super) fn of(states: &ObservationRows) -> Self {
        let is_open: Vec<bool> = states.iter().map(|state| state.is_open()).collect();
        let change = |(before, now): (&bool, &bool)| match (before, now) {
            (true, false) => Some(Program::Grip),
            (false, true) => Some(Program::Release),
            _ => None,
        };
        let all = is_open.iter().zip(is_open.iter().skip(1)).zip(1..);
        Self { changes: all.filter_map(|(pair, frame)| Some((frame, change(pair)?))).collect() }
    }

    /// Whether there is none: then nothing is known of where programs end.
    pub(super) fn is_none(&self) -> bool {
        self.changes.is_empty()
    }

    /// Those that come after a frame, up to the end of a part.
    fn ahead(&self, at: u32, part: Span) -> &[(u32, Program)] {
        let begin = self.changes.partition_point(|&(frame, _)| frame <= at);
        let end = self.changes.partition_point(|&(frame, _)| frame < part.end);
        self.changes.get(begin..end).unwrap_or_default()
    }

    /// Whether there is one after a frame, up to the end of a part.
    pub(super) fn has_ahead(&self, at: u32, part: Span) -> bool {
        !self.ahead(at, part).is_empty()
    }

    /// The primitive that the next key frame is the end of; nothing where the gripper stays as it is.
    pub(super) fn next(&self, at: u32) -> Option<Program> {
        self.changes.iter().find(|(frame, _)| *frame == at + 1).map(|&(_, primitive)| primitive)
    }

    /// What a program that was given a part may do at a frame, with what is held. A part that a root gives ends with an
    /// empty hand, and nothing is brought to itself.
    pub(super) fn allowed(&self, at: u32, part: Span, running: Program, held: Option<SlotIndex>) -> Option<Allowed> {
        if self.is_none() {
            return None;
        }
        let ahead = self.ahead(at, part);
        let Some(&(_, first)) = ahead.first() else {
            let (programs, lasts) = (vec![Program::None], Vec::new());
            return Some(Allowed { programs, begin: at, lasts, not_argument: None });
        };
        let programs = match running.n_slots() {
            1 => vec![self.next(at).unwrap_or(Program::MoveTo)],
            0 => with_slots(2),
            _ => with_slots(1)
                .into_iter()
                .filter(|&program| (program == Program::Pick) == (first == Program::Grip))
                .collect(),
        };
        let lasts = ahead.iter().filter(|(_, primitive)| !running.is_root() || *primitive == Program::Release);
        Some(Allowed { programs, begin: at, lasts: lasts.map(|&(frame, _)| frame).collect(), not_argument: held })
    }
}

/// Composite programs about so many slots. A root calls those about two, what is moved and where to; these call those
/// about one of them; and these call primitives.
fn with_slots(n_slots: usize) -> Vec<Program> {
    Program::ALL.into_iter().filter(|program| program.is_composite() && program.n_slots() == n_slots).collect()
}

#[cfg(test)]
mod tests {
    use super::GripperChanges;
    use crate::program::Program;
    use crate::scene::SlotIndex;
    use crate::trace::{Observation, ObservationRows, Span};

    /// Two things are picked up and put down, with a move before each.
    fn changes() -> GripperChanges {
        let closed = [false, false, true, true, false, false, true, true, false];
        let states = closed.map(|closed| Observation { slots_m: vec![[0.0; 3]], closed });
        GripperChanges::of(&ObservationRows::of(1, &states))
    }

    #[test]
    fn a_root_gives_parts_that_end_when_the_hand_is_empty() {
        let allowed = |at: u32| changes().allowed(at, Span { begin: 0, end: 9 }, Program::ANY_ROOT, None).unwrap();
        assert_eq!((allowed(0).begin, &allowed(0).lasts[..]), (0, &[4, 8][..]));
        assert_eq!(allowed(0).programs, [Program::PickAndPlace, Program::PickAndDrop]);
        assert_eq!(allowed(4).lasts, [8]);
        assert_eq!(allowed(8).programs, [Program::None]);
    }

    #[test]
    fn a_callee_moves_until_the_gripper_changes_and_ends_with_its_part() {
        let part = Span { begin: 0, end: 5 };
        let allowed = |at: u32, running: Program| changes().allowed(at, part, running, None).unwrap();
        assert_eq!(allowed(0, Program::PickAndDrop).lasts, [2, 4]);
        assert_eq!(allowed(0, Program::PickAndDrop).programs, [Program::Pick]);
        assert_eq!(allowed(2, Program::PickAndDrop).programs, [Program::Place, Program::Drop]);
        let calls = |at: u32| allowed(at, Program::Pick).programs;
        assert_eq!([calls(0), calls(1), calls(3)], [[Program::MoveTo], [Program::Grip], [Program::Release]]);
        assert_eq!(allowed(4, Program::PickAndDrop).programs, [Program::None]);
    }

    #[test]
    fn what_is_held_is_not_where_it_is_brought_to() {
        let held = Some(SlotIndex(3));
        let allowed = changes().allowed(2, Span { begin: 2, end: 5 }, Program::Place, held).unwrap();
        assert_eq!((&allowed.programs[..], allowed.not_argument), (&[Program::MoveTo][..], held));
    }

    #[test]
    fn a_gripper_that_never_changes_says_nothing() {
        let still = vec![Observation { slots_m: vec![[0.0; 3]], closed: false }; 3];
        let changes = GripperChanges::of(&ObservationRows::of(1, &still));
        assert!(changes.is_none());
        assert_eq!(changes.allowed(0, Span { begin: 0, end: 3 }, Program::ANY_ROOT, None), None);
    }
}
