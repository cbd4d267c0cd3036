//! What is whole of an MCAP file of anybody that is cut off or damaged.
//!
//! Records are copied up to where the file is cut, with the numbers of their channels, as `mcap recover` does. A chunk
//! is copied when its checksum is right and it can be decompressed, and left out otherwise. A recording of ours is read
//! episode by episode instead: see [`super::repair()`].
//!
//! # Invariants
//!
//! Memory holds one chunk, and the declarations of schemas and channels.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use mcap::records::{Channel, MessageHeader, Metadata, Record, op};
use mcap::{Compression, McapError, WriteOptions, Writer};
use serde::Serialize;

use super::chunk::Chunk;
use super::container::{Fields, Summary};
use super::error::RecordingError;
use super::file_records::{FileRecord, FileRecords};
use super::index::parse_metadata;
use super::plan::Attachment;
use super::reader::ShardReader;
use super::sink::ZSTD_LEVEL;
use super::stream::{RawMessage, Stream, damaged};
use super::survey::is_metadata;
use super::writer::{commit_in_order, failed};
use crate::artifact::{self, AtomicFile, IoError};

/// What became of an MCAP file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Recovery {
    /// Messages that were kept, all when the file is whole.
    pub messages: u64,
    /// Topics of these messages.
    pub topics: u64,
    /// How many messages the file says that it has; `None` where its end is not there to say it.
    pub counted: Option<u64>,
    /// Attachments that were kept.
    pub attachments: u64,
    /// Metadata records that were kept.
    pub metadata: u64,
    /// What was left out; nothing when the file is whole, and then nothing is written.
    pub lost: Vec<Lost>,
}

/// A part of a file that was left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Lost {
    /// Where it begins, in bytes.
    pub offset: u64,
    /// Its length in bytes.
    pub bytes: u64,
    /// What is wrong with it.
    pub problem: String,
}

/// Whether a file is a recording of ours, cut off or not: its metadata record comes before its first message.
pub fn is_own(path: &Path) -> bool {
    let first = || -> Result<Option<bool>, RecordingError> {
        let file = artifact::open(path)?;
        Stream::whole(path, file)?.records(|opcode, record, _offset| {
            Ok(match opcode {
                op::METADATA if is_metadata(record) => ControlFlow::Break(true),
                op::MESSAGE => ControlFlow::Break(false),
                _ => ControlFlow::Continue(()),
            })
        })
    };
    matches!(first(), Ok(Some(true))) || ShardReader::open(path).is_ok()
}

/// Writes what is whole of a file that is not.
///
/// # Errors
///
/// When no message is whole, or the file is no MCAP file.
pub fn recover(path: &Path, to: &Path) -> Result<Recovery, RecordingError> {
    let mut declared = Declared::default();
    let lost = walk(path, |opcode, record, offset| {
        declared.record(opcode, record, offset);
        Ok(())
    })?;
    let counted = counted_messages(path);
    if lost.is_empty() {
        let (messages, topics) = (declared.n_messages, declared.used.len() as u64);
        return Ok(Recovery { messages, topics, counted, ..Recovery::default() });
    }
    if declared.n_messages == 0 {
        let offset = lost.first().map_or(0, |lost| lost.offset);
        return Err(RecordingError::Truncated { path: path.to_owned(), offset });
    }
    let mut copy = Copy::begin(path, to, declared)?;
    walk(path, |opcode, record, offset| copy.record(opcode, record, offset))?;
    Ok(Recovery { counted, lost, ..copy.finish()? })
}

/// How many messages a file says that it has.
fn counted_messages(path: &Path) -> Option<u64> {
    let summary = Summary::read(&mut File::open(path).ok()?).ok()?;
    let (_, content, _) = summary.records().find(|(opcode, ..)| *opcode == op::STATISTICS)?;
    match mcap::parse_record(op::STATISTICS, content).ok()? {
        Record::Statistics(statistics) => Some(statistics.message_count),
        _ => None,
    }
}

/// Gives the records of a file, those of chunks one by one, that can be read; tells what cannot.
fn walk(
    path: &Path,
    mut visit: impl FnMut(u8, &[u8], u64) -> Result<(), RecordingError>,
) -> Result<Vec<Lost>, RecordingError> {
    let file = artifact::open(path)?;
    let size = file.metadata().map_err(IoError::system("read", path))?.len();
    let mut records = FileRecords::whole(file).map_err(|error| match error {
        McapError::BadMagic => RecordingError::NotMcap { path: path.to_owned() },
        error => damaged(path, 0, error),
    })?;
    let (mut chunk, mut lost) = (Chunk::default(), Vec::new());
    loop {
        let begin = records.offset();
        match records.next() {
            Ok(None) => return Ok(lost),
            Ok(Some(FileRecord { opcode: op::CHUNK, offset })) => {
                let bytes = records.offset() - offset;
                if let Err(error) =
                    open_chunk(&mut chunk, records.content(), |opcode, record| visit(opcode, record, offset))?
                {
                    lost.push(Lost { offset, bytes, problem: format!("a chunk: {error}") });
                }
            }
            Ok(Some(FileRecord { opcode, offset })) => visit(opcode, records.content(), offset)?,
            Err(McapError::Io(source)) => return Err(IoError::system("read", path)(source).into()),
            // A chunk that is left out is why, or a record outside of chunks has changed.
            Err(McapError::BadDataCrc { .. }) if !lost.is_empty() => {}
            Err(error @ McapError::BadDataCrc { .. }) => {
                lost.push(Lost { offset: begin, bytes: 0, problem: error.to_string() });
            }
            Err(error) => {
                // What stands behind the last record that is whole.
                let offset = begin.max(records.offset()).min(size);
                let problem = match error {
                    McapError::UnexpectedEof => "cut off".to_owned(),
                    error => error.to_string(),
                };
                lost.push(Lost { offset, bytes: size - offset, problem });
                return Ok(lost);
            }
        }
    }
}

/// Gives the records of a chunk; what is wrong with it, if it cannot be read.
fn open_chunk(
    chunk: &mut Chunk,
    content: &[u8],
    mut visit: impl FnMut(u8, &[u8]) -> Result<(), RecordingError>,
) -> Result<Result<(), McapError>, RecordingError> {
    if let Err(error) = chunk.fill(content) {
        return Ok(Err(error));
    }
    while !chunk.is_empty() {
        match chunk.next() {
            Ok((opcode, record)) => visit(opcode, record)?,
            Err(error) => return Ok(Err(error)),
        }
    }
    Ok(Ok(()))
}

/// A schema: name, encoding, text.
type Schema = (String, String, Vec<u8>);

/// What a file declares, in its data or its summary, and how many messages can be kept.
#[derive(Default)]
struct Declared {
    profile: String,
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    /// Channels with messages.
    used: BTreeSet<u16>,
    n_messages: u64,
}

impl Declared {
    fn record(&mut self, opcode: u8, record: &[u8], offset: u64) {
        match opcode {
            op::HEADER => {
                let profile = Fields::new(record).text().unwrap_or_default();
                self.profile = String::from_utf8_lossy(profile).into_owned();
            }
            op::MESSAGE => {
                if let Some(message) = RawMessage::parse(record, offset) {
                    self.used.insert(message.channel);
                    self.n_messages += 1;
                }
            }
            op::SCHEMA | op::CHANNEL => match mcap::parse_record(opcode, record) {
                Ok(Record::Schema { header, data }) => {
                    let schema = (header.name, header.encoding, data.into_owned());
                    self.schemas.entry(header.id).or_insert(schema);
                }
                Ok(Record::Channel(channel)) => {
                    self.channels.entry(channel.id).or_insert(channel);
                }
                // It may be told again, at the end.
                _ => {}
            },
            _ => {}
        }
    }
}

/// The file that is written.
struct Copy {
    path: PathBuf,
    to: PathBuf,
    mcap: Writer<AtomicFile>,
    declared: Declared,
    kept: Recovery,
    used: BTreeSet<u16>,
}

impl Copy {
    fn begin(path: &Path, to: &Path, declared: Declared) -> Result<Self, RecordingError> {
        let options = WriteOptions::new()
            .profile(declared.profile.as_str())
            .library(format!("ntp/{} {}", env!("CARGO_PKG_VERSION"), mcap::LIBRARY_IDENTIFIER))
            .compression(Some(Compression::Zstd))
            .compression_level(ZSTD_LEVEL)
            .compression_threads(0);
        let wrong = |error| failed(to, error);
        let mut mcap = options.create(AtomicFile::create(to)?).map_err(wrong)?;
        for (&id, (name, encoding, text)) in declared.schemas.iter().filter(|(id, _)| **id != 0) {
            mcap.add_schema_with_id(id, name, encoding, text).map_err(wrong)?;
        }
        for (&id, of) in &declared.channels {
            let schema = if declared.schemas.contains_key(&of.schema_id) { of.schema_id } else { 0 };
            mcap.add_channel_with_id(id, schema, &of.topic, &of.message_encoding, &of.metadata).map_err(wrong)?;
        }
        let (path, to, kept, used) = (path.to_owned(), to.to_owned(), Recovery::default(), BTreeSet::new());
        Ok(Self { path, to, mcap, declared, kept, used })
    }

    fn record(&mut self, opcode: u8, record: &[u8], offset: u64) -> Result<(), RecordingError> {
        let copied = match opcode {
            op::MESSAGE => self.message(record, offset),
            op::ATTACHMENT => self.attachment(record),
            op::METADATA => self.metadata(record),
            _ => Ok(()),
        };
        copied.map_err(|error| failed(&self.to, error))
    }

    /// A message of a channel that is nowhere declared says nothing to anybody.
    fn message(&mut self, record: &[u8], offset: u64) -> Result<(), McapError> {
        let Some(message) = RawMessage::parse(record, offset) else { return Ok(()) };
        let RawMessage { channel, sequence, log_time_nanos, publish_time_nanos, data, .. } = message;
        if !self.declared.channels.contains_key(&channel) {
            return Ok(());
        }
        self.kept.messages += 1;
        self.used.insert(channel);
        let (channel_id, log_time, publish_time) = (channel, log_time_nanos, publish_time_nanos);
        self.mcap.write_to_known_channel(&MessageHeader { channel_id, sequence, log_time, publish_time }, data)
    }

    fn attachment(&mut self, record: &[u8]) -> Result<(), McapError> {
        let Some(attachment) = Attachment::parse(record).filter(|of| of.check(record).is_ok()) else { return Ok(()) };
        self.kept.attachments += 1;
        self.mcap.attach(&attachment.to_mcap())
    }

    fn metadata(&mut self, record: &[u8]) -> Result<(), McapError> {
        let (Some(name), Some(metadata)) = (Fields::new(record).text(), parse_metadata(record)) else { return Ok(()) };
        self.kept.metadata += 1;
        self.mcap.write_metadata(&Metadata { name: String::from_utf8_lossy(name).into_owned(), metadata })
    }

    fn finish(mut self) -> Result<Recovery, RecordingError> {
        let topics = self.used.iter().filter_map(|id| self.declared.channels.get(id)).map(|of| of.topic.as_str());
        let topics = topics.collect::<BTreeSet<&str>>().len() as u64;
        if self.kept.messages == 0 {
            return Err(RecordingError::Truncated { path: self.path, offset: 0 });
        }
        self.mcap.finish().map_err(|error| failed(&self.to, error))?;
        commit_in_order(self.mcap.into_inner(), &self.to)?;
        Ok(Recovery { topics, ..self.kept })
    }
}
