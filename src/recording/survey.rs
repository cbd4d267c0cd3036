//! What is in a file whose end does not tell: the file is read through.

use std::collections::BTreeMap;
use std::fs::File;
use std::ops::ControlFlow;
use std::path::Path;

use mcap::records::{Record, op};

use super::container::Fields;
use super::error::{Damage, RecordingError};
use super::index::{Channel, Contents, broken, parse_metadata};
use super::plan::PlanSearch;
use super::schema::Topic;
use super::sink::METADATA;
use super::stream::{RawMessage, Stream, damaged};
use crate::artifact::IoError;

/// Reads a whole file and tells what is in it. Every checksum is checked.
pub(super) fn survey(path: &Path, file: &File) -> Result<Contents, RecordingError> {
    let file = file.try_clone().map_err(IoError::system("read", path))?;
    let mut stream = Stream::whole(path, file)?;
    let mut survey = Survey::default();
    let end: Option<()> = stream.records(|opcode, record, offset| {
        survey.record(path, opcode, record, offset)?;
        Ok(ControlFlow::Continue(()))
    })?;
    debug_assert!(end.is_none(), "nothing breaks");
    let Survey { contents, plan, starts, .. } = survey;
    Ok(Contents { n_chunks: stream.n_chunks(), plan_json: plan.finish()?, starts: Some(starts), ..contents })
}

/// What has been met so far.
#[derive(Default)]
struct Survey {
    contents: Contents,
    schemas: BTreeMap<u16, String>,
    plan: PlanSearch,
    starts: Vec<(u64, u64)>,
}

impl Survey {
    fn record(&mut self, path: &Path, opcode: u8, record: &[u8], offset: u64) -> Result<(), RecordingError> {
        match opcode {
            op::MESSAGE => self.message(path, record, offset),
            op::METADATA if is_metadata(record) => {
                let metadata = parse_metadata(record).ok_or_else(|| broken(path, offset, "metadata record"))?;
                self.contents.metadata.get_or_insert(metadata);
                Ok(())
            }
            op::ATTACHMENT => self.plan.attachment(path, offset, record),
            op::SCHEMA | op::CHANNEL => {
                let declaration = mcap::parse_record(opcode, record).map_err(|error| damaged(path, offset, error))?;
                declare(declaration, &mut self.schemas, &mut self.contents.channels);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn message(&mut self, path: &Path, record: &[u8], offset: u64) -> Result<(), RecordingError> {
        let message = RawMessage::parse(record, offset).ok_or_else(|| broken(path, offset, "message"))?;
        let RawMessage { channel, sequence, log_time_nanos, .. } = message;
        let Some(declared) = self.contents.channels.get(&channel) else {
            let (path, source) = (path.to_owned(), Damage::UnknownChannel { channel, sequence });
            return Err(RecordingError::Damaged { path, offset, source });
        };
        if declared.topic == Topic::EpisodeStart.name() {
            self.starts.push((log_time_nanos, offset));
        }
        *self.contents.messages.entry(channel).or_default() += 1;
        self.contents.end_nanos = self.contents.end_nanos.max(log_time_nanos);
        Ok(())
    }
}

/// Whether a metadata record is the one that every recording of ours has.
pub(super) fn is_metadata(record: &[u8]) -> bool {
    Fields::new(record).text() == Some(METADATA.as_bytes())
}

/// Takes a declaration of a schema or a channel.
pub(super) fn declare(record: Record<'_>, schemas: &mut BTreeMap<u16, String>, channels: &mut BTreeMap<u16, Channel>) {
    match record {
        Record::Schema { header, .. } => drop(schemas.insert(header.id, header.name)),
        Record::Channel(of) => {
            let schema = schemas.get(&of.schema_id).cloned().unwrap_or_default();
            channels.insert(of.id, Channel { topic: of.topic, schema, encoding: of.message_encoding });
        }
        _ => {}
    }
}
