//! What the MCAP library leaves to its users: framing of records, their fields, and a summary in a fixed order.
//!
//! # Source
//!
//! The MCAP specification, <https://mcap.dev/spec>: "Record Structure", "Summary Section", "Footer".

use std::io::{Read, Seek, SeekFrom, Write};

use mcap::records::op;

/// A reader takes no record that is longer, and no chunk that holds more: a wrong length must not exhaust memory.
pub(super) const MAX_RECORD_BYTES: usize = 256 << 20;
/// Opcode and length before each record.
pub(super) const FRAMING_BYTES: usize = 9;
/// The footer record and the closing magic.
const TAIL_BYTES: u64 = 9 + 8 + 8 + 4 + 8;

/// Records one after the other. Ends early, with [`Records::rest`] not empty, where no whole record follows.
pub(super) struct Records<'a>(&'a [u8]);

impl<'a> Records<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self(bytes)
    }

    /// What has not been taken yet.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.0
    }
}

impl<'a> Iterator for Records<'a> {
    /// Opcode, content, and the whole with its framing.
    type Item = (u8, &'a [u8], &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (&opcode, after) = self.0.split_first()?;
        let (length, _) = after.split_first_chunk()?;
        let end = usize::try_from(u64::from_le_bytes(*length)).ok()?.checked_add(FRAMING_BYTES)?;
        let (whole, rest) = self.0.split_at_checked(end)?;
        self.0 = rest;
        Some((opcode, &whole[FRAMING_BYTES..], whole))
    }
}

/// Fields of a record, one after the other; `None` where the record ends too early. The library reserves whatever a
/// text's length says, so records that no checksum has vouched for are taken apart here.
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn new(record: &'a [u8]) -> Self {
        Self(record)
    }

    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (bytes, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*bytes)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.bytes().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.bytes().map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.bytes().map(u64::from_le_bytes)
    }

    /// A text, which need not be UTF-8.
    pub(super) fn text(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.u32()?).ok()?;
        let (text, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(text)
    }

    /// What has not been taken yet.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.0
    }
}

/// The summary section of a file with the footer behind it.
pub(super) struct Summary {
    start: u64,
    /// From the start of the section to the closing magic, which is not included.
    bytes: Vec<u8>,
}

/// Why there is no sound summary.
pub(super) enum NoSummary {
    Io(std::io::Error),
    /// The file does not end as MCAP files do.
    CutOff,
    /// The file ends as it should and has no summary, or one too large to be held.
    Absent,
    /// The file ends as it should, but its footer points nowhere.
    Astray,
    Checksum {
        saved: u32,
        calculated: u32,
    },
}

impl Summary {
    /// Reads and checks the summary of a whole file.
    pub(super) fn read(file: &mut (impl Read + Seek)) -> Result<Self, NoSummary> {
        let size = file.seek(SeekFrom::End(0)).map_err(NoSummary::Io)?;
        let footer_start = size.checked_sub(TAIL_BYTES).ok_or(NoSummary::CutOff)?;
        let mut tail = [0; TAIL_BYTES as usize];
        file.seek(SeekFrom::Start(footer_start)).and_then(|_| file.read_exact(&mut tail)).map_err(NoSummary::Io)?;
        let footer = tail.strip_suffix(mcap::MAGIC).ok_or(NoSummary::CutOff)?;
        let Some((op::FOOTER, content, _)) = Records::new(footer).next() else { return Err(NoSummary::Astray) };
        let start = content.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
        let is_absent = start == 0 || size.saturating_sub(start) > MAX_RECORD_BYTES as u64;
        if start > footer_start {
            return Err(NoSummary::Astray);
        }
        if is_absent {
            let bytes = footer.to_vec();
            let checked = if start == 0 { Self { start, bytes }.check().map(drop) } else { Ok(()) };
            return Err(checked.err().unwrap_or(NoSummary::Absent));
        }
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(start)).map_err(NoSummary::Io)?;
        file.take(size - start - mcap::MAGIC.len() as u64).read_to_end(&mut bytes).map_err(NoSummary::Io)?;
        Self { start, bytes }.check()
    }

    /// Zero says that there is no checksum.
    fn check(self) -> Result<Self, NoSummary> {
        let (content, saved) = self.bytes.split_last_chunk().ok_or(NoSummary::Astray)?;
        let saved = u32::from_le_bytes(*saved);
        let calculated = if saved == 0 { 0 } else { crc32fast::hash(content) };
        if saved == calculated { Ok(self) } else { Err(NoSummary::Checksum { saved, calculated }) }
    }

    /// The records of the section, the footer included.
    pub(super) fn records(&self) -> Records<'_> {
        Records::new(&self.bytes)
    }

    /// Writes the section again with schemas and channels in the order of their ids. The library takes them from a
    /// hash map, so the bytes of two like files would differ.
    pub(super) fn write_in_order(mut self, file: &mut (impl Write + Seek)) -> std::io::Result<()> {
        let mut records: Vec<(u8, &[u8], &[u8])> = self.records().collect();
        let is_keyed = |opcode: u8| opcode == op::SCHEMA || opcode == op::CHANNEL;
        // Both groups lie before all others; the offsets of groups do not change within one.
        records.sort_by_key(|&(opcode, content, _)| match (is_keyed(opcode), content.first_chunk()) {
            (true, Some(id)) => (0, opcode, u16::from_le_bytes(*id)),
            _ => (1, 0, 0),
        });
        let mut bytes: Vec<u8> = records.into_iter().flat_map(|(_, _, whole)| whole).copied().collect();
        let content_end = bytes.len() - 4;
        let checksum = crc32fast::hash(&bytes[..content_end]);
        bytes[content_end..].copy_from_slice(&checksum.to_le_bytes());
        self.bytes = bytes;
        file.seek(SeekFrom::Start(self.start))?;
        file.write_all(&self.bytes)?;
        file.seek(SeekFrom::End(0)).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::Records;

    #[test]
    fn records_stop_at_a_cut() {
        let bytes = [5, 2, 0, 0, 0, 0, 0, 0, 0, b'a', b'b', 6, 9, 0];
        let mut records = Records::new(&bytes);
        assert_eq!(records.next().map(|(opcode, content, _)| (opcode, content)), Some((5, &b"ab"[..])));
        assert_eq!(records.next(), None);
        assert_eq!(records.rest(), [6, 9, 0]);
    }
}
