//! Parquet tables: what is written is read, and what does not fit its schema is named.

use std::path::Path;

use ntp::table::{Column, ColumnKind, ColumnSpec, Form, TableError, TableSchema, Value, read, write};
use ntp::training::METRICS;

const fn column(name: &'static str, form: Form, value: Value) -> ColumnSpec {
    ColumnSpec::new(name, ColumnKind { value, form }, "")
}

const EVERY_KIND: TableSchema = TableSchema::new(
    "every_kind",
    "",
    &[
        column("a.whole", Form::Required, Value::Int64),
        column("a/whole_or_not", Form::Optional, Value::Int64),
        column("b", Form::Required, Value::Float32),
        column("b_or_not", Form::Optional, Value::Float32),
        column("c", Form::Required, Value::Float64),
        column("c_or_not", Form::Optional, Value::Float64),
        column("d", Form::Required, Value::Boolean),
        column("e", Form::Required, Value::Text),
        column("e_or_not", Form::Optional, Value::Text),
        column("f", Form::List, Value::Int64),
        column("g", Form::List, Value::Float32),
        column("h", Form::List, Value::Float64),
        column("i", Form::List, Value::Text),
    ],
);

fn every_kind() -> Vec<(&'static str, Column)> {
    let text = |words: &[&str]| words.iter().map(|&word| word.to_owned()).collect::<Vec<_>>();
    vec![
        ("a.whole", Column::Int64(vec![i64::MIN, 0, i64::MAX])),
        ("a/whole_or_not", Column::OptionalInt64(vec![None, Some(-1), None])),
        ("b", Column::Float32(vec![f32::MIN_POSITIVE, -0.0, 1.0e30])),
        ("b_or_not", Column::OptionalFloat32(vec![Some(0.1), None, Some(0.3)])),
        ("c", Column::Float64(vec![0.1, 0.2, 0.3])),
        ("c_or_not", Column::OptionalFloat64(vec![None, None, None])),
        ("d", Column::Boolean(vec![true, false, true])),
        ("e", Column::Text(text(&["", "ü", "a\nb"]))),
        ("e_or_not", Column::OptionalText(vec![Some(String::new()), None, Some("x".to_owned())])),
        ("f", Column::Int64List(vec![vec![], vec![1, 2], vec![3]])),
        ("g", Column::Float32List(vec![vec![0.5], vec![], vec![0.25, 0.125]])),
        ("h", Column::Float64List(vec![vec![], vec![], vec![]])),
        ("i", Column::TextList(vec![text(&["p", "q"]), vec![], text(&[""])])),
    ]
}

fn metrics(steps: &[i64]) -> Vec<(&'static str, Column)> {
    let n_rows = steps.len();
    vec![
        ("step", Column::Int64(steps.to_vec())),
        ("level", Column::Text(vec!["pick".to_owned(); n_rows])),
        ("loss_program", Column::OptionalFloat32(vec![Some(0.5); n_rows])),
        ("loss_end", Column::OptionalFloat32(vec![None; n_rows])),
        ("loss_scope", Column::OptionalFloat32(vec![None; n_rows])),
        ("loss_argument", Column::OptionalFloat32(vec![None; n_rows])),
        ("loss_total", Column::OptionalFloat32(vec![Some(1.5); n_rows])),
        ("learning_rate", Column::Float32(vec![1e-3; n_rows])),
        ("examples", Column::Int64(vec![32; n_rows])),
    ]
}

fn owned(columns: Vec<(&str, Column)>) -> Vec<(String, Column)> {
    columns.into_iter().map(|(name, column)| (name.to_owned(), column)).collect()
}

#[track_caller]
fn refused(path: &Path, schema: &TableSchema, columns: Vec<(&str, Column)>, expected: &str) {
    let error = write(path, schema, columns).unwrap_err().to_string();
    assert!(error.ends_with(expected), "{error:?} does not end with {expected:?}");
    assert!(error.starts_with(&path.display().to_string()));
    assert!(!path.exists());
}

#[test]
fn every_kind_of_column_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep/er/table.parquet");
    write(&path, &EVERY_KIND, every_kind()).unwrap();
    let columns = read(&path, &EVERY_KIND).unwrap();
    assert_eq!(columns.n_rows(), 3);
    assert_eq!(columns.into_inner(), owned(every_kind()));
}

#[test]
fn a_table_without_rows_is_read_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.parquet");
    write(&path, &METRICS, metrics(&[])).unwrap();
    assert_eq!(read(&path, &METRICS).unwrap().into_inner(), owned(metrics(&[])));
}

#[test]
fn order_of_columns_does_not_matter_and_equal_columns_give_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let paths = ["a.parquet", "b.parquet"].map(|name| folder.path().join(name));
    let mut columns = metrics(&[1, 2, 3]);
    write(&paths[0], &METRICS, columns.clone()).unwrap();
    columns.reverse();
    write(&paths[1], &METRICS, columns).unwrap();
    assert_eq!(std::fs::read(&paths[0]).unwrap(), std::fs::read(&paths[1]).unwrap());
}

#[test]
fn columns_that_differ_from_the_schema_are_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("metrics.parquet");
    let schema = METRICS;
    let mut columns = metrics(&[1]);
    columns.remove(0);
    refused(&path, &schema, columns, r#"column "step" is missing (schema metrics: int64)"#);
    let mut columns = metrics(&[1]);
    columns.push(("extra", Column::Int64(vec![1])));
    refused(&path, &schema, columns, r#"column "extra" is not in schema metrics, or is given twice"#);
    let mut columns = metrics(&[1]);
    columns[0].1 = Column::Float64(vec![1.0]);
    refused(&path, &schema, columns, r#"column "step" is float64, but schema metrics says int64"#);
    let mut columns = metrics(&[1]);
    columns[8].1 = Column::Int64(vec![1, 2]);
    refused(&path, &schema, columns, r#"column "examples" has 2 rows, but the others have 1"#);
}

#[test]
fn a_column_that_is_missing_or_another_is_named_with_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("metrics.parquet");
    const STEP: ColumnSpec = column("step", Form::Required, Value::Int64);
    const NUMBER: ColumnSpec = column("new", Form::Required, Value::Int64);
    const OTHER: TableSchema =
        TableSchema::new("other", "", &[STEP, column("level", Form::Required, Value::Int64), NUMBER]);
    write(&path, &METRICS, metrics(&[1, 2])).unwrap();
    let error = read(&path, &OTHER).unwrap_err().to_string();
    assert_eq!(error, format!(r#"{}: column "level" is text, but schema other says int64"#, path.display()));
    const NEW: TableSchema = TableSchema::new("new", "", &[STEP, NUMBER]);
    let error = read(&path, &NEW).unwrap_err().to_string();
    assert_eq!(error, format!(r#"{}: column "new" is missing (schema new: int64)"#, path.display()));
}

#[test]
fn a_later_column_is_null_in_a_file_that_lacks_it_and_no_other_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("metrics.parquet");
    write(&path, &METRICS, metrics(&[1, 2])).unwrap();
    const STEP: ColumnSpec = column("step", Form::Required, Value::Int64);
    const LATER: TableSchema = TableSchema::new(
        "later",
        "",
        &[
            STEP,
            column("robot", Form::Optional, Value::Text).later(),
            column("goals", Form::Optional, Value::Int64).later(),
            column("share", Form::Optional, Value::Float64).later(),
        ],
    );
    let mut columns = read(&path, &LATER).unwrap();
    assert_eq!(columns.n_rows(), 2);
    assert_eq!(columns.int64("step").unwrap(), [1, 2]);
    assert_eq!(columns.optional_text("robot").unwrap(), [None, None]);
    assert_eq!(columns.optional_int64("goals").unwrap(), [None, None]);
    assert_eq!(columns.optional_float64("share").unwrap(), [None, None]);
    const NOT_LATER: TableSchema =
        TableSchema::new("not_later", "", &[STEP, column("robot", Form::Optional, Value::Text)]);
    let error = read(&path, &NOT_LATER).unwrap_err().to_string();
    assert!(error.ends_with(r#"column "robot" is missing (schema not_later: optional text)"#), "{error}");
    let robots = Column::OptionalText(vec![Some("arm".to_owned()), None]);
    let numbers = Column::OptionalInt64(vec![Some(8), None]);
    let shares = Column::OptionalFloat64(vec![None, Some(0.5)]);
    let whole = vec![("step", Column::Int64(vec![1, 2])), ("robot", robots), ("goals", numbers), ("share", shares)];
    write(&path, &LATER, whole.clone()).unwrap();
    assert_eq!(read(&path, &LATER).unwrap().into_inner(), owned(whole));
}

#[test]
fn a_null_where_a_value_is_required_is_named_by_row() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("loose.parquet");
    const LOOSE: TableSchema = TableSchema::new("loose", "", &[column("n", Form::Optional, Value::Int64)]);
    const STRICT: TableSchema = TableSchema::new("strict", "", &[column("n", Form::Required, Value::Int64)]);
    write(&path, &LOOSE, vec![("n", Column::OptionalInt64(vec![Some(1), Some(2)]))]).unwrap();
    assert_eq!(read(&path, &STRICT).unwrap().int64("n").unwrap(), [1, 2]);
    let rows = (0..10_000).map(|row| (row != 9_000).then_some(row)).collect();
    write(&path, &LOOSE, vec![("n", Column::OptionalInt64(rows))]).unwrap();
    let error = read(&path, &STRICT).unwrap_err();
    assert!(matches!(&error, TableError::Null { column, row: 9_000, .. } if column == "n"), "{error}");
}

#[test]
fn a_truncated_or_corrupted_table_is_an_error_with_its_path() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("metrics.parquet");
    write(&path, &METRICS, metrics(&(0..1000).collect::<Vec<_>>())).unwrap();
    let whole = std::fs::read(&path).unwrap();
    for length in [0, 3, 8, whole.len() / 2, whole.len() - 1] {
        std::fs::write(&path, &whole[..length]).unwrap();
        let error = read(&path, &METRICS).unwrap_err().to_string();
        assert!(error.contains("metrics.parquet"), "{error}");
    }
    for at in (0..whole.len()).step_by(31) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0xff;
        std::fs::write(&path, &bytes).unwrap();
        if let Err(error) = read(&path, &METRICS) {
            assert!(error.to_string().contains("metrics.parquet"), "{error}");
        }
    }
    let error = read(&folder.path().join("absent.parquet"), &METRICS).unwrap_err().to_string();
    assert!(error.contains("absent.parquet"), "{error}");
}
