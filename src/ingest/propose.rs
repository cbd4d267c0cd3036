//! A map for what is in a file, to begin with.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;

use super::decode::Decoder;
use super::error::IngestError;
use super::few::{FEW_MESSAGES, Marker, are_few, mark, quoted};
use super::map::USUAL_AGE_SECS;
use super::picture::is_picture;
use super::value::Value;
use crate::recording::read_messages;
use crate::words::counted;

/// What a topic shows.
#[derive(Default)]
struct Shown {
    n_messages: u64,
    first_nanos: u64,
    last_nanos: u64,
    schema: String,
    /// The first message, or why it is not read.
    message: Option<Result<Value, String>>,
    /// What it may mark, by the first few messages: a field and its values.
    marks: Option<(String, Vec<Value>)>,
}

impl Shown {
    /// Messages a second.
    fn rate(&self) -> f64 {
        let secs = self.last_nanos.saturating_sub(self.first_nanos) as f64 / 1e9;
        if secs > 0.0 { (self.n_messages.saturating_sub(1)) as f64 / secs } else { 0.0 }
    }

    /// Takes one of the first messages.
    fn look(&mut self, message: Result<Value, String>) {
        if let Ok(message) = &message
            && let Some((field, value)) = mark(message)
        {
            let (known, values) = self.marks.get_or_insert_with(|| (field.to_owned(), Vec::new()));
            if known == field {
                values.push(value.clone());
            }
        }
        self.message.get_or_insert(message);
    }
}

/// Writes a map for a file: pictures, joints, poses and numbers by their topics, those of commands as `action`. A topic
/// with few messages makes no rows: one that marks episodes, by its name, bounds them. Every other topic is listed in a
/// comment.
///
/// # Errors
///
/// When the file is damaged.
pub fn propose(path: &Path) -> Result<String, IngestError> {
    let mut topics: BTreeMap<String, Shown> = BTreeMap::new();
    read_messages(path, |message| {
        let shown = topics.entry(message.channel.topic.clone()).or_default();
        if shown.n_messages < FEW_MESSAGES {
            shown.look(Decoder::new(message.channel).and_then(|decoder| decoder.decode(message.data)));
        }
        if shown.n_messages == 0 {
            shown.first_nanos = message.log_time_nanos;
            shown.schema.clone_from(&message.channel.schema);
        }
        shown.n_messages += 1;
        shown.last_nanos = shown.last_nanos.max(message.log_time_nanos);
        Ok::<_, IngestError>(ControlFlow::Continue(()))
    })?;
    Ok(map_of(&topics))
}

fn map_of(topics: &BTreeMap<String, Shown>) -> String {
    let (mut cameras, mut others, mut marker) = (Vec::new(), Vec::new(), None);
    let mut sources: BTreeMap<&str, Vec<String>> = BTreeMap::new();
    let (secs, most) = (secs_of(topics), topics.values().map(|shown| shown.n_messages).max().unwrap_or(0));
    for (topic, shown) in topics {
        let (rate, schema) = (shown.rate(), &shown.schema);
        let is_few = are_few(shown.n_messages, secs, most);
        let found =
            shown.marks.as_ref().filter(|_| is_few).and_then(|(field, values)| Marker::of(topic, field, values));
        match (&shown.message, found) {
            (_, Some(found)) if marker.is_none() && found.is_named() => marker = Some(found),
            (_, found) if is_few => {
                let advice = found.map_or_else(too_few, |found| found.advice());
                others.push(format!("# {topic} ({schema}, {}): {advice}", counted(shown.n_messages, "message")));
            }
            (Some(Ok(message)), _) if is_picture(message) => cameras.push((topic, rate)),
            (Some(Ok(message)), _) => match field(message) {
                Some(field) => sources.entry(feature(topic)).or_default().push(source(topic, field, message)),
                None => others.push(format!("# {topic} ({schema}, {rate:.1} Hz): no numbers")),
            },
            (Some(Err(problem)), _) => others.push(format!("# {topic} ({schema}, {rate:.1} Hz): {problem}")),
            (None, _) => {}
        }
    }
    let fastest = topics.values().map(Shown::rate).fold(0.0, f64::max);
    let slowest_camera = cameras.iter().map(|(_, rate)| *rate).fold(f64::INFINITY, f64::min);
    let rate = if slowest_camera.is_finite() { slowest_camera } else { fastest };
    let fps = (rate + 0.01).floor().clamp(1.0, 1000.0);
    let episodes = marker.as_ref().map_or_else(|| vec!["by = \"file\"".to_owned()], Marker::settings).join("\n");
    let mut text = format!(
        "# Rows a second. A video that is not encoded again must have a picture for each.\nfps = {fps:.0}\nrobot_type = \"unknown\"\n\
         task = \"say what is done\"\n\n[episodes]\n{episodes}\n"
    );
    for (name, sources) in sources {
        let _ = write!(text, "\n[[feature]]\nname = \"{name}\"\nfrom = [\n");
        sources.iter().for_each(|source| text.push_str(&format!("  {source},\n")));
        text.push_str("]\n");
    }
    for (topic, rate) in cameras {
        let (name, topic) = (camera(topic), quoted(topic));
        let _ = write!(
            text,
            "\n# {rate:.1} Hz\n[[feature]]\nname = \"observation.images.{name}\"\nfrom = [{{ topic = {topic} }}]\n"
        );
    }
    if !others.is_empty() {
        let _ = write!(text, "\n# Not taken:\n{}\n", others.join("\n"));
    }
    text
}

fn too_few() -> String {
    format!("too few for rows, which take messages of up to {USUAL_AGE_SECS} s before; max_age_secs takes older ones")
}

/// Seconds from the first message of all topics to the last.
fn secs_of(topics: &BTreeMap<String, Shown>) -> f64 {
    let first = topics.values().map(|shown| shown.first_nanos).min().unwrap_or(0);
    let last = topics.values().map(|shown| shown.last_nanos).max().unwrap_or(0);
    last.saturating_sub(first) as f64 / 1e9
}

/// The field of a message whose numbers are most likely wanted; `None` without numbers.
fn field(message: &Value) -> Option<&'static str> {
    let has_numbers = |value: &Value| {
        let (mut numbers, mut names) = (Vec::new(), Vec::new());
        value.flatten("", &mut numbers, &mut names).is_some() && !numbers.is_empty()
    };
    let fields = ["position", "positions", "pose", "transform", "data", "value", "values", "twist"];
    let found = fields.into_iter().find(|name| message.field(name).is_some_and(has_numbers));
    found.or_else(|| has_numbers(message).then_some(""))
}

fn source(topic: &str, field: &str, message: &Value) -> String {
    let (topic, field_text) =
        (quoted(topic), if field.is_empty() { String::new() } else { format!(", field = \"{field}\"") });
    let names = match message.field("name") {
        Some(Value::List(names)) if field == "position" => names.iter().filter_map(Value::text).collect::<Vec<_>>(),
        _ => Vec::new(),
    };
    let joints = match names.is_empty() {
        true => String::new(),
        false => {
            format!(", joints = [{}]", names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", "))
        }
    };
    format!("{{ topic = {topic}{field_text}{joints} }}")
}

/// Commands are what the robot was told; all else it observed.
fn feature(topic: &str) -> &'static str {
    let is_command = |word: &str| topic.to_lowercase().contains(word);
    if ["command", "cmd", "action", "target", "leader", "desired"].into_iter().any(is_command) {
        "action"
    } else {
        "observation.state"
    }
}

/// `/camera/front/image_raw/compressed` as `front`.
fn camera(topic: &str) -> String {
    let is_common = |part: &&str| {
        !["", "camera", "cameras", "image", "image_raw", "image_rect", "compressed", "color", "rgb", "video"]
            .contains(part)
    };
    let parts: Vec<&str> = topic.split('/').filter(is_common).collect();
    if parts.is_empty() { "camera".to_owned() } else { parts.join("_") }
}
