//! Reads rows of a table in many files one after another, as pieces of Arrow batches.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::RecordBatch;
use arrow::datatypes::{DataType, SchemaRef};

use crate::dataset::DatasetError;
use crate::dataset::edit::pieces::Piece;
use crate::dataset::files::layout::FilePlace;
use crate::table::BatchReader;

/// Rows of a batch; fewer where a row may hold a picture.
const BATCH_ROWS: usize = 8192;
const PICTURE_BATCH_ROWS: usize = 256;

/// Where a table's rows are.
#[derive(Clone, Copy, Debug)]
pub(super) enum TableFiles {
    /// In one file.
    Single(&'static str),
    /// In the numbered files of a folder.
    Numbered(&'static str),
}

impl TableFiles {
    pub(super) fn path(self, root: &Path, place: FilePlace) -> PathBuf {
        match self {
            Self::Single(file) => root.join(file),
            Self::Numbered(folder) => place.in_dataset(root, folder),
        }
    }
}

/// A place among the rows of a table.
pub(super) struct BatchCursor {
    root: PathBuf,
    files: TableFiles,
    schema: SchemaRef,
    batch_rows: usize,
    open: Option<(FilePlace, BatchReader)>,
    batch: RecordBatch,
    at: usize,
}

impl BatchCursor {
    /// Opens the table's first file, which says what columns it has.
    pub(super) fn open(root: &Path, files: TableFiles) -> Result<Self, DatasetError> {
        let path = files.path(root, FilePlace::default());
        let schema = Arc::clone(BatchReader::open(&path, 1)?.schema());
        let has_pictures = schema.fields().iter().any(|field| matches!(field.data_type(), DataType::Struct(_)));
        let batch_rows = if has_pictures { PICTURE_BATCH_ROWS } else { BATCH_ROWS };
        let batch = RecordBatch::new_empty(Arc::clone(&schema));
        Ok(Self { root: root.to_owned(), files, schema, batch_rows, open: None, batch, at: 0 })
    }

    /// Columns and metadata of the table.
    pub(super) fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    /// The next rows, of the file `place`.
    pub(super) fn take(&mut self, place: FilePlace, n_rows: usize) -> Result<Vec<Piece>, DatasetError> {
        if self.open.as_ref().is_none_or(|(open, _)| *open != place) {
            self.open_file(place)?;
        }
        let mut pieces = Vec::new();
        let mut n_left = n_rows;
        while n_left > 0 {
            if self.at == self.batch.num_rows() {
                self.next_batch(place)?;
                continue;
            }
            let end = self.batch.num_rows().min(self.at + n_left);
            pieces.push(Piece { batch: self.batch.clone(), begin: self.at, end });
            n_left -= end - self.at;
            self.at = end;
        }
        Ok(pieces)
    }

    fn open_file(&mut self, place: FilePlace) -> Result<(), DatasetError> {
        let path = self.files.path(&self.root, place);
        let reader = BatchReader::open(&path, self.batch_rows)?;
        if reader.schema().fields() != self.schema.fields() {
            let problem =
                format!("its columns are not those of {}", self.files.path(&self.root, FilePlace::default()).display());
            return Err(DatasetError::Count { path, problem });
        }
        self.batch = RecordBatch::new_empty(Arc::clone(&self.schema));
        self.at = 0;
        self.open = Some((place, reader));
        Ok(())
    }

    fn next_batch(&mut self, place: FilePlace) -> Result<(), DatasetError> {
        let batch = match &mut self.open {
            Some((_, reader)) => reader.next_batch()?,
            None => None,
        };
        let Some(batch) = batch else {
            let path = self.files.path(&self.root, place);
            return Err(DatasetError::Count {
                path,
                problem: "it ends before the rows that it should have".to_owned(),
            });
        };
        (self.batch, self.at) = (batch, 0);
        Ok(())
    }
}
