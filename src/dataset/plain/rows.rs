//! The rows of episodes, one after another, as batches of the columns that are wanted.

use std::path::{Path, PathBuf};

use arrow::array::RecordBatch;

use crate::dataset::DatasetError;
use crate::table::BatchReader;
use crate::words::counted;

/// Rows that are read at a time; fewer where a row may hold a picture.
const BATCH_ROWS: usize = 4096;
const PICTURE_BATCH_ROWS: usize = 64;

/// Which columns are wanted.
type Wanted = Box<dyn Fn(&str) -> bool>;

/// A place among the rows of a dataset's files. Going forward reads nothing twice.
pub(crate) struct RowCursor {
    batch_rows: usize,
    is_wanted: Wanted,
    open: Option<Open>,
}

struct Open {
    path: PathBuf,
    reader: BatchReader,
    /// What was read and not yet taken.
    batch: Option<RecordBatch>,
    /// Row of the file that comes next.
    next: usize,
}

impl RowCursor {
    /// One for all columns.
    pub(crate) fn new(has_pictures: bool) -> Self {
        Self::of_batches(if has_pictures { PICTURE_BATCH_ROWS } else { BATCH_ROWS })
    }

    /// One that reads so many rows at a time.
    pub(crate) fn of_batches(batch_rows: usize) -> Self {
        Self { batch_rows, is_wanted: Box::new(|_name| true), open: None }
    }

    /// One for some columns.
    pub(crate) fn of_columns(is_wanted: impl Fn(&str) -> bool + 'static) -> Self {
        Self { is_wanted: Box::new(is_wanted), ..Self::of_batches(BATCH_ROWS) }
    }

    /// Gives some rows of a file to `take`, a batch at a time.
    pub(crate) fn each<E: From<DatasetError>>(
        &mut self,
        path: &Path,
        first: usize,
        n_rows: usize,
        mut take: impl FnMut(RecordBatch) -> Result<(), E>,
    ) -> Result<(), E> {
        if self.open.as_ref().is_none_or(|open| open.path != path || open.next != first) {
            let reader = BatchReader::open_from(path, first, self.batch_rows, &self.is_wanted);
            let reader = reader.map_err(DatasetError::from)?;
            self.open = Some(Open { path: path.to_owned(), reader, batch: None, next: first });
        }
        let Some(open) = &mut self.open else { return Ok(()) };
        let mut n_left = n_rows;
        while n_left > 0 {
            let batch = match open.batch.take() {
                Some(batch) => Some(batch),
                None => open.reader.next_batch().map_err(DatasetError::from)?,
            };
            let Some(batch) = batch else {
                let problem = format!("it ends {n_left} before the end of an episode", n_left = counted(n_left, "row"));
                return Err(DatasetError::Count { path: path.to_owned(), problem }.into());
            };
            let n = n_left.min(batch.num_rows());
            if n < batch.num_rows() {
                open.batch = Some(batch.slice(n, batch.num_rows() - n));
            }
            open.next += n;
            n_left -= n;
            take(batch.slice(0, n))?;
        }
        Ok(())
    }
}
