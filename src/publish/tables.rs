//! The tables of a dataset as they lie in its files: columns, types, and what each means.

use std::path::Path;

use serde::Serialize;

use crate::dataset::{DatasetSummary, table_files};
use crate::publish::PublishError;
use crate::table::{ColumnKind, file_columns};

/// What every column means, a section a table.
const MEANINGS: &str = include_str!("../../schemas/parquet/README.md");

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
    let mut tables = Vec::new();
    for (name, pattern, row, key) in SUBSETS {
        let first = files.iter().find(|(table, _)| *table == name).and_then(|(_, files)| files.first());
        let Some(first) = first else { continue };
        let columns = file_columns(first)?.into_iter().map(|(column, kind)| facts(name, column, kind)).collect();
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

fn facts(table: &str, name: String, column: Option<ColumnKind>) -> ColumnFacts {
    let is_picture = column.is_none() && name.starts_with("observation.images.");
    let (other, unknown) =
        if is_picture { ("picture", "what a camera saw, encoded") } else { ("group", "not described") };
    let kind = column.map_or_else(|| other.to_owned(), |kind| kind.to_string());
    ColumnFacts { meaning: meaning(table, &name).unwrap_or(unknown), name, kind, column }
}

/// What a column means, from the table of its section: `| column | type | meaning |`.
pub fn meaning(table: &str, column: &str) -> Option<&'static str> {
    let heading = format!("## `{table}`");
    let section = MEANINGS.lines().skip_while(|line| *line != heading).skip(1);
    let rows = section.take_while(|line| !line.starts_with("## ")).filter_map(row);
    rows.into_iter().find(|(pattern, _)| matches(pattern, column)).map(|(_, meaning)| meaning)
}

fn row(line: &'static str) -> Option<(&'static str, &'static str)> {
    let mut cells = line.strip_prefix("| `")?.strip_suffix(" |")?.splitn(3, " | ");
    let name = cells.next()?.strip_suffix('`')?;
    Some((name, cells.nth(1)?))
}

/// Whether a name is meant by a pattern, in which `*` stands for any part.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((before, after)) => name.strip_prefix(before).is_some_and(|rest| rest.ends_with(after)),
    }
}
