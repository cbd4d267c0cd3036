//! Reads the rows of a table in many files one after another, and knows where each one is.

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::dataset::DatasetError;
use crate::dataset::files::layout::FilePlace;
use crate::table::{Batch, TableReader};

/// Rows of a batch, one after another.
pub(crate) struct Rows<'c, B> {
    cursor: &'c Cursor<B>,
    pub(crate) batch: &'c B,
    /// Which rows of the batch.
    pub(crate) range: Range<usize>,
}

impl<B: Batch> Rows<'_, B> {
    /// The path of their file.
    pub(crate) fn path(&self) -> PathBuf {
        self.cursor.path()
    }

    /// Names one of the rows by its place in the batch.
    pub(crate) fn problem(&self, at: usize, problem: String) -> DatasetError {
        let after = self.range.end.saturating_sub(at + 1) as u64;
        let row = self.cursor.row().saturating_sub(after);
        DatasetError::Row { path: self.path(), row, problem }
    }
}

/// A place among the rows of the files of one folder.
pub(crate) struct Cursor<B> {
    root: PathBuf,
    folder: &'static str,
    open: Option<OpenFile<B>>,
}

struct OpenFile<B> {
    place: FilePlace,
    reader: TableReader,
    batch: Option<(B, usize)>,
    at: usize,
    /// Of the file; the one that was read last.
    row: Option<u64>,
}

impl<B: Batch> Cursor<B> {
    pub(crate) fn new(root: &Path, folder: &'static str) -> Self {
        Self { root: root.to_owned(), folder, open: None }
    }

    /// Reads the next row, which must be in the file `place`: the one before must then have ended.
    pub(crate) fn next(&mut self, place: FilePlace) -> Result<(&B, usize), DatasetError> {
        if self.open.as_ref().is_none_or(|open| open.place != place) {
            self.finish()?;
            self.open = Some(self.open_file(place)?);
        }
        let has_row = match &mut self.open {
            Some(open) => open.advance()?,
            None => false,
        };
        let row = self.open.as_ref().filter(|_| has_row).and_then(|open| Some((&open.batch.as_ref()?.0, open.at)));
        row.ok_or_else(|| self.count("it ends before the rows that it should have"))
    }

    /// Reads the next rows, at most `n_rows` and at least one, as [`Cursor::next`] does: those that lie in one batch.
    pub(crate) fn next_rows(&mut self, place: FilePlace, n_rows: usize) -> Result<Rows<'_, B>, DatasetError> {
        let (_, begin) = self.next(place)?;
        let n_further = match &mut self.open {
            Some(open) => open.advance_in_batch(n_rows.saturating_sub(1))?,
            None => 0,
        };
        let cursor = &*self;
        let batch = cursor.open.as_ref().and_then(|open| Some(&open.batch.as_ref()?.0));
        let batch = batch.ok_or_else(|| cursor.count("it ends before the rows that it should have"))?;
        Ok(Rows { cursor, batch, range: begin..begin + n_further + 1 })
    }

    /// Reads the next row, of the file that is open or, when it has ended, of the one after it.
    pub(crate) fn next_in_order(&mut self) -> Result<(&B, usize), DatasetError> {
        let place = match &self.open {
            None => FilePlace::default(),
            Some(open) if open.has_more() => open.place,
            Some(open) => open.place.next(),
        };
        self.next(place)
    }

    /// Makes sure that nothing is left of the open file.
    pub(crate) fn finish(&self) -> Result<(), DatasetError> {
        match &self.open {
            Some(open) if open.has_more() => Err(self.count("it has more rows than it should have")),
            _ => Ok(()),
        }
    }

    fn count(&self, problem: &str) -> DatasetError {
        DatasetError::Count { path: self.path(), problem: problem.to_owned() }
    }

    /// Which file the row that was read last is in.
    pub(crate) fn place(&self) -> FilePlace {
        self.open.as_ref().map_or(FilePlace::default(), |open| open.place)
    }

    /// The path of that file.
    pub(crate) fn path(&self) -> PathBuf {
        self.place().in_dataset(&self.root, self.folder)
    }

    /// Names the row that was read last.
    pub(crate) fn problem(&self, problem: String) -> DatasetError {
        DatasetError::Row { path: self.path(), row: self.row(), problem }
    }

    /// The number of the row that was read last, in its file.
    fn row(&self) -> u64 {
        self.open.as_ref().and_then(|open| open.row).unwrap_or(0)
    }

    fn open_file(&self, place: FilePlace) -> Result<OpenFile<B>, DatasetError> {
        let path = place.in_dataset(&self.root, self.folder);
        let reader = TableReader::open_batches(&path, &B::SCHEMA, B::COLUMNS)?;
        Ok(OpenFile { place, reader, batch: None, at: 0, row: None })
    }
}

impl<B: Batch> OpenFile<B> {
    /// Steps to the next row; false at the end of the file.
    fn advance(&mut self) -> Result<bool, DatasetError> {
        if !self.has_more() {
            return Ok(false);
        }
        self.at = if self.row.is_some() { self.at + 1 } else { 0 };
        self.row = Some(self.row.map_or(0, |row| row + 1));
        self.take_batch_if_spent()?;
        if !self.has_more() {
            self.check_end()?;
        }
        Ok(true)
    }

    /// Steps over rows of the batch, at most as many as there are; gives how many.
    fn advance_in_batch(&mut self, n_rows: usize) -> Result<usize, DatasetError> {
        let Some(row) = self.row else { return Ok(0) };
        let in_batch = self.batch.as_ref().map_or(0, |(_, n_rows)| n_rows.saturating_sub(self.at + 1));
        let in_file = self.reader.n_rows().saturating_sub(row + 1);
        let n_further = n_rows.min(in_batch).min(usize::try_from(in_file).unwrap_or(usize::MAX));
        self.at += n_further;
        self.row = Some(row + n_further as u64);
        if n_further > 0 && !self.has_more() {
            self.check_end()?;
        }
        Ok(n_further)
    }

    /// Makes sure that nothing follows the last row: what is broken there is broken for readers of whole files.
    fn check_end(&mut self) -> Result<(), DatasetError> {
        match self.reader.next() {
            None => Ok(()),
            Some(Err(error)) => Err(error.into()),
            Some(Ok(_)) => {
                let (path, problem) = (self.reader.path().to_owned(), "it has rows that its footer does not count");
                Err(DatasetError::Count { path, problem: problem.to_owned() })
            }
        }
    }

    fn has_more(&self) -> bool {
        self.row.map_or(0, |row| row + 1) < self.reader.n_rows()
    }

    fn take_batch_if_spent(&mut self) -> Result<(), DatasetError> {
        while self.batch.as_ref().is_none_or(|(_, n_rows)| self.at >= *n_rows) {
            let Some(columns) = self.reader.next() else {
                let path = self.reader.path().to_owned();
                return Err(DatasetError::Count {
                    path,
                    problem: "its footer counts rows that are not there".to_owned(),
                });
            };
            let mut columns = columns?;
            let n_rows = columns.n_rows();
            self.batch = Some((B::take(&mut columns)?, n_rows));
            self.at = 0;
        }
        Ok(())
    }
}
