//! Parquet tables: columns in memory to and from a file whose schema text is in schemas/parquet.
//!
//! # Input and output
//!
//! A [`TableSchema`] holds a `schemas/parquet/NAME.message` file, Parquet's own message text. [`write`] refuses columns
//! that are not exactly as it says; [`read`] and [`TableReader`] take columns by name and pass over any others.
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
mod encode;
mod error;
mod guard;
mod kind;
mod pictures;
mod read;
mod schema;
mod values;
mod write;

pub(crate) use arrays::{FloatRows, TextRows};
pub(crate) use batches::{BatchReader, BatchWriter};
pub use column::{Column, Columns};
pub use error::TableError;
pub(crate) use guard::catch_panic;
pub use kind::{ColumnKind, Form, Value};
pub(crate) use pictures::PictureReader;
pub(crate) use read::read_further;
pub use read::{TableReader, file_columns, read};
pub use schema::TableSchema;
pub(crate) use values::Values;
pub use write::write;
pub(crate) use write::{TableWriter, WriteOptions};
