//! Arrow arrays as columns: copied into vectors, or taken as they lie in memory.

use std::ops::Range;

use arrow::array::{Array as _, ArrayRef, AsArray as _, Int32Array, Int64Array, StringArray};
use arrow::buffer::{BooleanBuffer, OffsetBuffer, ScalarBuffer};
use arrow::datatypes::{ArrowNativeType, ArrowPrimitiveType, Float32Type, Float64Type, Int32Type, Int64Type};
use arrow::util::bit_chunk_iterator::UnalignedBitChunk;

use crate::table::{Column, ColumnKind, Columns, Form, TableError, Value};

/// Lists of numbers one after another, as they lie in a batch.
#[derive(Clone, Debug)]
pub(crate) struct ListRows<T: ArrowNativeType> {
    values: ScalarBuffer<T>,
    borders: OffsetBuffer<i32>,
}

impl<T: ArrowNativeType> ListRows<T> {
    /// The values of a row.
    pub(crate) fn row(&self, at: usize) -> &[T] {
        &self.values[self.borders[at] as usize..self.borders[at + 1] as usize]
    }

    /// The values of some rows, one after another.
    pub(crate) fn rows(&self, range: &Range<usize>) -> &[T] {
        &self.values[self.borders[range.start] as usize..self.borders[range.end] as usize]
    }

    /// Whether each of some rows has so many values.
    pub(crate) fn are_of_width(&self, range: &Range<usize>, width: usize) -> bool {
        let borders = self.borders[range.start..=range.end].windows(2);
        borders.fold(true, |all, ends| all & (ends[1] - ends[0] == width as i32))
    }
}

/// Lists of floats.
pub(crate) type FloatRows = ListRows<f32>;

/// Whole numbers one after another, as they lie in a batch; some rows have none.
#[derive(Clone, Debug)]
pub(crate) struct NumberRows(Int64Array);

impl NumberRows {
    /// The number of a row.
    pub(crate) fn get(&self, at: usize) -> Option<i64> {
        self.0.is_valid(at).then(|| self.0.value(at))
    }
}

/// Texts one after another, as they lie in a batch: each by itself, or by its number among the batch's words.
#[derive(Clone, Debug)]
pub(crate) struct TextRows {
    words: StringArray,
    /// Numbers of words, which are there; `None` where each row has a word of its own.
    numbers: Option<Int32Array>,
}

impl TextRows {
    fn of(array: &ArrayRef) -> Option<Self> {
        if let Some(texts) = array.as_string_opt::<i32>() {
            return Some(Self { words: texts.clone(), numbers: None });
        }
        let dictionary = array.as_dictionary_opt::<Int32Type>()?;
        let words = dictionary.values().as_string_opt::<i32>()?.clone();
        Some(Self { words, numbers: Some(dictionary.keys().clone()) })
    }

    /// The text of a row; empty where there is none.
    pub(crate) fn row(&self, at: usize) -> &str {
        self.get(at).unwrap_or_default()
    }

    /// The text of a row that may have none.
    pub(crate) fn get(&self, at: usize) -> Option<&str> {
        let word = self.word(at)?;
        self.words.is_valid(word).then(|| self.words.value(word))
    }

    /// The number of a row's word; rows with the same one have the same text. `None` where there is no text.
    pub(crate) fn word(&self, at: usize) -> Option<usize> {
        match &self.numbers {
            None => Some(at),
            Some(numbers) => numbers.is_valid(at).then(|| numbers.value(at) as usize),
        }
    }
}

/// How many rows of a range are flagged.
pub(crate) fn count_flags(flags: &BooleanBuffer, range: &Range<usize>) -> usize {
    UnalignedBitChunk::new(flags.values(), flags.offset() + range.start, range.len()).count_ones()
}

/// Columns of a batch without a copy. The errors are those of the other takers.
impl Columns {
    /// Takes whole numbers out.
    pub(crate) fn numbers(&mut self, name: &str) -> Result<ScalarBuffer<i64>, TableError> {
        let expected = ColumnKind { value: Value::Int64, form: Form::Required };
        self.take_array(name, expected, |_, array| Some(array.as_primitive_opt::<Int64Type>()?.values().clone()))
    }

    /// Takes flags out, a bit each.
    pub(crate) fn flags(&mut self, name: &str) -> Result<BooleanBuffer, TableError> {
        let expected = ColumnKind { value: Value::Boolean, form: Form::Required };
        self.take_array(name, expected, |_, array| Some(array.as_boolean_opt()?.values().clone()))
    }

    /// Takes whole numbers out, of which some rows may have none.
    pub(crate) fn optional_numbers(&mut self, name: &str) -> Result<NumberRows, TableError> {
        let expected = ColumnKind { value: Value::Int64, form: Form::Optional };
        self.take_array(name, expected, |_, array| Some(NumberRows(array.as_primitive_opt::<Int64Type>()?.clone())))
    }

    /// Takes floats out.
    pub(crate) fn floats(&mut self, name: &str) -> Result<ScalarBuffer<f32>, TableError> {
        let expected = ColumnKind { value: Value::Float32, form: Form::Required };
        self.take_array(name, expected, |_, array| Some(array.as_primitive_opt::<Float32Type>()?.values().clone()))
    }

    /// Takes doubles out.
    pub(crate) fn doubles(&mut self, name: &str) -> Result<ScalarBuffer<f64>, TableError> {
        let expected = ColumnKind { value: Value::Float64, form: Form::Required };
        self.take_array(name, expected, |_, array| Some(array.as_primitive_opt::<Float64Type>()?.values().clone()))
    }

    /// Takes texts out.
    pub(crate) fn texts(&mut self, name: &str) -> Result<TextRows, TableError> {
        self.text_rows(name, Form::Required)
    }

    /// Takes texts out, of which some rows may have none.
    pub(crate) fn optional_texts(&mut self, name: &str) -> Result<TextRows, TableError> {
        self.text_rows(name, Form::Optional)
    }

    fn text_rows(&mut self, name: &str, form: Form) -> Result<TextRows, TableError> {
        let expected = ColumnKind { value: Value::Text, form };
        self.take_array(name, expected, |_, array| TextRows::of(array))
    }

    /// Takes lists of floats out.
    pub(crate) fn float_rows(&mut self, name: &str) -> Result<FloatRows, TableError> {
        self.list_rows::<Float32Type>(name, Value::Float32)
    }

    /// Takes lists of doubles out.
    pub(crate) fn double_rows(&mut self, name: &str) -> Result<ListRows<f64>, TableError> {
        self.list_rows::<Float64Type>(name, Value::Float64)
    }

    /// Takes lists of whole numbers out.
    pub(crate) fn number_rows(&mut self, name: &str) -> Result<ListRows<i64>, TableError> {
        self.list_rows::<Int64Type>(name, Value::Int64)
    }

    fn list_rows<T: ArrowPrimitiveType>(
        &mut self,
        name: &str,
        value: Value,
    ) -> Result<ListRows<T::Native>, TableError> {
        self.take_array(name, ColumnKind { value, form: Form::List }, |_, array| {
            let list = array.as_list_opt::<i32>()?;
            let values = list.values().as_primitive_opt::<T>()?.values().clone();
            Some(ListRows { values, borders: list.offsets().clone() })
        })
    }
}

/// Appends the rows of an array; `None` when it is of another kind.
pub(super) fn append_array(column: &mut Column, array: &ArrayRef) -> Option<()> {
    match column {
        Column::Int64(rows) => rows.extend_from_slice(array.as_primitive_opt::<Int64Type>()?.values()),
        Column::OptionalInt64(rows) => rows.extend(array.as_primitive_opt::<Int64Type>()?),
        Column::Float32(rows) => rows.extend_from_slice(array.as_primitive_opt::<Float32Type>()?.values()),
        Column::OptionalFloat32(rows) => rows.extend(array.as_primitive_opt::<Float32Type>()?),
        Column::Float64(rows) => rows.extend_from_slice(array.as_primitive_opt::<Float64Type>()?.values()),
        Column::OptionalFloat64(rows) => rows.extend(array.as_primitive_opt::<Float64Type>()?),
        Column::Boolean(rows) => rows.extend(array.as_boolean_opt()?.values()),
        Column::Text(rows) => {
            rows.extend(array.as_string_opt::<i32>()?.iter().map(|text| text.unwrap_or_default().to_owned()));
        }
        Column::OptionalText(rows) => {
            rows.extend(array.as_string_opt::<i32>()?.iter().map(|text| text.map(ToOwned::to_owned)));
        }
        Column::Int64List(rows) => append_list::<Int64Type>(rows, array)?,
        Column::Float32List(rows) => append_list::<Float32Type>(rows, array)?,
        Column::Float64List(rows) => append_list::<Float64Type>(rows, array)?,
        Column::TextList(rows) => {
            let list = array.as_list_opt::<i32>()?;
            let values = list.values().as_string_opt::<i32>()?;
            let row = |ends: &[i32]| (ends[0]..ends[1]).map(|at| values.value(at as usize).to_owned()).collect();
            rows.extend(list.offsets().windows(2).map(row));
        }
    }
    Some(())
}

fn append_list<T: ArrowPrimitiveType>(rows: &mut Vec<Vec<T::Native>>, array: &ArrayRef) -> Option<()> {
    let list = array.as_list_opt::<i32>()?;
    let values = list.values().as_primitive_opt::<T>()?.values();
    rows.extend(list.offsets().windows(2).map(|ends| values[ends[0] as usize..ends[1] as usize].to_vec()));
    Some(())
}
