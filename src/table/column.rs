//! Columns in memory.

use std::path::{Path, PathBuf};

use arrow::array::{Array as _, ArrayRef};

use crate::table::arrays::append_array;
use crate::table::{ColumnKind, Form, TableError, Value};

/// The values of one column, a row each.
#[expect(missing_docs, reason = "the names are the types")]
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    Int64(Vec<i64>),
    OptionalInt64(Vec<Option<i64>>),
    Float32(Vec<f32>),
    OptionalFloat32(Vec<Option<f32>>),
    Float64(Vec<f64>),
    OptionalFloat64(Vec<Option<f64>>),
    Boolean(Vec<bool>),
    Text(Vec<String>),
    OptionalText(Vec<Option<String>>),
    Int64List(Vec<Vec<i64>>),
    Float32List(Vec<Vec<f32>>),
    Float64List(Vec<Vec<f64>>),
    TextList(Vec<Vec<String>>),
}

impl Column {
    /// A column without rows; `None` for kinds that no table has.
    pub(crate) fn empty(kind: ColumnKind) -> Option<Self> {
        Some(match (kind.form, kind.value) {
            (Form::Required, Value::Int64) => Self::Int64(Vec::new()),
            (Form::Optional, Value::Int64) => Self::OptionalInt64(Vec::new()),
            (Form::List, Value::Int64) => Self::Int64List(Vec::new()),
            (Form::Required, Value::Float32) => Self::Float32(Vec::new()),
            (Form::Optional, Value::Float32) => Self::OptionalFloat32(Vec::new()),
            (Form::List, Value::Float32) => Self::Float32List(Vec::new()),
            (Form::Required, Value::Float64) => Self::Float64(Vec::new()),
            (Form::Optional, Value::Float64) => Self::OptionalFloat64(Vec::new()),
            (Form::List, Value::Float64) => Self::Float64List(Vec::new()),
            (Form::Required, Value::Boolean) => Self::Boolean(Vec::new()),
            (Form::Required, Value::Text) => Self::Text(Vec::new()),
            (Form::Optional, Value::Text) => Self::OptionalText(Vec::new()),
            (Form::List, Value::Text) => Self::TextList(Vec::new()),
            (Form::Optional | Form::List, Value::Boolean) | (_, Value::Picture | Value::Channels) => return None,
        })
    }

    /// What it holds.
    pub fn kind(&self) -> ColumnKind {
        let (form, value) = match self {
            Self::Int64(_) => (Form::Required, Value::Int64),
            Self::OptionalInt64(_) => (Form::Optional, Value::Int64),
            Self::Int64List(_) => (Form::List, Value::Int64),
            Self::Float32(_) => (Form::Required, Value::Float32),
            Self::OptionalFloat32(_) => (Form::Optional, Value::Float32),
            Self::Float32List(_) => (Form::List, Value::Float32),
            Self::Float64(_) => (Form::Required, Value::Float64),
            Self::OptionalFloat64(_) => (Form::Optional, Value::Float64),
            Self::Float64List(_) => (Form::List, Value::Float64),
            Self::Boolean(_) => (Form::Required, Value::Boolean),
            Self::Text(_) => (Form::Required, Value::Text),
            Self::OptionalText(_) => (Form::Optional, Value::Text),
            Self::TextList(_) => (Form::List, Value::Text),
        };
        ColumnKind { value, form }
    }

    /// How many rows.
    pub fn len(&self) -> usize {
        match self {
            Self::Int64(rows) => rows.len(),
            Self::OptionalInt64(rows) => rows.len(),
            Self::Int64List(rows) => rows.len(),
            Self::Float32(rows) => rows.len(),
            Self::OptionalFloat32(rows) => rows.len(),
            Self::Float32List(rows) => rows.len(),
            Self::Float64(rows) => rows.len(),
            Self::OptionalFloat64(rows) => rows.len(),
            Self::Float64List(rows) => rows.len(),
            Self::Boolean(rows) => rows.len(),
            Self::Text(rows) => rows.len(),
            Self::OptionalText(rows) => rows.len(),
            Self::TextList(rows) => rows.len(),
        }
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Columns by name, all of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    path: PathBuf,
    schema: &'static str,
    columns: Vec<(String, Column)>,
    /// Those of a batch, as they lie in it until they are taken.
    arrays: Vec<(String, ColumnKind, ArrayRef)>,
}

macro_rules! takers {
    ($($take:ident, $variant:ident, $row:ty;)*) => {
        impl Columns {
            $(
                /// Takes a column of this kind out.
                ///
                /// # Errors
                ///
                /// When there is no such column, or none of this kind.
                pub fn $take(&mut self, name: &str) -> Result<Vec<$row>, TableError> {
                    let expected = Column::$variant(Vec::new()).kind();
                    match self.take(name, expected)? {
                        Column::$variant(rows) => Ok(rows),
                        other => Err(self.wrong_kind(name, expected, other.kind())),
                    }
                }
            )*
        }
    };
}

takers! {
    int64, Int64, i64;
    optional_int64, OptionalInt64, Option<i64>;
    float32, Float32, f32;
    optional_float32, OptionalFloat32, Option<f32>;
    float64, Float64, f64;
    optional_float64, OptionalFloat64, Option<f64>;
    boolean, Boolean, bool;
    text, Text, String;
    optional_text, OptionalText, Option<String>;
    int64_list, Int64List, Vec<i64>;
    float32_list, Float32List, Vec<f32>;
    float64_list, Float64List, Vec<f64>;
    text_list, TextList, Vec<String>;
}

impl Columns {
    pub(crate) fn new(path: &Path, schema: &'static str, columns: Vec<(String, Column)>) -> Self {
        Self { path: path.to_owned(), schema, columns, arrays: Vec::new() }
    }

    /// Those of a batch, without nulls where there must be none.
    pub(super) fn of_batch(path: &Path, schema: &'static str, arrays: Vec<(String, ColumnKind, ArrayRef)>) -> Self {
        Self { path: path.to_owned(), schema, columns: Vec::new(), arrays }
    }

    /// How many rows.
    pub fn n_rows(&self) -> usize {
        let of_arrays = || self.arrays.first().map_or(0, |(_, _, array)| array.len());
        self.columns.first().map_or_else(of_arrays, |(_, column)| column.len())
    }

    /// A column by name, of a table that was read whole.
    pub fn get(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|(column, _)| column == name).map(|(_, column)| column)
    }

    /// The columns that have not been taken, in the schema's order, of a table that was read whole.
    pub fn into_inner(self) -> Vec<(String, Column)> {
        self.columns
    }

    fn take(&mut self, name: &str, expected: ColumnKind) -> Result<Column, TableError> {
        if let Some(position) = self.columns.iter().position(|(column, _)| column == name) {
            return Ok(self.columns.remove(position).1);
        }
        let copy = |kind: ColumnKind, array: &ArrayRef| {
            let mut column = Column::empty(kind)?;
            append_array(&mut column, array)?;
            Some(column)
        };
        self.take_array(name, expected, copy)
    }

    /// Takes a column of a batch out, as what `of` makes of it.
    pub(super) fn take_array<T>(
        &mut self,
        name: &str,
        expected: ColumnKind,
        of: impl FnOnce(ColumnKind, &ArrayRef) -> Option<T>,
    ) -> Result<T, TableError> {
        let position = self.arrays.iter().position(|(column, ..)| column == name);
        let position = position.ok_or_else(|| self.missing(name, expected))?;
        let (_, kind, array) = self.arrays.remove(position);
        of(kind, &array).ok_or_else(|| self.wrong_kind(name, expected, kind))
    }

    fn missing(&self, name: &str, expected: ColumnKind) -> TableError {
        TableError::MissingColumn {
            path: self.path.clone(),
            schema: self.schema,
            column: name.to_owned(),
            expected: expected.to_string(),
        }
    }

    fn wrong_kind(&self, name: &str, expected: ColumnKind, found: ColumnKind) -> TableError {
        TableError::ColumnKind {
            path: self.path.clone(),
            schema: self.schema,
            column: name.to_owned(),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }
}
