//! An answer as text for people, and in the forms that other programs read.

use std::path::Path;

use polars::prelude::{AnyValue, CsvWriter, DataFrame, ParquetCompression, ParquetWriter, SerWriter as _};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value};

use crate::artifact::AtomicFile;
use crate::query::QueryError;
use crate::words::counted;

/// Between columns of the text form.
const GAP: &str = "  ";

/// The rows that a statement asked for.
pub struct Answer(DataFrame);

impl Answer {
    pub(super) fn new(rows: DataFrame) -> Self {
        Self(rows)
    }

    /// How many rows.
    pub fn n_rows(&self) -> usize {
        self.0.height()
    }

    /// Aligned columns under their names, then how many rows there are.
    pub fn to_text(&self) -> String {
        let columns: Vec<Vec<String>> = self.0.columns().iter().map(cells).collect();
        let widths: Vec<usize> =
            columns.iter().map(|cells| cells.iter().map(|cell| cell.chars().count()).max().unwrap_or(0)).collect();
        let line = |row: usize| {
            let cells = columns.iter().zip(self.0.columns()).zip(&widths).map(|((cells, column), &width)| {
                let cell = &cells[row];
                if column.dtype().is_primitive_numeric() {
                    format!("{cell:>width$}")
                } else {
                    format!("{cell:<width$}")
                }
            });
            cells.collect::<Vec<_>>().join(GAP).trim_end().to_owned()
        };
        let mut lines: Vec<String> = (0..=self.n_rows()).map(line).collect();
        lines.insert(1, widths.iter().map(|&width| "-".repeat(width)).collect::<Vec<_>>().join(GAP));
        lines.push(counted(self.n_rows(), "row"));
        lines.join("\n")
    }

    /// An object for each row. Numbers that are not finite become null: JSON has none.
    pub fn to_json(&self) -> Vec<Value> {
        let row = |row| Row { answer: self, row }.entries().map(|(name, value)| (name.to_owned(), value));
        (0..self.n_rows()).map(|number| Value::Object(row(number).collect::<Map<_, _>>())).collect()
    }

    /// As [`Answer::to_json`], with the columns of each object in the order that was asked for.
    pub fn rows(&self) -> impl Serialize + '_ {
        (0..self.n_rows()).map(|row| Row { answer: self, row }).collect::<Vec<_>>()
    }

    /// Comma-separated values with a line of names.
    ///
    /// # Errors
    ///
    /// When a column holds lists.
    pub fn to_csv(&self) -> Result<String, QueryError> {
        if let Some(column) = self.0.columns().iter().find(|column| column.dtype().is_nested()) {
            return Err(QueryError::NoForm { column: column.name().to_string(), kind: column.dtype().to_string() });
        }
        let mut bytes = Vec::new();
        CsvWriter::new(&mut bytes).finish(&mut self.0.clone()).map_err(QueryError::Encode)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Writes a Parquet file, whole or not at all.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn write_parquet(&self, path: &Path) -> Result<(), QueryError> {
        let mut file = AtomicFile::create(path)?;
        let writer = ParquetWriter::new(&mut file).with_compression(ParquetCompression::Snappy);
        writer.finish(&mut self.0.clone()).map_err(QueryError::Encode)?;
        Ok(file.commit()?)
    }
}

/// A row as an object.
struct Row<'a> {
    answer: &'a Answer,
    row: usize,
}

impl<'a> Row<'a> {
    fn entries(&self) -> impl Iterator<Item = (&'a str, Value)> + use<'a> {
        let Self { answer, row } = *self;
        answer.0.columns().iter().map(move |column| {
            let value = column.get(row).map_or(Value::Null, |value| json(&value));
            (column.name().as_str(), value)
        })
    }
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.entries())
    }
}

/// A column's name and values as texts.
fn cells(column: &polars::prelude::Column) -> Vec<String> {
    let values = (0..column.len()).map(|row| column.get(row).map_or_else(|_error| String::new(), |value| text(&value)));
    std::iter::once(column.name().to_string()).chain(values).collect()
}

fn text(value: &AnyValue<'_>) -> String {
    match value {
        AnyValue::Null => "null".to_owned(),
        AnyValue::String(text) => (*text).to_owned(),
        AnyValue::StringOwned(text) => text.to_string(),
        AnyValue::Float32(number) => number.to_string(),
        AnyValue::Float64(number) => number.to_string(),
        AnyValue::List(_) | AnyValue::Array(..) => json(value).to_string(),
        other => other.to_string(),
    }
}

fn json(value: &AnyValue<'_>) -> Value {
    match value {
        AnyValue::Null => Value::Null,
        AnyValue::Boolean(flag) => Value::from(*flag),
        AnyValue::String(text) => Value::from(*text),
        AnyValue::StringOwned(text) => Value::from(text.as_str()),
        // Through text: 0.1 shall not become 0.10000000149011612.
        AnyValue::Float32(number) => number.to_string().parse::<f64>().map_or(Value::Null, Value::from),
        AnyValue::Float64(number) => Value::from(*number),
        AnyValue::List(series) | AnyValue::Array(series, _) => series.iter().map(|value| json(&value)).collect(),
        AnyValue::Int8(_) | AnyValue::Int16(_) | AnyValue::Int32(_) | AnyValue::Int64(_) => {
            value.extract::<i64>().map_or(Value::Null, Value::from)
        }
        AnyValue::UInt8(_) | AnyValue::UInt16(_) | AnyValue::UInt32(_) | AnyValue::UInt64(_) => {
            value.extract::<u64>().map_or(Value::Null, Value::from)
        }
        other => Value::from(other.to_string()),
    }
}
