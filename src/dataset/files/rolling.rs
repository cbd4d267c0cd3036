//! A table in many files: row groups of whole episodes, and a new file at a given size.

use std::path::{Path, PathBuf};

use crate::dataset::files::layout::FilePlace;
use crate::table::{BatchWriter, TableError, TableWriter};

/// A file that row groups are written to.
pub(crate) trait Sink: Sized {
    /// Size of what has been written, in bytes.
    fn bytes_written(&self) -> usize;

    /// Ends the file and gives it its name.
    fn commit(self) -> Result<(), TableError>;
}

impl Sink for TableWriter {
    fn bytes_written(&self) -> usize {
        Self::bytes_written(self)
    }

    fn commit(self) -> Result<(), TableError> {
        Self::commit(self)
    }
}

impl Sink for BatchWriter {
    fn bytes_written(&self) -> usize {
        Self::bytes_written(self)
    }

    fn commit(self) -> Result<(), TableError> {
        Self::commit(self)
    }
}

/// Begins a file.
type Begin<S> = Box<dyn Fn(&Path) -> Result<S, TableError>>;

/// Writes `FOLDER/chunk-000/file-000.parquet` and its successors.
pub(crate) struct Rolling<S> {
    root: PathBuf,
    folder: &'static str,
    begin: Begin<S>,
    file_bytes: usize,
    place: FilePlace,
    open: Option<S>,
    files: Vec<String>,
}

impl<S: Sink> Rolling<S> {
    pub(crate) fn new(
        root: &Path,
        folder: &'static str,
        file_bytes: usize,
        begin: impl Fn(&Path) -> Result<S, TableError> + 'static,
    ) -> Self {
        let (root, place) = (root.to_owned(), FilePlace::default());
        Self { root, folder, begin: Box::new(begin), file_bytes, place, open: None, files: Vec::new() }
    }

    /// The file that the next row group goes to.
    pub(crate) fn place(&self) -> FilePlace {
        self.place
    }

    /// Writes one row group. When the file is then as large as it shall be, it is ended.
    pub(crate) fn write(&mut self, group: impl FnOnce(&mut S) -> Result<(), TableError>) -> Result<(), TableError> {
        let mut sink = match self.open.take() {
            Some(sink) => sink,
            None => self.begin()?,
        };
        group(&mut sink)?;
        if sink.bytes_written() < self.file_bytes {
            self.open = Some(sink);
            return Ok(());
        }
        self.place = self.place.next();
        sink.commit()
    }

    /// Ends the last file. A table without rows still has its first file.
    pub(crate) fn finish(mut self) -> Result<Vec<String>, TableError> {
        if self.files.is_empty() {
            self.open = Some(self.begin()?);
        }
        self.open.map_or(Ok(()), Sink::commit)?;
        Ok(self.files)
    }

    fn begin(&mut self) -> Result<S, TableError> {
        self.files.push(self.place.relative(self.folder));
        (self.begin)(&self.place.in_dataset(&self.root, self.folder))
    }
}
