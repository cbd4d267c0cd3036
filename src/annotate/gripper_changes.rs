//! Between which key frames the gripper closes and opens, and what programs can be doing there.
//!
//! `grip` and `release` are the only primitives that change the gripper, and each ends the program that calls it. So a
//! demonstration shows where these programs end. What they are, and what they are about, is the policy's to say.

use crate::program::Program;
use crate::rollout::Allowed;
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

    /// What a program that was given a part may do at a frame. A part that a root gives ends with an empty hand.
    pub(super) fn allowed(&self, at: u32, part: Span, is_root: bool) -> Option<Allowed> {
        if self.is_none() {
            return None;
        }
        let ahead = self.ahead(at, part);
        if ahead.is_empty() {
            return Some(Allowed { programs: vec![Program::None], begin: at, lasts: Vec::new() });
        }
        let parts = Program::ALL.into_iter().filter(|program| program.is_composite() && !program.is_root());
        let primitive = (!is_root).then(|| self.next(at).unwrap_or(Program::MoveTo));
        let releases = ahead.iter().filter(|(_, primitive)| !is_root || *primitive == Program::Release);
        let lasts = releases.map(|&(frame, _)| frame).collect();
        Some(Allowed { programs: parts.chain(primitive).collect(), begin: at, lasts })
    }
}

#[cfg(test)]
mod tests {
    use super::GripperChanges;
    use crate::program::Program;
    use crate::trace::{Observation, ObservationRows, Span};

    /// Two things are picked up and put down, with a move before each.
    fn changes() -> GripperChanges {
        let closed = [false, false, true, true, false, false, true, true, false];
        let states = closed.map(|closed| Observation { slots_m: vec![[0.0; 3]], closed });
        GripperChanges::of(&ObservationRows::of(1, &states))
    }

    #[test]
    fn a_root_gives_parts_that_end_when_the_hand_is_empty() {
        let whole = Span { begin: 0, end: 9 };
        let allowed = changes().allowed(0, whole, true).unwrap();
        assert_eq!((allowed.begin, &allowed.lasts[..]), (0, &[4, 8][..]));
        assert!(!allowed.programs.contains(&Program::None) && !allowed.programs.contains(&Program::MoveTo));
        assert_eq!(changes().allowed(4, whole, true).unwrap().lasts, [8]);
        assert_eq!(changes().allowed(8, whole, true).unwrap().programs, [Program::None]);
    }

    #[test]
    fn a_callee_moves_until_the_gripper_changes_and_ends_with_its_part() {
        let part = Span { begin: 0, end: 5 };
        let allowed = |at: u32| changes().allowed(at, part, false).unwrap();
        assert_eq!(allowed(0).lasts, [2, 4]);
        let primitives = |at: u32| {
            let programs = allowed(at).programs.into_iter();
            programs.filter(|program| program.is_primitive()).collect::<Vec<_>>()
        };
        assert_eq!(primitives(0), [Program::MoveTo]);
        assert_eq!(primitives(1), [Program::Grip]);
        assert_eq!(primitives(3), [Program::Release]);
        assert_eq!(allowed(4).programs, [Program::None]);
    }

    #[test]
    fn a_gripper_that_never_changes_says_nothing() {
        let still = vec![Observation { slots_m: vec![[0.0; 3]], closed: false }; 3];
        let changes = GripperChanges::of(&ObservationRows::of(1, &still));
        assert!(changes.is_none());
        assert_eq!(changes.allowed(0, Span { begin: 0, end: 3 }, true), None);
    }
}
