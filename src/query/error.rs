//! Why there is no answer.

use std::path::PathBuf;

use polars::prelude::PolarsError;

use crate::artifact::IoError;
use crate::dataset::DatasetError;
use crate::table::TableError;

/// A query without an answer.
#[derive(Debug, thiserror::Error)]
pub enum QueryError {
    /// A dataset's tables are not as it says.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// A file could not be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A table could not be opened.
    #[error("{}: {source}", path.display())]
    Table {
        /// Which file.
        path: PathBuf,
        /// What Polars said.
        source: PolarsError,
    },
    /// No statement.
    #[error("{words}")]
    Syntax {
        /// What the parser said.
        words: String,
    },
    /// A statement of a form that is not answered.
    #[error("{found} is not answered; {instead}")]
    NotAnswered {
        /// The form.
        found: String,
        /// What to write instead.
        instead: String,
    },
    /// A table of another name is asked for.
    #[error("no table {name:?}; tables are {}", tables.join(", "))]
    NoTable {
        /// As asked.
        name: String,
        /// The tables that there are.
        tables: Vec<&'static str>,
    },
    /// A column of a type that queries do not read.
    #[error("column {column:?} is {kind}, which queries do not read; other tables can still be asked: {}", path.display())]
    Type {
        /// A file of the table.
        path: PathBuf,
        /// Which column.
        column: String,
        /// Its type.
        kind: String,
    },
    /// A file is no Parquet table.
    #[error(transparent)]
    Parquet(#[from] TableError),
    /// The statement was refused, or failed while it was answered.
    #[error("{source}; tables are {}", tables.join(", "))]
    Refused {
        /// What Polars said.
        source: PolarsError,
        /// The tables that there are.
        tables: Vec<&'static str>,
    },
    /// Polars broke off on a statement that it should have refused.
    #[error("the statement cannot be answered: {words}{instead}")]
    Panic {
        /// What it said.
        words: String,
        /// What to write instead, behind a semicolon, where that is known.
        instead: &'static str,
    },
    /// A format has no place for a value.
    #[error("column {column:?} is {kind}, for which CSV has no form; choose other columns, JSON or Parquet")]
    NoForm {
        /// Which column.
        column: String,
        /// Its type.
        kind: String,
    },
    /// The answer could not be encoded.
    #[error("the answer cannot be written: {0}")]
    Encode(PolarsError),
}
