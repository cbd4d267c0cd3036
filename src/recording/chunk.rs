//! The records of one chunk, decompressed at once.
//!
//! The library can do it too, but it decompresses record by record at twice the cost, and where a damaged chunk ends
//! before its stated size it asks the decompressor for more for ever.

use std::io::Read as _;

use mcap::McapError;
use zstd::bulk::Decompressor;

use super::container::{Fields, MAX_RECORD_BYTES, Records};

/// A chunk being given out record by record.
#[derive(Default)]
pub(super) struct Chunk {
    content: Vec<u8>,
    /// How much of the content has been given out.
    position: usize,
    decompressor: Option<Decompressor<'static>>,
}

impl Chunk {
    /// Takes the place of the chunk before.
    pub(super) fn fill(&mut self, record: &[u8]) -> Result<(), McapError> {
        let mut fields = Fields::new(record);
        let mut header = || -> Option<_> {
            let [_start_time, _end_time, uncompressed_size] = [fields.u64()?, fields.u64()?, fields.u64()?];
            Some((uncompressed_size, fields.u32()?, fields.text()?, fields.u64()?))
        };
        let (uncompressed_size, saved, compression, header) = header().ok_or(McapError::UnexpectedEoc)?;
        let (data, available) = (fields.rest(), fields.rest().len() as u64);
        if header != available {
            return Err(McapError::BadChunkLength { header, available });
        }
        let size = usize::try_from(uncompressed_size).ok().filter(|&size| size <= MAX_RECORD_BYTES);
        let size = size.ok_or(McapError::ChunkTooLarge(uncompressed_size))?;
        self.content.clear();
        self.position = 0;
        match compression {
            b"zstd" => self.decompress_zstd(data, size)?,
            b"lz4" => self.decompress_lz4(data, size)?,
            b"" => self.content.extend_from_slice(data),
            _ => return Err(McapError::UnsupportedCompression(String::from_utf8_lossy(compression).into_owned())),
        }
        if self.content.len() != size {
            return Err(McapError::UnexpectedEoc);
        }
        // Zero says that there is none.
        let calculated = if saved == 0 { 0 } else { crc32fast::hash(&self.content) };
        if saved == calculated { Ok(()) } else { Err(McapError::BadChunkCrc { saved, calculated }) }
    }

    fn decompress_zstd(&mut self, data: &[u8], size: usize) -> Result<(), McapError> {
        let decompressor = match &mut self.decompressor {
            Some(decompressor) => decompressor,
            none => none.insert(Decompressor::new().map_err(failed)?),
        };
        self.content.reserve_exact(size);
        decompressor.decompress_to_buffer(data, &mut self.content).map_err(failed)?;
        Ok(())
    }

    /// One byte more than there should be is enough to know that there is too much.
    fn decompress_lz4(&mut self, data: &[u8], size: usize) -> Result<(), McapError> {
        let decoder = lz4::Decoder::new(data).map_err(failed)?;
        decoder.take(size as u64 + 1).read_to_end(&mut self.content).map_err(failed)?;
        Ok(())
    }

    /// Whether all of it has been given out.
    pub(super) fn is_empty(&self) -> bool {
        self.position == self.content.len()
    }

    /// The next record: opcode and content.
    pub(super) fn next(&mut self) -> Result<(u8, &[u8]), McapError> {
        let next = Records::new(&self.content[self.position..]).next();
        let (opcode, content, whole) = next.ok_or(McapError::UnexpectedEoc)?;
        self.position += whole.len();
        Ok((opcode, content))
    }
}

fn failed(error: std::io::Error) -> McapError {
    McapError::DecompressionError(error.to_string())
}
