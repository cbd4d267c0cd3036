//! The messages of any MCAP file, whoever wrote it, in the order of the file.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

use mcap::McapError;
use mcap::records::{Record, op};

use super::error::{Damage, RecordingError};
use super::stream::{RawMessage, Stream, damaged};
use crate::artifact;

/// A channel as the file declares it, with its schema.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct AnyChannel {
    /// Its number in the file.
    pub(crate) id: u16,
    pub(crate) topic: String,
    /// How messages are encoded, as `cdr`.
    pub(crate) encoding: String,
    /// The message type's name; empty without a schema.
    pub(crate) schema: String,
    /// How the schema is encoded, as `ros2msg`; empty without a schema.
    pub(crate) schema_encoding: String,
    pub(crate) schema_data: Vec<u8>,
}

/// One message.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnyMessage<'a> {
    pub(crate) channel: &'a Arc<AnyChannel>,
    pub(crate) log_time_nanos: u64,
    pub(crate) publish_time_nanos: u64,
    pub(crate) data: &'a [u8],
}

/// A schema: name, encoding, text.
type Schema = (String, String, Vec<u8>);

/// Gives every message of a file to `visit`, in the memory of one chunk. Every checksum is checked.
///
/// # Errors
///
/// When the file is damaged, and whatever `visit` gives.
pub(crate) fn read_messages<E: From<RecordingError>>(
    path: &Path,
    mut visit: impl FnMut(&AnyMessage<'_>) -> Result<ControlFlow<()>, E>,
) -> Result<(), E> {
    let file = artifact::open(path).map_err(RecordingError::from)?;
    let mut schemas: BTreeMap<u16, Schema> = BTreeMap::new();
    let mut channels: BTreeMap<u16, Arc<AnyChannel>> = BTreeMap::new();
    let refused = Stream::whole(path, file)?.records(|opcode, record, offset| {
        match opcode {
            op::SCHEMA | op::CHANNEL => {
                let declaration = mcap::parse_record(opcode, record).map_err(|error| damaged(path, offset, error))?;
                declare(declaration, &mut schemas, &mut channels);
            }
            op::MESSAGE => {
                let raw =
                    RawMessage::parse(record, offset).ok_or_else(|| damaged(path, offset, McapError::UnexpectedEoc))?;
                let RawMessage { channel, sequence, log_time_nanos, publish_time_nanos, data, .. } = raw;
                let Some(channel) = channels.get(&channel) else {
                    let (path, source) = (path.to_owned(), Damage::UnknownChannel { channel, sequence });
                    return Err(RecordingError::Damaged { path, offset, source });
                };
                match visit(&AnyMessage { channel, log_time_nanos, publish_time_nanos, data }) {
                    Ok(ControlFlow::Continue(())) => {}
                    Ok(ControlFlow::Break(())) => return Ok(ControlFlow::Break(Ok(()))),
                    Err(error) => return Ok(ControlFlow::Break(Err(error))),
                }
            }
            _ => {}
        }
        Ok(ControlFlow::Continue(()))
    })?;
    refused.unwrap_or(Ok(()))
}

fn declare(record: Record<'_>, schemas: &mut BTreeMap<u16, Schema>, channels: &mut BTreeMap<u16, Arc<AnyChannel>>) {
    match record {
        Record::Schema { header, data } => {
            schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
        }
        // A channel that is declared again is the same.
        Record::Channel(of) if !channels.contains_key(&of.id) => {
            let (schema, schema_encoding, schema_data) = schemas.get(&of.schema_id).cloned().unwrap_or_default();
            let (id, topic, encoding) = (of.id, of.topic, of.message_encoding);
            channels.insert(id, Arc::new(AnyChannel { id, topic, encoding, schema, schema_encoding, schema_data }));
        }
        _ => {}
    }
}
