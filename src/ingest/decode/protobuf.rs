//! Protobuf by the descriptors that a file carries.

use std::sync::Arc;

use prost_reflect::{
    DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, ReflectMessage as _, Value as Found,
};

use crate::ingest::value::Value;

/// A message type.
pub(in crate::ingest) struct Layout(MessageDescriptor);

impl Layout {
    pub(super) fn parse(name: &str, descriptors: &[u8]) -> Result<Self, String> {
        let pool = DescriptorPool::decode(descriptors).map_err(|error| format!("its descriptors: {error}"))?;
        let found = pool.get_message_by_name(name);
        found.map(Self).ok_or_else(|| format!("its descriptors have no message {name}"))
    }

    pub(super) fn decode(&self, data: &[u8]) -> Result<Value, String> {
        let message = DynamicMessage::decode(self.0.clone(), data).map_err(|error| error.to_string())?;
        Ok(fields(&message))
    }
}

/// Fields in the order of their numbers. Those that a message leaves out have their default, messages none.
fn fields(message: &DynamicMessage) -> Value {
    let of = |field: FieldDescriptor| {
        let is_absent = field.supports_presence() && !message.has_field(&field);
        let found = if is_absent { Value::Nothing } else { value(&message.get_field(&field)) };
        (Arc::from(field.name()), found)
    };
    Value::Fields(message.descriptor().fields().map(of).collect())
}

fn value(found: &Found) -> Value {
    match found {
        Found::Bool(flag) => Value::Flag(*flag),
        Found::I32(whole) | Found::EnumNumber(whole) => Value::Whole(i64::from(*whole)),
        Found::I64(whole) => Value::Whole(*whole),
        Found::U32(whole) => Value::Whole(i64::from(*whole)),
        Found::U64(whole) => i64::try_from(*whole).map_or(Value::Number(*whole as f64), Value::Whole),
        Found::F32(number) => Value::Number(f64::from(*number)),
        Found::F64(number) => Value::Number(*number),
        Found::String(text) => Value::Text(text.clone()),
        Found::Bytes(bytes) => Value::Bytes(bytes.to_vec()),
        Found::Message(message) => fields(message),
        Found::List(values) => Value::List(values.iter().map(value).collect()),
        // Maps have no order.
        Found::Map(_) => Value::Nothing,
    }
}
