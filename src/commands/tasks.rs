//! `ntp tasks PIPELINE.toml` and `ntp tasks --import FILE`.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde_json::json;

use crate::cli::{ScopeArgs, StageArgs, TasksArgs};
use crate::commands::{CommandOutcome, output, stages};
use crate::model::ComputeDevice;
use crate::pipeline::Stage;
use crate::task::{self, Split, TaskSet};
use crate::words::counted;

pub(super) fn run(args: &TasksArgs, stop: &Arc<AtomicBool>) -> anyhow::Result<CommandOutcome> {
    if let Some(import) = &args.import {
        return run_import(args, import);
    }
    let stage_args = StageArgs {
        pipeline: args.pipeline.clone().unwrap_or_default(),
        out: args.out.clone(),
        jobs: None,
        dry_run: args.dry_run,
        force: args.force,
        scope: ScopeArgs::default(),
        no_lock: false,
        store: args.store.clone(),
        json: args.json,
    };
    stages::run(&stage_args, ComputeDevice::Cpu, Stage::Tasks, Stage::Tasks, stop)
}

fn run_import(args: &TasksArgs, path: &Path) -> anyhow::Result<CommandOutcome> {
    if let Some(out) = &args.out {
        output::refuse_replacing(path, "--out", out)?;
    }
    let tasks = task::import(path, args.train)?;
    tasks.validate()?;
    if let Some(out) = &args.out {
        tasks.write(out)?;
    }
    if args.json {
        output::print_json(&summary(&tasks))?;
    } else {
        let count = |split| tasks.of_split(split).count();
        let text = format!(
            "{}: {}, {} seen, {} unseen",
            tasks.family.name(),
            counted(tasks.tasks.len(), "task"),
            count(Split::Seen),
            count(Split::Unseen)
        );
        output::print(&text)?;
    }
    Ok(CommandOutcome::Done)
}

fn summary(tasks: &TaskSet) -> serde_json::Value {
    json!({
        "family": tasks.family,
        "tasks": tasks.tasks.len(),
        "seen": tasks.of_split(Split::Seen).count(),
        "unseen": tasks.of_split(Split::Unseen).count(),
        "goals": tasks.tasks.iter().map(|task| task.goals.len()).sum::<usize>(),
    })
}
