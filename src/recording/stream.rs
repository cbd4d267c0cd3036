//! Messages of a file one after the other, in the memory of one chunk.

use std::fs::File;
use std::io::{ErrorKind, Read as _, Seek as _, SeekFrom};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::records::op;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::container::{Fields, MAX_RECORD_BYTES};
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
    fn parse(record: &'a [u8], offset: u64) -> Option<Self> {
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
    chunk: Option<LinearReader>,
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
        let reader = LinearReader::new_with_options(options.with_emit_chunks(true));
        Self { path: path.to_owned(), file, reader, chunk: None, offset, last_log_time_nanos: 0 }
    }

    /// Gives messages to `visit` until it breaks; `None` when there are no more.
    pub(super) fn messages<T>(
        &mut self,
        mut visit: impl FnMut(&RawMessage<'_>) -> Result<ControlFlow<T>, RecordingError>,
    ) -> Result<Option<T>, RecordingError> {
        loop {
            let Self { path, reader, chunk, offset, last_log_time_nanos, .. } = self;
            let reading_chunk = chunk.is_some();
            let (opcode, record) = match chunk.as_mut().unwrap_or(reader).next_event() {
                Some(Ok(LinearReadEvent::Record { opcode, data })) => (opcode, data),
                Some(Ok(LinearReadEvent::ReadRequest(_))) => {
                    self.read_on()?;
                    continue;
                }
                // The chunk's record was whole, so it is its content that ends too early.
                Some(Err(McapError::UnexpectedEof)) if reading_chunk => {
                    return Err(damaged(path, *offset, McapError::UnexpectedEoc));
                }
                Some(Err(error)) => return Err(damaged(path, *offset, error)),
                None if reading_chunk => {
                    *chunk = None;
                    continue;
                }
                None => return Ok(None),
            };
            match opcode {
                op::CHUNK => *chunk = Some(chunk_reader(record).map_err(|error| damaged(path, *offset, error))?),
                op::MESSAGE => {
                    let message = RawMessage::parse(record, *offset);
                    let message = message.ok_or_else(|| damaged(path, *offset, McapError::UnexpectedEoc))?;
                    check_time(path, &message, last_log_time_nanos)?;
                    if let ControlFlow::Break(value) = visit(&message)? {
                        return Ok(Some(value));
                    }
                }
                _ => {}
            }
        }
    }

    /// What is asked for may be more, after a wrong length; so memory grows only with what is there.
    fn read_on(&mut self) -> Result<(), RecordingError> {
        if let Some(chunk) = &mut self.chunk {
            chunk.notify_read(0);
            return Ok(());
        }
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
    LinearReaderOptions::default().with_prevalidate_chunk_crcs(true).with_record_length_limit(MAX_RECORD_BYTES)
}

/// A reader of one chunk that has nothing else before it: where a damaged chunk ends before its stated size, the
/// library asks the decompressor for more for ever if other bytes follow.
fn chunk_reader(record: &[u8]) -> Result<LinearReader, McapError> {
    let mut fields = Fields::new(record);
    let mut header = || -> Option<(&[u8], u64)> {
        let [_start_time, _end_time, _uncompressed_size] = [fields.u64()?, fields.u64()?, fields.u64()?];
        let _checksum = fields.u32()?;
        Some((fields.text()?, fields.u64()?))
    };
    let (compression, compressed_size) = header().ok_or(McapError::UnexpectedEoc)?;
    let available = fields.rest().len() as u64;
    if compressed_size != available {
        return Err(McapError::BadChunkLength { header: compressed_size, available });
    }
    // Of uncompressed chunks the library does not check lengths.
    if compression != b"zstd" {
        return Err(McapError::UnsupportedCompression(String::from_utf8_lossy(compression).into_owned()));
    }
    let options = options().with_skip_start_magic(true).with_skip_end_magic(true);
    let mut reader = LinearReader::new_with_options(options);
    let framing = [&[op::CHUNK][..], &(record.len() as u64).to_le_bytes()].concat();
    for part in [&framing, record] {
        reader.insert(part.len()).copy_from_slice(part);
        reader.notify_read(part.len());
    }
    Ok(reader)
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
