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
//! It gives `SCHEMA`, `Row` (one value a column) and `Rows` (one buffer a column, see [`TableRows`]); `batch!` then names
//! columns that are read together. A column is called as its field, unless another name stands behind it. The kinds of columns are in [`crate::table::kinds`]. A word behind
//! the kind is a method of [`crate::table::ColumnSpec`]: `later` for a column that files of earlier versions lack, `plain`
//! and `delta` for how its numbers are stored. `sorted_by(…)` behind the table's name says how rows are sorted. Columns of
//! a second block, `each(names) { … }`, are there once for each name that the function gives, in place of the `*`.
//!
//! `schemas/parquet/NAME.message` and the tables of `schemas/parquet/README.md` are made of these declarations by the
//! test `schemas_parquet`.

use std::path::Path;

use crate::table::kinds::Kind;
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

    /// Forgets all rows, but not the words of columns that keep each once.
    fn clear(&mut self);

    /// How many rows there are.
    fn n_rows(&self) -> usize {
        self.columns().first().map_or(0, |(_, values)| values.n_rows())
    }

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
        $(#[doc = $about])*
        pub const SCHEMA: $crate::table::TableSchema = $crate::table::TableSchema::new(
            stringify!($table),
            concat!($($about, "\n"),*),
            &[$(
                $crate::table::ColumnSpec::new(
                    <column::$field as $crate::table::DeclaredColumn>::NAME,
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

        /// The columns of the table, a type each.
        #[expect(non_camel_case_types, reason = "a column's type is called as its field")]
        pub(crate) mod column {$(
            $(#[doc = $meaning])*
            pub(crate) enum $field {}

            impl $crate::table::DeclaredColumn for $field {
                type Kind = $crate::table::kinds::$kind;
                const NAME: &'static str = $crate::table::column_name!($field $($name)?);
            }
        )*}

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

            fn clear(&mut self) {
                $(<$crate::table::kinds::$kind as $crate::table::kinds::Kind>::clear(&mut self.$field);)*
            }

            fn columns(&self) -> Vec<(&'static str, $crate::table::Values<'_>)> {
                vec![$((
                    <column::$field as $crate::table::DeclaredColumn>::NAME,
                    <$crate::table::kinds::$kind as $crate::table::kinds::Kind>::values(&self.$field),
                )),*]
            }

            fn take(columns: &mut $crate::table::Columns) -> Result<Self, $crate::table::TableError> {
                Ok(Self {$(
                    $field: <$crate::table::kinds::$kind as $crate::table::kinds::Kind>::read(
                        columns,
                        <column::$field as $crate::table::DeclaredColumn>::NAME,
                    )?,
                )*})
            }
        }
    };
}

/// Some columns of a declared table, taken out of a batch as they lie in memory.
pub(crate) trait Batch: Sized {
    /// The table.
    const SCHEMA: TableSchema;
    /// Names of the columns that are read.
    const COLUMNS: &'static [&'static str];

    /// Takes the columns.
    fn take(columns: &mut Columns) -> Result<Self, TableError>;
}

/// A column of a declared table, as a type.
pub(crate) trait DeclaredColumn {
    /// What it holds.
    type Kind: Kind;
    /// Its name in files.
    const NAME: &'static str;
}

/// Declares a [`Batch`]: `batch! { struct Ids of calls { episode_index, call_id } }`, where `calls` is the table's room.
macro_rules! batch {
    (
        $(#[$doc:meta])*
        $visibility:vis struct $batch:ident of $table:ident {
            $($(#[$field_doc:meta])* $field_visibility:vis $field:ident),* $(,)?
        }
    ) => {
        $(#[$doc])*
        $visibility struct $batch {$(
            $(#[$field_doc])*
            $field_visibility $field: <
                <$table::column::$field as $crate::table::DeclaredColumn>::Kind as $crate::table::kinds::Kind
            >::Taken,
        )*}

        impl $crate::table::Batch for $batch {
            const SCHEMA: $crate::table::TableSchema = $table::SCHEMA;
            const COLUMNS: &'static [&'static str] =
                &[$(<$table::column::$field as $crate::table::DeclaredColumn>::NAME),*];

            fn take(columns: &mut $crate::table::Columns) -> Result<Self, $crate::table::TableError> {
                Ok(Self {$(
                    $field: <
                        <$table::column::$field as $crate::table::DeclaredColumn>::Kind as $crate::table::kinds::Kind
                    >::take(columns, <$table::column::$field as $crate::table::DeclaredColumn>::NAME)?,
                )*})
            }
        }
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

pub(crate) use {batch, column_name, table};
