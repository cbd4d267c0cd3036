//! Texts that occur again and again, each kept once.

use std::collections::BTreeMap;

/// Texts with their numbers, in order of first use.
#[derive(Clone, Debug, Default, PartialEq)]
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
