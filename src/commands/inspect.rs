//! `ntp inspect PATH`: what is this?

use std::path::Path;

use serde_json::{Value, json};

use crate::artifact;
use crate::cli::PathArgs;
use crate::commands::kind::{self, Kind};
use crate::commands::{CommandOutcome, output, replay};
use crate::rollout::RolloutRows;
use crate::task::{Split, TaskSet};
use crate::{dataset, model, recording};

pub(super) fn run(args: &PathArgs) -> anyhow::Result<CommandOutcome> {
    let description = describe(&args.path)?;
    if args.json {
        output::print_json(&description)?;
    } else {
        output::print(&to_text(&description))?;
    }
    Ok(CommandOutcome::Done)
}

fn describe(path: &Path) -> anyhow::Result<Value> {
    let kind = Kind::of(path)?;
    let details = match kind {
        Kind::Recording => serde_json::to_value(recording::inspect(path)?)?,
        Kind::Recordings => recordings(path)?,
        Kind::Tasks => tasks(path)?,
        Kind::Dataset => serde_json::to_value(dataset::summarize(path)?)?,
        Kind::Model => serde_json::to_value(model::inspect(path)?)?,
        Kind::Rollouts => rollouts(path)?,
        Kind::Report => report(path)?,
        Kind::Run => run_directory(path)?,
        Kind::Study => study(path)?,
    };
    Ok(json!({ "kind": kind.name(), "path": path, "details": details }))
}

fn recordings(path: &Path) -> anyhow::Result<Value> {
    let files = replay::recordings(path)?;
    let inspections = files.iter().map(|file| recording::inspect(file)).collect::<Result<Vec<_>, _>>()?;
    let sum = |of: fn(&recording::RecordingInspection) -> u64| inspections.iter().map(of).sum::<u64>();
    Ok(json!({
        "files": files.len(),
        "episodes": sum(|inspection| inspection.episodes),
        "messages": sum(|inspection| inspection.messages),
        "bytes": sum(|inspection| inspection.bytes),
        "first": inspections.first(),
    }))
}

fn tasks(path: &Path) -> anyhow::Result<Value> {
    let tasks = TaskSet::read(&path.join("tasks.json"))?;
    let example = tasks.tasks.first().map(|task| json!({ "id": task.id, "text": task.text() }));
    Ok(json!({
        "family": tasks.family.name(),
        "seen": tasks.of_split(Split::Seen).count(),
        "unseen": tasks.of_split(Split::Unseen).count(),
        "first": example,
    }))
}

fn rollouts(path: &Path) -> anyhow::Result<Value> {
    let rows = RolloutRows::read(&path.join("rollouts.parquet"))?;
    let (episodes, successes) = rows.successes();
    Ok(json!({ "episodes": episodes, "successes": successes, "causes": rows.causes() }))
}

fn report(path: &Path) -> anyhow::Result<Value> {
    let report: Value = artifact::read_json(&path.join("report.json"))?;
    Ok(json!({ "title": report.get("title"), "results": report.get("results") }))
}

fn run_directory(path: &Path) -> anyhow::Result<Value> {
    let parts = kind::parts_of_run(path)?;
    let lines = parts.iter().map(|part| {
        let name = part.strip_prefix(path).unwrap_or(part);
        Ok((name.display().to_string(), Value::from(Kind::of(part)?.name())))
    });
    Ok(Value::Object(lines.collect::<anyhow::Result<_>>()?))
}

fn study(path: &Path) -> anyhow::Result<Value> {
    let experiments = kind::experiments(path)?;
    let parts = experiments.iter().map(|run| {
        let name = run.strip_prefix(path).unwrap_or(run);
        Ok((name.display().to_string(), run_directory(run)?))
    });
    Ok(Value::Object(parts.collect::<anyhow::Result<_>>()?))
}

/// One `key: value` a line, indented by depth.
fn to_text(value: &Value) -> String {
    let mut text = String::new();
    write_value(&mut text, value, 0);
    text
}

fn write_value(text: &mut String, value: &Value, depth: usize) {
    let indent = "  ".repeat(depth);
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                write_entry(text, &format!("{indent}{key}:"), value, depth);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| write_entry(text, &format!("{indent}-"), item, depth)),
        scalar => text.push_str(&format!("{indent}{}\n", scalar_text(scalar))),
    }
}

fn write_entry(text: &mut String, head: &str, value: &Value, depth: usize) {
    let is_nested = value.as_object().is_some_and(|map| !map.is_empty())
        || value.as_array().is_some_and(|items| items.iter().any(|item| item.is_object() || item.is_array()));
    if is_nested {
        text.push_str(&format!("{head}\n"));
        write_value(text, value, depth + 1);
    } else {
        text.push_str(&format!("{head} {}\n", scalar_text(value)));
    }
}

fn scalar_text(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) => items.iter().map(scalar_text).collect::<Vec<_>>().join(", "),
        Value::Null => "none".to_owned(),
        other => other.to_string(),
    }
}
