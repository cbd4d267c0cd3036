//! Encoded pictures of a table, by row, from a file that stays open.

use std::fs::File;
use std::path::{Path, PathBuf};

use arrow::array::AsArray as _;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder, RowSelection, RowSelectionPolicy,
};
use parquet::file::metadata::PageIndexPolicy;

use crate::artifact::{self, IoError};
use crate::table::guard::guarded;
use crate::table::read::find_roots;
use crate::table::{ColumnKind, Form, TableError, TableSchema, Value};

/// A column of pictures of one file. Its footer says where each page is, so that only the pages with the wanted rows
/// are read; a file without such an index is read from the beginning of a row group on.
pub(crate) struct PictureReader {
    path: PathBuf,
    schema: &'static str,
    column: String,
    file: File,
    footer: ArrowReaderMetadata,
    mask: ProjectionMask,
    /// The first row of each row group, and how many rows there are.
    groups: Vec<usize>,
}

impl PictureReader {
    /// Opens a file and reads its footer.
    ///
    /// # Errors
    ///
    /// When the file is not there, is damaged, or has no such column of pictures.
    pub(crate) fn open(path: &Path, schema: &TableSchema, column: &str) -> Result<Self, TableError> {
        guarded(path, || {
            let file = artifact::open(path)?;
            let options = ArrowReaderOptions::new()
                .with_skip_arrow_metadata(true)
                .with_offset_index_policy(PageIndexPolicy::Optional);
            let footer = ArrowReaderMetadata::load(&file, options).map_err(TableError::parquet(path))?;
            let kind = ColumnKind { value: Value::Picture, form: Form::Required };
            let metadata = footer.metadata();
            find_roots(path, schema.name(), &[(column.to_owned(), kind)], metadata)?;
            let leaves = metadata.file_metadata().schema_descr().columns().iter();
            let bytes = leaves.enumerate().filter(|(_, leaf)| leaf.path().parts() == [column, BYTES]);
            let mask = ProjectionMask::leaves(
                metadata.file_metadata().schema_descr(),
                bytes.map(|(position, _)| position).collect::<Vec<_>>(),
            );
            let mut groups = vec![0_usize];
            for group in metadata.row_groups() {
                let n_rows = usize::try_from(group.num_rows()).unwrap_or(0);
                groups.push(groups[groups.len() - 1].saturating_add(n_rows));
            }
            let (path, column) = (path.to_owned(), column.to_owned());
            Ok(Self { path, schema: schema.name(), column, file, footer, mask, groups })
        })
    }

    /// The pictures of some rows of the file, given in rising order.
    ///
    /// # Errors
    ///
    /// When there is no such row, it has no picture, or the file is damaged.
    pub(crate) fn read(&mut self, rows: &[usize]) -> Result<Vec<Vec<u8>>, TableError> {
        let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else { return Ok(Vec::new()) };
        let n_rows = self.groups[self.groups.len() - 1];
        if last >= n_rows {
            return Err(self.missing(last));
        }
        let group_of = |row: usize| self.groups.partition_point(|&begin| begin <= row) - 1;
        let (from, to) = (group_of(first), group_of(last) + 1);
        let (begin, end) = (self.groups[from], self.groups[to]);
        let ranges = rows.iter().map(|&row| row - begin..row - begin + 1);
        let selection = RowSelection::from_consecutive_ranges(ranges, end - begin);
        let mut pictures = Vec::with_capacity(rows.len());
        guarded(&self.path, || {
            let file = self.file.try_clone().map_err(IoError::system("read", &self.path))?;
            let reader = ParquetRecordBatchReaderBuilder::new_with_metadata(file, self.footer.clone())
                .with_projection(self.mask.clone())
                .with_row_groups((from..to).collect())
                .with_row_selection(selection)
                .with_row_selection_policy(RowSelectionPolicy::Selectors)
                .with_batch_size(rows.len())
                .build()
                .map_err(TableError::parquet(&self.path))?;
            for batch in reader {
                let batch = batch.map_err(TableError::arrow(&self.path))?;
                let bytes = batch.column(0).as_struct_opt().and_then(|fields| fields.column_by_name(BYTES));
                let bytes = bytes.and_then(|bytes| bytes.as_binary_opt::<i32>());
                pictures.extend(bytes.into_iter().flatten().map(|picture| picture.map(<[u8]>::to_vec)));
            }
            Ok(())
        })?;
        pictures.resize(rows.len(), None);
        let found = rows.iter().zip(pictures).map(|(&row, picture)| picture.ok_or_else(|| self.missing(row)));
        found.collect()
    }

    fn missing(&self, row: usize) -> TableError {
        let (path, column) = (self.path.clone(), self.column.clone());
        TableError::Null { path, schema: self.schema, column, row: row as u64 }
    }
}

/// The part of a picture that holds its bytes.
const BYTES: &str = "bytes";
