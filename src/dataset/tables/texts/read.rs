//! The tables of texts read back, and what frames say of them.

use std::collections::BTreeSet;
use std::path::Path;

use crate::dataset::DatasetError;
use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::tables::texts::{subtasks, tasks};
use crate::table::{self, TableReader};
use crate::words::or_nothing;

/// Texts that frames refer to, and the range that observations should have. Empty where they could not be read.
#[derive(Default)]
pub(crate) struct Texts {
    pub(crate) tasks: Vec<String>,
    subtasks: Vec<String>,
    pub(crate) state_range: Option<(Vec<f64>, Vec<f64>)>,
}

impl Texts {
    /// What is wrong with a frame's task.
    pub(crate) fn task_problem(&self, task_index: i64, expected: &str) -> Option<String> {
        let text = usize::try_from(task_index).ok().and_then(|index| self.tasks.get(index));
        let is_known = self.tasks.is_empty() || text.is_some_and(|text| text == expected);
        (!is_known)
            .then(|| format!("task_index {task_index} is {}, but the episode's task is {expected:?}", or_nothing(text)))
    }

    /// What is wrong with a frame's sub-task, when it should have this text, or none.
    pub(crate) fn named_subtask_problem(&self, subtask_index: i64, expected: Option<&str>) -> Option<String> {
        let text = usize::try_from(subtask_index).ok().map(|index| self.subtasks.get(index).map(String::as_str));
        let is_right = text.map_or(expected.is_none(), |text| text.is_some() && text == expected);
        (!is_right).then(|| {
            let text = text.flatten();
            format!("subtask_index {subtask_index} is {}, but the call is {}", or_nothing(text), or_nothing(expected))
        })
    }

    /// What is wrong with a frame's sub-task.
    pub(crate) fn subtask_problem(&self, subtask_index: i64) -> Option<String> {
        let n_subtasks = self.subtasks.len();
        let is_known = n_subtasks == 0 || usize::try_from(subtask_index).is_ok_and(|index| index < n_subtasks);
        (!is_known).then(|| format!("subtask_index is {subtask_index}, but there are {n_subtasks}"))
    }
}

/// Reads the texts that frames refer to.
pub(crate) fn read_all_texts(root: &Path, validation: &mut Validation) -> Texts {
    let mut texts = Texts::default();
    let mut note = |result: Result<(), DatasetError>| {
        if let Err(error) = result {
            validation.failed("meta.row", &error);
        }
    };
    let tasks = read_texts(root, layout::TASKS, &tasks::SCHEMA, ["task_index", "__index_level_0__"]);
    note(tasks.map(|tasks| texts.tasks = tasks));
    let subtasks = read_texts(root, layout::SUBTASKS, &subtasks::SCHEMA, ["subtask_index", "subtask"]);
    note(subtasks.map(|subtasks| texts.subtasks = subtasks));
    for (file, schema, text) in
        [(layout::TASKS, &tasks::SCHEMA, "__index_level_0__"), (layout::SUBTASKS, &subtasks::SCHEMA, "subtask")]
    {
        check_pandas_index(root, file, schema, text, validation);
    }
    texts
}

/// Reads a table of texts, whose rows must be in order of their numbers: readers take them by position.
fn read_texts(
    root: &Path,
    file: &str,
    schema: &table::TableSchema,
    [number, text]: [&str; 2],
) -> Result<Vec<String>, DatasetError> {
    let path = root.join(file);
    let mut columns = table::read(&path, schema)?;
    let numbers = columns.int64(number)?;
    let texts = columns.text(text)?;
    let row_error = |row: usize, problem: String| DatasetError::Row { path: path.clone(), row: row as u64, problem };
    if let Some((row, found)) = numbers.iter().enumerate().find(|(row, number)| **number != *row as i64) {
        return Err(row_error(row, format!("{number} is {found}, but should be {row}")));
    }
    let mut seen = BTreeSet::new();
    if let Some((row, text)) = texts.iter().enumerate().find(|(_, text)| !seen.insert(text.as_str())) {
        return Err(row_error(row, format!("the text {text:?} is there twice")));
    }
    Ok(texts)
}

/// Checks that pandas makes the text the index of the table: `LeRobot` takes it from there.
fn check_pandas_index(root: &Path, file: &str, schema: &table::TableSchema, text: &str, validation: &mut Validation) {
    let path = root.join(file);
    let reader = match TableReader::open_columns(&path, schema, &[text]) {
        Ok(reader) => reader,
        Err(error) => return validation.failed_once("tasks.index", &error.into()),
    };
    let pandas = reader.metadata("pandas").and_then(|json| serde_json::from_str::<serde_json::Value>(json).ok());
    if pandas.is_none_or(|pandas| pandas["index_columns"] != serde_json::json!([text])) {
        let message =
            format!("pandas metadata does not make {text:?} the index: LeRobot would take row numbers for texts");
        validation.error("tasks.index", &path, String::new(), message);
    }
}
