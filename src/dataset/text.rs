//! Texts that occur again and again, each kept once.

use std::collections::BTreeMap;

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

/// Texts with their numbers, in order of first use.
#[derive(Clone, Debug, Default)]
pub(crate) struct TextTable {
    texts: Vec<String>,
    keys: BTreeMap<String, u32>,
}

impl TextTable {
    /// The number of a text; a new one is added.
    pub(crate) fn key(&mut self, text: &str) -> u32 {
        if let Some(&key) = self.keys.get(text) {
            return key;
        }
        let key = self.texts.len() as u32;
        self.texts.push(text.to_owned());
        self.keys.insert(text.to_owned(), key);
        key
    }

    /// The texts in order of their numbers.
    pub(crate) fn texts(&self) -> &[String] {
        &self.texts
    }
}
