//! The Parquet contracts: `schemas/parquet` is what the declarations in the code make of it.
//!
//! With `NTP_REGENERATE=1` in the environment the files are written anew in place of being compared.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use ntp::dataset::schema;
use ntp::rollout::{DETECTIONS, ROLLOUTS};
use ntp::table::{ColumnKind, Form, TableSchema, Value};
use ntp::training::{DETECTOR_METRICS, METRICS};

/// Every table, in the order of the README.
fn schemas() -> Vec<TableSchema> {
    let of_dataset = [schema::FRAMES, schema::CALLS, schema::SCOPES, schema::EPISODES, schema::META_EPISODES];
    let of_texts = [schema::TASKS, schema::SUBTASKS];
    let of_runs = [ROLLOUTS, METRICS, DETECTOR_METRICS, DETECTIONS];
    of_dataset.into_iter().chain(of_texts).chain(of_runs).collect()
}

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/schemas"))
}

/// Holds a generated file against what it should be; or writes it, when that is asked for.
#[track_caller]
fn is_generated(path: PathBuf, expected: &str) {
    if std::env::var_os("NTP_REGENERATE").is_some() {
        std::fs::write(path, expected).unwrap();
        return;
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(found == expected, "{} is not as declared; NTP_REGENERATE=1 writes it anew", path.display());
}

/// The README's section of a table.
fn section(schema: &TableSchema) -> String {
    let about: String =
        schema.about().lines().map(|line| format!("{}\n", line.strip_prefix(' ').unwrap_or(line))).collect();
    let mut rows: Vec<String> = Vec::new();
    for column in schema.specs() {
        rows.push(format!("| `{}` | {} | {} |\n", column.name(), column.kind(), column.meaning()));
    }
    let rows = rows.concat();
    format!("## `{}`\n\n{about}\n| column | type | meaning |\n|---|---|---|\n{rows}", schema.name())
}

#[test]
fn every_schema_text_is_made_of_its_declaration() {
    for schema in schemas() {
        is_generated(folder().join(format!("parquet/{}.message", schema.name())), &schema.text());
        let columns = schema.columns();
        let names: BTreeSet<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names.len(), columns.len(), "{} names a column twice", schema.name());
    }
    let files = std::fs::read_dir(folder().join("parquet")).unwrap();
    let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    let files: BTreeSet<String> = names.filter(|name| name != "README.md").collect();
    assert_eq!(files, schemas().iter().map(|schema| format!("{}.message", schema.name())).collect());
}

#[test]
fn the_readme_of_the_tables_is_made_of_their_declarations() {
    let path = folder().join("parquet/README.md");
    let found = std::fs::read_to_string(&path).unwrap();
    let introduction = found.split("\n## ").next().unwrap();
    let sections: Vec<String> = schemas().iter().map(section).collect();
    is_generated(path, &format!("{introduction}\n{}", sections.join("\n")));
}

#[test]
fn every_column_of_every_table_has_a_meaning() {
    for schema in schemas() {
        assert!(!schema.about().is_empty(), "{} tells of no rows", schema.name());
        for column in schema.specs() {
            assert!(!column.meaning().is_empty(), "{}: {} has no meaning", schema.name(), column.name());
        }
    }
}

#[test]
fn the_readme_tells_of_every_dataset_table() {
    let readme = std::fs::read_to_string(folder().join("README.md")).unwrap();
    for schema in schema::ALL {
        assert!(readme.contains(&format!("`{}`", schema.name())), "{} is not there", schema.name());
    }
}

#[test]
fn lerobots_columns_are_of_the_types_that_its_readers_ask_for() {
    let columns = schema::META_EPISODES.columns();
    let kind = |name: &str| columns.iter().find(|(column, _)| column == name).map(|(_, kind)| *kind);
    let int64 = Some(ColumnKind { value: Value::Int64, form: Form::Required });
    let places = ["data/chunk_index", "data/file_index", "meta/episodes/chunk_index", "meta/episodes/file_index"];
    let counts = ["episode_index", "length", "dataset_from_index", "dataset_to_index"];
    for name in places.into_iter().chain(counts) {
        assert_eq!(kind(name), int64, "{name}");
    }
    let list = |value| Some(ColumnKind { value, form: Form::List });
    assert_eq!(kind("tasks"), list(Value::Text));
    for feature in ["observation.state", "action", "timestamp", "index"] {
        for name in ["min", "max", "mean", "std"] {
            assert_eq!(kind(&format!("stats/{feature}/{name}")), list(Value::Float64));
        }
        assert_eq!(kind(&format!("stats/{feature}/count")), list(Value::Int64));
    }
}

#[test]
fn labels_of_our_own_are_never_taken_for_observations_or_actions() {
    for (name, _) in schema::FRAMES.columns() {
        let is_input = name.starts_with("observation.") || name.starts_with("action");
        assert!(!is_input || ["observation.state", "action"].contains(&name.as_str()), "{name}");
    }
}
