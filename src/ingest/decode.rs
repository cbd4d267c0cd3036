//! Messages as values: ROS 2 by its message definitions, protobuf by reflection, JSON.

mod json;
mod protobuf;
mod ros2;

use super::value::Value;
use crate::recording::AnyChannel;
use crate::words::counted;

pub(super) use json::base64;

/// Decodes the messages of a channel.
pub(super) enum Decoder {
    Ros2(ros2::Layout),
    Protobuf(protobuf::Layout),
    Json,
}

impl Decoder {
    /// By what the channel declares.
    ///
    /// # Errors
    ///
    /// When its encoding is none that is read, or its schema is damaged, in words.
    pub(super) fn new(channel: &AnyChannel) -> Result<Self, String> {
        match (channel.encoding.as_str(), channel.schema_encoding.as_str()) {
            ("cdr", "ros2msg") => ros2::Layout::parse(&channel.schema, &channel.schema_data).map(Self::Ros2),
            ("protobuf", "protobuf") => {
                protobuf::Layout::parse(&channel.schema, &channel.schema_data).map(Self::Protobuf)
            }
            ("json", _) => Ok(Self::Json),
            (encoding, schema) => Err(format!(
                "its messages are {encoding:?} with a schema in {schema:?}; read are cdr with ros2msg, protobuf, and json"
            )),
        }
    }

    /// What a message says.
    ///
    /// # Errors
    ///
    /// When it is not as the schema says, in words.
    pub(super) fn decode(&self, data: &[u8]) -> Result<Value, String> {
        match self {
            Self::Ros2(layout) => layout
                .decode(data)
                .ok_or_else(|| format!("its {} are no {}", counted(data.len(), "byte"), layout.name())),
            Self::Protobuf(layout) => layout.decode(data),
            Self::Json => json::decode(data),
        }
    }
}
