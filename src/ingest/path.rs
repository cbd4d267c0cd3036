//! Where a value stands in a message: `pose.position.x`, `data[3]`, `data[0:7]`, `transforms[child_frame_id=tool0]`.

use serde::Deserialize;

use super::value::Value;

/// A path from a message to a value in it; the empty one is the message.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub(super) struct FieldPath {
    text: String,
    steps: Vec<Step>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Step {
    Field(String),
    Element(usize),
    /// Half-open.
    Range(usize, usize),
    /// The first element whose field has a text.
    Where(String, String),
}

impl TryFrom<String> for FieldPath {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let mut steps = Vec::new();
        let mut rest = text.as_str();
        while !rest.is_empty() {
            rest = step(rest, &mut steps).ok_or_else(|| {
                format!("{text:?} is no path: write as pose.position.x, data[3], data[0:7] or list[field=text]")
            })?;
        }
        Ok(Self { text, steps })
    }
}

/// Takes a step off the front; gives what is left.
fn step<'t>(text: &'t str, steps: &mut Vec<Step>) -> Option<&'t str> {
    if let Some(inner) = text.strip_prefix('[') {
        let (inner, rest) = inner.split_once(']')?;
        steps.push(if let Some((field, wanted)) = inner.split_once('=') {
            Step::Where(field.to_owned(), wanted.to_owned())
        } else if let Some((begin, end)) = inner.split_once(':') {
            let (begin, end) = (begin.parse().ok()?, end.parse().ok()?);
            Step::Range(begin, (begin < end).then_some(end)?)
        } else {
            Step::Element(inner.parse().ok()?)
        });
        return Some(rest);
    }
    let text = if steps.is_empty() { text } else { text.strip_prefix('.')? };
    let end = text.find(['.', '[']).unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    steps.push(Step::Field((!name.is_empty()).then(|| name.to_owned())?));
    Some(rest)
}

impl FieldPath {
    /// As it is written.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// The value in a message; `None` when there is none.
    pub(super) fn select(&self, message: &Value) -> Option<Value> {
        let mut found: Option<Value> = None;
        for step in &self.steps {
            let value = found.as_ref().unwrap_or(message);
            found = Some(match step {
                Step::Field(name) => value.field(name)?.clone(),
                Step::Element(position) => value.element(*position)?,
                Step::Range(begin, end) => {
                    Value::List((*begin..*end).map(|at| value.element(at)).collect::<Option<_>>()?)
                }
                Step::Where(field, wanted) => {
                    let Value::List(values) = value else { return None };
                    let is_wanted = |value: &&Value| value.field(field).and_then(Value::text) == Some(wanted.as_str());
                    values.iter().find(is_wanted)?.clone()
                }
            });
        }
        Some(found.unwrap_or_else(|| message.clone()))
    }

    /// Whether a message is about other things alone: it has a list of named elements, and none of the name asked for. A
    /// tree of transforms comes in such messages, each with the frames that have moved.
    pub(super) fn is_of_others(&self, message: &Value) -> bool {
        let Some(at) = self.steps.iter().position(|step| matches!(step, Step::Where(..))) else { return false };
        let before = Self { text: self.text.clone(), steps: self.steps[..at].to_vec() };
        let up_to = Self { text: self.text.clone(), steps: self.steps[..=at].to_vec() };
        matches!(before.select(message), Some(Value::List(_))) && up_to.select(message).is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(text: &str) -> FieldPath {
        FieldPath::try_from(text.to_owned()).unwrap()
    }

    fn pose(name: &str, x: f64) -> Value {
        Value::Fields(vec![("frame".into(), Value::Text(name.to_owned())), ("x".into(), Value::Number(x))])
    }

    #[test]
    fn paths_lead_to_fields_elements_ranges_and_named_elements() {
        let numbers = Value::Numbers(vec![1.0, 2.0, 3.0]);
        let list = Value::List(vec![pose("a", 4.0), pose("b", 5.0)]);
        let message = Value::Fields(vec![("data".into(), numbers.clone()), ("poses".into(), list)]);
        assert_eq!(path("data").select(&message), Some(numbers));
        assert!(path("poses[frame=c].x").is_of_others(&message));
        for about in ["poses[frame=b].x", "poses[frame=b].y", "data[2]", "nothing[frame=c]"] {
            assert!(!path(about).is_of_others(&message), "{about}");
        }
        assert_eq!(path("data[2]").select(&message), Some(Value::Number(3.0)));
        assert_eq!(path("data[1:3]").select(&message), Some(Value::List(vec![Value::Number(2.0), Value::Number(3.0)])));
        assert_eq!(path("poses[frame=b].x").select(&message), Some(Value::Number(5.0)));
        assert_eq!(path("").select(&message), Some(message.clone()));
        for absent in ["velocity", "data[3]", "data[2:4]", "poses[frame=c]", "data.x"] {
            assert_eq!(path(absent).select(&message), None, "{absent}");
        }
    }

    #[test]
    fn what_is_no_path_is_refused() {
        for wrong in ["a..b", ".a", "a[", "a[x]", "a[3:3]"] {
            assert!(FieldPath::try_from(wrong.to_owned()).is_err(), "{wrong}");
        }
    }
}
