//! ROS 2: the common data representation (CDR), by the message definition that a file carries.
//!
//! # Source
//!
//! <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>; plain CDR of OMG DDS-XTypes 1.3, section 7.4.

use std::collections::BTreeMap;
use std::sync::Arc;

use re_ros_msg::MessageSchema;
use re_ros_msg::message_spec::{ArraySize, BuiltInType, ComplexType, MessageSpecification, Type};

use crate::ingest::value::Value;

/// The deepest that messages lie in each other.
const MAX_DEPTH: usize = 32;
/// Encapsulation kinds: plain CDR, big and little endian.
const BIG_ENDIAN: [u8; 2] = [0, 0];
const LITTLE_ENDIAN: [u8; 2] = [0, 1];

/// A message type with those that it holds.
pub(in crate::ingest) struct Layout {
    name: String,
    /// The message itself first.
    messages: Vec<Vec<(Arc<str>, Kind)>>,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Primitive(Primitive),
    Message(usize),
    List(Box<Kind>, Option<usize>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Primitive {
    Bool,
    Signed(usize),
    Unsigned(usize),
    Float32,
    Float64,
    Text,
}

impl Layout {
    pub(super) fn parse(name: &str, definition: &[u8]) -> Result<Self, String> {
        let text = std::str::from_utf8(definition).map_err(|error| format!("its message definition: {error}"))?;
        let schema = MessageSchema::parse(name, text).map_err(|error| format!("its message definition: {error:#}"))?;
        let specs = std::iter::once(&schema.spec).chain(&schema.dependencies);
        let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
        for (number, spec) in specs.clone().enumerate() {
            numbers.entry(short(&spec.name)).or_insert(number);
        }
        let messages = specs.map(|spec| fields(spec, &numbers)).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { name: name.to_owned(), messages })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// `None` when the bytes end too early, or are no plain CDR.
    pub(super) fn decode(&self, data: &[u8]) -> Option<Value> {
        let (header, content) = data.split_first_chunk::<4>()?;
        let is_little = match [header[0], header[1]] {
            BIG_ENDIAN => false,
            LITTLE_ENDIAN => true,
            _ => return None,
        };
        Cdr { content, at: 0, is_little }.message(self, 0, 0)
    }
}

/// `pkg/msg/Name` as `pkg/Name`.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

fn fields(spec: &MessageSpecification, numbers: &BTreeMap<String, usize>) -> Result<Vec<(Arc<str>, Kind)>, String> {
    let scope = short(&spec.name);
    let package = scope.split_once('/').map_or("", |(package, _)| package);
    let field = |field: &re_ros_msg::message_spec::Field| {
        Ok((Arc::from(field.name.as_str()), kind(&field.ty, package, numbers)?))
    };
    spec.fields.iter().map(field).collect()
}

fn kind(of: &Type, package: &str, numbers: &BTreeMap<String, usize>) -> Result<Kind, String> {
    Ok(match of {
        Type::BuiltIn(primitive) => Kind::Primitive(built_in(primitive)?),
        Type::Complex(complex) => {
            let name = match complex {
                ComplexType::Absolute { package, name } => short(&format!("{package}/{name}")),
                ComplexType::Relative { name } => format!("{package}/{name}"),
            };
            let number = numbers.get(&name).or_else(|| {
                numbers.iter().find(|(known, _)| known.ends_with(&format!("/{name}"))).map(|(_, number)| number)
            });
            Kind::Message(*number.ok_or_else(|| format!("its message definition lacks {name}"))?)
        }
        Type::Array { ty, size } => {
            let length = match size {
                ArraySize::Fixed(length) => Some(*length),
                ArraySize::Bounded(_) | ArraySize::Unbounded => None,
            };
            Kind::List(Box::new(kind(ty, package, numbers)?), length)
        }
    })
}

fn built_in(primitive: &BuiltInType) -> Result<Primitive, String> {
    Ok(match primitive {
        BuiltInType::Bool => Primitive::Bool,
        BuiltInType::Byte | BuiltInType::Char | BuiltInType::UInt8 => Primitive::Unsigned(1),
        BuiltInType::Int8 => Primitive::Signed(1),
        BuiltInType::Int16 => Primitive::Signed(2),
        BuiltInType::UInt16 => Primitive::Unsigned(2),
        BuiltInType::Int32 => Primitive::Signed(4),
        BuiltInType::UInt32 => Primitive::Unsigned(4),
        BuiltInType::Int64 => Primitive::Signed(8),
        BuiltInType::UInt64 => Primitive::Unsigned(8),
        BuiltInType::Float32 => Primitive::Float32,
        BuiltInType::Float64 => Primitive::Float64,
        BuiltInType::String(_) => Primitive::Text,
        BuiltInType::WString(_) => return Err("wide strings are not read".to_owned()),
    })
}

/// The bytes behind the encapsulation header; numbers are aligned from there.
struct Cdr<'a> {
    content: &'a [u8],
    at: usize,
    is_little: bool,
}

impl<'a> Cdr<'a> {
    fn message(&mut self, layout: &Layout, number: usize, depth: usize) -> Option<Value> {
        let fields = layout.messages.get(number).filter(|_| depth < MAX_DEPTH)?;
        if fields.is_empty() {
            // What has no field is sent as one byte.
            self.take(1)?;
        }
        let values = fields.iter().map(|(name, kind)| Some((Arc::clone(name), self.value(layout, kind, depth)?)));
        Some(Value::Fields(values.collect::<Option<Vec<_>>>()?))
    }

    fn value(&mut self, layout: &Layout, kind: &Kind, depth: usize) -> Option<Value> {
        match kind {
            Kind::Primitive(primitive) => self.primitive(*primitive),
            Kind::Message(number) => self.message(layout, *number, depth + 1),
            Kind::List(element, length) => {
                let length = match length {
                    Some(length) => *length,
                    None => usize::try_from(self.unsigned(4)?).ok()?,
                };
                self.list(layout, element, length, depth)
            }
        }
    }

    /// A wrong length must not exhaust memory: each element has a byte at least.
    fn list(&mut self, layout: &Layout, element: &Kind, length: usize, depth: usize) -> Option<Value> {
        if length > self.content.len() - self.at {
            return None;
        }
        match element {
            Kind::Primitive(Primitive::Unsigned(1)) => self.take(length).map(|bytes| Value::Bytes(bytes.to_vec())),
            Kind::Primitive(primitive) if *primitive != Primitive::Text => {
                let numbers = (0..length).map(|_| self.primitive(*primitive)?.number());
                numbers.collect::<Option<Vec<_>>>().map(Value::Numbers)
            }
            element => {
                let values = (0..length).map(|_| self.value(layout, element, depth));
                values.collect::<Option<Vec<_>>>().map(Value::List)
            }
        }
    }

    fn primitive(&mut self, primitive: Primitive) -> Option<Value> {
        Some(match primitive {
            Primitive::Bool => Value::Flag(self.unsigned(1)? != 0),
            Primitive::Signed(size) => Value::Whole(self.signed(size)?),
            Primitive::Unsigned(size) => {
                let number = self.unsigned(size)?;
                i64::try_from(number).map_or(Value::Number(number as f64), Value::Whole)
            }
            Primitive::Float32 => Value::Number(f64::from(f32::from_bits(self.unsigned(4)? as u32))),
            Primitive::Float64 => Value::Number(f64::from_bits(self.unsigned(8)?)),
            Primitive::Text => {
                let length = usize::try_from(self.unsigned(4)?).ok()?;
                let bytes = self.take(length)?;
                let text = bytes.strip_suffix(&[0]).unwrap_or(bytes);
                Value::Text(String::from_utf8_lossy(text).into_owned())
            }
        })
    }

    fn signed(&mut self, size: usize) -> Option<i64> {
        let unused = 64 - 8 * size as u32;
        Some((self.unsigned(size)? << unused) as i64 >> unused)
    }

    fn unsigned(&mut self, size: usize) -> Option<u64> {
        self.at = self.at.next_multiple_of(size);
        let bytes = self.take(size)?;
        let join = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        Some(if self.is_little { bytes.iter().rev().fold(0, join) } else { bytes.iter().fold(0, join) })
    }

    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let taken = self.content.get(self.at..self.at.checked_add(length)?)?;
        self.at += length;
        Some(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `sensor_msgs/msg/JointState` of one joint, written by hand.
    #[test]
    fn a_joint_state_is_read_with_its_alignment() {
        let definition = "std_msgs/Header header\nstring[] name\nfloat64[] position\n================\n\
                          MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n================\n\
                          MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
        let layout = Layout::parse("sensor_msgs/msg/JointState", definition.as_bytes()).unwrap();
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend([7, 0, 0, 0, 9, 0, 0, 0]); // stamp
        bytes.extend([2, 0, 0, 0, b'b', 0, 0, 0]); // frame_id, padded to 4
        bytes.extend([1, 0, 0, 0, 2, 0, 0, 0, b'j', 0, 0, 0]); // one name
        bytes.extend([1, 0, 0, 0]); // one position, from byte 32 on: no padding
        bytes.extend(1.5_f64.to_le_bytes());
        let message = layout.decode(&bytes).unwrap();
        assert_eq!(message.stamp_nanos(), Some(7_000_000_009));
        assert_eq!(message.field("name"), Some(&Value::List(vec![Value::Text("j".to_owned())])));
        assert_eq!(message.field("position"), Some(&Value::Numbers(vec![1.5])));
        for end in 0..bytes.len() {
            assert_eq!(layout.decode(&bytes[..end]), None, "cut at {end}");
        }
    }
}
