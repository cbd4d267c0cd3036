//! Writing: columns, checked against the schema, to an atomic file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use parquet::arrow::add_encoded_arrow_schema_to_metadata;
use parquet::basic::{Compression, Encoding, Type};
use parquet::file::metadata::{KeyValue, SortingColumn};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::ColumnPath;

use crate::artifact::AtomicFile;
use crate::table::encode::Encoder;
use crate::table::schema::ParsedSchema;
use crate::table::values::Values;
use crate::table::{Column, ColumnKind, TableError, TableSchema, Value};

/// Named in every file. The same for every run of this version.
const CREATED_BY: &str = concat!("ntp version ", env!("CARGO_PKG_VERSION"));

/// Where a page of a column ends: small enough for a processor's cache, and for a reader that skips pages.
const PAGE_BYTES: usize = 1 << 16;

/// Writes a table.
///
/// # Errors
///
/// When the columns are not exactly those of the schema, in any order, or the file cannot be written; then nothing is
/// at `path` that was not before.
pub fn write(path: &Path, schema: &TableSchema, columns: Vec<(&str, Column)>) -> Result<(), TableError> {
    let mut writer = TableWriter::create(path, schema, WriteOptions::default())?;
    let mut named: Vec<_> = columns.iter().map(|(name, column)| (*name, Values::of(column))).collect();
    let position = |name: &str| writer.parsed.find(name).map_or(usize::MAX, |(position, _)| position);
    named.sort_by_key(|(name, _)| position(name));
    writer.write_row_group(&named)?;
    writer.commit()
}

/// What a schema text cannot say.
#[derive(Clone, Debug, Default)]
pub(crate) struct WriteOptions {
    /// Lists that have a fixed length, by column.
    pub(crate) list_lengths: BTreeMap<&'static str, i32>,
    /// Columns of numbers that are stored as they are: in a dictionary they would find nothing to share.
    pub(crate) plain: Vec<&'static str>,
    /// Columns of whole numbers near to their neighbours, whose differences are stored.
    pub(crate) delta_encoded: Vec<&'static str>,
    /// Columns that the rows are sorted by. Where there are any, only these have minima and maxima in the file: they
    /// let a reader skip pages, the others' would not.
    pub(crate) sorted_by: Vec<&'static str>,
    /// Columns behind those of the schema, as lines of Parquet's message text.
    pub(crate) further: Vec<String>,
    /// Further entries of the file's key-value metadata.
    pub(crate) metadata: Vec<(String, String)>,
}

/// A table being written, row group by row group. Dropped without [`TableWriter::commit`] it leaves nothing.
pub(crate) struct TableWriter {
    path: PathBuf,
    schema: TableSchema,
    parsed: ParsedSchema,
    writer: SerializedFileWriter<AtomicFile>,
    encoder: Encoder,
}

impl TableWriter {
    pub(crate) fn create(path: &Path, schema: &TableSchema, options: WriteOptions) -> Result<Self, TableError> {
        let mut parsed = schema.parse_with(&options.further)?.with_list_lengths(&options.list_lengths);
        // Where there is an Arrow schema in a file, pyarrow and pandas read metadata from it alone.
        parsed.arrow = parsed.arrow.with_metadata(options.metadata.iter().cloned().collect());
        let properties = Arc::new(properties(&parsed, options));
        let file = AtomicFile::create(path)?;
        let writer = SerializedFileWriter::new(file, parsed.descriptor.root_schema_ptr(), properties)
            .map_err(TableError::parquet(path))?;
        Ok(Self { path: path.to_owned(), schema: *schema, parsed, writer, encoder: Encoder::default() })
    }

    /// Writes rows: the schema's columns in its order.
    pub(crate) fn write_row_group(&mut self, columns: &[(&str, Values<'_>)]) -> Result<(), TableError> {
        self.check(columns)?;
        if columns.first().is_none_or(|(_, values)| values.n_rows() == 0) {
            return Ok(());
        }
        let failed = TableError::parquet(&self.path);
        let mut group = self.writer.next_row_group().map_err(&failed)?;
        for (_, values) in columns {
            let Some(mut column) = group.next_column().map_err(&failed)? else { break };
            self.encoder.write(&mut column, values).map_err(&failed)?;
            column.close().map_err(&failed)?;
            // A picture has a second leaf, its path.
            if let Values::Pictures(rows) = values
                && let Some(mut path) = group.next_column().map_err(&failed)?
            {
                self.encoder.write_nothing(&mut path, rows.len()).map_err(&failed)?;
                path.close().map_err(&failed)?;
            }
        }
        group.close().map_err(&failed)?;
        Ok(())
    }

    /// Size of what has been written, in bytes.
    pub(crate) fn bytes_written(&self) -> usize {
        self.writer.bytes_written()
    }

    /// Ends the file and gives it its name.
    pub(crate) fn commit(self) -> Result<(), TableError> {
        let file = self.writer.into_inner().map_err(TableError::parquet(&self.path))?;
        Ok(file.commit()?)
    }

    /// Holds the columns against the schema.
    fn check(&self, columns: &[(&str, Values<'_>)]) -> Result<(), TableError> {
        let n_rows = columns.first().map_or(0, |(_, values)| values.n_rows());
        for (position, (expected_name, expected)) in self.parsed.columns.iter().enumerate() {
            match columns.get(position) {
                Some((name, values)) if name == expected_name => self.check_column(name, values, *expected, n_rows)?,
                Some((name, _)) if self.is_surplus(name, &columns[..position]) => return Err(self.unknown(name)),
                _ => return Err(self.missing(expected_name, *expected)),
            }
        }
        columns.get(self.parsed.columns.len()).map_or(Ok(()), |(name, _)| Err(self.unknown(name)))
    }

    fn is_surplus(&self, name: &str, before: &[(&str, Values<'_>)]) -> bool {
        self.parsed.find(name).is_none() || before.iter().any(|(other, _)| *other == name)
    }

    fn unknown(&self, name: &str) -> TableError {
        TableError::UnknownColumn { path: self.path.clone(), schema: self.schema.name(), column: name.to_owned() }
    }

    fn missing(&self, name: &str, expected: ColumnKind) -> TableError {
        TableError::MissingColumn {
            path: self.path.clone(),
            schema: self.schema.name(),
            column: name.to_owned(),
            expected: expected.to_string(),
        }
    }

    fn check_column(
        &self,
        name: &str,
        values: &Values<'_>,
        expected: ColumnKind,
        n_rows: usize,
    ) -> Result<(), TableError> {
        if values.kind() != expected {
            return Err(TableError::ColumnKind {
                path: self.path.clone(),
                schema: self.schema.name(),
                column: name.to_owned(),
                expected: expected.to_string(),
                found: values.kind().to_string(),
            });
        }
        if values.n_rows() != n_rows {
            return Err(TableError::RowCount {
                path: self.path.clone(),
                column: name.to_owned(),
                expected: n_rows,
                found: values.n_rows(),
            });
        }
        Ok(())
    }
}

/// How a file is written.
pub(super) fn properties(parsed: &ParsedSchema, options: WriteOptions) -> WriterProperties {
    let mut builder =
        WriterProperties::builder().set_created_by(CREATED_BY.to_owned()).set_compression(Compression::SNAPPY);
    builder = builder.set_data_page_size_limit(PAGE_BYTES);
    if !options.sorted_by.is_empty() {
        builder = builder.set_statistics_enabled(EnabledStatistics::None);
    }
    for name in &options.sorted_by {
        builder = builder.set_column_statistics_enabled(ColumnPath::from(*name), EnabledStatistics::Page);
    }
    for column in parsed.descriptor.columns() {
        let leaf = column.path();
        // A table that is carried from elsewhere may have texts where ours has numbers, and is found out by its check.
        let is_whole = matches!(column.physical_type(), Type::INT32 | Type::INT64);
        let name = leaf.parts().first().map_or("", String::as_str);
        if parsed.is_float_list(name) || options.plain.contains(&name) || options.delta_encoded.contains(&name) {
            builder = builder.set_column_dictionary_enabled(leaf.clone(), false);
        }
        if parsed.find(name).is_some_and(|(_, kind)| kind.value == Value::Picture) {
            builder = builder.set_column_dictionary_enabled(leaf.clone(), false);
            builder = builder.set_column_compression(leaf.clone(), Compression::UNCOMPRESSED);
        }
        if options.delta_encoded.contains(&name) && is_whole {
            builder = builder.set_column_encoding(leaf.clone(), Encoding::DELTA_BINARY_PACKED);
        }
    }
    let sorting = |name: &str| {
        let column_idx = parsed.descriptor.columns().iter().position(|column| column.path().string() == name)?;
        Some(SortingColumn { column_idx: column_idx as i32, descending: false, nulls_first: false })
    };
    let sorting: Vec<_> = options.sorted_by.into_iter().filter_map(sorting).collect();
    let metadata = options.metadata.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect::<Vec<_>>();
    let mut properties = builder
        .set_sorting_columns((!sorting.is_empty()).then_some(sorting))
        .set_key_value_metadata((!metadata.is_empty()).then_some(metadata))
        .build();
    add_encoded_arrow_schema_to_metadata(&parsed.arrow, &mut properties);
    properties
}
