//! Rows as pieces of batches, and whole batches put together from them.

use std::sync::Arc;

use arrow::array::{RecordBatch, UInt32Array};
use arrow::compute::{concat_batches, take_record_batch};
use arrow::error::ArrowError;

/// Some rows of a batch.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) batch: RecordBatch,
    pub(super) begin: usize,
    pub(super) end: usize,
}

impl Piece {
    /// Its rows alone; nothing is copied.
    pub(super) fn rows(&self) -> RecordBatch {
        self.batch.slice(self.begin, self.end - self.begin)
    }
}

/// Rows until they are worth a row group. Holds no more of the batches than the rows need: what is picked from a batch
/// is copied when the next batch comes.
#[derive(Debug, Default)]
pub(super) struct Gather {
    done: Vec<RecordBatch>,
    open: Option<Open>,
    n_rows: usize,
    n_bytes: usize,
}

#[derive(Debug)]
struct Open {
    batch: RecordBatch,
    ranges: Vec<(usize, usize)>,
}

impl Gather {
    pub(super) fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// About how many bytes of memory the rows take.
    pub(super) fn n_bytes(&self) -> usize {
        self.n_bytes
    }

    /// Adds rows, which come after all before them.
    pub(super) fn push(&mut self, piece: &Piece) -> Result<(), ArrowError> {
        let n_rows = piece.end - piece.begin;
        self.n_rows += n_rows;
        self.n_bytes += piece.batch.get_array_memory_size() * n_rows / piece.batch.num_rows().max(1);
        match &mut self.open {
            Some(open) if is_same(&open.batch, &piece.batch) => match open.ranges.last_mut() {
                Some((_, end)) if *end == piece.begin => *end = piece.end,
                _ => open.ranges.push((piece.begin, piece.end)),
            },
            _ => {
                self.close()?;
                let ranges = vec![(piece.begin, piece.end)];
                self.open = Some(Open { batch: piece.batch.clone(), ranges });
            }
        }
        Ok(())
    }

    /// All rows as one batch; `None` when there are none. Then it begins anew.
    pub(super) fn take(&mut self) -> Result<Option<RecordBatch>, ArrowError> {
        self.close()?;
        (self.n_rows, self.n_bytes) = (0, 0);
        let done = std::mem::take(&mut self.done);
        let Some(first) = done.first() else { return Ok(None) };
        concat_batches(&first.schema(), &done).map(Some)
    }

    /// Takes the rows of the open batch, which is then let go.
    fn close(&mut self) -> Result<(), ArrowError> {
        let Some(Open { batch, ranges, .. }) = self.open.take() else { return Ok(()) };
        let is_whole = ranges[..] == [(0, batch.num_rows())];
        self.done.push(if is_whole {
            batch
        } else {
            let rows = ranges.into_iter().flat_map(|(begin, end)| begin as u32..end as u32);
            take_record_batch(&batch, &UInt32Array::from_iter_values(rows))?
        });
        Ok(())
    }
}

/// Whether two are one batch in memory, not only alike.
fn is_same(a: &RecordBatch, b: &RecordBatch) -> bool {
    a.columns().iter().zip(b.columns()).all(|(a, b)| Arc::ptr_eq(a, b))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use arrow::array::{AsArray as _, Int64Array};
    use arrow::datatypes::Int64Type;

    use super::{Gather, Piece, RecordBatch};

    fn batch(values: std::ops::Range<i64>) -> RecordBatch {
        RecordBatch::try_from_iter([("a", Arc::new(Int64Array::from_iter_values(values)) as _)]).unwrap()
    }

    #[test]
    fn rows_come_out_in_the_order_in_which_they_went_in() {
        let (first, second) = (batch(0..6), batch(6..10));
        let piece = |batch: &RecordBatch, begin, end| Piece { batch: batch.clone(), begin, end };
        let mut gather = Gather::default();
        for piece in [piece(&first, 1, 2), piece(&first, 2, 3), piece(&first, 5, 6), piece(&second, 0, 4)] {
            gather.push(&piece).unwrap();
        }
        assert_eq!(gather.n_rows(), 7);
        let rows = gather.take().unwrap().unwrap();
        assert_eq!(rows.column(0).as_primitive::<Int64Type>().values(), &[1, 2, 5, 6, 7, 8, 9]);
        assert!(gather.take().unwrap().is_none());
    }
}
