//! Reading: whole tables, or in batches so that memory does not grow with the file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{Array, ArrayRef, AsArray as _, RecordBatch, new_null_array};
use arrow::datatypes::{DataType, FieldRef, Fields, Schema};
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder,
};
use parquet::errors::ParquetError;
use parquet::file::metadata::ParquetMetaData;

use crate::artifact;
use crate::table::arrays::append_array;
use crate::table::guard::guarded;
use crate::table::{Column, ColumnKind, Columns, Form, TableError, TableSchema};

/// Rows of one batch.
const BATCH_ROWS: usize = 8192;

/// Reads a whole table: the schema's columns, in its order. Other columns are passed over.
///
/// # Errors
///
/// When the file is not there, is truncated or corrupted, or lacks a column that the schema has.
pub fn read(path: &Path, schema: &TableSchema) -> Result<Columns, TableError> {
    let names: Vec<String> = schema.columns().into_iter().map(|(name, _)| name).collect();
    let mut reader = TableReader::open_columns(path, schema, &names.iter().map(String::as_str).collect::<Vec<_>>())?;
    let mut columns = reader.empty_columns();
    while reader.append_batch(&mut columns)? {}
    Ok(Columns::new(path, schema.name(), columns))
}

/// Reads columns that a schema text does not have, whole.
///
/// # Errors
///
/// As [`read`].
pub(crate) fn read_further(
    path: &Path,
    schema: &TableSchema,
    columns: &[(String, ColumnKind)],
) -> Result<Columns, TableError> {
    let open = || TableReader::open_kinds(path, schema, columns.to_vec());
    let mut reader = guarded(path, open)?;
    let mut columns = reader.empty_columns();
    while reader.append_batch(&mut columns)? {}
    Ok(Columns::new(path, schema.name(), columns))
}

/// Reads a table in batches of some thousand rows.
pub struct TableReader {
    path: PathBuf,
    schema: &'static str,
    columns: Vec<(String, ColumnKind)>,
    /// Those of them that came later than the file.
    absent: Vec<(String, ColumnKind)>,
    reader: ParquetRecordBatchReader,
    footer: Arc<ParquetMetaData>,
    rows_read: u64,
}

impl TableReader {
    /// Opens some columns of a table.
    ///
    /// # Errors
    ///
    /// As [`read`].
    pub fn open_columns(path: &Path, schema: &TableSchema, names: &[&str]) -> Result<Self, TableError> {
        guarded(path, || Self::open_unguarded(path, schema, names))
    }

    /// The same for batches alone: their texts come as numbers of words, as they mostly lie in the file.
    ///
    /// # Errors
    ///
    /// As [`read`].
    pub(crate) fn open_batches(path: &Path, schema: &TableSchema, names: &[&str]) -> Result<Self, TableError> {
        guarded(path, || Self::open_metadata(path, schema, columns_named(schema, names), by_words))
    }

    fn open_unguarded(path: &Path, schema: &TableSchema, names: &[&str]) -> Result<Self, TableError> {
        Self::open_kinds(path, schema, columns_named(schema, names))
    }

    fn open_kinds(path: &Path, schema: &TableSchema, columns: Vec<(String, ColumnKind)>) -> Result<Self, TableError> {
        Self::open_metadata(path, schema, columns, Ok)
    }

    fn open_metadata(
        path: &Path,
        schema: &TableSchema,
        columns: Vec<(String, ColumnKind)>,
        form: impl Fn(ArrowReaderMetadata) -> Result<ArrowReaderMetadata, ParquetError>,
    ) -> Result<Self, TableError> {
        let file = artifact::open(path)?;
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let metadata = ArrowReaderMetadata::load(&file, options).and_then(form).map_err(TableError::parquet(path))?;
        let builder = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata);
        let fields = builder.metadata().file_metadata().schema().get_fields();
        let is_there = |name: &str| !schema.is_later(name) || fields.iter().any(|field| field.name() == name);
        let (there, absent): (Vec<_>, Vec<_>) = columns.iter().cloned().partition(|(name, _)| is_there(name));
        let roots = find_roots(path, schema.name(), &there, builder.metadata())?;
        let footer = Arc::clone(builder.metadata());
        let mask = ProjectionMask::roots(builder.parquet_schema(), roots);
        let reader =
            builder.with_projection(mask).with_batch_size(BATCH_ROWS).build().map_err(TableError::parquet(path))?;
        Ok(Self { path: path.to_owned(), schema: schema.name(), columns, absent, reader, footer, rows_read: 0 })
    }

    /// Rows of the file, as its footer says.
    pub fn n_rows(&self) -> u64 {
        self.footer.file_metadata().num_rows().max(0) as u64
    }

    /// Names of all columns of the file, also of those that are not read.
    pub fn file_columns(&self) -> impl Iterator<Item = &str> {
        self.footer.file_metadata().schema().get_fields().iter().map(|field| field.name())
    }

    /// An entry of the file's key-value metadata.
    pub fn metadata(&self, key: &str) -> Option<&str> {
        let entries = self.footer.file_metadata().key_value_metadata()?;
        entries.iter().find(|entry| entry.key == key)?.value.as_deref()
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn empty_columns(&self) -> Vec<(String, Column)> {
        self.columns.iter().filter_map(|(name, kind)| Some((name.clone(), Column::empty(*kind)?))).collect()
    }

    /// Appends the next batch; false at the end.
    fn append_batch(&mut self, columns: &mut [(String, Column)]) -> Result<bool, TableError> {
        let first_row = self.rows_read;
        let Some(batch) = self.next_batch()? else { return Ok(false) };
        for (name, column) in columns {
            self.append(name, column, &batch, first_row)?;
        }
        Ok(true)
    }

    /// The next batch as Arrow arrays; nulls are not yet looked for.
    pub(crate) fn next_batch(&mut self) -> Result<Option<RecordBatch>, TableError> {
        let (path, reader) = (&self.path, &mut self.reader);
        let batch = guarded(path, || reader.next().transpose().map_err(TableError::arrow(path)))?;
        self.rows_read += batch.as_ref().map_or(0, |batch| batch.num_rows() as u64);
        Ok(batch)
    }

    fn append(&self, name: &str, column: &mut Column, batch: &RecordBatch, first_row: u64) -> Result<(), TableError> {
        let array = self.array(name, column.kind(), batch, first_row)?;
        append_array(column, &array).ok_or_else(|| self.wrong(name, column.kind(), array.data_type().to_string()))
    }

    /// A column of a batch, without nulls where there must be none.
    fn array(
        &self,
        name: &str,
        expected: ColumnKind,
        batch: &RecordBatch,
        first_row: u64,
    ) -> Result<ArrayRef, TableError> {
        let array = batch.column_by_name(name).cloned().or_else(|| self.nulls(name, batch.num_rows()));
        let array = array.ok_or_else(|| self.wrong(name, expected, "missing".to_owned()))?;
        match first_null(&array, expected) {
            None => Ok(array),
            Some(row) => Err(TableError::Null {
                path: self.path.clone(),
                schema: self.schema,
                column: name.to_owned(),
                row: first_row + row as u64,
            }),
        }
    }

    /// A column that came later than the file.
    fn nulls(&self, name: &str, n_rows: usize) -> Option<ArrayRef> {
        let (_, kind) = self.absent.iter().find(|(absent, _)| absent == name)?;
        Some(new_null_array(&kind.nullable_type()?, n_rows))
    }

    fn wrong(&self, column: &str, expected: ColumnKind, found: String) -> TableError {
        TableError::ColumnKind {
            path: self.path.clone(),
            schema: self.schema,
            column: column.to_owned(),
            expected: expected.to_string(),
            found,
        }
    }

    /// The next batch as columns.
    fn next_columns(&mut self) -> Result<Option<Columns>, TableError> {
        let first_row = self.rows_read;
        let Some(batch) = self.next_batch()? else { return Ok(None) };
        let array = |(name, kind): &(String, ColumnKind)| {
            Ok((name.clone(), *kind, self.array(name, *kind, &batch, first_row)?))
        };
        let arrays = self.columns.iter().map(array).collect::<Result<_, TableError>>()?;
        Ok(Some(Columns::of_batch(&self.path, self.schema, arrays)))
    }
}

impl Iterator for TableReader {
    type Item = Result<Columns, TableError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_columns().transpose()
    }
}

/// Columns of a table by name; those that it does not have are left out.
fn columns_named(schema: &TableSchema, names: &[&str]) -> Vec<(String, ColumnKind)> {
    let columns = schema.columns();
    let named = |name: &&str| columns.iter().find(|(column, _)| column == name).cloned();
    names.iter().filter_map(named).collect()
}

/// The same file with its texts as numbers of words.
fn by_words(metadata: ArrowReaderMetadata) -> Result<ArrowReaderMetadata, ParquetError> {
    let words = || DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8));
    let field = |field: &FieldRef| match field.data_type() {
        DataType::Utf8 => Arc::new(field.as_ref().clone().with_data_type(words())),
        _ => Arc::clone(field),
    };
    let fields: Fields = metadata.schema().fields().iter().map(field).collect();
    let schema = Schema::new_with_metadata(fields, metadata.schema().metadata().clone());
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true).with_schema(Arc::new(schema));
    ArrowReaderMetadata::try_new(Arc::clone(metadata.metadata()), options)
}

/// Every column of a file, in order, with what it holds; `None` for a kind that no table of ours has.
///
/// # Errors
///
/// When the file is not there, or is truncated or corrupted.
pub fn file_columns(path: &Path) -> Result<Vec<(String, Option<ColumnKind>)>, TableError> {
    guarded(path, || {
        let file = artifact::open(path)?;
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let footer = ArrowReaderMetadata::load(&file, options).map_err(TableError::parquet(path))?;
        let fields = footer.metadata().file_metadata().schema().get_fields();
        Ok(fields.iter().map(|field| (field.name().to_owned(), ColumnKind::of(field))).collect())
    })
}

/// Positions of the wanted columns among the file's.
pub(super) fn find_roots(
    path: &Path,
    schema: &'static str,
    columns: &[(String, ColumnKind)],
    metadata: &ParquetMetaData,
) -> Result<Vec<usize>, TableError> {
    let fields = metadata.file_metadata().schema().get_fields();
    let find = |(name, expected): &(String, ColumnKind)| {
        let position = fields.iter().position(|field| field.name() == name);
        let Some(position) = position else {
            return Err(TableError::MissingColumn {
                path: path.to_owned(),
                schema,
                column: name.clone(),
                expected: expected.to_string(),
            });
        };
        let found = ColumnKind::of(&fields[position]);
        if found.is_some_and(|found| found.can_be_read_as(*expected)) {
            return Ok(position);
        }
        Err(TableError::ColumnKind {
            path: path.to_owned(),
            schema,
            column: name.clone(),
            expected: expected.to_string(),
            found: found.map_or_else(|| "of another kind".to_owned(), |found| found.to_string()),
        })
    };
    columns.iter().map(find).collect()
}

/// The first row without a value, where there must be one.
fn first_null(array: &ArrayRef, expected: ColumnKind) -> Option<usize> {
    let null_row =
        |array: &dyn Array| (array.null_count() > 0).then(|| (0..array.len()).find(|&row| array.is_null(row)));
    match expected.form {
        Form::Optional => None,
        Form::Required => null_row(array).flatten(),
        Form::List => null_row(array).flatten().or_else(|| {
            let list = array.as_list_opt::<i32>()?;
            let value = null_row(list.values()).flatten()?;
            list.offsets().windows(2).position(|ends| (ends[0]..ends[1]).contains(&(value as i32)))
        }),
    }
}
