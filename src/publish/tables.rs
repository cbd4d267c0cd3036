//! The tables of a dataset as they lie in its files: columns, types, and what each means.

use std::path::Path;

use serde::Serialize;

use crate::dataset::{DatasetSummary, TableFiles, schema, table_files};
use crate::publish::PublishError;
use crate::table::{ColumnKind, file_columns};

/// Tables that are subsets on the hub and record sets in the metadata; the first is what readers open by default.
/// Name, files, what a row is, columns that tell rows apart.
const SUBSETS: [(&str, &str, &str, &[&str]); 4] = [
    ("frames", "data/*/*.parquet", "a frame", &["index"]),
    ("episodes", "ntp/episodes.parquet", "an episode", &["episode_index"]),
    ("calls", "ntp/calls/*/*.parquet", "a program call", &["episode_index", "call_id"]),
    (
        "scopes",
        "ntp/scopes/*/*.parquet",
        "a call and a frame of its caller's window",
        &["episode_index", "call_id", "specification_frame"],
    ),
];

/// Those of a dataset without program tables.
const PLAIN_SUBSETS: [(&str, &str, &str, &[&str]); 2] = [
    ("frames", "data/*/*.parquet", "a frame", &["index"]),
    ("episodes", "meta/episodes/*/*.parquet", "an episode", &["episode_index"]),
];

/// Columns that no schema of ours has, by table, with what each means.
const FURTHER_COLUMNS: [(&str, &str, &str); 3] = [
    ("calls", "confidence", "how sure the model is of the call: from 0, not at all, to 1"),
    (
        "frames",
        "language_persistent",
        "what the episode's plan, sub-tasks and motions are in words, and when each begins",
    ),
    ("frames", "language_events", "what is said at this frame"),
];

/// A column of a table.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ColumnFacts {
    pub(super) name: String,
    /// The type in words.
    pub(super) kind: String,
    #[serde(skip)]
    pub(super) column: Option<ColumnKind>,
    pub(super) meaning: &'static str,
}

/// A table of a dataset.
#[derive(Clone, Debug, Serialize)]
pub(super) struct TableFacts {
    pub(super) name: &'static str,
    /// Its files, as a pattern below the dataset.
    pub(super) pattern: &'static str,
    /// What a row is.
    pub(super) row: &'static str,
    pub(super) key: &'static [&'static str],
    pub(super) rows: u64,
    pub(super) columns: Vec<ColumnFacts>,
}

/// The tables of a dataset; columns are those of each table's first file.
pub(super) fn tables(root: &Path, summary: &DatasetSummary) -> Result<Vec<TableFacts>, PublishError> {
    let files = table_files(root)?;
    let schemas = schema::ALL;
    let mut tables = Vec::new();
    let subsets: &[_] = if summary.declared.is_some() { &PLAIN_SUBSETS } else { &SUBSETS };
    for &(name, pattern, row, key) in subsets {
        let first = files.iter().find_map(|(table, files)| match files {
            TableFiles::Parquet(files) if *table == name => files.first(),
            _ => None,
        });
        let Some(first) = first else { continue };
        let known = if summary.declared.is_some() && name == "episodes" { "meta_episodes" } else { name };
        let meaning = |column: &str| {
            let of_ours = schemas.iter().find(|schema| schema.name() == known).and_then(|of| of.meaning(column));
            let further = || FURTHER_COLUMNS.iter().find(|(table, other, _)| (*table, *other) == (name, column));
            of_ours.or_else(|| further().map(|(_, _, meaning)| *meaning))
        };
        let facts = |(column, kind): (String, _)| facts(meaning(&column), column, kind);
        let columns = file_columns(first)?.into_iter().map(facts).collect();
        let rows = match name {
            "frames" => summary.total_frames,
            "calls" => summary.total_calls,
            "scopes" => summary.total_scopes,
            _ => summary.total_episodes,
        };
        tables.push(TableFacts { name, pattern, row, key, rows, columns });
    }
    Ok(tables)
}

fn facts(meaning: Option<&'static str>, name: String, column: Option<ColumnKind>) -> ColumnFacts {
    let is_picture = column.is_none() && name.starts_with("observation.images.");
    let (other, unknown) =
        if is_picture { ("picture", "what a camera saw, encoded") } else { ("group", "not described") };
    let kind = column.map_or_else(|| other.to_owned(), |kind| kind.to_string());
    ColumnFacts { meaning: meaning.unwrap_or(unknown), name, kind, column }
}
