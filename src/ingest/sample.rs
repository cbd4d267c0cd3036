//! A message as a feature takes it.

use super::map::{FeatureMap, NumberType, SourceMap};
use super::picture::{PictureTaker, Reason, Shown, is_picture};
use super::value::Value;
use crate::dataset::plain::Picture;

/// What a source gives at a time.
#[derive(Clone, Debug)]
pub(super) enum Content {
    Numbers(Vec<f64>),
    Text(String),
    Picture(Picture),
    /// A packet of H.264, and whether it can be shown without those before.
    Packet(Vec<u8>, bool),
}

/// What kind of values a source gives.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ContentKind {
    /// Numbers by name.
    Numbers(Vec<String>),
    Text,
    Image([u32; 2]),
    /// Packets of H.264, of which the size is not known before a key frame.
    Packets,
}

/// Takes the messages of one source.
pub(super) struct Sampler<'m> {
    source: &'m SourceMap,
    dtype: NumberType,
    pictures: PictureTaker,
}

impl<'m> Sampler<'m> {
    pub(super) fn new(feature: &FeatureMap, source: &'m SourceMap) -> Self {
        Self { source, dtype: feature.dtype, pictures: PictureTaker::new(feature.store) }
    }

    /// Whether a message is about other things alone.
    pub(super) fn is_of_others(&self, message: &Value) -> bool {
        self.source.field.is_of_others(message)
    }

    /// What a message gives, with its kind.
    pub(super) fn take(&mut self, message: &Value) -> Result<(Content, ContentKind), Reason> {
        let path = &self.source.field;
        let found = path.select(message);
        let value = found.ok_or_else(|| format!("it has no {:?}{}", path.text(), has(message)))?;
        if is_picture(&value) {
            return Ok(match self.pictures.take(&value)? {
                Shown::Picture(size, picture) => (Content::Picture(picture), ContentKind::Image(size)),
                Shown::Packet(packet, is_key) => (Content::Packet(packet, is_key), ContentKind::Packets),
            });
        }
        if let Value::Text(text) = value {
            return Ok((Content::Text(text), ContentKind::Text));
        }
        let (mut numbers, mut names) = (Vec::new(), Vec::new());
        let all = match self.source.joints.as_slice() {
            [] => value.flatten("", &mut numbers, &mut names),
            joints => {
                names = joints.to_vec();
                numbers = self.joints(&value, message, joints)?;
                Some(())
            }
        };
        let problem =
            || format!("{:?} holds something that is no number; name a field of numbers{}", path.text(), has(&value));
        all.ok_or_else(problem)?;
        if numbers.is_empty() {
            return Err(format!("{:?} holds no number", path.text()));
        }
        // No reader of datasets takes what is not a number, and no statistic has a place for it.
        if numbers.iter().any(|number| !(*number as f32).is_finite()) {
            return Err(format!("{:?} holds a number that is not finite", path.text()));
        }
        if let Some(number) = numbers.iter().find(|number| !is_of_type(**number, self.dtype)) {
            return Err(format!("{:?} holds {number}, which is none of the dtype that the map asks for", path.text()));
        }
        Ok((Content::Numbers(numbers), ContentKind::Numbers(names)))
    }

    /// Elements by the names that the message has beside them.
    fn joints(&self, values: &Value, message: &Value, joints: &[String]) -> Result<Vec<f64>, Reason> {
        let path = &self.source.joint_names;
        let Some(Value::List(names)) = path.select(message) else {
            return Err(format!("it has no list of names {:?}", path.text()));
        };
        let one = |joint: &String| {
            let position = names.iter().position(|name| name.text() == Some(joint));
            let position = position.ok_or_else(|| format!("it has no joint {joint:?}"))?;
            let number = values.element(position).and_then(|value| value.number());
            number.ok_or_else(|| format!("joint {joint:?} has no number"))
        };
        joints.iter().map(one).collect()
    }
}

/// Whether a number is one of a type, and nothing of it would be lost.
fn is_of_type(number: f64, dtype: NumberType) -> bool {
    match dtype {
        NumberType::Float32 | NumberType::Float64 => true,
        NumberType::Int64 => number.fract() == 0.0 && number.abs() < (1_u64 << 53) as f64,
        NumberType::Bool => number == 0.0 || number == 1.0,
    }
}

/// The fields that there are, in words.
fn has(value: &Value) -> String {
    match value {
        Value::Fields(fields) => {
            let names: Vec<&str> = fields.iter().map(|(name, _)| &**name).collect();
            format!("; it has {}", names.join(", "))
        }
        _ => String::new(),
    }
}
