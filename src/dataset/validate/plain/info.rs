//! What is there once: declarations, splits, texts, totals.

use std::collections::BTreeSet;

use crate::dataset::files::finding::Validation;
use crate::dataset::files::layout;
use crate::dataset::plain::{PlainSource, PlainTexts, PlainVersion, has_programs};

/// Problems that do not keep a dataset from being read.
const WARNINGS: [&str; 2] = ["info.dtype", "info.names"];

pub(super) fn check(source: &PlainSource, validation: &mut Validation) {
    let info = &source.info;
    let path = info.root().join(layout::INFO);
    for problem in &info.problems {
        let (code, place, message) = (problem.code, problem.place.clone(), problem.message.clone());
        if WARNINGS.contains(&code) {
            validation.warn(code, &path, place, message);
        } else {
            validation.error(code, &path, place, message);
        }
    }
    let found = [
        ("total_episodes", source.episodes.len() as u64),
        ("total_frames", source.episodes.iter().map(|episode| episode.length).sum()),
        ("total_tasks", source.tasks.rows.len() as u64),
    ];
    for (key, found) in found {
        let declared = info.total(key);
        if declared.is_some_and(|declared| declared != found) {
            let message = format!("it is {}, but there are {found}", info.json[key]);
            validation.error("info.value", &path, key.to_owned(), message);
        }
    }
    check_splits(source, validation);
    check_texts(source, validation);
}

/// No episode is in two splits, and none is behind the last.
fn check_splits(source: &PlainSource, validation: &mut Validation) {
    let path = source.info.root().join(layout::INFO);
    let n_episodes = source.episodes.len() as u64;
    let mut until = (0, "");
    for (name, range) in &source.info.splits {
        if range.end > n_episodes {
            let message = format!("it ends at episode {}, but there are {n_episodes}", range.end);
            validation.error("info.value", &path, format!("splits, {name}"), message);
        }
        if range.start < until.0 && !range.is_empty() {
            let shared = range.start..range.end.min(until.0);
            let message = format!("episodes {}..{} are in {name} and in {}", shared.start, shared.end, until.1);
            validation.error("split.overlap", &path, "splits".to_owned(), message);
        }
        if range.end > until.0 {
            until = (range.end, name);
        }
    }
}

fn check_texts(source: &PlainSource, validation: &mut Validation) {
    let root = source.info.root();
    let is_table = source.info.version == PlainVersion::V3_0;
    let tasks = if is_table { layout::TASKS } else { "meta/tasks.jsonl" };
    check_rows(&source.tasks, root.join(tasks).as_path(), "task_index", validation);
    if !source.tasks.is_indexed {
        validation.error("tasks.index", &root.join(tasks), String::new(), no_index("task"));
    }
    let Some(subtasks) = &source.subtasks else { return };
    let path = root.join(layout::SUBTASKS);
    check_rows(subtasks, &path, "subtask_index", validation);
    if !subtasks.is_indexed && !has_programs(root) {
        validation.error("tasks.index", &path, String::new(), no_index("sub-task"));
    }
}

fn no_index(kind: &str) -> String {
    format!("pandas metadata does not make the {kind}'s text the index: LeRobot would take row numbers for texts")
}

/// Rows are in order of their numbers, since readers take them by position, and no text is there twice.
fn check_rows(texts: &PlainTexts, path: &std::path::Path, number: &str, validation: &mut Validation) {
    let mut seen = BTreeSet::new();
    for (row, (found, text)) in texts.rows.iter().enumerate() {
        if *found != row as i64 {
            let message = format!("{number} is {found}: readers take it by position, as {row}");
            return validation.error("meta.row", path, format!("row {row}"), message);
        }
        if !seen.insert(text) {
            validation.error("meta.row", path, format!("row {row}"), format!("the text {text:?} is there twice"));
        }
    }
}
