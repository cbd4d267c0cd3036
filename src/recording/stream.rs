//! Messages of a file one after the other, in the memory of one chunk.

use std::fs::File;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::McapError;
use mcap::records::op;

use super::chunk::Chunk;
use super::container::Fields;
use super::error::{Damage, RecordingError};
use super::file_records::{FileRecord, FileRecords};
use crate::artifact::IoError;

/// One message.
pub(super) struct RawMessage<'a> {
    pub(super) channel: u16,
    pub(super) sequence: u32,
    pub(super) log_time_nanos: u64,
    pub(super) publish_time_nanos: u64,
    pub(super) data: &'a [u8],
    /// Where the message, or the chunk that it lies in, begins in the file.
    pub(super) offset: u64,
}

impl<'a> RawMessage<'a> {
    pub(super) fn parse(record: &'a [u8], offset: u64) -> Option<Self> {
        let mut fields = Fields::new(record);
        let (channel, sequence, log_time_nanos) = (fields.u16()?, fields.u32()?, fields.u64()?);
        let publish_time_nanos = fields.u64()?;
        Some(Self { channel, sequence, log_time_nanos, publish_time_nanos, data: fields.rest(), offset })
    }
}

/// A file being read from some place to its end. Every checksum on the way is checked; a chunk's before any of its
/// messages is given out.
pub(super) struct Stream {
    path: PathBuf,
    file: FileRecords,
    chunk: Chunk,
    /// Where the record, or the chunk, that is being given out begins.
    offset: u64,
    n_chunks: u64,
    last_log_time_nanos: u64,
}

impl Stream {
    /// The whole file.
    pub(super) fn whole(path: &Path, file: File) -> Result<Self, RecordingError> {
        Self::new(path, FileRecords::whole(file))
    }

    /// From the chunk, or the record outside of chunks, at `offset` on.
    pub(super) fn from_record(path: &Path, file: File, offset: u64) -> Result<Self, RecordingError> {
        Self::new(path, FileRecords::from_record(file, offset))
    }

    fn new(path: &Path, file: Result<FileRecords, McapError>) -> Result<Self, RecordingError> {
        let file = file.map_err(|error| damaged(path, 0, error))?;
        Ok(Self {
            path: path.to_owned(),
            file,
            chunk: Chunk::default(),
            offset: 0,
            n_chunks: 0,
            last_log_time_nanos: 0,
        })
    }

    /// How many chunks have been met.
    pub(super) fn n_chunks(&self) -> u64 {
        self.n_chunks
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

    /// Gives records (opcode, content, where they or their chunks begin) to `visit` until it breaks; those of a chunk one
    /// by one.
    pub(super) fn records<T>(
        &mut self,
        mut visit: impl FnMut(u8, &[u8], u64) -> Result<ControlFlow<T>, RecordingError>,
    ) -> Result<Option<T>, RecordingError> {
        loop {
            let Self { path, file, chunk, offset, n_chunks, .. } = self;
            let (opcode, record) = if chunk.is_empty() {
                let Some(next) = file.next().map_err(|error| damaged(path, file.offset(), error))? else {
                    return Ok(None);
                };
                let FileRecord { opcode, offset: begin } = next;
                *offset = begin;
                if opcode == op::CHUNK {
                    *n_chunks += 1;
                    chunk.fill(file.content()).map_err(|error| damaged(path, begin, error))?;
                    continue;
                }
                (opcode, file.content())
            } else {
                chunk.next().map_err(|error| damaged(path, *offset, error))?
            };
            if let ControlFlow::Break(value) = visit(opcode, record, *offset)? {
                return Ok(Some(value));
            }
        }
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
