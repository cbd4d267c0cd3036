//! Borrowed columns, in the forms that a writer has them in.

use crate::table::{Column, ColumnKind, Form, Value};

/// The values of one column, a row each unless said otherwise.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Values<'a> {
    Int64(&'a [i64]),
    OptionalInt64(&'a [Option<i64>]),
    Float32(&'a [f32]),
    OptionalFloat32(&'a [Option<f32>]),
    Float64(&'a [f64]),
    OptionalFloat64(&'a [Option<f64>]),
    Boolean(&'a [bool]),
    Text(&'a [String]),
    OptionalText(&'a [Option<String>]),
    /// Texts by their numbers in a list.
    Word(&'a [u32], &'a [String]),
    /// The same; a row may have none.
    OptionalWord(&'a [Option<u32>], &'a [String]),
    Int64List(&'a [Vec<i64>]),
    Float32List(&'a [Vec<f32>]),
    Float64List(&'a [Vec<f64>]),
    TextList(&'a [Vec<String>]),
    /// Lists of one length, which is not 0, one after another.
    Int64Vector(&'a [i64], usize),
    /// The same of floats.
    Float32Vector(&'a [f32], usize),
    /// The same of doubles.
    Float64Vector(&'a [f64], usize),
    /// Encoded pictures.
    Pictures(&'a [Vec<u8>]),
    /// A number for each channel.
    Channels(&'a [[f64; 3]]),
}

impl<'a> Values<'a> {
    /// The values of an owned column.
    pub(crate) fn of(column: &'a Column) -> Self {
        match column {
            Column::Int64(rows) => Self::Int64(rows),
            Column::OptionalInt64(rows) => Self::OptionalInt64(rows),
            Column::Float32(rows) => Self::Float32(rows),
            Column::OptionalFloat32(rows) => Self::OptionalFloat32(rows),
            Column::Float64(rows) => Self::Float64(rows),
            Column::OptionalFloat64(rows) => Self::OptionalFloat64(rows),
            Column::Boolean(rows) => Self::Boolean(rows),
            Column::Text(rows) => Self::Text(rows),
            Column::OptionalText(rows) => Self::OptionalText(rows),
            Column::Int64List(rows) => Self::Int64List(rows),
            Column::Float32List(rows) => Self::Float32List(rows),
            Column::Float64List(rows) => Self::Float64List(rows),
            Column::TextList(rows) => Self::TextList(rows),
        }
    }

    /// What the column holds.
    pub(crate) fn kind(&self) -> ColumnKind {
        let (form, value) = match self {
            Self::Int64(_) => (Form::Required, Value::Int64),
            Self::OptionalInt64(_) => (Form::Optional, Value::Int64),
            Self::Int64List(_) | Self::Int64Vector(..) => (Form::List, Value::Int64),
            Self::Float32(_) => (Form::Required, Value::Float32),
            Self::OptionalFloat32(_) => (Form::Optional, Value::Float32),
            Self::Float32List(_) | Self::Float32Vector(..) => (Form::List, Value::Float32),
            Self::Float64(_) => (Form::Required, Value::Float64),
            Self::OptionalFloat64(_) => (Form::Optional, Value::Float64),
            Self::Float64List(_) | Self::Float64Vector(..) => (Form::List, Value::Float64),
            Self::Boolean(_) => (Form::Required, Value::Boolean),
            Self::Text(_) | Self::Word(..) => (Form::Required, Value::Text),
            Self::OptionalText(_) | Self::OptionalWord(..) => (Form::Optional, Value::Text),
            Self::TextList(_) => (Form::List, Value::Text),
            Self::Pictures(_) => (Form::Required, Value::Picture),
            Self::Channels(_) => (Form::Required, Value::Channels),
        };
        ColumnKind { value, form }
    }

    /// How many rows.
    pub(crate) fn n_rows(&self) -> usize {
        match self {
            Self::Int64(rows) => rows.len(),
            Self::OptionalInt64(rows) => rows.len(),
            Self::Float32(rows) => rows.len(),
            Self::OptionalFloat32(rows) => rows.len(),
            Self::Float64(rows) => rows.len(),
            Self::OptionalFloat64(rows) => rows.len(),
            Self::Boolean(rows) => rows.len(),
            Self::Text(rows) => rows.len(),
            Self::OptionalText(rows) => rows.len(),
            Self::Word(rows, _) => rows.len(),
            Self::OptionalWord(rows, _) => rows.len(),
            Self::Int64List(rows) => rows.len(),
            Self::Float32List(rows) => rows.len(),
            Self::Float64List(rows) => rows.len(),
            Self::TextList(rows) => rows.len(),
            Self::Int64Vector(values, width) => values.len() / width,
            Self::Float32Vector(values, width) => values.len() / width,
            Self::Float64Vector(values, width) => values.len() / width,
            Self::Pictures(rows) => rows.len(),
            Self::Channels(rows) => rows.len(),
        }
    }
}
