//! The tables of texts that LeRobot counts tasks and sub-tasks by.

use std::path::Path;

use crate::dataset::files::layout;
use crate::dataset::schema::{SUBTASKS, TASKS};
use crate::table::{TableError, TableSchema, TableWriter, Values, WriteOptions};

/// Writes `meta/tasks.parquet`.
pub(crate) fn write_tasks(root: &Path, texts: &[String]) -> Result<(), TableError> {
    let metadata = pandas_index("task_index", "__index_level_0__", None);
    write_texts(root, layout::TASKS, TASKS, ["task_index", "__index_level_0__"], texts, metadata)
}

/// Writes `meta/subtasks.parquet`.
pub(crate) fn write_subtasks(root: &Path, texts: &[String]) -> Result<(), TableError> {
    let metadata = pandas_index("subtask_index", "subtask", Some("subtask"));
    write_texts(root, layout::SUBTASKS, SUBTASKS, ["subtask_index", "subtask"], texts, metadata)
}

fn write_texts(
    root: &Path,
    file: &str,
    schema: TableSchema,
    [number, text]: [&'static str; 2],
    texts: &[String],
    pandas: String,
) -> Result<(), TableError> {
    let options = WriteOptions { metadata: vec![("pandas".to_owned(), pandas)], ..WriteOptions::default() };
    let mut writer = TableWriter::create(&root.join(file), &schema, options)?;
    let numbers: Vec<i64> = (0..texts.len() as i64).collect();
    writer.write_row_group(&[(number, Values::Int64(&numbers)), (text, Values::Text(texts))])?;
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
