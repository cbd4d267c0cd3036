//! The tables of texts that LeRobot counts tasks and sub-tasks by.

use std::path::Path;

use crate::dataset::files::layout;
use crate::dataset::tables::texts::{subtasks, tasks};
use crate::table::{DeclaredColumn as _, TableError, TableRows, TableWriter, WriteOptions};

/// Writes `meta/tasks.parquet`.
pub(crate) fn write_tasks(root: &Path, texts: &[String]) -> Result<(), TableError> {
    let mut rows = tasks::Rows::default();
    numbered(texts).for_each(|(task_index, text)| rows.push(tasks::Row { task_index, text: text.into() }));
    let pandas = pandas_index(tasks::column::task_index::NAME, tasks::column::text::NAME, None);
    write_texts(&root.join(layout::TASKS), &rows, pandas)
}

/// Writes `meta/subtasks.parquet`.
pub(crate) fn write_subtasks(root: &Path, texts: &[String]) -> Result<(), TableError> {
    let mut rows = subtasks::Rows::default();
    numbered(texts).for_each(|(subtask_index, text)| rows.push(subtasks::Row { subtask_index, text: text.into() }));
    let text = subtasks::column::text::NAME;
    let pandas = pandas_index(subtasks::column::subtask_index::NAME, text, Some(text));
    write_texts(&root.join(layout::SUBTASKS), &rows, pandas)
}

fn numbered(texts: &[String]) -> impl Iterator<Item = (i64, &str)> {
    (0..).zip(texts.iter().map(String::as_str))
}

fn write_texts<R: TableRows>(path: &Path, rows: &R, pandas: String) -> Result<(), TableError> {
    let options = WriteOptions { metadata: vec![("pandas".to_owned(), pandas)], ..R::SCHEMA.options() };
    let mut writer = TableWriter::create(path, &R::SCHEMA, options)?;
    writer.write_row_group(&rows.columns())?;
    writer.commit()
}

/// Key-value metadata that makes the text the index of the table in pandas: `LeRobot` takes a task's text from there,
/// and from a plain column would silently take the number of the row.
fn pandas_index(number: &str, text: &str, index_name: Option<&str>) -> String {
    let column = |name: Option<&str>, field: &str, pandas: &str, numpy: &str| {
        serde_json::json!({
            "name": name, "field_name": field, "pandas_type": pandas, "numpy_type": numpy, "metadata": null
        })
    };
    let columns = [column(Some(number), number, "int64", "int64"), column(index_name, text, "unicode", "object")];
    serde_json::json!({
        "index_columns": [text],
        "column_indexes": [],
        "columns": columns,
        "creator": {"library": "ntp", "version": env!("CARGO_PKG_VERSION")},
        "pandas_version": "2.2.0",
    })
    .to_string()
}
