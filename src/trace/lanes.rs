//! The stack of running programs over time: a lane for each depth.

use std::collections::BTreeMap;

use crate::program::Program;
use crate::trace::{Episode, ProgramCall};

/// The calls that take time, by depth and in order. A step that only ends its program takes none.
pub fn calls_by_depth(episode: &Episode) -> BTreeMap<u8, Vec<&ProgramCall>> {
    let mut by_depth: BTreeMap<u8, Vec<&ProgramCall>> = BTreeMap::new();
    for call in episode.calls.iter().filter(|call| call.program != Program::None) {
        by_depth.entry(call.depth).or_default().push(call);
    }
    by_depth
}
