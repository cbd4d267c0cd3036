//! A copy of a Parquet file that tells no extension types of Arrow, for readers that do not know them.
//!
//! `LeRobot` declares arrays of several dimensions as extension types of `datasets`. They stand in the footer alone: the
//! rows are lists, which every reader knows.

use std::io::Seek as _;
use std::path::Path;

use parquet::arrow::ARROW_SCHEMA_META_KEY;
use parquet::arrow::arrow_reader::{ArrowReaderMetadata, ArrowReaderOptions};
use parquet::file::metadata::{FileMetaData, ParquetMetaData, ParquetMetaDataWriter};
use tempfile::{NamedTempFile, TempPath};

use crate::artifact::{self, IoError};
use crate::table::TableError;
use crate::table::guard::guarded;

/// The key of a field's extension type, as Arrow's format has it.
const EXTENSION: &str = "ARROW:extension:name";

/// A temporary copy without extension types; `None` where the file has none. Fixed lengths of lists are not told either.
///
/// # Errors
///
/// When the file cannot be read, or there is no room for a copy.
pub(crate) fn without_extensions(path: &Path) -> Result<Option<TempPath>, TableError> {
    guarded(path, || {
        let mut file = artifact::open(path)?;
        let footer = ArrowReaderMetadata::load(&file, ArrowReaderOptions::new()).map_err(TableError::parquet(path))?;
        let fields = footer.schema().flattened_fields();
        if !fields.iter().any(|field| field.metadata().contains_key(EXTENSION)) {
            return Ok(None);
        }
        let failed = || IoError::system("make a temporary copy of", path);
        let mut copy = NamedTempFile::new().map_err(failed())?;
        file.rewind().map_err(failed())?;
        std::io::copy(&mut file, copy.as_file_mut()).map_err(failed())?;
        // What comes last is the footer; the one before it is then no more than unused bytes.
        let plain = plain(footer.metadata());
        ParquetMetaDataWriter::new(copy.as_file_mut(), &plain).finish().map_err(TableError::parquet(path))?;
        Ok(Some(copy.into_temp_path()))
    })
}

/// The same metadata, without Arrow's own schema.
fn plain(metadata: &ParquetMetaData) -> ParquetMetaData {
    let file = metadata.file_metadata();
    let told = file.key_value_metadata().map(|all| {
        let others = all.iter().filter(|told| told.key != ARROW_SCHEMA_META_KEY);
        others.cloned().collect()
    });
    let file = FileMetaData::new(
        file.version(),
        file.num_rows(),
        file.created_by().map(str::to_owned),
        told,
        file.schema_descr_ptr(),
        file.column_orders().cloned(),
    );
    ParquetMetaData::new(file, metadata.row_groups().to_vec())
}
