//! Keys until quantiles are selected: in memory while they are few, else on disk, so that memory does not grow with how
//! many there are.
//!
//! The file has no name: the system removes it with the process, however that ends.

use std::fs::File;
use std::io::{BufReader, BufWriter, ErrorKind, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};

use tempfile::{SpooledData, SpooledTempFile};

use crate::artifact::IoError;
use crate::dataset::statistics::number::{n_bytes, read_keys};
use crate::dataset::statistics::quantile::Selector;

const BUFFER_BYTES: usize = 1 << 16;

/// Keys that are kept in memory; more go to a file.
const MEMORY_BYTES: usize = 1 << 26;

/// The keys of some rows at a time, column by column.
pub(super) struct Spool {
    folder: PathBuf,
    file: BufWriter<SpooledTempFile>,
    n_blocks: u64,
}

impl Spool {
    /// A spool in a folder, which must have room for all keys.
    pub(super) fn new(folder: &Path) -> Self {
        let file = BufWriter::with_capacity(BUFFER_BYTES, tempfile::spooled_tempfile_in(MEMORY_BYTES, folder));
        Self { folder: folder.to_owned(), file, n_blocks: 0 }
    }

    /// Begins a block of `n_rows` rows.
    pub(super) fn begin_block(&mut self, n_rows: usize) -> Result<(), IoError> {
        self.n_blocks += 1;
        self.append(&(n_rows as u64).to_le_bytes())
    }

    /// Adds a column of the block.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        self.file.write_all(bytes).map_err(IoError::system("write a temporary file in", &self.folder))
    }

    /// Passes over all keys until every selector is done. Selectors are by column, one for each dimension.
    pub(super) fn select(self, columns: &mut [Vec<Selector>]) -> Result<(), IoError> {
        let Self { folder, file, n_blocks } = self;
        let failed = || IoError::system("read a temporary file in", &folder);
        let file = file.into_inner().map_err(|error| failed()(error.into_error()))?;
        let mut keys = Keys::new(file.into_inner());
        while columns.iter().flatten().any(|selector| !selector.is_done()) {
            pass(&mut keys, n_blocks, columns).map_err(failed())?;
            columns.iter_mut().flatten().filter(|selector| !selector.is_done()).for_each(Selector::end_pass);
        }
        Ok(())
    }
}

/// Keys being read, wherever they are.
enum Keys {
    Memory { bytes: Vec<u8>, position: usize },
    Disk { reader: BufReader<File>, bytes: Vec<u8> },
}

impl Keys {
    fn new(data: SpooledData) -> Self {
        match data {
            SpooledData::InMemory(cursor) => Self::Memory { bytes: cursor.into_inner(), position: 0 },
            SpooledData::OnDisk(file) => {
                Self::Disk { reader: BufReader::with_capacity(BUFFER_BYTES, file), bytes: Vec::new() }
            }
        }
    }

    fn rewind(&mut self) -> std::io::Result<()> {
        match self {
            Self::Memory { position, .. } => *position = 0,
            Self::Disk { reader, .. } => reader.rewind()?,
        }
        Ok(())
    }

    /// The next bytes.
    fn take(&mut self, length: usize) -> std::io::Result<&[u8]> {
        match self {
            Self::Memory { bytes, position } => {
                let taken = bytes.get(*position..*position + length).ok_or(ErrorKind::UnexpectedEof)?;
                *position += length;
                Ok(taken)
            }
            Self::Disk { reader, bytes } => {
                bytes.resize(length, 0);
                reader.read_exact(bytes)?;
                Ok(bytes)
            }
        }
    }

    fn skip(&mut self, length: usize) -> std::io::Result<()> {
        match self {
            Self::Memory { position, .. } => *position += length,
            Self::Disk { reader, .. } => reader.seek_relative(length as i64)?,
        }
        Ok(())
    }
}

fn pass(spooled: &mut Keys, n_blocks: u64, columns: &mut [Vec<Selector>]) -> std::io::Result<()> {
    let mut keys = Vec::new();
    spooled.rewind()?;
    for _ in 0..n_blocks {
        let n_rows = spooled.take(8)?.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes)) as usize;
        for selectors in &mut *columns {
            let Some(dtype) = selectors.first().map(Selector::dtype) else { continue };
            let width = selectors.len();
            let length = n_rows * width * n_bytes(dtype);
            if selectors.iter().all(Selector::is_done) {
                spooled.skip(length)?;
                continue;
            }
            let bytes = spooled.take(length)?;
            for (dimension, selector) in selectors.iter_mut().enumerate().filter(|(_, selector)| !selector.is_done()) {
                read_keys(dtype, bytes, (dimension, width), &mut keys);
                selector.count(&keys);
            }
        }
    }
    Ok(())
}
