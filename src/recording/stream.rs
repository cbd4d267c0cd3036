//! Messages of a file one after the other, in the memory of one chunk.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use zstd::bulk::Decompressor;

use super::container::{Fields, MAX_RECORD_BYTES, Records};
use super::error::{Damage, RecordingError};
use crate::artifact::IoError;

/// How much is read from the file at a time.
const READ_BYTES: usize = 1 << 17;

/// One message.
pub(super) struct RawMessage<'a> {
    pub(super) channel: u16,
    pub(super) sequence: u32,
    pub(super) log_time_nanos: u64,
    pub(super) data: &'a [u8],
    /// How far the file had been read, in bytes.
    pub(super) offset: u64,
}

impl<'a> RawMessage<'a> {
    pub(super) fn parse(record: &'a [u8], offset: u64) -> Option<Self> {
        let mut fields = Fields::new(record);
        let (channel, sequence, log_time_nanos) = (fields.u16()?, fields.u32()?, fields.u64()?);
        let _publish_time = fields.u64()?;
        Some(Self { channel, sequence, log_time_nanos, data: fields.rest(), offset })
    }
}

/// A file being read from some place to its end. Every checksum on the way is checked; a chunk's before any of its
/// messages is given out.
pub(super) struct Stream {
    path: PathBuf,
    file: File,
    reader: LinearReader,
    chunk: Chunk,
    /// How far the file has been read.
    offset: u64,
    last_log_time_nanos: u64,
}

impl Stream {
    /// The whole file.
    pub(super) fn whole(path: &Path, mut file: File) -> Result<Self, RecordingError> {
        file.rewind().map_err(IoError::system("read", path))?;
        let options = options()
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true);
        Ok(Self::new(path, file, options, 0))
    }

    /// From the chunk at `offset` on.
    pub(super) fn from_chunk(path: &Path, mut file: File, offset: u64) -> Result<Self, RecordingError> {
        file.seek(SeekFrom::Start(offset)).map_err(IoError::system("read", path))?;
        Ok(Self::new(path, file, options().with_skip_start_magic(true), offset))
    }

    fn new(path: &Path, file: File, options: LinearReaderOptions, offset: u64) -> Self {
        let reader = LinearReader::new_with_options(options);
        Self { path: path.to_owned(), file, reader, chunk: Chunk::default(), offset, last_log_time_nanos: 0 }
    }

    /// Gives messages to `visit` until it breaks; `None` when there are no more.
    pub(super) fn messages<T>(
        &mut self,
        mut visit: impl FnMut(&RawMessage<'_>) -> Result<ControlFlow<T>, RecordingError>,
    ) -> Result<Option<T>, RecordingError> {
        let (path, mut last_log_time_nanos) = (self.path.clone(), self.last_log_time_nanos);
        let value = self.records(|opcode, record, offset| {
            if opcode != op::MESSAGE {
                return Ok(ControlFlow::Continue(()));
            }
            let message =
                RawMessage::parse(record, offset).ok_or_else(|| damaged(&path, offset, McapError::UnexpectedEoc))?;
            check_time(&path, &message, &mut last_log_time_nanos)?;
            visit(&message)
        });
        self.last_log_time_nanos = last_log_time_nanos;
        value
    }

    /// Gives records (opcode, content, how far the file had been read) to `visit` until it breaks; those of a chunk one
    /// by one.
    pub(super) fn records<T>(
        &mut self,
        mut visit: impl FnMut(u8, &[u8], u64) -> Result<ControlFlow<T>, RecordingError>,
    ) -> Result<Option<T>, RecordingError> {
        loop {
            let Self { path, reader, chunk, offset, .. } = self;
            let damaged = |error| damaged(path, *offset, error);
            let (opcode, record) = if chunk.is_empty() {
                match reader.next_event() {
                    None => return Ok(None),
                    Some(Err(error)) => return Err(damaged(error)),
                    Some(Ok(LinearReadEvent::ReadRequest(_))) => {
                        self.read_on()?;
                        continue;
                    }
                    Some(Ok(LinearReadEvent::Record { opcode: op::CHUNK, data })) => {
                        chunk.fill(data).map_err(damaged)?;
                        continue;
                    }
                    Some(Ok(LinearReadEvent::Record { opcode, data })) => (opcode, data),
                }
            } else {
                chunk.next().map_err(damaged)?
            };
            if let ControlFlow::Break(value) = visit(opcode, record, *offset)? {
                return Ok(Some(value));
            }
        }
    }

    /// What is asked for may be more, after a wrong length; so memory grows only with what is there.
    fn read_on(&mut self) -> Result<(), RecordingError> {
        let n = loop {
            match self.file.read(self.reader.insert(READ_BYTES)) {
                Ok(n) => break n,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(IoError::system("read", &self.path)(error).into()),
            }
        };
        self.reader.notify_read(n);
        self.offset += n as u64;
        Ok(())
    }
}

fn options() -> LinearReaderOptions {
    LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(MAX_RECORD_BYTES)
}

/// The records of one chunk, decompressed at once.
///
/// The library can do it too, but it decompresses record by record at twice the cost, and where a damaged chunk ends
/// before its stated size it asks the decompressor for more for ever.
#[derive(Default)]
struct Chunk {
    content: Vec<u8>,
    /// How much of the content has been given out.
    position: usize,
    decompressor: Option<Decompressor<'static>>,
}

impl Chunk {
    /// Takes the place of the chunk before.
    fn fill(&mut self, record: &[u8]) -> Result<(), McapError> {
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
        self.content.clear();
        self.position = 0;
        match compression {
            b"zstd" => self.decompress(data, size.ok_or(McapError::ChunkTooLarge(uncompressed_size))?)?,
            b"" => self.content.extend_from_slice(data),
            _ => return Err(McapError::UnsupportedCompression(String::from_utf8_lossy(compression).into_owned())),
        }
        let calculated = crc32fast::hash(&self.content);
        if Some(self.content.len()) != size {
            return Err(McapError::UnexpectedEoc);
        }
        // Zero says that there is none.
        if saved != 0 && saved != calculated {
            return Err(McapError::BadChunkCrc { saved, calculated });
        }
        Ok(())
    }

    fn decompress(&mut self, data: &[u8], size: usize) -> Result<(), McapError> {
        let failed = |error: std::io::Error| McapError::DecompressionError(error.to_string());
        let decompressor = match &mut self.decompressor {
            Some(decompressor) => decompressor,
            none => none.insert(Decompressor::new().map_err(failed)?),
        };
        self.content.reserve_exact(size);
        decompressor.decompress_to_buffer(data, &mut self.content).map_err(failed)?;
        Ok(())
    }

    /// Whether all of it has been given out.
    fn is_empty(&self) -> bool {
        self.position == self.content.len()
    }

    /// The next record: opcode and content.
    fn next(&mut self) -> Result<(u8, &[u8]), McapError> {
        let next = Records::new(&self.content[self.position..]).next();
        let (opcode, content, whole) = next.ok_or(McapError::UnexpectedEoc)?;
        self.position += whole.len();
        Ok((opcode, content))
    }
}

fn check_time(path: &Path, message: &RawMessage<'_>, last_nanos: &mut u64) -> Result<(), RecordingError> {
    let (before_nanos, after_nanos) = (*last_nanos, message.log_time_nanos);
    if after_nanos < before_nanos {
        let source = Damage::TimeGoesBack { before_nanos, after_nanos };
        return Err(RecordingError::Damaged { path: path.to_owned(), offset: message.offset, source });
    }
    *last_nanos = after_nanos;
    Ok(())
}

/// The library's error with its place.
pub(super) fn damaged(path: &Path, offset: u64, error: McapError) -> RecordingError {
    match error {
        McapError::Io(source) => IoError::system("read", path)(source).into(),
        McapError::UnexpectedEof => RecordingError::Truncated { path: path.to_owned(), offset },
        error => RecordingError::Damaged { path: path.to_owned(), offset, source: Damage::Mcap(Box::new(error)) },
    }
}
