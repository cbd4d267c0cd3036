//! The texts of tasks and sub-tasks, whichever of the usual names their column has.

use std::path::Path;

use arrow::array::{Array as _, ArrayRef, AsArray as _};
use arrow::compute::cast;
use arrow::datatypes::{DataType, Int64Type};

use crate::dataset::edit::EditError;
use crate::dataset::files::layout;
use crate::table::BatchReader;

const BATCH_ROWS: usize = 8192;

/// Reads the tasks; `LeRobot` names the column of texts by the index of a pandas table.
pub(super) fn read_tasks(root: &Path) -> Result<Vec<String>, EditError> {
    read_texts(&root.join(layout::TASKS), "task_index", &["task", "__index_level_0__"])
}

/// Reads the sub-tasks.
pub(super) fn read_subtasks(root: &Path) -> Result<Vec<String>, EditError> {
    read_texts(&root.join(layout::SUBTASKS), "subtask_index", &["subtask", "__index_level_0__"])
}

/// Texts in the order of their numbers, which must be 0, 1 and so on.
fn read_texts(path: &Path, number: &str, names: &[&str]) -> Result<Vec<String>, EditError> {
    let refused = |problem: String| EditError::refused("import.texts", path, problem);
    let mut reader = BatchReader::open(path, BATCH_ROWS)?;
    let mut rows: Vec<(i64, String)> = Vec::new();
    while let Some(batch) = reader.next_batch()? {
        let text = names.iter().find_map(|name| batch.column_by_name(name));
        let text = text.ok_or_else(|| refused(format!("it has no column of texts; allowed: {}", names.join(", "))))?;
        let texts = cast(text, &DataType::Utf8).map_err(EditError::rows(path))?;
        let numbers = batch.column_by_name(number).and_then(|column| column.as_primitive_opt::<Int64Type>());
        let numbers = numbers.ok_or_else(|| refused(format!("it has no column {number} of int64")))?;
        let text_of = |texts: &ArrayRef, row: usize| Some(texts.as_string_opt::<i32>()?.value(row).to_owned());
        for row in 0..batch.num_rows() {
            let text = text_of(&texts, row).filter(|_| texts.is_valid(row) && numbers.is_valid(row));
            let text = text.ok_or_else(|| refused(format!("row {row} has no number or no text")))?;
            rows.push((numbers.value(row), text));
        }
    }
    rows.sort();
    if let Some((row, (found, _))) = rows.iter().enumerate().find(|(row, (number, _))| *number != *row as i64) {
        return Err(refused(format!("{number} {found} is there where {row} should be")));
    }
    Ok(rows.into_iter().map(|(_, text)| text).collect())
}
