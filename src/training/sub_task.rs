//! A sub-task of a demonstration: what a callee of the root brings to what, and how they are to each other then.

use crate::program::Program;
use crate::scene::SlotIndex;
use crate::trace::{ObservationRow, Span};

/// How far a pair may be from where the demonstration leaves it, horizontally and in height, in metres.
const SAME_M: [f32; 2] = [0.045, 0.01];

/// A callee of the root that brings one slot to another.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SubTask {
    pub(super) program: Program,
    pub(super) source: SlotIndex,
    pub(super) target: SlotIndex,
    /// Its part of the demonstration.
    pub(super) part: Span,
    /// From the target to the source at its end, in metres.
    pub(super) offset_m: [f32; 3],
}

impl SubTask {
    /// Whether source and target are to each other as the demonstration leaves them.
    pub(super) fn holds(&self, state: ObservationRow<'_>) -> bool {
        let (source, target) = (state.position(self.source), state.position(self.target));
        let [x, y, z]: [f32; 3] = std::array::from_fn(|axis| source[axis] - target[axis] - self.offset_m[axis]);
        x.hypot(y) <= SAME_M[0] && z.abs() <= SAME_M[1]
    }
}
