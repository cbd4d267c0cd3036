//! Texts that occur again and again, each kept once.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::array::{ArrayRef, DictionaryArray, Int32Array, StringArray};
use arrow::datatypes::Int32Type;
use arrow::error::ArrowError;

/// Texts with their numbers, in order of first use.
#[derive(Clone, Debug, Default)]
pub(crate) struct TextTable {
    texts: Vec<String>,
    keys: BTreeMap<String, i32>,
}

impl TextTable {
    /// The number of a text; a new one is added.
    pub(crate) fn key(&mut self, text: &str) -> i32 {
        if let Some(&key) = self.keys.get(text) {
            return key;
        }
        let key = self.texts.len() as i32;
        self.texts.push(text.to_owned());
        self.keys.insert(text.to_owned(), key);
        key
    }

    /// The texts in order of their numbers.
    pub(crate) fn texts(&self) -> &[String] {
        &self.texts
    }

    /// A column of texts by their numbers.
    pub(crate) fn column(&self, keys: Int32Array) -> Result<ArrayRef, ArrowError> {
        let values = StringArray::from_iter_values(&self.texts);
        Ok(Arc::new(DictionaryArray::<Int32Type>::try_new(keys, Arc::new(values))?))
    }
}
