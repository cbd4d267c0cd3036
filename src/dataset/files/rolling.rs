//! A table in many files: row groups of whole episodes, and a new file at a given size.

use std::path::{Path, PathBuf};

use crate::dataset::files::layout::FilePlace;
use crate::table::{TableError, TableSchema, TableWriter, Values, WriteOptions};

/// Writes `FOLDER/chunk-000/file-000.parquet` and its successors.
pub(crate) struct RollingTable {
    root: PathBuf,
    folder: &'static str,
    schema: TableSchema,
    options: WriteOptions,
    file_bytes: usize,
    place: FilePlace,
    writer: Option<TableWriter>,
    files: Vec<String>,
}

impl RollingTable {
    pub(crate) fn new(
        root: &Path,
        folder: &'static str,
        schema: TableSchema,
        options: WriteOptions,
        file_bytes: usize,
    ) -> Self {
        let (root, place) = (root.to_owned(), FilePlace::default());
        Self { root, folder, schema, options, file_bytes, place, writer: None, files: Vec::new() }
    }

    /// The file that the next row group goes to.
    pub(crate) fn place(&self) -> FilePlace {
        self.place
    }

    /// Writes one row group. When the file is then as large as it shall be, it is ended.
    pub(crate) fn write_row_group(&mut self, columns: &[(&str, Values<'_>)]) -> Result<(), TableError> {
        let mut writer = match self.writer.take() {
            Some(writer) => writer,
            None => self.create()?,
        };
        writer.write_row_group(columns)?;
        if writer.bytes_written() < self.file_bytes {
            self.writer = Some(writer);
            return Ok(());
        }
        self.place = self.place.next();
        writer.commit()
    }

    /// Ends the last file. A table without rows still has its first file.
    pub(crate) fn finish(mut self) -> Result<Vec<String>, TableError> {
        if self.files.is_empty() {
            self.writer = Some(self.create()?);
        }
        if let Some(writer) = self.writer {
            writer.commit()?;
        }
        Ok(self.files)
    }

    fn create(&mut self) -> Result<TableWriter, TableError> {
        let path = self.place.in_dataset(&self.root, self.folder);
        self.files.push(self.place.relative(self.folder));
        TableWriter::create(&path, &self.schema, self.options.clone())
    }
}
