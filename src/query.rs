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
//! [`QueryError`]: files that are not as their dataset counts them, statements that Polars refuses, answers that a
//! format cannot hold. No statement makes it panic.
//!
//! # Invariants
//!
//! Nothing is written but the answer. Only the columns that a statement names are read.

mod answer;
mod error;
mod tables;

use polars::prelude::LazyFrame;
use polars::sql::SQLContext;

use crate::table::catch_panic;

pub use answer::Answer;
pub use error::QueryError;
pub use tables::{TableInfo, Tables};

/// Answers one SQL statement.
///
/// # Errors
///
/// See the module.
pub fn query(tables: &Tables, sql: &str) -> Result<Answer, QueryError> {
    let frames = tables.scan()?;
    let execute = || {
        let mut context = SQLContext::new();
        for (name, frame) in frames {
            context.register(name, frame);
        }
        context.execute(sql).and_then(LazyFrame::collect)
    };
    let answer = catch_panic(execute).map_err(|words| QueryError::Panic { words })?;
    answer.map(Answer::new).map_err(|source| QueryError::Refused { source, tables: tables.names() })
}
