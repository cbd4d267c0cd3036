//! A table declared once: `table!` makes rows to write, rows that were read and the contract of one list of columns.
//!
//! ```text
//! table! {
//!     /// `rollouts.parquet` of a suite: a row an episode that a policy acted.
//!     rollouts {
//!         /// position in the suite
//!         episode: Int64,
//!         /// bodies that pushes knocked off what they stood on; null without pushes
//!         toppled: OptionalInt64 later,
//!         /// folder of the file in which the episode's calls begin
//!         calls_chunk("calls/chunk_index"): Int64,
//!     }
//! }
//! ```
//!
//! It gives `SCHEMA`, `Row` (one value a column) and `Rows` (one buffer a column, see [`TableRows`]). A column is called
//! as its field, unless another name stands behind it. The kinds of columns are in [`crate::table::kinds`]. A word behind
//! the kind is a method of [`crate::table::ColumnSpec`]: `later` for a column that files of earlier versions lack, `plain`
//! and `delta` for how its numbers are stored. `sorted_by(…)` behind the table's name says how rows are sorted. Columns of
//! a second block, `each(names) { … }`, are there once for each name that the function gives, in place of the `*`.
//!
//! `schemas/parquet/NAME.message` and the tables of `schemas/parquet/README.md` are made of these declarations by the
//! test `schemas_parquet`.

use std::path::Path;

use crate::table::read::read;
use crate::table::write::TableWriter;
use crate::table::{Columns, TableError, TableSchema, Values};

/// Rows of a declared table, column by column.
pub(crate) trait TableRows: Default {
    /// The table.
    const SCHEMA: TableSchema;
    /// One row.
    type Row<'a>;

    /// Adds a row.
    fn push(&mut self, row: Self::Row<'_>);

    /// Adds the rows of others at the end.
    fn append(&mut self, others: Self);

    /// The columns of all rows, in the order of the declaration.
    fn columns(&self) -> Vec<(&'static str, Values<'_>)>;

    /// Takes the columns of a table that was read whole.
    fn take(columns: &mut Columns) -> Result<Self, TableError>;

    /// Writes the rows as a file of their own.
    fn write(&self, path: &Path) -> Result<(), TableError> {
        let mut writer = TableWriter::create(path, &Self::SCHEMA, Self::SCHEMA.options())?;
        writer.write_row_group(&self.columns())?;
        writer.commit()
    }

    /// Reads a file.
    fn read(path: &Path) -> Result<Self, TableError> {
        Self::take(&mut read(path, &Self::SCHEMA)?)
    }
}

/// Declares a table; see the module.
macro_rules! table {
    (
        $(#[doc = $about:literal])*
        $table:ident $(sorted_by($($by:literal),*))? {
            $($(#[doc = $meaning:literal])* $field:ident $(($name:literal))?: $kind:ident $($mark:ident)*,)*
        }
        $(each($names:path) {$(
            $(#[doc = $each_meaning:literal])* $each:literal: $each_kind:ident,
        )*})?
    ) => {
        $crate::table::schema! {
            $(#[doc = $about])*
            SCHEMA = $table $(sorted_by($($by),*))? {
                $($(#[doc = $meaning])* $field $(($name))?: $kind $($mark)*,)*
            }
            $(each($names) {$($(#[doc = $each_meaning])* $each: $each_kind,)*})?
        }

        /// One row of the table.
        pub(crate) struct Row<'a> {$(
            $(#[doc = $meaning])*
            pub(crate) $field: <$crate::table::kinds::$kind as $crate::table::kinds::Kind>::Cell<'a>,
        )*}

        /// Rows of the table, column by column.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub(crate) struct Rows {$(
            $(#[doc = $meaning])*
            pub(crate) $field: <$crate::table::kinds::$kind as $crate::table::kinds::Kind>::Buffer,
        )*}

        impl $crate::table::TableRows for Rows {
            const SCHEMA: $crate::table::TableSchema = SCHEMA;
            type Row<'a> = Row<'a>;

            fn push(&mut self, row: Row<'_>) {
                $(<$crate::table::kinds::$kind as $crate::table::kinds::Kind>::push(&mut self.$field, row.$field);)*
            }

            fn append(&mut self, others: Self) {
                $(<$crate::table::kinds::$kind as $crate::table::kinds::Kind>::append(
                    &mut self.$field,
                    others.$field,
                );)*
            }

            fn columns(&self) -> Vec<(&'static str, $crate::table::Values<'_>)> {
                vec![$((
                    $crate::table::column_name!($field $($name)?),
                    <$crate::table::kinds::$kind as $crate::table::kinds::Kind>::values(&self.$field),
                )),*]
            }

            fn take(columns: &mut $crate::table::Columns) -> Result<Self, $crate::table::TableError> {
                Ok(Self {$(
                    $field: <$crate::table::kinds::$kind as $crate::table::kinds::Kind>::read(
                        columns,
                        $crate::table::column_name!($field $($name)?),
                    )?,
                )*})
            }
        }
    };
}

/// The contract of a table alone, as a constant.
macro_rules! schema {
    (
        $(#[doc = $about:literal])*
        $constant:ident = $table:ident $(sorted_by($($by:literal),*))? {
            $($(#[doc = $meaning:literal])* $field:ident $(($name:literal))?: $kind:ident $($mark:ident)*,)*
        }
        $(each($names:path) {$(
            $(#[doc = $each_meaning:literal])* $each:literal: $each_kind:ident,
        )*})?
    ) => {
        $(#[doc = $about])*
        pub const $constant: $crate::table::TableSchema = $crate::table::TableSchema::new(
            stringify!($table),
            concat!($($about, "\n"),*),
            &[$(
                $crate::table::ColumnSpec::new(
                    $crate::table::column_name!($field $($name)?),
                    <$crate::table::kinds::$kind as $crate::table::kinds::Kind>::KIND,
                    concat!($($meaning),*),
                )$(.$mark())*,
            )*],
        )
        $(.sorted_by(&[$($by),*]))?
        $(.each($names, &[$(
            $crate::table::ColumnSpec::new(
                $each,
                <$crate::table::kinds::$each_kind as $crate::table::kinds::Kind>::KIND,
                concat!($($each_meaning),*),
            ),
        )*]))?;
    };
}

/// The name of a column in its file.
macro_rules! column_name {
    ($field:ident) => {
        stringify!($field)
    };
    ($field:ident $name:literal) => {
        $name
    };
}

pub(crate) use {column_name, schema, table};
