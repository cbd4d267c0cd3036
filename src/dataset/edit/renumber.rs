//! Rows as they were, but for the columns of whole numbers that are counted anew.

use std::sync::Arc;

use arrow::array::{ArrayRef, Int64Array, RecordBatch};
use arrow::error::ArrowError;

use crate::dataset::edit::pieces::{Gather, Piece};

/// A table's rows that are not yet written.
pub(super) struct Renumbered<const N: usize> {
    gather: Gather,
    names: [&'static str; N],
    /// The numbers of the columns `names`, which must be as long as there are rows when these are taken.
    pub(super) numbers: [Vec<i64>; N],
}

impl<const N: usize> Renumbered<N> {
    pub(super) fn new(names: [&'static str; N]) -> Self {
        Self { gather: Gather::default(), names, numbers: std::array::from_fn(|_column| Vec::new()) }
    }

    pub(super) fn n_rows(&self) -> usize {
        self.gather.n_rows()
    }

    pub(super) fn n_bytes(&self) -> usize {
        self.gather.n_bytes()
    }

    /// Adds rows.
    pub(super) fn push(&mut self, pieces: &[Piece]) -> Result<(), ArrowError> {
        pieces.iter().try_for_each(|piece| self.gather.push(piece))
    }

    /// Fills a column up to the number of rows.
    pub(super) fn fill(&mut self, column: usize, number: i64) {
        self.numbers[column].resize(self.gather.n_rows(), number);
    }

    /// Adds a row's number to each of the columns.
    pub(super) fn push_numbers(&mut self, row: impl IntoIterator<Item = i64>) {
        self.numbers.iter_mut().zip(row).for_each(|(column, number)| column.push(number));
    }

    /// All rows with their new numbers; `None` when there are none. Then it begins anew.
    pub(super) fn take(&mut self) -> Result<Option<RecordBatch>, ArrowError> {
        let Some(rows) = self.gather.take()? else { return Ok(None) };
        let numbers =
            self.numbers.each_mut().map(|column| Arc::new(Int64Array::from(std::mem::take(column))) as ArrayRef);
        replace(&rows, self.names.into_iter().zip(numbers)).map(Some)
    }
}

/// The rows with other columns under the same names.
pub(super) fn replace<'n>(
    rows: &RecordBatch,
    columns: impl IntoIterator<Item = (&'n str, ArrayRef)>,
) -> Result<RecordBatch, ArrowError> {
    let mut all = rows.columns().to_vec();
    for (name, column) in columns {
        all[rows.schema_ref().index_of(name)?] = column;
    }
    RecordBatch::try_new(rows.schema(), all)
}
