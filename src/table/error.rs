//! Why a table could not be written or read.

use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;

use crate::artifact::IoError;
use crate::words::counted;

/// A table that could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file could not be opened or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// It is truncated, corrupted or no Parquet file.
    #[error("{}: {source}", path.display())]
    Parquet {
        /// Which file.
        path: PathBuf,
        /// What the Parquet reader or writer said.
        source: ParquetError,
    },
    /// A schema text of the program is wrong.
    #[error("schemas/parquet/{schema}.message: {problem}")]
    Schema {
        /// The schema's name.
        schema: &'static str,
        /// What is wrong.
        problem: String,
    },
    /// A column that the schema has is not there.
    #[error("{}: column {column:?} is missing (schema {schema}: {expected})", path.display())]
    MissingColumn {
        /// Which file.
        path: PathBuf,
        /// The schema's name.
        schema: &'static str,
        /// Which column.
        column: String,
        /// What it should hold.
        expected: String,
    },
    /// A column is to be written that the schema does not have, or has once only.
    #[error("{}: column {column:?} is not in schema {schema}, or is given twice", path.display())]
    UnknownColumn {
        /// Which file.
        path: PathBuf,
        /// The schema's name.
        schema: &'static str,
        /// Which column.
        column: String,
    },
    /// A column holds something else.
    #[error("{}: column {column:?} is {found}, but schema {schema} says {expected}", path.display())]
    ColumnKind {
        /// Which file.
        path: PathBuf,
        /// The schema's name.
        schema: &'static str,
        /// Which column.
        column: String,
        /// What it should hold.
        expected: String,
        /// What it holds.
        found: String,
    },
    /// Columns to be written differ in length.
    #[error("{}: column {column:?} has {found}, but the others have {expected}", path.display(), found = counted(*found, "row"))]
    RowCount {
        /// Which file.
        path: PathBuf,
        /// Which column.
        column: String,
        /// Rows of the first column.
        expected: usize,
        /// Rows of this one.
        found: usize,
    },
    /// A value is missing where the schema has it required.
    #[error("{}: column {column:?} is null at row {row}, but schema {schema} has it required", path.display())]
    Null {
        /// Which file.
        path: PathBuf,
        /// The schema's name.
        schema: &'static str,
        /// Which column.
        column: String,
        /// Which row of the file, from 0.
        row: u64,
    },
}

impl TableError {
    /// The file that it is about; `None` when it is about a schema of the program.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Io(error) => Some(error.path()),
            Self::Schema { .. } => None,
            Self::Parquet { path, .. }
            | Self::MissingColumn { path, .. }
            | Self::UnknownColumn { path, .. }
            | Self::ColumnKind { path, .. }
            | Self::RowCount { path, .. }
            | Self::Null { path, .. } => Some(path),
        }
    }

    /// Names the file of an error of the Parquet crate.
    pub(crate) fn parquet(path: &Path) -> impl Fn(ParquetError) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Parquet { path: path.clone(), source }
    }

    /// Names the file of an error of the Arrow crate.
    pub(crate) fn arrow(path: &Path) -> impl Fn(arrow::error::ArrowError) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::Parquet { path: path.clone(), source: source.into() }
    }
}
