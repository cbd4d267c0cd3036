//! Batches in many files: a new one begins at a given size.

use std::path::{Path, PathBuf};

use arrow::array::RecordBatch;
use arrow::datatypes::SchemaRef;

use crate::dataset::files::layout::FilePlace;
use crate::table::{BatchWriter, TableError, WriteOptions};

/// Writes `FOLDER/chunk-000/file-000.parquet` and its successors.
pub(super) struct RollingBatches {
    root: PathBuf,
    folder: &'static str,
    name: &'static str,
    schema: SchemaRef,
    options: WriteOptions,
    file_bytes: usize,
    place: FilePlace,
    writer: Option<BatchWriter>,
    files: Vec<String>,
}

impl RollingBatches {
    pub(super) fn new(
        root: &Path,
        (folder, name): (&'static str, &'static str),
        schema: SchemaRef,
        options: WriteOptions,
        file_bytes: usize,
    ) -> Self {
        let (root, place) = (root.to_owned(), FilePlace::default());
        Self { root, folder, name, schema, options, file_bytes, place, writer: None, files: Vec::new() }
    }

    /// The file that the next row group goes to.
    pub(super) fn place(&self) -> FilePlace {
        self.place
    }

    /// Writes a row group. When the file is then as large as it shall be, it is ended.
    pub(super) fn write(&mut self, rows: &RecordBatch) -> Result<(), TableError> {
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => self.create()?,
        };
        writer.write(rows)?;
        if writer.bytes_written() < self.file_bytes {
            self.writer = Some(writer);
            return Ok(());
        }
        self.place = self.place.next();
        writer.commit()
    }

    /// Ends the last file. A table without rows still has its first file.
    pub(super) fn finish(mut self) -> Result<Vec<String>, TableError> {
        if self.files.is_empty() {
            self.writer = Some(self.create()?);
        }
        if let Some(writer) = self.writer {
            writer.commit()?;
        }
        Ok(self.files)
    }

    fn create(&mut self) -> Result<BatchWriter, TableError> {
        let path = self.place.in_dataset(&self.root, self.folder);
        self.files.push(self.place.relative(self.folder));
        BatchWriter::create(&path, self.name, &self.schema, self.options.clone())
    }
}
