//! The authors' released task file, e.g. `stack_2000.json`.
//!
//! # Input and output
//!
//! JSON: `scene.task_objects` names the objects, whose order is the order of our slots; `tasks` holds `id`, `goals`
//! (`name`, `src`, `target`) and `end_constraints` (`type`, `src`, `target`). What else the scene says (poses, meshes,
//! workspace) is not taken: our scenes are our own. A `count` limits the instances of a trial and not the task, so it
//! is checked and left.
//!
//! # Invariants
//!
//! Nothing is dropped: an unseen task that asks for what a training task asks for is refused, since otherwise the size
//! of a suite would depend on the file in silence.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::artifact::{self, IoError};
use crate::scene::SlotIndex;
use crate::task::{Condition, Family, Goal, Split, Task, TaskSet, TaskSetError};
use crate::words::counted;

/// A task file of the authors' that cannot be taken.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The file could not be read or is not JSON.
    #[error(transparent)]
    Io(#[from] IoError),
    /// Something in it is not as it should be.
    #[error("{place}: {problem}: {}", path.display())]
    Content {
        /// Which file.
        path: PathBuf,
        /// Where in it, e.g. `tasks[12].goals[3].src`.
        place: String,
        /// What is wrong.
        problem: ImportProblem,
    },
    /// The split asks for more tasks than there are.
    #[error("the split asks for {asked} training tasks, the file has {found}: {}", path.display(), found = counted(*found, "task"))]
    TooFewTasks {
        /// Which file.
        path: PathBuf,
        /// How many are asked for.
        asked: u32,
        /// How many there are.
        found: usize,
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

/// What is wrong at one place of a task file.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImportProblem {
    /// A field is missing.
    #[error("missing field {0:?}")]
    Missing(&'static str),
    /// A value is of another type.
    #[error("is not {0}")]
    NotA(&'static str),
    /// A word that is not of the set that is asked for.
    #[error("unknown {kind} {word:?}; allowed: {allowed}")]
    Unknown {
        /// Of what.
        kind: &'static str,
        /// The word.
        word: String,
        /// The words of the set.
        allowed: String,
    },
    /// The scene has another number of objects than ours.
    #[error("has {found} objects, {} has {expected}", family.name())]
    ObjectCount {
        /// How many there are.
        found: usize,
        /// The family of the goals.
        family: Family,
        /// How many slots it has.
        expected: usize,
    },
    /// Two objects have one name.
    #[error("{0:?} is named twice")]
    DuplicateObject(String),
    /// The goals are of more than one family.
    #[error("is a goal of {}, the first goal is of {}", found.name(), expected.name())]
    MixedFamilies {
        /// The goal's family.
        found: Family,
        /// The first goal's family.
        expected: Family,
    },
}

/// Reads the authors' task file. Its first `train` tasks are trained on, the rest are unseen.
///
/// # Errors
///
/// When it is not one, has fewer than `train` tasks, or breaks a rule of [`TaskSet::validate`].
pub fn import(path: &Path, train: u32) -> Result<TaskSet, ImportError> {
    let text = artifact::read(path)?;
    let root = serde_json::from_slice(&text).map_err(|source| IoError::Json { path: path.to_owned(), source })?;
    let root = Node { value: &root, place: String::new() };
    let content = |Problem { place, problem }| ImportError::Content { path: path.to_owned(), place, problem };
    let set = task_set(&root, train as usize).map_err(content)?;
    if set.tasks.len() < train as usize {
        return Err(ImportError::TooFewTasks { path: path.to_owned(), asked: train, found: set.tasks.len() });
    }
    set.validate().map_err(|source| ImportError::Rule { path: path.to_owned(), source })?;
    Ok(set)
}

/// A problem and where it is.
struct Problem {
    place: String,
    problem: ImportProblem,
}

/// A JSON value that knows its place.
struct Node<'a> {
    value: &'a Value,
    place: String,
}

impl<'a> Node<'a> {
    fn problem(&self, problem: ImportProblem) -> Problem {
        let place = if self.place.is_empty() { "the top level".to_owned() } else { self.place.clone() };
        Problem { place, problem }
    }

    fn field(&self, key: &'static str) -> Result<Node<'a>, Problem> {
        let object = self.value.as_object().ok_or_else(|| self.problem(ImportProblem::NotA("an object")))?;
        let value = object.get(key).ok_or_else(|| self.problem(ImportProblem::Missing(key)))?;
        let dot = if self.place.is_empty() { "" } else { "." };
        Ok(Node { value, place: format!("{}{dot}{key}", self.place) })
    }

    fn items(&self) -> Result<impl Iterator<Item = Node<'a>>, Problem> {
        let items = self.value.as_array().ok_or_else(|| self.problem(ImportProblem::NotA("a list")))?;
        let place = self.place.clone();
        Ok(items.iter().enumerate().map(move |(at, value)| Node { value, place: format!("{place}[{at}]") }))
    }

    fn text(&self) -> Result<&'a str, Problem> {
        self.value.as_str().ok_or_else(|| self.problem(ImportProblem::NotA("a string")))
    }

    fn unknown(&self, kind: &'static str, word: &str, allowed: &str) -> Problem {
        let (word, allowed) = (word.to_owned(), allowed.to_owned());
        self.problem(ImportProblem::Unknown { kind, word, allowed })
    }

    fn check_count(&self) -> Result<(), Problem> {
        let Some(count) = self.value.get("count") else { return Ok(()) };
        match count.as_u64() {
            Some(1..) => Ok(()),
            _ => Err(self.field("count")?.problem(ImportProblem::NotA("a positive whole number"))),
        }
    }
}

fn task_set(root: &Node<'_>, train: usize) -> Result<TaskSet, Problem> {
    let objects_node = root.field("scene")?.field("task_objects")?;
    let objects = object_names(&objects_node)?;
    let tasks_node = root.field("tasks")?;
    let mut family = None;
    let mut tasks = Vec::new();
    for (task_idx, node) in tasks_node.items()?.enumerate() {
        let split = if task_idx < train { Split::Seen } else { Split::Unseen };
        tasks.push(task(&node, &objects, &mut family, split)?);
    }
    let Some(family) = family else { return Err(tasks_node.problem(ImportProblem::NotA("a list with goals in it"))) };
    let (found, expected) = (objects.len(), family.n_slots());
    if found != expected {
        return Err(objects_node.problem(ImportProblem::ObjectCount { found, family, expected }));
    }
    Ok(TaskSet { family, tasks })
}

fn object_names<'a>(node: &Node<'a>) -> Result<Vec<&'a str>, Problem> {
    let mut names = Vec::new();
    for item in node.items()? {
        let name = item.text()?;
        if names.contains(&name) {
            return Err(item.problem(ImportProblem::DuplicateObject(name.to_owned())));
        }
        names.push(name);
    }
    Ok(names)
}

/// One task. The family is that of the first goal of the file.
fn task(node: &Node<'_>, objects: &[&str], family: &mut Option<Family>, split: Split) -> Result<Task, Problem> {
    let id = node.field("id")?.text()?.to_owned();
    let mut goals = Vec::new();
    for goal in node.field("goals")?.items()? {
        let found = goal_family(&goal.field("name")?)?;
        let expected = *family.get_or_insert(found);
        if found != expected {
            return Err(goal.problem(ImportProblem::MixedFamilies { found, expected }));
        }
        goals.push(pair(&goal, objects)?);
    }
    let constraints = node.field("end_constraints")?;
    let Some(family) = *family else { return Err(node.field("goals")?.problem(ImportProblem::NotA("a filled list"))) };
    let conditions = constraints.items()?.map(|item| condition(&item, objects, family));
    let conditions = conditions.collect::<Result<_, Problem>>()?;
    Ok(Task { id, family, goals, conditions, split, blocks: None })
}

fn goal_family(node: &Node<'_>) -> Result<Family, Problem> {
    let word = node.text()?;
    let imported = || Family::ALL.into_iter().filter_map(|family| Some((family, family.spec().imported_as?)));
    let named = imported().find(|(_, name)| *name == word);
    let allowed = || imported().map(|(_, name)| name).collect::<Vec<_>>().join(", ");
    named.map(|(family, _)| family).ok_or_else(|| node.unknown("goal name", word, &allowed()))
}

/// The authors say `on_top` also of what lies in a container.
fn condition(node: &Node<'_>, objects: &[&str], family: Family) -> Result<Condition, Problem> {
    let kind = node.field("type")?;
    match kind.text()? {
        "on_top" => Ok(pair(node, objects)?.brings_about(family)),
        other => Err(kind.unknown("constraint type", other, "on_top")),
    }
}

fn pair(node: &Node<'_>, objects: &[&str]) -> Result<Goal, Problem> {
    node.check_count()?;
    let slot = |key| {
        let name = node.field(key)?;
        let word = name.text()?;
        let at = objects.iter().position(|&object| object == word);
        let at = at.ok_or_else(|| name.unknown("object", word, &objects.join(", ")))?;
        Ok(SlotIndex(at as u16))
    };
    Ok(Goal { source: slot("src")?, target: slot("target")? })
}
