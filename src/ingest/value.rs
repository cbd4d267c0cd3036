//! What a message says, whatever it was encoded in.

use std::sync::Arc;

/// A value in a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Not there.
    Nothing,
    Flag(bool),
    Whole(i64),
    Number(f64),
    Text(String),
    Bytes(Vec<u8>),
    /// A list of numbers alone.
    Numbers(Vec<f64>),
    List(Vec<Value>),
    /// In the order of the schema.
    Fields(Vec<(Arc<str>, Value)>),
}

impl Value {
    pub(super) fn field(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Fields(fields) => fields.iter().find(|(field, _)| **field == *name).map(|(_, value)| value),
            _ => None,
        }
    }

    /// A number, also of a whole one or a flag.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Flag(flag) => Some(f64::from(u8::from(*flag))),
            Self::Whole(whole) => Some(*whole as f64),
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    pub(super) fn whole(&self) -> Option<i64> {
        match self {
            Self::Whole(whole) => Some(*whole),
            _ => None,
        }
    }

    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// An element of a list.
    pub(super) fn element(&self, position: usize) -> Option<Self> {
        match self {
            Self::Numbers(numbers) => numbers.get(position).map(|&number| Self::Number(number)),
            Self::List(values) => values.get(position).cloned(),
            Self::Bytes(bytes) => bytes.get(position).map(|&byte| Self::Whole(i64::from(byte))),
            _ => None,
        }
    }

    /// All numbers in it, in order, with a name for each: where it stands below `name`. `None` when there is something
    /// else in it.
    pub(super) fn flatten(&self, name: &str, numbers: &mut Vec<f64>, names: &mut Vec<String>) -> Option<()> {
        let below = |part: &str| if name.is_empty() { part.to_owned() } else { format!("{name}.{part}") };
        match self {
            Self::Flag(_) | Self::Whole(_) | Self::Number(_) => {
                numbers.push(self.number()?);
                names.push(if name.is_empty() { "value".to_owned() } else { name.to_owned() });
            }
            Self::Numbers(values) => {
                numbers.extend_from_slice(values);
                names.extend((0..values.len()).map(|position| below(&position.to_string())));
            }
            Self::List(values) => {
                let numbered = values.iter().enumerate();
                numbered
                    .into_iter()
                    .try_for_each(|(position, value)| value.flatten(&below(&position.to_string()), numbers, names))?;
            }
            Self::Fields(fields) => {
                fields.iter().try_for_each(|(field, value)| value.flatten(&below(field), numbers, names))?;
            }
            Self::Nothing | Self::Text(_) | Self::Bytes(_) => return None,
        }
        Some(())
    }

    /// The stamp that a message carries, in nanoseconds: `header.stamp`, `stamp` or `timestamp`.
    pub(super) fn stamp_nanos(&self) -> Option<i64> {
        let header = self.field("header").and_then(|header| header.field("stamp"));
        let stamp = header.or_else(|| self.field("stamp")).or_else(|| self.field("timestamp"))?;
        let part = |names: &[&str]| names.iter().find_map(|name| stamp.field(name)).and_then(Self::whole);
        let (seconds, nanos) = (part(&["sec", "seconds"])?, part(&["nanosec", "nanos", "nsec"])?);
        seconds.checked_mul(1_000_000_000)?.checked_add(nanos)
    }
}
