//! Events alone, as an MCAP file that viewers list beside a recording or a video.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};
use prost::Message as _;

use super::error::RecordingError;
use super::schema::{Topic, foxglove, timestamp};
use crate::artifact::{AtomicFile, IoError};
use crate::program::KnownPrograms;

const CHANNEL: u16 = 1;
/// Fixed, because the library's default may change between versions.
const ZSTD_LEVEL: u32 = 3;

/// A file of `foxglove.Event` messages being written. Dropped without [`EventWriter::finish`] it leaves nothing behind.
pub struct EventWriter {
    path: PathBuf,
    mcap: Writer<AtomicFile>,
    sequence: u32,
    buffer: Vec<u8>,
}

impl EventWriter {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// When it cannot be made.
    pub fn create(path: &Path) -> Result<Self, RecordingError> {
        let file = AtomicFile::create(path)?;
        let options = WriteOptions::new()
            .profile("")
            .library(format!("ntp/{} {}", env!("CARGO_PKG_VERSION"), mcap::LIBRARY_IDENTIFIER))
            .compression(Some(Compression::Zstd))
            .compression_level(ZSTD_LEVEL)
            .compression_threads(0);
        let failed = |error| failed(path, error);
        let mut mcap = options.create(file).map_err(failed)?;
        let topic = Topic::Event;
        let schema =
            mcap.add_schema(topic.message(), "protobuf", topic.descriptor(KnownPrograms::FIRST)).map_err(failed)?;
        let no_metadata = BTreeMap::new();
        mcap.add_channel_with_id(CHANNEL, schema, topic.name(), "protobuf", &no_metadata).map_err(failed)?;
        Ok(Self { path: path.to_owned(), mcap, sequence: 0, buffer: Vec::new() })
    }

    /// Writes an event at its end; both ends are included. Events must come in order of their ends.
    ///
    /// # Errors
    ///
    /// When the disk is full.
    pub fn write(
        &mut self,
        [begin_nanos, end_nanos]: [u64; 2],
        metadata: Vec<(&str, String)>,
    ) -> Result<(), RecordingError> {
        let pair = |(key, value): (&str, String)| foxglove::KeyValuePair { key: key.to_owned(), value };
        let event = foxglove::Event {
            start_time: Some(timestamp(begin_nanos)),
            end_time: Some(timestamp(end_nanos)),
            metadata: metadata.into_iter().map(pair).collect(),
        };
        self.buffer.clear();
        event.encode_raw(&mut self.buffer);
        let header = MessageHeader {
            channel_id: CHANNEL,
            sequence: self.sequence,
            log_time: end_nanos,
            publish_time: end_nanos,
        };
        self.sequence = self.sequence.wrapping_add(1);
        self.mcap.write_to_known_channel(&header, &self.buffer).map_err(|error| failed(&self.path, error))
    }

    /// Ends the file and gives it its name.
    ///
    /// # Errors
    ///
    /// When the disk is full or the name cannot be taken.
    pub fn finish(mut self) -> Result<(), RecordingError> {
        self.mcap.finish().map_err(|error| failed(&self.path, error))?;
        Ok(self.mcap.into_inner().commit()?)
    }
}

fn failed(path: &Path, error: McapError) -> RecordingError {
    match error {
        McapError::Io(source) => IoError::system("write", path)(source).into(),
        error => RecordingError::Write { path: path.to_owned(), source: Box::new(error) },
    }
}
