//! BEHAVIOR-1K's annotation files: `annotations/task-XXXX/episode_XXXXXXXX.json`, with skills and their primitives.

use std::path::PathBuf;

use serde_json::Value;

use crate::artifact::{IoError, read_json};
use crate::dataset::DatasetError;
use crate::dataset::plain::labels::LabelSpan;
use crate::dataset::plain::source::PlainSource;
use crate::table::TextTable;

const LEVELS: [(&str, &str, u8); 2] =
    [("skill_annotation", "skill_description", 1), ("primitive_annotation", "primitive_description", 2)];

pub(super) struct BehaviorLabels;

impl BehaviorLabels {
    /// None where the episode has no file.
    pub(super) fn of_episode(
        &mut self,
        source: &PlainSource,
        position: usize,
        texts: &mut TextTable,
    ) -> Result<Vec<LabelSpan>, DatasetError> {
        let index = source.episodes[position].index;
        let Some(path) = find(source, &format!("episode_{index:08}.json"))? else { return Ok(Vec::new()) };
        let annotation: Value = read_json(&path)?;
        let mut spans = Vec::new();
        for (list, description, level) in LEVELS {
            for (at, entry) in annotation[list].as_array().into_iter().flatten().enumerate() {
                let wrong = |problem: &str| DatasetError::Count {
                    path: path.clone(),
                    problem: format!("{list} {at}: {problem}"),
                };
                let text = words(&entry[description]).ok_or_else(|| wrong("it has no description"))?;
                let durations = durations(&entry["frame_duration"]);
                let durations =
                    durations.ok_or_else(|| wrong("frame_duration is no [begin, end], nor a list of them"))?;
                let text = texts.key(&text);
                spans.extend(durations.into_iter().map(|frames| LabelSpan { level, text, frames }));
            }
        }
        Ok(spans)
    }
}

/// The file of this name in the folder of any task.
fn find(source: &PlainSource, name: &str) -> Result<Option<PathBuf>, IoError> {
    let folder = source.info.root().join("annotations");
    let entries = std::fs::read_dir(&folder).map_err(IoError::system("list", &folder))?;
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.map_err(IoError::system("list", &folder))?.path().join(name);
        if path.is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found.into_iter().next())
}

/// A description: a text, or a list of them.
fn words(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Array(texts) => {
            let texts: Vec<&str> = texts.iter().map(Value::as_str).collect::<Option<_>>()?;
            Some(texts.join(", "))
        }
        _ => None,
    }
}

/// `[begin, end]`, or a list of these.
fn durations(value: &Value) -> Option<Vec<[u32; 2]>> {
    let pair = |value: &Value| -> Option<[u32; 2]> {
        let [begin, end] = value.as_array()?.as_slice() else { return None };
        Some([u32::try_from(begin.as_u64()?).ok()?, u32::try_from(end.as_u64()?).ok()?])
    };
    pair(value).map(|frames| vec![frames]).or_else(|| value.as_array()?.iter().map(pair).collect())
}
