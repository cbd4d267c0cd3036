//! Writing: columns or Arrow arrays, checked against the schema, to an atomic file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{
    ArrayRef, BooleanArray, Float32Array, Float64Array, Int64Array, ListArray, RecordBatch, StringArray,
};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::{Compression, Encoding};
use parquet::file::metadata::{KeyValue, SortingColumn};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::ColumnPath;

use crate::artifact::AtomicFile;
use crate::table::schema::ParsedSchema;
use crate::table::{Column, TableError, TableSchema};

/// Named in every file. The same for every run of this version.
const CREATED_BY: &str = concat!("ntp version ", env!("CARGO_PKG_VERSION"));

/// Writes a table.
///
/// # Errors
///
/// When the columns are not exactly those of the schema, in any order, or the file cannot be written; then nothing is
/// at `path` that was not before.
pub fn write(path: &Path, schema: &TableSchema, columns: Vec<(&str, Column)>) -> Result<(), TableError> {
    let mut writer = TableWriter::create(path, schema, WriteOptions::default())?;
    writer.write_columns(columns)?;
    writer.commit()
}

/// What a schema text cannot say.
#[derive(Clone, Debug, Default)]
pub(crate) struct WriteOptions {
    /// Lists that have a fixed length, by column.
    pub(crate) list_lengths: BTreeMap<&'static str, i32>,
    /// Columns of numbers that hardly ever occur twice.
    pub(crate) plain: Vec<&'static str>,
    /// Columns of whole numbers near to their neighbours, whose differences are stored.
    pub(crate) delta_encoded: Vec<&'static str>,
    /// Columns that the rows are sorted by. Where there are any, only these have minima and maxima in the file: they
    /// let a reader skip pages, the others' would not.
    pub(crate) sorted_by: Vec<&'static str>,
    /// Further entries of the file's key-value metadata.
    pub(crate) metadata: Vec<(String, String)>,
}

/// A table being written, row group by row group. Dropped without [`TableWriter::commit`] it leaves nothing.
pub(crate) struct TableWriter {
    path: PathBuf,
    schema: TableSchema,
    parsed: ParsedSchema,
    writer: ArrowWriter<AtomicFile>,
}

impl TableWriter {
    pub(crate) fn create(path: &Path, schema: &TableSchema, options: WriteOptions) -> Result<Self, TableError> {
        let mut parsed = schema.parse()?.with_list_lengths(&options.list_lengths);
        // Where there is an Arrow schema in a file, pyarrow and pandas read metadata from it alone.
        parsed.arrow = parsed.arrow.with_metadata(options.metadata.iter().cloned().collect());
        let properties = properties(&parsed, options);
        let file = AtomicFile::create(path)?;
        let options =
            ArrowWriterOptions::new().with_properties(properties).with_parquet_schema(parsed.descriptor.clone());
        let writer = ArrowWriter::try_new_with_options(file, Arc::new(parsed.arrow.clone()), options)
            .map_err(TableError::parquet(path))?;
        Ok(Self { path: path.to_owned(), schema: *schema, parsed, writer })
    }

    /// Writes rows: the schema's columns in any order.
    pub(crate) fn write_columns(&mut self, columns: Vec<(&str, Column)>) -> Result<(), TableError> {
        let arrays = self.arrays_in_order(columns)?;
        self.write(&arrays)
    }

    /// Writes rows: one array a column in the schema's order. A column of text may come as a dictionary.
    pub(crate) fn write(&mut self, arrays: &[ArrayRef]) -> Result<(), TableError> {
        let fields = self.parsed.arrow.fields().iter().zip(arrays);
        let fields = fields.map(|(field, array)| field.as_ref().clone().with_data_type(array.data_type().clone()));
        let batch_schema = Arc::new(Schema::new(fields.collect::<Vec<Field>>()));
        let batch = RecordBatch::try_new(batch_schema, arrays.to_vec()).map_err(TableError::arrow(&self.path))?;
        self.writer.write(&batch).map_err(TableError::parquet(&self.path))
    }

    /// As [`TableWriter::write`], and the names must be the schema's.
    pub(crate) fn write_named(&mut self, columns: &[(&str, ArrayRef)]) -> Result<(), TableError> {
        let expected = self.parsed.columns.iter().map(|(name, _)| name.as_str());
        if let Some((_, &(found, _))) = expected.clone().zip(columns).find(|(name, (found, _))| name != found) {
            let (path, schema) = (self.path.clone(), self.schema.name());
            return Err(TableError::UnknownColumn { path, schema, column: found.to_owned() });
        }
        self.write(&columns.iter().map(|(_, array)| Arc::clone(array)).collect::<Vec<_>>())
    }

    /// Ends the row group.
    pub(crate) fn end_row_group(&mut self) -> Result<(), TableError> {
        self.writer.flush().map_err(TableError::parquet(&self.path))
    }

    /// Size of the row groups that have been ended, in bytes.
    pub(crate) fn bytes_written(&self) -> usize {
        self.writer.bytes_written()
    }

    /// Ends the file and gives it its name.
    pub(crate) fn commit(self) -> Result<(), TableError> {
        let file = self.writer.into_inner().map_err(TableError::parquet(&self.path))?;
        Ok(file.commit()?)
    }

    fn arrays_in_order(&self, columns: Vec<(&str, Column)>) -> Result<Vec<ArrayRef>, TableError> {
        let mut arrays: Vec<Option<ArrayRef>> = vec![None; self.parsed.columns.len()];
        let n_rows = columns.first().map_or(0, |(_, column)| column.len());
        for (name, column) in columns {
            let unknown = || TableError::UnknownColumn {
                path: self.path.clone(),
                schema: self.schema.name(),
                column: name.into(),
            };
            let (position, expected) = self.parsed.find(name).ok_or_else(unknown)?;
            if arrays[position].is_some() {
                return Err(unknown());
            }
            self.check(name, &column, expected, n_rows)?;
            arrays[position] = Some(to_array(column, self.parsed.arrow.field(position), &self.path)?);
        }
        let named = arrays.into_iter().zip(&self.parsed.columns);
        let required = named.map(|(array, (name, expected))| {
            array.ok_or_else(|| TableError::MissingColumn {
                path: self.path.clone(),
                schema: self.schema.name(),
                column: name.clone(),
                expected: expected.to_string(),
            })
        });
        required.collect()
    }

    fn check(
        &self,
        name: &str,
        column: &Column,
        expected: crate::table::ColumnKind,
        n_rows: usize,
    ) -> Result<(), TableError> {
        if column.kind() != expected {
            return Err(TableError::ColumnKind {
                path: self.path.clone(),
                schema: self.schema.name(),
                column: name.to_owned(),
                expected: expected.to_string(),
                found: column.kind().to_string(),
            });
        }
        if column.len() != n_rows {
            return Err(TableError::RowCount {
                path: self.path.clone(),
                column: name.to_owned(),
                expected: n_rows,
                found: column.len(),
            });
        }
        Ok(())
    }
}

fn properties(parsed: &ParsedSchema, options: WriteOptions) -> WriterProperties {
    let path_of = |name: &str| {
        parsed.descriptor.columns().iter().find(|column| column.path().parts().first().is_some_and(|part| part == name))
    };
    let mut builder =
        WriterProperties::builder().set_created_by(CREATED_BY.to_owned()).set_compression(Compression::SNAPPY);
    if !options.sorted_by.is_empty() {
        builder = builder.set_statistics_enabled(EnabledStatistics::None);
        for name in &options.sorted_by {
            builder = builder.set_column_statistics_enabled(ColumnPath::from(*name), EnabledStatistics::Page);
        }
    }
    for name in parsed.float_lists() {
        if let Some(column) = path_of(name) {
            builder = builder.set_column_dictionary_enabled(column.path().clone(), false);
        }
    }
    for name in options.plain {
        builder = builder.set_column_dictionary_enabled(ColumnPath::from(name), false);
    }
    for name in options.delta_encoded {
        let column = ColumnPath::from(name);
        builder = builder
            .set_column_dictionary_enabled(column.clone(), false)
            .set_column_encoding(column, Encoding::DELTA_BINARY_PACKED);
    }
    let sorting = |name: &str| {
        let column_idx = parsed.descriptor.columns().iter().position(|column| column.path().string() == name)?;
        Some(SortingColumn { column_idx: column_idx as i32, descending: false, nulls_first: false })
    };
    let sorting: Vec<_> = options.sorted_by.into_iter().filter_map(sorting).collect();
    let metadata = options.metadata.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect::<Vec<_>>();
    builder
        .set_sorting_columns((!sorting.is_empty()).then_some(sorting))
        .set_key_value_metadata((!metadata.is_empty()).then_some(metadata))
        .build()
}

fn to_array(column: Column, field: &Field, path: &Path) -> Result<ArrayRef, TableError> {
    Ok(match column {
        Column::Int64(rows) => Arc::new(Int64Array::from(rows)),
        Column::OptionalInt64(rows) => Arc::new(Int64Array::from(rows)),
        Column::Float32(rows) => Arc::new(Float32Array::from(rows)),
        Column::OptionalFloat32(rows) => Arc::new(Float32Array::from(rows)),
        Column::Float64(rows) => Arc::new(Float64Array::from(rows)),
        Column::OptionalFloat64(rows) => Arc::new(Float64Array::from(rows)),
        Column::Boolean(rows) => Arc::new(BooleanArray::from(rows)),
        Column::Text(rows) => Arc::new(StringArray::from(rows)),
        Column::OptionalText(rows) => Arc::new(StringArray::from(rows)),
        Column::Int64List(rows) => list(&rows, |values| Arc::new(Int64Array::from(values)), field, path)?,
        Column::Float32List(rows) => list(&rows, |values| Arc::new(Float32Array::from(values)), field, path)?,
        Column::Float64List(rows) => list(&rows, |values| Arc::new(Float64Array::from(values)), field, path)?,
        Column::TextList(rows) => list(&rows, |values| Arc::new(StringArray::from(values)), field, path)?,
    })
}

fn list<T: Clone>(
    rows: &[Vec<T>],
    to_values: impl FnOnce(Vec<T>) -> ArrayRef,
    field: &Field,
    path: &Path,
) -> Result<ArrayRef, TableError> {
    let offsets = OffsetBuffer::from_lengths(rows.iter().map(Vec::len));
    let (DataType::List(element) | DataType::FixedSizeList(element, _)) = field.data_type() else {
        return Err(TableError::arrow(path)(arrow::error::ArrowError::SchemaError(format!("{field} is no list"))));
    };
    let list = ListArray::try_new(Arc::clone(element), offsets, to_values(rows.concat()), None);
    Ok(Arc::new(list.map_err(TableError::arrow(path))?))
}
