//! Parquet tables: declared once; columns in memory to and from files.
//!
//! # Input and output
//!
//! A table is declared once, by `table!` (see `declare`), in the room that fills it: of its list of columns come the
//! rows, the contract ([`TableSchema`]), `schemas/parquet/NAME.message` and what the README there says. [`write`] refuses
//! columns that are not exactly as the contract says; [`read`] and [`TableReader`] take columns by name and pass over any
//! others. A column that came later is null in files that lack it.
//!
//! # Errors
//!
//! [`TableError`] names file, column, row, and what was expected and found. No content of a file makes them panic.
//!
//! # Invariants
//!
//! The same columns give the same bytes: Snappy, a fixed `created_by`, no clock. `ARROW:schema` is kept in the file,
//! so that readers tell lists of fixed size from others.

mod arrays;
mod batches;
mod column;
mod declare;
mod encode;
mod error;
mod file_types;
mod guard;
mod kind;
pub(crate) mod kinds;
mod pictures;
#[cfg(feature = "query")]
mod plain_copy;
mod read;
mod schema;
mod values;
mod words;
mod write;

pub(crate) use arrays::{TextRows, count_flags};
pub(crate) use batches::{BatchReader, BatchWriter};
pub use column::{Column, Columns};
pub(crate) use declare::{Batch, DeclaredColumn, TableRows, batch, column_name, table};
pub use error::TableError;
pub use file_types::column_types;
pub(crate) use guard::catch_panic;
pub use kind::{ColumnKind, Form, Value};
pub(crate) use pictures::PictureReader;
#[cfg(feature = "query")]
pub(crate) use plain_copy::without_extensions;
pub(crate) use read::read_further;
pub use read::{TableReader, file_columns, read};
pub use schema::{ColumnSpec, TableSchema};
pub(crate) use values::Values;
pub(crate) use words::TextTable;
pub use write::write;
pub(crate) use write::{TableWriter, WriteOptions};
