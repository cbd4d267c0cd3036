//! The texts that frames refer to by numbers: tasks, and sub-tasks where there are any.

use std::path::Path;

use serde_json::Value;

use crate::dataset::DatasetError;
use crate::dataset::files::layout;
use crate::dataset::plain::arrays::{texts, whole_numbers};
use crate::dataset::plain::declared::PlainVersion;
use crate::dataset::plain::lines::json_lines;
use crate::table::BatchReader;

/// Task texts of older datasets, a line each.
const TASK_LINES: &str = "meta/tasks.jsonl";
/// Names that pandas gives an index, of which a text comes from.
const INDEX_NAMES: [&str; 2] = ["task", "__index_level_0__"];

/// Texts by their numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct PlainTexts {
    /// Texts by position of their row, with the number that the row gives.
    pub(crate) rows: Vec<(i64, String)>,
    /// Whether readers that go by pandas take the texts from where they are.
    pub(crate) is_indexed: bool,
}

impl PlainTexts {
    /// The text of a number.
    pub(crate) fn get(&self, number: i64) -> Option<&str> {
        let at = usize::try_from(number).ok().and_then(|at| self.rows.get(at)).filter(|(found, _)| *found == number);
        let row = at.or_else(|| self.rows.iter().find(|(found, _)| *found == number));
        row.map(|(_, text)| text.as_str())
    }

    /// The number of a text.
    pub(crate) fn number(&self, text: &str) -> Option<i64> {
        self.rows.iter().find(|(_, of)| of == text).map(|(number, _)| *number)
    }

    /// Texts in the order of their numbers from 0, as far as they go without a gap.
    pub(crate) fn in_order(&self) -> Vec<String> {
        (0..).map_while(|number| self.get(number).map(ToOwned::to_owned)).collect()
    }
}

/// The task texts.
pub(crate) fn read_tasks(root: &Path, version: PlainVersion) -> Result<PlainTexts, DatasetError> {
    if !version.is_by_episode() {
        return read_table(&root.join(layout::TASKS), "task_index", &INDEX_NAMES);
    }
    let path = root.join(TASK_LINES);
    let rows = json_lines(&path, |row, line| {
        let number = line["task_index"].as_i64().ok_or_else(|| "task_index is no whole number".to_owned())?;
        let text = line["task"].as_str().ok_or_else(|| format!("row {row} has no text `task`"))?;
        Ok((number, text.to_owned()))
    })?;
    Ok(PlainTexts { rows, is_indexed: true })
}

/// The texts of sub-tasks; `None` where there are none.
pub(crate) fn read_subtasks(root: &Path) -> Result<Option<PlainTexts>, DatasetError> {
    let path = root.join(layout::SUBTASKS);
    if !path.is_file() {
        return Ok(None);
    }
    read_table(&path, "subtask_index", &["subtask", "__index_level_0__"]).map(Some)
}

/// A table of numbers and texts; the text is a column of one of these names.
fn read_table(path: &Path, number: &str, names: &[&str]) -> Result<PlainTexts, DatasetError> {
    let mut reader = BatchReader::open(path, 8192)?;
    let pandas = reader.metadata("pandas").and_then(|json| serde_json::from_str::<Value>(json).ok());
    let index = pandas.as_ref().and_then(|pandas| pandas["index_columns"][0].as_str().map(ToOwned::to_owned));
    let fields = reader.schema().fields().clone();
    let is_there = |name: &str| fields.iter().any(|field| field.name() == name);
    let name = index.clone().filter(|name| is_there(name));
    let name = name.or_else(|| names.iter().find(|name| is_there(name)).map(|name| (*name).to_owned()));
    let wrong = |problem: String| DatasetError::Count { path: path.to_owned(), problem };
    let name = name.ok_or_else(|| wrong(format!("it has no column of texts: none of {}", names.join(", "))))?;
    let mut rows = Vec::new();
    while let Some(batch) = reader.next_batch()? {
        let numbers = whole_numbers(&batch, number);
        let numbers = numbers.ok_or_else(|| wrong(format!("it has no column {number} of whole numbers")))?;
        let texts = texts(&batch, &name).ok_or_else(|| wrong(format!("its column {name} is not of texts")))?;
        rows.extend(numbers.into_iter().zip(texts));
    }
    Ok(PlainTexts { rows, is_indexed: index.as_deref() == Some(name.as_str()) })
}
