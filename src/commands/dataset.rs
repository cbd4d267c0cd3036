//! `ntp dataset merge | filter | split | diff`: datasets of datasets.

use std::path::Path;

use serde_json::json;

use crate::cli::{DatasetCommand, DiffArgs, ExportArgs, FilterArgs, ImportArgs, MergeArgs, SplitArgs};
use crate::commands::{CommandOutcome, UsageError, output};
use crate::dataset::edit::{
    Carry, ChangedEpisode, Condition, Difference, EditSummary, EpisodeName, SplitBy, Unit, diff, filter, merge, split,
};
use crate::dataset::export::{ExportSummary, export};
use crate::dataset::import::{ImportSummary, import};
use crate::words::counted;

pub(super) fn run(command: &DatasetCommand) -> anyhow::Result<CommandOutcome> {
    match command {
        DatasetCommand::Merge(args) => run_merge(args),
        DatasetCommand::Filter(args) => run_filter(args),
        DatasetCommand::Split(args) => run_split(args),
        DatasetCommand::Diff(args) => run_diff(args),
        DatasetCommand::Export(args) => run_export(args),
        DatasetCommand::Import(args) => run_import(args),
    }
}

/// Refuses a folder within a dataset that is read: it would become a part of it.
pub(super) fn refuse_within(source: &Path, to: &Path) -> Result<(), UsageError> {
    let there = std::path::absolute(to).ok();
    let there = there.and_then(|to| to.ancestors().find_map(|path| path.canonicalize().ok()));
    let (Ok(source), Some(there)) = (source.canonicalize(), there) else { return Ok(()) };
    if there.starts_with(&source) {
        let (to, source) = (to.display(), source.display());
        return Err(UsageError(format!("--to {to} lies within {source}, which is read; choose a folder elsewhere")));
    }
    Ok(())
}

fn carry(reencode: bool) -> Carry {
    if reencode { Carry::Reencode } else { Carry::Packets }
}

fn run_merge(args: &MergeArgs) -> anyhow::Result<CommandOutcome> {
    args.sources.iter().try_for_each(|source| refuse_within(source, &args.to))?;
    let summary = merge(&args.sources, &args.to, carry(args.reencode))?;
    tell(&[(&args.to, &summary)], args.json)
}

fn run_filter(args: &FilterArgs) -> anyhow::Result<CommandOutcome> {
    let condition = Condition {
        tasks: args.task.clone(),
        families: args.family.clone(),
        programs: args.program.clone(),
        outcomes: args.outcome.clone(),
        split: args.split.clone(),
        episodes: args.episodes.clone(),
        min_frames: args.min_frames,
        max_frames: args.max_frames,
    };
    if condition == Condition::default() {
        return Err(UsageError(
            "filter needs a condition, e.g. --split seen; see ntp dataset filter --help".to_owned(),
        )
        .into());
    }
    refuse_within(&args.dataset, &args.to)?;
    let summary = filter(&args.dataset, &condition, &args.to, carry(args.reencode))?;
    tell(&[(&args.to, &summary)], args.json)
}

fn run_split(args: &SplitArgs) -> anyhow::Result<CommandOutcome> {
    let by = match args.by.as_deref() {
        Some("split") => SplitBy::Split,
        Some("task") => SplitBy::Task,
        Some("family") => SplitBy::Family,
        Some(_) => SplitBy::Outcome,
        None => SplitBy::Shares {
            parts: args.shares.iter().map(|part| share(part)).collect::<Result<_, _>>()?,
            unit: if args.unit == "episode" { Unit::Episode } else { Unit::Task },
            seed: args.seed,
        },
    };
    refuse_within(&args.dataset, &args.to)?;
    let parts = split(&args.dataset, &by, &args.to, carry(args.reencode))?;
    let parts: Vec<_> = parts.into_iter().map(|(name, summary)| (args.to.join(name), summary)).collect();
    tell(&parts.iter().map(|(path, summary)| (path.as_path(), summary)).collect::<Vec<_>>(), args.json)
}

fn share(part: &str) -> Result<(String, f64), UsageError> {
    let wrong = || UsageError(format!("--shares: {part:?} is not NAME=SHARE, e.g. train=0.8"));
    let (name, share) = part.split_once('=').ok_or_else(wrong)?;
    Ok((name.to_owned(), share.parse().map_err(|_number| wrong())?))
}

fn tell(written: &[(&Path, &EditSummary)], as_json: bool) -> anyhow::Result<CommandOutcome> {
    let is_left = written.iter().any(|(_, of)| !of.left_behind.is_empty());
    let outcome = if is_left { CommandOutcome::LeftOut } else { CommandOutcome::Done };
    if as_json {
        let written: Vec<_> =
            written.iter().map(|(path, summary)| json!({ "path": path, "summary": summary })).collect();
        output::print_json(&json!({ "written": written }))?;
        return Ok(outcome);
    }
    let line = |(path, of): &(&Path, &EditSummary)| {
        let left_out = if of.left_out > 0 { format!(", {} left out", of.left_out) } else { String::new() };
        let EditSummary { episodes, frames, calls, tasks, .. } = of;
        // Where there are no program tables, none were counted.
        let calls = if *calls > 0 { format!(", {}", counted(*calls, "call")) } else { String::new() };
        let (episodes, tasks) = (counted(*episodes, "episode"), counted(*tasks, "task"));
        format!("{}: {episodes}{left_out}, {tasks}, {}{calls}", path.display(), counted(*frames, "frame"))
    };
    output::print(&written.iter().map(line).collect::<Vec<_>>().join("\n"))?;
    for (path, EditSummary { without_statistics, .. }) in
        written.iter().filter(|(_, of)| !of.without_statistics.is_empty())
    {
        output::note(&format!("{}: without statistics: {}", path.display(), without_statistics.join(", ")));
    }
    for (path, EditSummary { left_behind, .. }) in written.iter().filter(|(_, of)| !of.left_behind.is_empty()) {
        output::note(&format!("{}: not carried over: {}", path.display(), left_behind.join(", ")));
    }
    Ok(outcome)
}

fn run_diff(args: &DiffArgs) -> anyhow::Result<CommandOutcome> {
    let found = diff(&args.before, &args.after)?;
    if args.json {
        output::print_json(&found)?;
    } else {
        output::print(&diff_text(&found))?;
    }
    Ok(if found.is_none() { CommandOutcome::Done } else { CommandOutcome::CheckFailed })
}

fn run_export(args: &ExportArgs) -> anyhow::Result<CommandOutcome> {
    refuse_within(&args.dataset, &args.to)?;
    let written = export(&args.dataset, args.labels, &args.to)?;
    if args.json {
        output::print_json(&json!({ "path": args.to, "labels": args.labels, "summary": written }))?;
    } else {
        let ExportSummary { episodes, labels } = written;
        output::print(&format!(
            "{}: {} of {}",
            args.to.display(),
            counted(labels, "label"),
            counted(episodes, "episode")
        ))?;
    }
    Ok(CommandOutcome::Done)
}

fn run_import(args: &ImportArgs) -> anyhow::Result<CommandOutcome> {
    refuse_within(&args.dataset, &args.to)?;
    let written = import(&args.dataset, args.labels, &args.to)?;
    if args.json {
        output::print_json(&json!({ "path": args.to, "summary": written }))?;
    } else {
        let ImportSummary { episodes, frames, calls, subtasks, cut, .. } = written;
        let text = [(episodes, "episode"), (frames, "frame"), (calls, "call")].map(|(n, of)| counted(n, of)).join(", ");
        output::print(&format!("{}: {text} of {}", args.to.display(), counted(subtasks, "sub-task")))?;
        if cut > 0 {
            output::note(&format!(
                "cut, for sharing frames with another of its level or lying behind the end: {}",
                counted(cut, "label")
            ));
        }
    }
    Ok(CommandOutcome::Done)
}

fn diff_text(found: &Difference) -> String {
    let name = |of: &EpisodeName| {
        if of.recording.is_empty() {
            return format!("episode {} ({})", of.episode_index, of.task_id);
        }
        format!("episode {} ({}, {} of {})", of.episode_index, of.task_id, of.recording_index, of.recording)
    };
    let mut lines: Vec<String> = found.settings.iter().map(|line| format!("setting  {line}")).collect();
    lines.extend(found.removed_episodes.iter().map(|of| format!("removed  {}", name(of))));
    lines.extend(found.added_episodes.iter().map(|of| format!("added    {}", name(of))));
    lines.extend(found.changed_episodes.iter().map(|of| format!("changed  {}: {}", name(&of.before), changes(of))));
    let Difference { same, moved, removed, added, changed, .. } = found;
    lines.push(format!("{same} the same ({moved} of them moved), {removed} removed, {added} added, {changed} changed"));
    lines.join("\n")
}

fn changes(of: &ChangedEpisode) -> String {
    let mut parts = Vec::new();
    if !of.episode_columns.is_empty() {
        parts.push(of.episode_columns.join(", "));
    }
    if !of.calls.is_empty() {
        let ids: Vec<String> = of.calls.iter().map(ToString::to_string).collect();
        parts.push(format!("calls {}", ids.join(", ")));
    }
    if of.scopes > 0 {
        parts.push(counted(of.scopes, "scoping label"));
    }
    parts.extend(of.frames.iter().map(|(column, frames)| format!("{column} in {}", counted(*frames, "frame"))));
    if parts.is_empty() {
        parts.push("how its columns are written".to_owned());
    }
    parts.join("; ")
}
