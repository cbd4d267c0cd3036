//! SQL over the tables of a dataset, of rollouts and of models, by Polars.
//!
//! # Input and output
//!
//! [`Tables`] names the files behind each table; [`query`] reads what a statement asks of them and gives an [`Answer`],
//! which is printed, or written as CSV, JSON or Parquet. `schemas/queries.md` is a page of worked examples.
//!
//! | table | a row |
//! |---|---|
//! | `frames` | frame: `data/` |
//! | `calls`, `scopes` | program call; scoping label of a call and a frame: `ntp/calls/`, `ntp/scopes/` |
//! | `episodes` | episode with its provenance: `ntp/episodes.parquet` |
//! | `tasks`, `subtasks` | text: `meta/` |
//! | `rollouts` | rollout, of all suites and models |
//! | `metrics` | point of a learning curve; `model` is the folder's name |
//!
//! # Errors
//!
//! [`QueryError`]: files that are not as their dataset counts them, statements that are not answered, with what to write
//! instead, statements that Polars refuses, answers that a format cannot hold. No statement makes it panic.
//!
//! # Invariants
//!
//! Nothing is written but the answer, and no statement changes a table. Only the tables and columns that a statement
//! names are read, and a part of the rows at a time: groups and sums need memory for themselves alone. An answer is the
//! same with any number of threads: where a statement asks for no order and groups, joins or makes distinct, rows are
//! sorted by their columns.

mod answer;
mod error;
mod rewrite;
mod statement;
mod tables;

use polars::prelude::{DataFrame, Engine, LazyFrame, PolarsResult, SortMultipleOptions};
use polars::sql::SQLContext;

use crate::table::catch_panic;
use statement::{Asked, Rows};

pub use answer::Answer;
pub use error::QueryError;
pub use tables::{TableInfo, Tables};

/// Answers one SQL statement.
///
/// # Errors
///
/// See the module.
pub fn query(tables: &Tables, sql: &str) -> Result<Answer, QueryError> {
    let panicked = |words| QueryError::Panic { words, instead: "" };
    match catch_panic(|| statement::read(sql)).map_err(panicked)?? {
        Asked::Columns { table } => tables.columns_of(&table),
        Asked::Tables => tables.listed(),
        Asked::Rows(rows) => answer(tables, &rows),
    }
}

/// What to write where Polars breaks off on tables that are crossed.
const OF_CROSSED: &str = "; columns of crossed tables are compared by = alone: write the rest over a window, or as columns of \
                          a query within";

fn answer(tables: &Tables, Rows { sql, relations, has_elements, is_crossed }: &Rows) -> Result<Answer, QueryError> {
    let frames = tables.scan(|name| relations.contains(name), *has_elements)?;
    let execute = || {
        let mut context = SQLContext::new();
        for (name, frame) in frames {
            context.register(name, frame);
        }
        let rows = collect(context.execute(sql)?)?;
        if has_order(sql) { Ok(rows) } else { sorted(rows) }
    };
    let instead = if *is_crossed { OF_CROSSED } else { "" };
    let answer = catch_panic(execute).map_err(|words| QueryError::Panic { words, instead })?;
    answer.map(Answer::new).map_err(|source| QueryError::Refused { source, tables: tables.names() })
}

/// The rows, by the engine that goes through files a part at a time. A statement has one result.
fn collect(frame: LazyFrame) -> PolarsResult<DataFrame> {
    Ok(frame.collect_with_engine(Engine::Streaming)?.unwrap_single())
}

/// Whether the order of the answer's rows is asked for, or that of the files.
fn has_order(sql: &str) -> bool {
    let sql = sql.to_lowercase();
    let words: Vec<&str> = sql.split(|letter: char| !letter.is_alphanumeric() && letter != '_').collect();
    let is_mixed =
        words.iter().any(|word| ["group", "distinct", "join", "union", "intersect", "except"].contains(word));
    !is_mixed || words.contains(&"order") || words.contains(&"limit")
}

/// Sorted by all columns that have an order.
fn sorted(rows: DataFrame) -> PolarsResult<DataFrame> {
    let columns = rows.columns().iter().filter(|column| !column.dtype().is_nested());
    let names: Vec<String> = columns.map(|column| column.name().to_string()).collect();
    if names.is_empty() { Ok(rows) } else { rows.sort(names, SortMultipleOptions::default().with_nulls_last(true)) }
}
