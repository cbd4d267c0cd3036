//! Files of JSON, an object a line, as older datasets have them.

use std::io::{BufRead as _, BufReader};
use std::path::Path;

use serde_json::Value;

use crate::artifact::{self, IoError};
use crate::dataset::DatasetError;

/// Takes each line that is not empty; what is wrong with one is named by its row, from 0.
pub(crate) fn json_lines<T>(
    path: &Path,
    mut take: impl FnMut(u64, &Value) -> Result<T, String>,
) -> Result<Vec<T>, DatasetError> {
    let file = artifact::open(path)?;
    let mut taken = Vec::new();
    for line in BufReader::new(file).lines() {
        let line = line.map_err(IoError::system("read", path))?;
        if line.trim().is_empty() {
            continue;
        }
        let row = taken.len() as u64;
        let wrong = |problem: String| DatasetError::Row { path: path.to_owned(), row, problem };
        let value: Value = serde_json::from_str(&line).map_err(|error| wrong(format!("no JSON: {error}")))?;
        taken.push(take(row, &value).map_err(wrong)?);
    }
    Ok(taken)
}
