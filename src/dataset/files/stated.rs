//! Statistics as others state them: in JSON that may have NaN and Infinity, which no JSON has.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use crate::artifact::{IoError, read};

/// What Python writes of numbers that are none.
const NO_NUMBERS: [&str; 3] = ["-Infinity", "Infinity", "NaN"];

/// Reads `meta/stats.json`, by feature. Numbers that are none are null; a feature with one is of no use to a reader, and
/// is left out.
///
/// # Errors
///
/// When the file cannot be read, or is no JSON for other reasons.
pub(crate) fn read_statistics(path: &Path) -> Result<Map<String, Value>, IoError> {
    let text = String::from_utf8_lossy(&read(path)?).into_owned();
    let all: Map<String, Value> = parse(&text).map_err(|source| IoError::Json { path: path.to_owned(), source })?;
    Ok(all.into_iter().filter(|(_, of)| is_of_numbers(of)).collect())
}

/// Reads JSON in which numbers that are none are null.
pub(crate) fn parse<T: DeserializeOwned>(text: &str) -> Result<T, serde_json::Error> {
    serde_json::from_str(text).or_else(|error| {
        let without = without_no_numbers(text);
        if without == text { Err(error) } else { serde_json::from_str(&without) }
    })
}

/// Whether nothing in it is null.
pub(crate) fn is_of_numbers(of: &Value) -> bool {
    match of {
        Value::Null => false,
        Value::Array(items) => items.iter().all(is_of_numbers),
        Value::Object(map) => map.values().all(is_of_numbers),
        Value::Bool(_) | Value::Number(_) | Value::String(_) => true,
    }
}

/// The text with null for what Python writes of numbers that are none; strings stay.
fn without_no_numbers(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let (mut rest, mut is_string) = (text, false);
    while let Some(letter) = rest.chars().next() {
        let word = NO_NUMBERS.into_iter().find(|word| !is_string && rest.starts_with(word));
        // What is escaped in a string ends none.
        let length = match (word, letter) {
            (Some(word), _) => word.len(),
            (None, '\\') if is_string => 1 + rest[1..].chars().next().map_or(0, char::len_utf8),
            (None, _) => letter.len_utf8(),
        };
        is_string ^= letter == '"';
        out.push_str(if word.is_some() { "null" } else { &rest[..length] });
        rest = &rest[length..];
    }
    out
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::{is_of_numbers, parse};

    #[test]
    fn numbers_that_are_none_are_null_and_strings_stay() {
        let text = r#"{"a \"NaN": [NaN, -Infinity, 1.5], "b": "Infinity \\"}"#;
        let value: Value = parse(text).unwrap();
        assert_eq!(value, json!({ "a \"NaN": [null, null, 1.5], "b": "Infinity \\" }));
        assert!(!is_of_numbers(&value["a \"NaN"]) && is_of_numbers(&json!([[1.0], [2]])));
        assert!(parse::<Value>("{\"a\": nan}").is_err());
    }
}
