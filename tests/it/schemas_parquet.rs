//! The Parquet contracts: each text is used by the code that it binds, and told of in the README.

use std::collections::BTreeSet;
use std::path::Path;

use ntp::dataset::schema;
use ntp::table::{ColumnKind, Form, TableSchema, Value};

fn schemas() -> Vec<TableSchema> {
    let others = [TableSchema::ROLLOUTS, TableSchema::METRICS, TableSchema::DETECTOR_METRICS, TableSchema::DETECTIONS];
    schema::ALL.into_iter().chain(others).collect()
}

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/schemas"))
}

#[test]
fn every_schema_text_is_embedded_and_parses() {
    let files = std::fs::read_dir(folder().join("parquet")).unwrap();
    let names = files.map(|file| file.unwrap().file_name().into_string().unwrap());
    let files: BTreeSet<String> = names.filter(|name| name != "README.md").collect();
    let embedded: BTreeSet<String> = schemas().iter().map(|schema| format!("{}.message", schema.name())).collect();
    assert_eq!(files, embedded);
    for schema in schemas() {
        let text = std::fs::read_to_string(folder().join(format!("parquet/{}.message", schema.name()))).unwrap();
        assert_eq!(text, schema.text());
        let columns = schema.columns().unwrap();
        let names: BTreeSet<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names.len(), columns.len(), "{} names a column twice", schema.name());
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
    let columns = schema::META_EPISODES.columns().unwrap();
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
    for (name, _) in schema::FRAMES.columns().unwrap() {
        let is_input = name.starts_with("observation.") || name.starts_with("action");
        assert!(!is_input || ["observation.state", "action"].contains(&name.as_str()), "{name}");
    }
}
