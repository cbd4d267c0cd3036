//! `ntp replay PATH --episode K`.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde_json::json;

use crate::artifact::Plan;
use crate::cli::ReplayArgs;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::pipeline::{self, Verification};
use crate::recording::ShardReader;
use crate::trace::Episode;
use crate::visualize;

pub(super) fn run(args: &ReplayArgs) -> anyhow::Result<CommandOutcome> {
    let (file, plan, episode) = find(&args.path, args.episode)?;
    if args.verify {
        return verify(args, &plan, &episode);
    }
    let episodes = [episode];
    let (summary, place) = match &args.save {
        Some(path) => (visualize::save(&episodes, path)?, path.display().to_string()),
        None if args.spawn => (visualize::spawn(&episodes)?, "the Rerun viewer".to_owned()),
        None => return Err(UsageError("replay needs one of --save FILE.rrd, --spawn, --verify".to_owned()).into()),
    };
    if args.json {
        output::print_json(&json!({
            "recording": file,
            "episode": args.episode,
            "frames": summary.frames,
            "calls": summary.calls,
            "bytes": summary.bytes,
            "written": place,
        }))?;
    } else {
        output::print(&format!(
            "episode {} of {} ({} frames, {} calls) → {place}",
            args.episode,
            file.display(),
            summary.frames,
            summary.calls
        ))?;
    }
    Ok(CommandOutcome::Done)
}

fn verify(args: &ReplayArgs, plan: &Plan, episode: &Episode) -> anyhow::Result<CommandOutcome> {
    let found = pipeline::verify(plan, episode)?;
    if args.json {
        output::print_json(&found)?;
    } else {
        output::print(&found.to_string())?;
    }
    Ok(if matches!(found, Verification::Same { .. }) { CommandOutcome::Done } else { CommandOutcome::CheckFailed })
}

/// The episode of a number, counted through the recording, or through the recordings of a folder in order of names.
pub(super) fn find(path: &Path, episode: u64) -> anyhow::Result<(PathBuf, Plan, Episode)> {
    let files = recordings(path)?;
    let mut n_episodes = 0;
    for file in &files {
        let mut reader = ShardReader::open(file)?;
        if episode < n_episodes + reader.n_episodes() {
            let plan = serde_json::from_str(reader.plan_json())
                .with_context(|| format!("the plan attached to {}", file.display()))?;
            let found = reader.read_episode(episode - n_episodes)?;
            return Ok((file.clone(), plan, found));
        }
        n_episodes += reader.n_episodes();
    }
    anyhow::bail!("no episode {episode} among the {n_episodes} of {}", path.display())
}

/// A recording itself, or those in a folder: of a stage, of a suite, or the folder that holds the files.
pub(super) fn recordings(path: &Path) -> anyhow::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let with_recordings = [path.to_owned(), path.join("recordings")];
    for folder in with_recordings.iter().filter(|folder| folder.is_dir()) {
        let entries = std::fs::read_dir(folder).with_context(|| format!("failed to list {}", folder.display()))?;
        let mut files = Vec::new();
        for entry in entries {
            let file = entry?.path();
            if file.extension().is_some_and(|extension| extension == "mcap") {
                files.push(file);
            }
        }
        files.sort();
        if !files.is_empty() {
            return Ok(files);
        }
    }
    anyhow::bail!("no recording (.mcap) in {}", path.display())
}
