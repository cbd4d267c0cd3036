//! What is told of labels that models made, carried on to what is made of them.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use crate::artifact::{IoError, read_json, write_json};
use crate::dataset::files::layout;

/// Writes what the first source tells that tells anything, and adds the file to `files`. Episodes have other numbers
/// now, so the doubtful ones are not listed any more; `calls.confidence` still tells of each. What was measured is told
/// of one source alone: of several together nothing was.
pub(super) fn carry(roots: &[PathBuf], to: &Path, files: &mut Vec<String>) -> Result<(), IoError> {
    let told = roots.iter().map(|root| root.join(layout::ANNOTATION)).filter(|path| path.is_file());
    let told: Vec<Map<String, Value>> = told.map(|path| read_json(&path)).collect::<Result<_, _>>()?;
    let n_told = told.len();
    let models = told.iter().filter_map(|told| told.get("models")?.as_array()).flatten().cloned().collect();
    let Some(mut carried) = told.into_iter().next() else { return Ok(()) };
    carried.insert("models".to_owned(), Value::Array(models));
    carried.remove("doubtful");
    if n_told > 1 {
        carried.remove("measured");
    }
    write_json(&to.join(layout::ANNOTATION), &carried)?;
    files.push(layout::ANNOTATION.to_owned());
    files.sort_unstable();
    Ok(())
}
