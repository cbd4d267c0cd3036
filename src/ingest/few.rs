//! Topics with few messages: they make no rows, but may mark episodes or say the task.

use super::map::USUAL_AGE_SECS;
use super::value::Value;

/// Of so many messages and fewer, a topic is no series beside one that has many more.
pub(super) const FEW_MESSAGES: u64 = 10;
/// How many times as many messages another topic has.
const MANY_TIMES: u64 = 10;
/// Words of topics that mark episodes.
const MARKERS: [&str; 5] = ["record", "episode", "marker", "trial", "demo"];

/// Whether `n_messages` over a file of so many seconds are too few for rows, next to a topic of `most` messages.
pub(super) fn are_few(n_messages: u64, secs: f64, most: u64) -> bool {
    let is_rare = n_messages <= FEW_MESSAGES || n_messages as f64 * USUAL_AGE_SECS < secs;
    is_rare && n_messages.saturating_mul(MANY_TIMES) <= most
}

/// The name and value of the one field of a message that can mark something: a flag, a whole number or a text.
pub(super) fn mark(message: &Value) -> Option<(&str, &Value)> {
    let Value::Fields(fields) = message else { return None };
    let is_mark = |value: &Value| matches!(value, Value::Flag(_) | Value::Whole(_) | Value::Text(_));
    let mut marks = fields.iter().filter(|(_, value)| is_mark(value));
    match (marks.next(), marks.next()) {
        (Some((name, value)), None) => Some((&**name, value)),
        _ => None,
    }
}

/// What a topic with few messages may mark.
pub(super) struct Marker<'s> {
    pub(super) topic: &'s str,
    field: &'s str,
    start: &'s Value,
    end: Option<&'s Value>,
}

impl<'s> Marker<'s> {
    /// Of the values of a topic, in their order: the first begins an episode, and the other, if there is one other,
    /// ends it. A flag begins one by `true`.
    pub(super) fn of(topic: &'s str, field: &'s str, values: &'s [Value]) -> Option<Self> {
        let first = values.iter().find(|value| **value != Value::Flag(false)).or(values.first())?;
        let mut others: Vec<&Value> = Vec::new();
        for value in values.iter().filter(|value| *value != first) {
            if !others.contains(&value) {
                others.push(value);
            }
        }
        let end = if let [end] = others[..] { Some(end) } else { None };
        Some(Self { topic, field, start: first, end })
    }

    /// Whether the topic's name says so.
    pub(super) fn is_named(&self) -> bool {
        let topic = self.topic.to_lowercase();
        MARKERS.iter().any(|word| topic.contains(word))
    }

    /// Its settings, as `[episodes]` has them.
    pub(super) fn settings(&self) -> Vec<String> {
        let Self { topic, field, start, end } = self;
        let mut settings = vec![
            "by = \"marker\"".to_owned(),
            format!("topic = {}", quoted(topic)),
            format!("field = {}", quoted(field)),
            format!("start = {}", in_toml(start)),
        ];
        settings.extend(end.map(|end| format!("end = {}", in_toml(end))));
        settings
    }

    /// What to do with it, in a comment.
    pub(super) fn advice(&self) -> String {
        let task = match self.start {
            Value::Text(_) => {
                format!(" or the task: task = {{ topic = {}, field = {} }}", quoted(self.topic), quoted(self.field))
            }
            _ => String::new(),
        };
        format!("too few for rows; as bounds of episodes: {}{task}", self.settings().join(", "))
    }
}

/// A text as TOML has it.
pub(super) fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn in_toml(value: &Value) -> String {
    match value {
        Value::Flag(flag) => flag.to_string(),
        Value::Whole(whole) => whole.to_string(),
        Value::Text(text) => quoted(text),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_are_few_beside_many_alone() {
        // Four messages, of which others have forty or thirty-nine.
        assert!(are_few(4, 1.0, 40) && !are_few(4, 1.0, 39));
        // Twenty messages in thirty seconds leave rows without one; in ten they do not.
        assert!(are_few(20, 30.0, 900) && !are_few(20, 10.0, 900));
    }

    #[test]
    fn a_flag_begins_by_true_and_others_by_what_comes_first() {
        let settings = |values: &[Value]| Marker::of("/m", "data", values).unwrap().settings()[3..].join(", ");
        assert_eq!(settings(&[Value::Flag(false), Value::Flag(true)]), "start = true, end = false");
        assert_eq!(settings(&[Value::Whole(2), Value::Whole(2), Value::Whole(0)]), "start = 2, end = 0");
        let texts = ["a\"b", "c", "d"].map(|text| Value::Text(text.to_owned()));
        assert_eq!(settings(&texts), "start = 'a\"b'");
    }
}
