//! `tasks.json`: the edge types, reading, writing, and the schema that is generated from them.
//!
//! # Input and output
//!
//! schemas/tasks.schema.json. One task a line, so that the file can be searched and compared by line.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::artifact::{self, IoError};
use crate::scene::SlotIndex;
use crate::task::{Condition, Family, Goal, Split, Task, TaskSet, TaskSetError};

/// Version of the file. A reader takes no other.
const SCHEMA_VERSION: u32 = 1;

/// A task file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum TaskFileError {
    /// The file could not be read or written, or is not the JSON it should be.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The file is of another version.
    #[error("schema_version is {found}, this program reads {SCHEMA_VERSION}: {}", path.display())]
    Version {
        /// Which file.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// A slot name that the family does not have.
    #[error("{place}: unknown slot {word:?}; allowed: {allowed}: {}", path.display())]
    UnknownSlot {
        /// Which file.
        path: PathBuf,
        /// Where in it.
        place: String,
        /// The name.
        word: String,
        /// The family's slots.
        allowed: String,
    },
    /// The tasks break a rule.
    #[error("{source}: {}", path.display())]
    Rule {
        /// Which file.
        path: PathBuf,
        /// Which rule, and where.
        source: TaskSetError,
    },
}

/// The tasks of one run: what is to be reached, in which order, and whether a learner may train on it.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TaskFile {
    /// Version of this form: 1.
    schema_version: u32,
    /// The family of all tasks.
    family: Family,
    /// Training tasks first.
    tasks: Vec<TaskEntry>,
}

/// One task.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct TaskEntry {
    /// Unique in the file.
    id: String,
    /// Whether it may be trained on.
    split: Split,
    /// The sub-tasks in the order of the demonstration.
    goals: Vec<Goal<String>>,
    /// What must hold in the end.
    conditions: Vec<Condition<String>>,
    /// Families of blocks: only the first so many, from 2, are within reach; left out when all are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    blocks: Option<u16>,
}

/// Read before the rest, so that another version is told as that and not as an unknown field.
#[derive(Deserialize)]
struct Version {
    schema_version: u32,
}

impl TaskSet {
    /// Reads and validates a task file.
    ///
    /// # Errors
    ///
    /// When it is not one, or breaks a rule.
    pub fn read(path: &Path) -> Result<Self, TaskFileError> {
        let bytes = artifact::read(path)?;
        let json = |source| IoError::Json { path: path.to_owned(), source };
        let found = serde_json::from_slice::<Version>(&bytes).map_err(json)?.schema_version;
        if found != SCHEMA_VERSION {
            return Err(TaskFileError::Version { path: path.to_owned(), found });
        }
        let file: TaskFile = serde_json::from_slice(&bytes).map_err(json)?;
        let set = SlotNames { family: file.family, path }.set(file.tasks)?;
        set.validate().map_err(|source| TaskFileError::Rule { path: path.to_owned(), source })?;
        Ok(set)
    }

    /// Validates and writes a task file, atomically. The same tasks give the same bytes.
    ///
    /// # Errors
    ///
    /// When the tasks break a rule, or the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TaskFileError> {
        self.validate().map_err(|source| TaskFileError::Rule { path: path.to_owned(), source })?;
        let lines: Result<Vec<String>, _> = self.tasks.iter().map(|task| serde_json::to_string(&entry(task))).collect();
        let lines = lines.map_err(|source| IoError::Json { path: path.to_owned(), source })?;
        let tasks = if lines.is_empty() { String::new() } else { format!("\n    {}\n  ", lines.join(",\n    ")) };
        let family = self.family.name();
        let text = format!(
            "{{\n  \"schema_version\": {SCHEMA_VERSION},\n  \"family\": \"{family}\",\n  \"tasks\": [{tasks}]\n}}\n"
        );
        Ok(artifact::write(path, text.as_bytes())?)
    }

    /// The JSON schema of the file, as in schemas/tasks.schema.json.
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(TaskFile).to_value()
    }
}

fn entry(task: &Task) -> TaskEntry {
    let name = |slot: SlotIndex| task.family.slot_name(slot).to_owned();
    TaskEntry {
        id: task.id.clone(),
        split: task.split,
        goals: task.goals.iter().map(|goal| Goal { source: name(goal.source), target: name(goal.target) }).collect(),
        conditions: task.conditions.iter().map(|condition| condition.map(name)).collect(),
        blocks: task.blocks,
    }
}

/// From names to slots, with the place in the error.
struct SlotNames<'a> {
    family: Family,
    path: &'a Path,
}

impl SlotNames<'_> {
    fn set(&self, entries: Vec<TaskEntry>) -> Result<TaskSet, TaskFileError> {
        let tasks = entries.into_iter().enumerate().map(|(task_idx, entry)| self.task(task_idx, entry));
        Ok(TaskSet { family: self.family, tasks: tasks.collect::<Result<_, _>>()? })
    }

    fn task(&self, task_idx: usize, entry: TaskEntry) -> Result<Task, TaskFileError> {
        let TaskEntry { id, split, goals, conditions, blocks } = entry;
        let goals = goals.iter().enumerate().map(|(at, goal)| {
            let slot = |key, word| self.slot(&format!("tasks[{task_idx}].goals[{at}].{key}"), word);
            Ok(Goal { source: slot("source", &goal.source)?, target: slot("target", &goal.target)? })
        });
        let conditions = conditions.into_iter().enumerate().map(|(at, condition)| {
            condition.try_map(|key, word| self.slot(&format!("tasks[{task_idx}].conditions[{at}].{key}"), &word))
        });
        let goals = goals.collect::<Result<_, TaskFileError>>()?;
        let conditions = conditions.collect::<Result<_, TaskFileError>>()?;
        Ok(Task { id, family: self.family, goals, conditions, split, blocks })
    }

    fn slot(&self, place: &str, word: &str) -> Result<SlotIndex, TaskFileError> {
        let slots = (0..self.family.n_slots() as u16).map(SlotIndex);
        let name = |slot: SlotIndex| self.family.slot_name(slot);
        slots.clone().find(|&slot| name(slot) == word).ok_or_else(|| TaskFileError::UnknownSlot {
            path: self.path.to_owned(),
            place: place.to_owned(),
            word: word.to_owned(),
            allowed: slots.map(name).collect::<Vec<_>>().join(", "),
        })
    }
}
