//! Tables as Arrow batches, every column of them: for what is carried from file to file as it is.

use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::RecordBatch;
use arrow::datatypes::{Schema, SchemaRef};
use parquet::arrow::arrow_reader::{ParquetRecordBatchReader, ParquetRecordBatchReaderBuilder};
use parquet::arrow::arrow_writer::{ArrowWriter, ArrowWriterOptions};
use parquet::arrow::{ArrowSchemaConverter, ProjectionMask};

use crate::artifact::{self, AtomicFile};
use crate::table::guard::guarded;
use crate::table::schema::ParsedSchema;
use crate::table::write::{WriteOptions, properties};
use crate::table::{ColumnKind, TableError};

type FileReaderBuilder = ParquetRecordBatchReaderBuilder<File>;

/// Reads every column of a file.
pub(crate) struct BatchReader {
    path: PathBuf,
    schema: SchemaRef,
    n_rows: u64,
    metadata: Vec<(String, String)>,
    reader: ParquetRecordBatchReader,
}

impl BatchReader {
    /// Opens a file, to be read in batches of so many rows.
    pub(crate) fn open(path: &Path, batch_rows: usize) -> Result<Self, TableError> {
        Self::open_with(path, |builder| builder.with_batch_size(batch_rows))
    }

    /// Opens the columns of a file that are wanted, to be read in batches of so many rows.
    pub(crate) fn open_columns(
        path: &Path,
        batch_rows: usize,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Self, TableError> {
        Self::open_with(path, |builder| projected(builder, is_wanted).with_batch_size(batch_rows))
    }

    /// Opens the same from a row on.
    pub(crate) fn open_from(
        path: &Path,
        first: usize,
        batch_rows: usize,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Self, TableError> {
        Self::open_with(path, |builder| projected(builder, is_wanted).with_offset(first).with_batch_size(batch_rows))
    }

    /// Opens some rows of a file, to be read as one batch or several.
    pub(crate) fn open_rows(path: &Path, rows: Range<usize>) -> Result<Self, TableError> {
        Self::open_with(path, |builder| builder.with_offset(rows.start).with_limit(rows.len()))
    }

    fn open_with(
        path: &Path,
        settings: impl FnOnce(FileReaderBuilder) -> FileReaderBuilder,
    ) -> Result<Self, TableError> {
        guarded(path, || {
            let file = artifact::open(path)?;
            let builder = FileReaderBuilder::try_new(file).map_err(TableError::parquet(path))?;
            let schema = Arc::clone(builder.schema());
            let footer = builder.metadata().file_metadata();
            let n_rows = footer.num_rows().max(0) as u64;
            let entries = footer.key_value_metadata().into_iter().flatten();
            let metadata = entries.filter_map(|entry| Some((entry.key.clone(), entry.value.clone()?))).collect();
            let reader = settings(builder).build().map_err(TableError::parquet(path))?;
            Ok(Self { path: path.to_owned(), schema, n_rows, metadata, reader })
        })
    }

    /// Its columns and metadata.
    pub(crate) fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    /// Rows of the file, as its footer says.
    pub(crate) fn n_rows(&self) -> u64 {
        self.n_rows
    }

    /// An entry of the file's key-value metadata.
    pub(crate) fn metadata(&self, key: &str) -> Option<&str> {
        self.metadata.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// The next rows; `None` at the end.
    pub(crate) fn next_batch(&mut self) -> Result<Option<RecordBatch>, TableError> {
        let (path, reader) = (&self.path, &mut self.reader);
        guarded(path, || reader.next().transpose().map_err(TableError::arrow(path)))
    }
}

/// Leaves out the columns that are not wanted.
fn projected(builder: FileReaderBuilder, is_wanted: impl Fn(&str) -> bool) -> FileReaderBuilder {
    let fields = builder.schema().fields().iter().enumerate();
    let roots: Vec<usize> = fields.filter(|(_, field)| is_wanted(field.name())).map(|(at, _)| at).collect();
    let mask = ProjectionMask::roots(builder.parquet_schema(), roots);
    builder.with_projection(mask)
}

/// Writes batches, each a row group. Dropped without [`BatchWriter::commit`] it leaves nothing.
pub(crate) struct BatchWriter {
    path: PathBuf,
    writer: ArrowWriter<AtomicFile>,
}

impl BatchWriter {
    /// Begins a file with the columns and the metadata of an Arrow schema. `name` is that of Parquet's message.
    pub(crate) fn create(path: &Path, name: &str, schema: &Schema, options: WriteOptions) -> Result<Self, TableError> {
        let failed = TableError::parquet(path);
        let descriptor = ArrowSchemaConverter::new().schema_root(name).convert(schema).map_err(&failed)?;
        let fields = descriptor.root_schema().get_fields().iter();
        let columns = fields.filter_map(|field| Some((field.name().to_owned(), ColumnKind::of(field)?))).collect();
        let mut all = options;
        all.metadata.extend(schema.metadata().iter().map(|(key, value)| (key.clone(), value.clone())));
        all.metadata.sort_unstable();
        let parsed = ParsedSchema { descriptor, arrow: schema.clone(), columns };
        let options = ArrowWriterOptions::new()
            .with_properties(properties(&parsed, all))
            .with_skip_arrow_metadata(true)
            .with_parquet_schema(parsed.descriptor);
        let file = AtomicFile::create(path)?;
        let writer = ArrowWriter::try_new_with_options(file, Arc::new(parsed.arrow), options).map_err(&failed)?;
        Ok(Self { path: path.to_owned(), writer })
    }

    /// Writes rows as a row group.
    pub(crate) fn write(&mut self, batch: &RecordBatch) -> Result<(), TableError> {
        let failed = TableError::parquet(&self.path);
        self.writer.write(batch).map_err(&failed)?;
        self.writer.flush().map_err(&failed)
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
}
