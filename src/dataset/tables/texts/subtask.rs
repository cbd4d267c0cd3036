//! Sub-tasks in words.

use crate::scene::SlotIndex;
use crate::trace::ProgramCall;

/// A call of the root with the slots that are moved to below it, in order of first use.
pub(crate) fn subtask_text<'s>(calls: &[ProgramCall], position: usize, name: impl Fn(usize) -> &'s str) -> String {
    let below = calls[position + 1..].iter().take_while(|call| call.depth > calls[position].depth);
    let mut arguments: Vec<SlotIndex> = Vec::new();
    for slot in below.filter_map(|call| call.argument) {
        if !arguments.contains(&slot) {
            arguments.push(slot);
        }
    }
    let names: Vec<&str> = arguments.iter().map(|slot| name(usize::from(slot.0))).collect();
    format!("{} {}", calls[position].program, names.join(" ")).trim_end().to_owned()
}
