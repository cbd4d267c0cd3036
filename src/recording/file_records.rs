//! The records of a file one after the other, with the checksums of its sections.
//!
//! The library's own reader holds every record in memory, also those that nobody asks for. Here a record is loaded when
//! its kind is read, and passed over otherwise, however long it is.
//!
//! # Source
//!
//! The MCAP specification, <https://mcap.dev/spec>: "Records", "Data End", "Footer".

use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom};

use crc32fast::Hasher;
use mcap::McapError;
use mcap::records::op;

use super::container::{FRAMING_BYTES, MAX_RECORD_BYTES};

/// How much is read from the file at a time.
const READ_BYTES: usize = 1 << 17;
/// Summary start, summary offset start and checksum.
const FOOTER_BYTES: usize = 8 + 8 + 4;

/// A file being read from its beginning, or from the beginning of a record, to its end.
pub(super) struct FileRecords {
    input: BufReader<File>,
    /// Of the next record.
    offset: u64,
    content: Vec<u8>,
    /// Of the section that is being read, as far as it has been read; `None` when reading began behind its beginning.
    checksum: Option<Hasher>,
    has_ended: bool,
}

/// Which record was read: its content is [`FileRecords::content`].
#[derive(Clone, Copy)]
pub(super) struct FileRecord {
    pub(super) opcode: u8,
    /// Where it begins.
    pub(super) offset: u64,
}

impl FileRecords {
    /// The whole file.
    pub(super) fn whole(mut file: File) -> Result<Self, McapError> {
        file.rewind()?;
        let mut records = Self::new(file, 0, Some(Hasher::new()));
        let mut magic = [0; mcap::MAGIC.len()];
        records.take(&mut magic)?;
        records.offset = magic.len() as u64;
        if magic == mcap::MAGIC { Ok(records) } else { Err(McapError::BadMagic) }
    }

    /// From the record at `offset` on.
    pub(super) fn from_record(mut file: File, offset: u64) -> Result<Self, McapError> {
        file.seek(SeekFrom::Start(offset))?;
        Ok(Self::new(file, offset, None))
    }

    fn new(file: File, offset: u64, checksum: Option<Hasher>) -> Self {
        let input = BufReader::with_capacity(READ_BYTES, file);
        Self { input, offset, content: Vec::new(), checksum, has_ended: false }
    }

    /// Where the next record begins.
    pub(super) fn offset(&self) -> u64 {
        self.offset
    }

    /// The content of the record that was read last.
    pub(super) fn content(&self) -> &[u8] {
        &self.content
    }

    /// Reads the next record whose kind is read; `None` behind the closing magic.
    pub(super) fn next(&mut self) -> Result<Option<FileRecord>, McapError> {
        while !self.has_ended {
            let offset = self.offset;
            let mut framing = [0; FRAMING_BYTES];
            // Neither framing nor content of the end of the data is part of a checksum.
            let data_checksum = match self.peek()? {
                op::DATA_END => self.checksum.take(),
                _ => None,
            };
            self.take(&mut framing)?;
            let (opcode, length) = framing.split_first().expect("framing is not empty");
            let length = u64::from_le_bytes(length.try_into().expect("a length has 8 bytes"));
            let is_loaded = self.record(*opcode, length)?;
            self.offset = offset.saturating_add(FRAMING_BYTES as u64).saturating_add(length);
            match *opcode {
                op::DATA_END => self.end_data(data_checksum)?,
                op::FOOTER => self.end_file()?,
                opcode if is_loaded => return Ok(Some(FileRecord { opcode, offset })),
                _ => {}
            }
        }
        Ok(None)
    }

    fn peek(&mut self) -> Result<u8, McapError> {
        self.input.fill_buf()?.first().copied().ok_or(McapError::UnexpectedEof)
    }

    fn take(&mut self, bytes: &mut [u8]) -> Result<(), McapError> {
        self.input.read_exact(bytes).map_err(|error| match error.kind() {
            std::io::ErrorKind::UnexpectedEof => McapError::UnexpectedEof,
            _ => McapError::Io(error),
        })?;
        if let Some(checksum) = &mut self.checksum {
            checksum.update(bytes);
        }
        Ok(())
    }

    /// Loads the content of a record, or passes it over; says which.
    fn record(&mut self, opcode: u8, length: u64) -> Result<bool, McapError> {
        let fits = length <= MAX_RECORD_BYTES as u64;
        match opcode {
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK | op::DATA_END | op::FOOTER if !fits => {
                Err(McapError::RecordTooLarge { opcode, len: length })
            }
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK => self.load(length, true),
            op::DATA_END | op::FOOTER => self.load(length, false),
            op::METADATA | op::ATTACHMENT if fits => self.load(length, true),
            _ => self.pass_over(length),
        }
    }

    /// A wrong length must not exhaust memory: it grows only with what is there.
    fn load(&mut self, length: u64, is_counted: bool) -> Result<bool, McapError> {
        self.content.clear();
        let n = (&mut self.input).take(length).read_to_end(&mut self.content)?;
        if n as u64 != length {
            return Err(McapError::UnexpectedEof);
        }
        match &mut self.checksum {
            Some(checksum) if is_counted => checksum.update(&self.content),
            _ => {}
        }
        Ok(true)
    }

    fn pass_over(&mut self, mut length: u64) -> Result<bool, McapError> {
        while length > 0 {
            let bytes = self.input.fill_buf()?;
            let n = bytes.len().min(usize::try_from(length).unwrap_or(usize::MAX));
            if n == 0 {
                return Err(McapError::UnexpectedEof);
            }
            if let Some(checksum) = &mut self.checksum {
                checksum.update(&bytes[..n]);
            }
            self.input.consume(n);
            length -= n as u64;
        }
        Ok(false)
    }

    /// Behind the end of the data. Zero says that there is no checksum.
    fn end_data(&mut self, checksum: Option<Hasher>) -> Result<(), McapError> {
        let saved = self.content.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
        let saved = saved.ok_or(McapError::UnexpectedEoc)?;
        self.checksum = Some(Hasher::new());
        match checksum.map(Hasher::finalize) {
            Some(calculated) if saved != 0 && saved != calculated => Err(McapError::BadDataCrc { saved, calculated }),
            _ => Ok(()),
        }
    }

    /// Behind the footer: its checksum, the magic, and nothing.
    fn end_file(&mut self) -> Result<(), McapError> {
        let footer: &[u8; FOOTER_BYTES] = self.content.first_chunk().ok_or(McapError::UnexpectedEoc)?;
        let (counted, saved) = footer.split_last_chunk().expect("a footer ends with its checksum");
        let saved = u32::from_le_bytes(*saved);
        if let Some(mut checksum) = self.checksum.take() {
            checksum.update(counted);
            let calculated = checksum.finalize();
            if saved != 0 && saved != calculated {
                return Err(McapError::BadSummaryCrc { saved, calculated });
            }
        }
        let mut magic = [0; mcap::MAGIC.len()];
        self.take(&mut magic)?;
        if magic != mcap::MAGIC {
            return Err(McapError::BadMagic);
        }
        self.has_ended = true;
        if self.input.fill_buf()?.is_empty() { Ok(()) } else { Err(McapError::BytesAfterEndMagic) }
    }
}
