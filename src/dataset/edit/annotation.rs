//! What is told of labels that models made, carried on to what is made of them.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value, json};

use crate::artifact::{IoError, read_json, write_json};
use crate::dataset::edit::target::EditSummary;
use crate::dataset::files::layout;

/// What tells models apart.
const MODEL: [&str; 4] = ["name", "variant", "family", "version"];
/// What several sources must agree on to be told of all.
const COMMON: [&str; 3] = ["date", "key_frames", "doubt_below"];

/// The episodes of a source that are in what is made.
pub(super) struct Kept {
    /// The source.
    pub(super) root: PathBuf,
    /// Their numbers there, rising.
    pub(super) numbers: Vec<u64>,
    /// How many there are in the source.
    pub(super) n_source: u64,
    /// The number of the first one in what is made; the others follow it.
    pub(super) begin: u64,
}

impl Kept {
    fn renumbered(&self, number: u64) -> Option<u64> {
        self.numbers.binary_search(&number).ok().map(|at| self.begin + at as u64)
    }

    /// How many of a model's episodes are kept, where that is known: of several models nothing tells whose an episode is.
    fn episodes_of(&self, model: &Value, is_only: bool) -> Value {
        let of_source = model["episodes"].as_u64();
        match of_source {
            Some(0) => json!(0),
            Some(_) if is_only => json!(self.numbers.len()),
            Some(all) if self.numbers.len() as u64 == self.n_source => json!(all),
            _ => Value::Null,
        }
    }
}

/// Writes what the sources tell, with the numbers that episodes have now, and adds the file to those of `summary`. What
/// was measured is told of one source alone: of several together nothing was.
pub(super) fn carry(sources: &[Kept], to: &Path, summary: &mut EditSummary) -> Result<(), IoError> {
    let mut told = Vec::new();
    for kept in sources {
        let path = kept.root.join(layout::ANNOTATION);
        if path.is_file() {
            told.push((kept, read_json::<Map<String, Value>>(&path)?));
        }
    }
    let Some((_, first)) = told.first() else { return Ok(()) };
    let mut carried = first.clone();
    for key in COMMON {
        if told.iter().any(|(_, other)| other.get(key) != first.get(key)) {
            carried.remove(key);
        }
    }
    if told.len() > 1 {
        carried.remove("measured");
    }
    match doubtful(&told) {
        Some(doubtful) => carried.insert("doubtful".to_owned(), Value::Array(doubtful)),
        None => carried.remove("doubtful"),
    };
    carried.insert("models".to_owned(), Value::Array(models(&told)));
    carried.remove("subtasks");
    for (key, count) in [
        ("episodes", summary.episodes),
        ("frames", summary.frames),
        ("calls", summary.calls),
        ("scopes", summary.scopes),
    ] {
        carried.insert(key.to_owned(), json!(count));
    }
    write_json(&to.join(layout::ANNOTATION), &carried)?;
    summary.files.push(layout::ANNOTATION.to_owned());
    summary.files.sort_unstable();
    Ok(())
}

/// The doubtful episodes that were kept; nothing where a source does not list them.
fn doubtful(told: &[(&Kept, Map<String, Value>)]) -> Option<Vec<Value>> {
    let mut all = Vec::new();
    for (kept, told) in told {
        for doubt in told.get("doubtful")?.as_array()? {
            let number = doubt["episode"].as_u64().and_then(|number| kept.renumbered(number));
            let mut doubt = doubt.clone();
            if let (Some(number), Some(entry)) = (number, doubt.as_object_mut()) {
                entry.insert("episode".to_owned(), json!(number));
                all.push(doubt);
            }
        }
    }
    Some(all)
}

/// Each model once, with how many of its episodes there are.
fn models(told: &[(&Kept, Map<String, Value>)]) -> Vec<Value> {
    let mut all: Vec<Value> = Vec::new();
    for (kept, told) in told {
        let models = told.get("models").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let is_only = models.iter().filter(|model| model["episodes"] != json!(0)).count() == 1;
        for model in models {
            let episodes = kept.episodes_of(model, is_only);
            match all.iter_mut().find(|known| MODEL.iter().all(|key| known[*key] == model[*key])) {
                Some(known) => {
                    let sum = known["episodes"].as_u64().zip(episodes.as_u64()).map(|(a, b)| a + b);
                    known["episodes"] = json!(sum);
                }
                None => {
                    let mut model = model.clone();
                    model["episodes"] = episodes;
                    all.push(model);
                }
            }
        }
    }
    all
}
