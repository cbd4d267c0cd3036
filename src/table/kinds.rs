//! What a column of a declared table holds, as a type: how its values are gathered, written and read.

use std::borrow::Cow;
use std::fmt::Debug;

use arrow::buffer::{BooleanBuffer, ScalarBuffer};

use crate::table::arrays::{FloatRows, ListRows, NumberRows, TextRows};
use crate::table::values::Values;
use crate::table::words::TextTable;
use crate::table::{ColumnKind, Columns, Form, TableError, Value};

/// A kind of column.
pub(crate) trait Kind {
    /// What the column holds.
    const KIND: ColumnKind;
    /// The value of one row.
    type Cell<'a>;
    /// The values of rows that are not yet written, or were read.
    type Buffer: Clone + Debug + Default + PartialEq;
    /// The values of a batch as they lie in memory.
    type Taken;

    /// Adds a row.
    fn push(buffer: &mut Self::Buffer, cell: Self::Cell<'_>);

    /// Adds the rows of another buffer.
    fn append(buffer: &mut Self::Buffer, other: Self::Buffer);

    /// Forgets all rows.
    fn clear(buffer: &mut Self::Buffer);

    /// The values as a writer takes them.
    fn values(buffer: &Self::Buffer) -> Values<'_>;

    /// Takes a column of this name out of a table that was read.
    fn read(columns: &mut Columns, name: &str) -> Result<Self::Buffer, TableError>;

    /// Takes a column of this name out of a batch, without a copy where that can be.
    fn take(columns: &mut Columns, name: &str) -> Result<Self::Taken, TableError>;
}

const fn kind(form: Form, value: Value) -> ColumnKind {
    ColumnKind { value, form }
}

/// Kinds whose buffer is a vector of what a row holds.
macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident: $form:ident $value:ident, $cell:ty => $owned:ty, $read:ident, $push:expr,
        $taken:ty, $take:ident;)*) => {$(
        $(#[$doc])*
        pub(crate) enum $kind {}

        impl Kind for $kind {
            const KIND: ColumnKind = kind(Form::$form, Value::$value);
            type Cell<'a> = $cell;
            type Buffer = Vec<$owned>;
            type Taken = $taken;

            fn push(buffer: &mut Self::Buffer, cell: Self::Cell<'_>) {
                buffer.push($push(cell));
            }

            fn append(buffer: &mut Self::Buffer, other: Self::Buffer) {
                buffer.extend(other);
            }

            fn clear(buffer: &mut Self::Buffer) {
                buffer.clear();
            }

            fn values(buffer: &Self::Buffer) -> Values<'_> {
                Values::$kind(buffer)
            }

            fn read(columns: &mut Columns, name: &str) -> Result<Self::Buffer, TableError> {
                columns.$read(name)
            }

            fn take(columns: &mut Columns, name: &str) -> Result<Self::Taken, TableError> {
                columns.$take(name)
            }
        }
    )*};
}

kinds! {
    /// A whole number.
    Int64: Required Int64, i64 => i64, int64, same, ScalarBuffer<i64>, numbers;
    /// A whole number or none.
    OptionalInt64: Optional Int64, Option<i64> => Option<i64>, optional_int64, same, NumberRows, optional_numbers;
    /// A float of four bytes.
    Float32: Required Float32, f32 => f32, float32, same, ScalarBuffer<f32>, floats;
    /// A float of four bytes or none.
    OptionalFloat32: Optional Float32, Option<f32> => Option<f32>, optional_float32, same, Vec<Option<f32>>, optional_float32;
    /// A float of eight bytes.
    Float64: Required Float64, f64 => f64, float64, same, ScalarBuffer<f64>, doubles;
    /// A float of eight bytes or none.
    OptionalFloat64: Optional Float64, Option<f64> => Option<f64>, optional_float64, same, Vec<Option<f64>>, optional_float64;
    /// True or false.
    Boolean: Required Boolean, bool => bool, boolean, same, BooleanBuffer, flags;
    /// A text.
    Text: Required Text, Cow<'a, str> => String, text, Cow::into_owned, TextRows, texts;
    /// A text or none.
    OptionalText: Optional Text, Option<Cow<'a, str>> => Option<String>, optional_text, owned, TextRows, optional_texts;
    /// Any number of whole numbers.
    Int64List: List Int64, Vec<i64> => Vec<i64>, int64_list, same, ListRows<i64>, number_rows;
    /// Any number of floats of eight bytes.
    Float64List: List Float64, Vec<f64> => Vec<f64>, float64_list, same, ListRows<f64>, double_rows;
    /// Any number of texts.
    TextList: List Text, Vec<String> => Vec<String>, text_list, same, Vec<Vec<String>>, text_list;
}

fn same<T>(cell: T) -> T {
    cell
}

fn owned(cell: Option<Cow<'_, str>>) -> Option<String> {
    cell.map(Cow::into_owned)
}

/// A text of which there are few: each is kept once.
pub(crate) enum Word {}

/// Texts by their numbers in a list.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Words<K> {
    pub(crate) keys: Vec<K>,
    pub(crate) texts: TextTable,
}

impl Kind for Word {
    const KIND: ColumnKind = kind(Form::Required, Value::Text);
    type Cell<'a> = Cow<'a, str>;
    type Buffer = Words<u32>;
    type Taken = TextRows;

    fn push(buffer: &mut Self::Buffer, cell: Self::Cell<'_>) {
        buffer.keys.push(buffer.texts.key(&cell));
    }

    fn append(buffer: &mut Self::Buffer, other: Self::Buffer) {
        let texts = other.texts.texts();
        other.keys.iter().for_each(|&key| Self::push(buffer, texts[key as usize].as_str().into()));
    }

    fn clear(buffer: &mut Self::Buffer) {
        buffer.keys.clear();
    }

    fn values(buffer: &Self::Buffer) -> Values<'_> {
        Values::Word(&buffer.keys, buffer.texts.texts())
    }

    fn read(columns: &mut Columns, name: &str) -> Result<Self::Buffer, TableError> {
        let mut words = Self::Buffer::default();
        columns.text(name)?.into_iter().for_each(|text| Self::push(&mut words, text.into()));
        Ok(words)
    }

    fn take(columns: &mut Columns, name: &str) -> Result<Self::Taken, TableError> {
        columns.texts(name)
    }
}

/// A text of which there are few, or none.
pub(crate) enum OptionalWord {}

impl Kind for OptionalWord {
    const KIND: ColumnKind = kind(Form::Optional, Value::Text);
    type Cell<'a> = Option<Cow<'a, str>>;
    type Buffer = Words<Option<u32>>;
    type Taken = TextRows;

    fn push(buffer: &mut Self::Buffer, cell: Self::Cell<'_>) {
        buffer.keys.push(cell.map(|text| buffer.texts.key(&text)));
    }

    fn append(buffer: &mut Self::Buffer, other: Self::Buffer) {
        let texts = other.texts.texts();
        let text = |key: Option<u32>| key.map(|key| texts[key as usize].as_str().into());
        other.keys.iter().for_each(|&key| Self::push(buffer, text(key)));
    }

    fn clear(buffer: &mut Self::Buffer) {
        buffer.keys.clear();
    }

    fn values(buffer: &Self::Buffer) -> Values<'_> {
        Values::OptionalWord(&buffer.keys, buffer.texts.texts())
    }

    fn read(columns: &mut Columns, name: &str) -> Result<Self::Buffer, TableError> {
        let mut words = Self::Buffer::default();
        columns.optional_text(name)?.into_iter().for_each(|text| Self::push(&mut words, text.map(Into::into)));
        Ok(words)
    }

    fn take(columns: &mut Columns, name: &str) -> Result<Self::Taken, TableError> {
        columns.optional_texts(name)
    }
}

/// As many floats of four bytes in each row.
pub(crate) enum Float32Vector {}

/// Lists of one length, one after another.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Vectors {
    pub(crate) values: Vec<f32>,
    /// Their length; 0 as long as there are none.
    pub(crate) width: usize,
}

impl Kind for Float32Vector {
    const KIND: ColumnKind = kind(Form::List, Value::Float32);
    type Cell<'a> = &'a [f32];
    type Buffer = Vectors;
    type Taken = FloatRows;

    fn push(buffer: &mut Self::Buffer, cell: Self::Cell<'_>) {
        buffer.width = cell.len();
        buffer.values.extend_from_slice(cell);
    }

    fn append(buffer: &mut Self::Buffer, other: Self::Buffer) {
        buffer.width = other.width;
        buffer.values.extend(other.values);
    }

    fn clear(buffer: &mut Self::Buffer) {
        buffer.values.clear();
    }

    fn values(buffer: &Self::Buffer) -> Values<'_> {
        Values::Float32Vector(&buffer.values, buffer.width.max(1))
    }

    fn read(columns: &mut Columns, name: &str) -> Result<Self::Buffer, TableError> {
        let mut vectors = Vectors::default();
        columns.float32_list(name)?.iter().for_each(|row| Self::push(&mut vectors, row));
        Ok(vectors)
    }

    fn take(columns: &mut Columns, name: &str) -> Result<Self::Taken, TableError> {
        columns.float_rows(name)
    }
}
