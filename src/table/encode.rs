//! Columns to Parquet's column writers: values, and the levels that say which row they are of.

use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::errors::Result;
use parquet::file::writer::SerializedColumnWriter;

use crate::table::values::Values;

/// Texts that are handed to the column writer at a time; between them it sees whether its page is full.
const TEXT_BATCH: usize = 1024;

/// Pictures that are handed to it at a time: a few fill a page, and whoever wants one reads the whole page.
const PICTURE_BATCH: usize = 1;

/// Levels of the column being written; used again for the next one.
#[derive(Default)]
pub(super) struct Encoder {
    definition: Vec<i16>,
    repetition: Vec<i16>,
}

impl Encoder {
    /// Writes a column, whose kind must be the column writer's.
    pub(super) fn write(&mut self, column: &mut SerializedColumnWriter<'_>, values: &Values<'_>) -> Result<()> {
        match *values {
            Values::Int64(rows) => plain::<Int64Type>(column, rows),
            Values::Float32(rows) => plain::<FloatType>(column, rows),
            Values::Float64(rows) => plain::<DoubleType>(column, rows),
            Values::Boolean(rows) => plain::<BoolType>(column, rows),
            Values::OptionalInt64(rows) => self.optional::<Int64Type>(column, rows),
            Values::OptionalFloat32(rows) => self.optional::<FloatType>(column, rows),
            Values::OptionalFloat64(rows) => self.optional::<DoubleType>(column, rows),
            Values::Text(rows) => texts(column, rows.iter().map(bytes)),
            Values::OptionalText(rows) => self.optional_texts(column, rows.iter().map(|row| row.as_ref().map(bytes))),
            Values::Word(rows, words) => {
                let words: Vec<ByteArray> = words.iter().map(bytes).collect();
                texts(column, rows.iter().map(|&row| words[row as usize].clone()))
            }
            Values::OptionalWord(rows, words) => {
                let words: Vec<ByteArray> = words.iter().map(bytes).collect();
                self.optional_texts(column, rows.iter().map(|row| row.map(|row| words[row as usize].clone())))
            }
            Values::Int64List(rows) => self.lists::<Int64Type>(column, rows),
            Values::Float32List(rows) => self.lists::<FloatType>(column, rows),
            Values::Float64List(rows) => self.lists::<DoubleType>(column, rows),
            Values::TextList(rows) => {
                let values: Vec<ByteArray> = rows.iter().flatten().map(bytes).collect();
                self.levels_of_lists(rows);
                self.with_levels::<ByteArrayType>(column, &values)
            }
            Values::Int64Vector(values, width) => self.vectors::<Int64Type>(column, values, width),
            Values::Float32Vector(values, width) => self.vectors::<FloatType>(column, values, width),
            Values::Float64Vector(values, width) => self.vectors::<DoubleType>(column, values, width),
            Values::Channels(rows) => {
                // Three lists, and in each a list of one value: only the first value of a row begins anew.
                self.definition.clear();
                self.definition.resize(3 * rows.len(), 3);
                self.repetition.clear();
                self.repetition.extend(rows.iter().flat_map(|_| [0, 1, 1]));
                self.with_levels::<DoubleType>(column, rows.as_flattened())
            }
            Values::Pictures(rows) => {
                self.optional_bytes(column, rows.iter().map(|row| Some(row.clone().into())), PICTURE_BATCH)
            }
        }
    }

    /// Writes a column of so many rows that all hold nothing.
    pub(super) fn write_nothing(&mut self, column: &mut SerializedColumnWriter<'_>, n_rows: usize) -> Result<()> {
        self.optional_texts(column, std::iter::repeat_n(None, n_rows))
    }

    fn optional<T: DataType>(&mut self, column: &mut SerializedColumnWriter<'_>, rows: &[Option<T::T>]) -> Result<()> {
        let values: Vec<T::T> = rows.iter().flatten().cloned().collect();
        self.definition.clear();
        self.definition.extend(rows.iter().map(|row| i16::from(row.is_some())));
        column.typed::<T>().write_batch(&values, Some(&self.definition), None)?;
        Ok(())
    }

    fn optional_texts(
        &mut self,
        column: &mut SerializedColumnWriter<'_>,
        rows: impl ExactSizeIterator<Item = Option<ByteArray>>,
    ) -> Result<()> {
        self.optional_bytes(column, rows, TEXT_BATCH)
    }

    fn optional_bytes(
        &mut self,
        column: &mut SerializedColumnWriter<'_>,
        rows: impl ExactSizeIterator<Item = Option<ByteArray>>,
        batch: usize,
    ) -> Result<()> {
        let mut rows = rows.peekable();
        let mut values = Vec::with_capacity(batch);
        while rows.peek().is_some() {
            values.clear();
            self.definition.clear();
            for row in rows.by_ref().take(batch) {
                self.definition.push(i16::from(row.is_some()));
                values.extend(row);
            }
            column.typed::<ByteArrayType>().write_batch(&values, Some(&self.definition), None)?;
        }
        Ok(())
    }

    fn lists<T: DataType>(&mut self, column: &mut SerializedColumnWriter<'_>, rows: &[Vec<T::T>]) -> Result<()> {
        self.levels_of_lists(rows);
        self.with_levels::<T>(column, &rows.concat())
    }

    fn levels_of_lists<T>(&mut self, rows: &[Vec<T>]) {
        self.definition.clear();
        self.repetition.clear();
        for row in rows {
            self.repetition.push(0);
            self.definition.push(i16::from(!row.is_empty()));
            self.repetition.resize(self.repetition.len() + row.len().saturating_sub(1), 1);
            self.definition.resize(self.repetition.len(), 1);
        }
    }

    fn vectors<T: DataType>(
        &mut self,
        column: &mut SerializedColumnWriter<'_>,
        values: &[T::T],
        width: usize,
    ) -> Result<()> {
        self.definition.clear();
        self.definition.resize(values.len(), 1);
        self.repetition.clear();
        self.repetition.resize(values.len(), 1);
        self.repetition.iter_mut().step_by(width).for_each(|level| *level = 0);
        self.with_levels::<T>(column, values)
    }

    fn with_levels<T: DataType>(&self, column: &mut SerializedColumnWriter<'_>, values: &[T::T]) -> Result<()> {
        column.typed::<T>().write_batch(values, Some(&self.definition), Some(&self.repetition))?;
        Ok(())
    }
}

fn plain<T: DataType>(column: &mut SerializedColumnWriter<'_>, rows: &[T::T]) -> Result<()> {
    column.typed::<T>().write_batch(rows, None, None)?;
    Ok(())
}

fn texts(column: &mut SerializedColumnWriter<'_>, rows: impl ExactSizeIterator<Item = ByteArray>) -> Result<()> {
    let mut rows = rows.peekable();
    let mut values = Vec::with_capacity(TEXT_BATCH);
    while rows.peek().is_some() {
        values.clear();
        values.extend(rows.by_ref().take(TEXT_BATCH));
        column.typed::<ByteArrayType>().write_batch(&values, None, None)?;
    }
    Ok(())
}

fn bytes(text: &String) -> ByteArray {
    ByteArray::from(text.as_bytes().to_vec())
}
