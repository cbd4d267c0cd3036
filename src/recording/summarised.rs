//! What the summary at the end of a file tells of the file.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use mcap::records::{AttachmentIndex, ChunkIndex, MessageIndex, MetadataIndex, Record, Statistics, op};

use super::container::Summary;
use super::error::RecordingError;
use super::index::{Channel, Contents, broken, parse_metadata, read_record};
use super::plan::PlanSearch;
use super::sink::{METADATA, PLAN};
use super::stream::damaged;
use super::survey::declare;
use crate::artifact::IoError;

/// The records of a summary. None of them need be there.
#[derive(Default)]
pub(super) struct Summarised {
    statistics: Option<Statistics>,
    schemas: BTreeMap<u16, String>,
    channels: BTreeMap<u16, Channel>,
    chunks: Vec<ChunkIndex>,
    metadata: Vec<MetadataIndex>,
    attachments: Vec<AttachmentIndex>,
}

impl Summarised {
    /// Takes a summary apart.
    pub(super) fn read(path: &Path, size: u64, summary: &Summary) -> Result<Self, RecordingError> {
        let mut found = Self::default();
        let mut records = summary.records();
        for (opcode, content, _) in records.by_ref() {
            // None is in a summary, and the library trusts its lengths.
            if opcode != op::ATTACHMENT {
                found.record(mcap::parse_record(opcode, content).map_err(|error| damaged(path, size, error))?);
            }
        }
        if !records.rest().is_empty() {
            return Err(broken(path, size, "whole record in the summary"));
        }
        found.chunks.sort_by_key(|chunk| chunk.chunk_start_offset);
        found.metadata.sort_by_key(|metadata| metadata.offset);
        found.attachments.sort_by_key(|attachment| attachment.offset);
        Ok(found)
    }

    fn record(&mut self, record: Record<'_>) {
        match record {
            Record::Statistics(statistics) => self.statistics = Some(statistics),
            Record::ChunkIndex(chunk) => self.chunks.push(chunk),
            Record::MetadataIndex(metadata) => self.metadata.push(metadata),
            Record::AttachmentIndex(attachment) => self.attachments.push(attachment),
            declaration => declare(declaration, &mut self.schemas, &mut self.channels),
        }
    }

    /// The contents of the file; `None` when the summary leaves something out.
    pub(super) fn contents(
        mut self,
        path: &Path,
        file: &mut File,
        size: u64,
    ) -> Result<Option<Contents>, RecordingError> {
        let Some(statistics) = self.statistics.take().filter(|statistics| self.is_complete(statistics)) else {
            return Ok(None);
        };
        let mut metadata = None;
        if let Some(MetadataIndex { offset, length, .. }) = self.metadata.iter().find(|index| index.name == METADATA) {
            let content = read_record(path, file, size, (*offset, *length), (op::METADATA, "metadata record"))?;
            metadata = Some(parse_metadata(&content).ok_or_else(|| broken(path, *offset, "metadata record"))?);
        }
        let mut plan = PlanSearch::default();
        for AttachmentIndex { offset, length, .. } in self.attachments.iter().filter(|index| index.name == PLAN) {
            let content = read_record(path, file, size, (*offset, *length), (op::ATTACHMENT, "attachment"))?;
            plan.attachment(path, *offset, &content)?;
        }
        Ok(Some(Contents {
            channels: self.channels,
            messages: statistics.channel_message_counts,
            end_nanos: statistics.message_end_time,
            n_chunks: self.chunks.len() as u64,
            chunks: self.chunks,
            metadata,
            plan_json: plan.finish()?,
            starts: None,
        }))
    }

    /// Whether everything that the statistics count is listed. Any kind of record may be left out of a summary.
    fn is_complete(&self, statistics: &Statistics) -> bool {
        let listed = [self.channels.len(), self.chunks.len(), self.metadata.len(), self.attachments.len()];
        let counted =
            [statistics.channel_count, statistics.chunk_count, statistics.metadata_count, statistics.attachment_count];
        let has_schemas = self.schemas.len() == usize::from(statistics.schema_count);
        let n_messages: u64 = statistics.channel_message_counts.values().sum();
        has_schemas && listed.map(|n| n as u64) == counted.map(u64::from) && n_messages == statistics.message_count
    }
}

/// Log time of each message of some channels, and where its chunk begins, by the indexes of the messages of each chunk.
pub(super) fn places(
    path: &Path,
    file: &mut File,
    chunks: &[ChunkIndex],
    channels: &[u16],
) -> Result<Vec<(u64, u64)>, RecordingError> {
    let size = file.metadata().map_err(IoError::system("read", path))?.len();
    let mut places = Vec::new();
    for chunk in chunks {
        for channel in channels {
            let Some(&offset) = chunk.message_index_offsets.get(channel) else { continue };
            let content = read_record(path, file, size, (offset, 0), (op::MESSAGE_INDEX, "message index"))?;
            let record = mcap::parse_record(op::MESSAGE_INDEX, &content);
            let Record::MessageIndex(MessageIndex { mut records, .. }) =
                record.map_err(|error| damaged(path, offset, error))?
            else {
                return Err(broken(path, offset, "message index"));
            };
            records.sort_by_key(|entry| entry.offset);
            places.extend(records.iter().map(|entry| (entry.log_time, chunk.chunk_start_offset)));
        }
    }
    Ok(places)
}
