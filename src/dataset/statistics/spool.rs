//! Keys on disk until the quantiles are selected: memory does not grow with their number.
//!
//! The file has no name: the system removes it with the process, however that ends.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use crate::artifact::IoError;
use crate::dataset::statistics::quantile::Selector;

const BUFFER_BYTES: usize = 1 << 18;

/// Sorted keys of each episode and dimension, in the order of writing.
pub(super) struct Spool {
    folder: PathBuf,
    file: BufWriter<File>,
    n_blocks: u64,
    bytes: Vec<u8>,
}

impl Spool {
    /// A spool in a folder, which must have room for all keys.
    pub(super) fn create(folder: &Path) -> Result<Self, IoError> {
        let file = tempfile::tempfile_in(folder).map_err(IoError::system("create a temporary file in", folder))?;
        let file = BufWriter::with_capacity(BUFFER_BYTES, file);
        Ok(Self { folder: folder.to_owned(), file, n_blocks: 0, bytes: Vec::new() })
    }

    /// Begins an episode of `n_keys` keys in each dimension.
    pub(super) fn begin_block(&mut self, n_keys: usize) -> Result<(), IoError> {
        self.n_blocks += 1;
        self.write(&(n_keys as u64).to_le_bytes())
    }

    /// Adds a dimension, with its lowest `key_bytes` bytes of each key.
    pub(super) fn append(&mut self, keys: &[u64], key_bytes: usize) -> Result<(), IoError> {
        let mut bytes = std::mem::take(&mut self.bytes);
        bytes.clear();
        match key_bytes {
            4 => keys.iter().for_each(|&key| bytes.extend_from_slice(&(key as u32).to_le_bytes())),
            1 => bytes.extend(keys.iter().map(|&key| key as u8)),
            _ => keys.iter().for_each(|&key| bytes.extend_from_slice(&key.to_le_bytes())),
        }
        let written = self.write(&bytes);
        self.bytes = bytes;
        written
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        self.file.write_all(bytes).map_err(IoError::system("write a temporary file in", &self.folder))
    }

    /// Passes over all keys until every selector is done. Selectors are in the order of the dimensions, each with the
    /// bytes of its keys.
    pub(super) fn select(self, selectors: &mut [(Selector, usize)]) -> Result<(), IoError> {
        let Self { folder, file, n_blocks, .. } = self;
        let failed = || IoError::system("read a temporary file in", &folder);
        let file = file.into_inner().map_err(|error| failed()(error.into_error()))?;
        let mut reader = BufReader::with_capacity(BUFFER_BYTES, file);
        while selectors.iter().any(|(selector, _)| !selector.is_done()) {
            pass(&mut reader, n_blocks, selectors).map_err(failed())?;
            selectors.iter_mut().filter(|(selector, _)| !selector.is_done()).for_each(|(one, _)| one.end_pass());
        }
        Ok(())
    }
}

fn pass(reader: &mut BufReader<File>, n_blocks: u64, selectors: &mut [(Selector, usize)]) -> std::io::Result<()> {
    let (mut bytes, mut keys) = (Vec::new(), Vec::new());
    reader.seek(SeekFrom::Start(0))?;
    for _ in 0..n_blocks {
        let mut n_keys = [0; 8];
        reader.read_exact(&mut n_keys)?;
        let n_keys = u64::from_le_bytes(n_keys) as usize;
        for (selector, key_bytes) in &mut *selectors {
            if selector.is_done() {
                reader.seek_relative((n_keys * *key_bytes) as i64)?;
                continue;
            }
            bytes.resize(n_keys * *key_bytes, 0);
            reader.read_exact(&mut bytes)?;
            decode(&bytes, *key_bytes, &mut keys);
            selector.count(&keys);
        }
    }
    Ok(())
}

fn decode(bytes: &[u8], key_bytes: usize, keys: &mut Vec<u64>) {
    keys.clear();
    match key_bytes {
        4 => keys.extend(bytes.as_chunks::<4>().0.iter().map(|&key| u64::from(u32::from_le_bytes(key)))),
        1 => keys.extend(bytes.iter().copied().map(u64::from)),
        _ => keys.extend(bytes.as_chunks::<8>().0.iter().map(|&key| u64::from_le_bytes(key))),
    }
}
