//! `ntp submit PIPELINE --out RUN` and `ntp status RUN`.

use std::process::{Command, Stdio};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use anyhow::Context as _;

use crate::cli::{StatusArgs, SubmitArgs};
use crate::cluster::{self, ClusterError, FailedItem, StageStatus, Submission, SubmitOptions, SubmittedStage};
use crate::commands::{CommandOutcome, output};
use crate::pipeline::{ItemRanges, PipelineFile};
use crate::process;
use crate::words::{counted, shell_path};

/// How often a run is looked at with `--watch`.
const LOOK_AGAIN: Duration = Duration::from_secs(2);

/// Writes what is left into the run directory, and hands it over.
pub(super) fn submit(args: &SubmitArgs, stop: &AtomicBool) -> anyhow::Result<CommandOutcome> {
    let file = PipelineFile::load(&args.pipeline)?;
    let options = SubmitOptions {
        engine: args.engine,
        max_running: args.max_running,
        per_task: args.per_task,
        sbatch_args: args.sbatch_arg.clone(),
        store: args.store.clone(),
        force: args.force,
    };
    let program = std::env::current_exe().context("failed to find this program")?;
    let submission = Submission::write(&file, &args.out, &program, &options)?;
    if args.json {
        output::print_json(&submission)?;
    } else {
        output::print(&in_words(&submission))?;
    }
    if args.dry_run || submission.stages.is_empty() {
        return Ok(CommandOutcome::Done);
    }
    let mut script = Command::new("bash");
    // Results are on stdout; what the script says is for people.
    script.arg(&submission.script).stdin(Stdio::null()).stdout(std::io::stderr());
    let ended = process::run_in_group(&mut script, stop);
    let ended = ended.with_context(|| format!("failed to run {}", submission.script.display()))?;
    let Some(ended) = ended else {
        return Err(ClusterError::Interrupted.into());
    };
    anyhow::ensure!(ended.success(), "{} ended with {ended}", submission.script.display());
    Ok(CommandOutcome::Done)
}

fn in_words(submission: &Submission) -> String {
    let line = |stage: &SubmittedStage| {
        let SubmittedStage { folder, stage, items, tasks } = stage;
        let folder = if folder == "." { String::new() } else { format!("{folder}: ") };
        format!("{folder}{stage}: {} left, in {}", counted(*items, "item"), counted(*tasks, "task"))
    };
    let mut lines: Vec<String> = submission.stages.iter().map(line).collect();
    lines.push(match submission.stages.is_empty() {
        true => "nothing is left to do".to_owned(),
        false => submission.script.display().to_string(),
    });
    lines.join("\n")
}

/// Says how far a submitted run is; with `--watch` until nothing is left.
pub(super) fn status(args: &StatusArgs) -> anyhow::Result<CommandOutcome> {
    loop {
        let status = cluster::status(&args.run)?;
        if args.json {
            output::print_json(&status)?;
        } else {
            output::print(&status.stages.iter().flat_map(lines).collect::<Vec<String>>().join("\n"))?;
        }
        match (status.is_done(), args.watch) {
            (true, _) => return Ok(CommandOutcome::Done),
            (false, true) => std::thread::sleep(LOOK_AGAIN),
            (false, false) => return Ok(CommandOutcome::LeftOut),
        }
    }
}

/// `generate: 62 of 64 items done, 1 left: 5, 1 failed`, and a line a failure.
fn lines(stage: &StageStatus) -> Vec<String> {
    let StageStatus { experiment, stage, items, done, left, failed } = stage;
    let experiment = experiment.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
    let mut line = format!("{experiment}{stage}: {done} of {} done", counted(*items, "item"));
    if !left.is_empty() {
        let numbers: ItemRanges = left.iter().copied().collect();
        line.push_str(&format!(", {} left: {numbers}", left.len()));
    }
    if !failed.is_empty() {
        line.push_str(&format!(", {} failed", failed.len()));
    }
    let failure = |failed: &FailedItem| {
        let FailedItem { item, unit, message, attempts, node, log } = failed;
        let attempts = counted(*attempts, "time");
        let node = node.as_ref().map(|node| format!(" on {node}")).unwrap_or_default();
        let log = log.as_ref().map(|log| format!(" (tail -F {})", shell_path(log))).unwrap_or_default();
        format!("  item {item} of {unit} failed {attempts}{node}: {message}{log}")
    };
    std::iter::once(line).chain(failed.iter().map(failure)).collect()
}
