//! Episodes shown in Rerun.

use anyhow::Context as _;
use serde_json::{Value, json};

use crate::cli::ReplayArgs;
use crate::commands::replay::{Found, find};
use crate::commands::{CommandOutcome, UsageError, output};
use crate::dataset::{Playback, play_back};
use crate::pipeline;
use crate::rollout::{Divergence, RolloutRows};
use crate::scene::BodyIndex;
use crate::task::TaskSet;
use crate::trace::{Actor, Episode, Push};
use crate::visualize::{self, Replay};
use crate::words::counted;

/// An episode, with what is to be shown beside it.
struct Shown {
    found: Found,
    /// What a rollout was given.
    demonstration: Option<Episode>,
    /// Where a rollout first left the expert's decisions.
    divergence: Option<Divergence>,
}

pub(super) fn recordings(args: &ReplayArgs) -> anyhow::Result<CommandOutcome> {
    let found = find(&args.path, &args.episode)?;
    let shown = found.into_iter().map(beside_expert).collect::<anyhow::Result<Vec<Shown>>>()?;
    let replays: Vec<Replay<'_>> = shown.iter().map(Shown::replay).collect();
    let (summary, place) = match &args.save {
        Some(path) => (visualize::save_replays(&replays, path)?, path.display().to_string()),
        None if args.spawn => (visualize::spawn_replays(&replays)?, "the Rerun viewer".to_owned()),
        None => return Err(UsageError("replay needs one of --save FILE.rrd, --spawn, --verify".to_owned()).into()),
    };
    if args.json {
        let episodes: Vec<Value> = shown.iter().map(Shown::to_json).collect();
        output::print_json(&json!({ "episodes": episodes, "bytes": summary.bytes, "written": place }))?;
    } else {
        let lines: Vec<String> = shown.iter().map(|shown| format!("{} → {place}", shown.in_words())).collect();
        output::print(&lines.join("\n"))?;
    }
    Ok(CommandOutcome::Done)
}

/// Shows episodes of a dataset: also of one that was annotated elsewhere, of which there is no recording.
pub(super) fn dataset(args: &ReplayArgs) -> anyhow::Result<CommandOutcome> {
    let episodes = args.episode.iter().flat_map(|range| range.numbers());
    let playbacks = episodes.map(|episode| play_back(&args.path, episode)).collect::<Result<Vec<_>, _>>()?;
    let (summary, place) = match &args.save {
        Some(path) => (visualize::save_playbacks(&playbacks, path)?, path.display().to_string()),
        None if args.spawn => (visualize::spawn_playbacks(&playbacks)?, "the Rerun viewer".to_owned()),
        None => {
            let problem = "replay of a dataset needs one of --save FILE.rrd, --spawn";
            return Err(UsageError(problem.to_owned()).into());
        }
    };
    let counts = |of: &Playback| (of.facts.episode_index, of.times_secs.len(), of.facts.calls.len());
    if args.json {
        let episodes = playbacks.iter().map(counts);
        let episodes: Vec<Value> = episodes
            .map(|(episode, frames, calls)| json!({ "episode": episode, "frames": frames, "calls": calls }))
            .collect();
        output::print_json(&json!({ "episodes": episodes, "bytes": summary.bytes, "written": place }))?;
    } else {
        let line = |(episode, frames, calls)| {
            let (frames, calls) = (counted(frames, "frame"), counted(calls, "call"));
            format!("episode {episode} of {} ({frames}, {calls}) → {place}", args.path.display())
        };
        output::print(&playbacks.iter().map(counts).map(line).collect::<Vec<String>>().join("\n"))?;
    }
    Ok(CommandOutcome::Done)
}

/// Adds to a rollout what the folders around its recording tell. A recording that was taken elsewhere is shown by itself.
fn beside_expert(found: Found) -> anyhow::Result<Shown> {
    let mut shown = Shown { found, demonstration: None, divergence: None };
    let found = &shown.found;
    if found.episode.provenance.actor == Actor::Expert {
        return Ok(shown);
    }
    let file = found.file.canonicalize().with_context(|| format!("failed to find {}", found.file.display()))?;
    let table = file.ancestors().nth(2).map(|suite| suite.join("rollouts.parquet")).filter(|table| table.is_file());
    if let Some(table) = table {
        shown.divergence = RolloutRows::read(&table)?.divergence(found.episode.provenance.index);
    }
    let tasks = file.ancestors().map(|folder| folder.join("tasks/tasks.json")).find(|tasks| tasks.is_file());
    if let Some(tasks) = tasks {
        let demonstration = pipeline::demonstration_of(&found.plan, &TaskSet::read(&tasks)?, &found.episode)?;
        // A model that reads instructions counts sentences, which have no place on a strip of frames.
        shown.demonstration = demonstration
            .filter(|whole| whole.boundary_frames().count() == found.episode.specification_frames as usize);
    }
    Ok(shown)
}

impl Shown {
    fn replay(&self) -> Replay<'_> {
        let Self { found: Found { episode, cameras, .. }, demonstration, divergence } = self;
        Replay { episode, demonstration: demonstration.as_ref(), divergence: *divergence, cameras }
    }

    /// The frame at which a policy first left the expert's decisions, and its time.
    fn divergent_frame(&self) -> Option<(u32, f64)> {
        let episode = &self.found.episode;
        let call = episode.calls.get(self.divergence?.call().0 as usize)?;
        let frame = episode.frames.get(call.frames.begin as usize)?;
        Some((call.frames.begin, frame.time_nanos as f64 / 1e9))
    }

    fn in_words(&self) -> String {
        let Self { found: Found { number, file, episode, .. }, demonstration, divergence } = self;
        let (frames, calls) = (counted(episode.frames.len(), "frame"), counted(episode.calls.len(), "call"));
        let mut words = format!("episode {number} of {} ({frames}, {calls}", file.display());
        if demonstration.is_some() {
            words.push_str(", beside its demonstration");
        }
        words.push(')');
        if let (Some(divergence), Some((frame, secs))) = (divergence, self.divergent_frame()) {
            words.push_str(&format!("; leaves the expert at {secs:.1} s, frame {frame}: {divergence}"));
        }
        if !episode.pushes.is_empty() {
            let times = episode.pushes.iter().map(|push| format!("{:.1} s", secs_of(episode, push.frames.begin)));
            words.push_str(&format!("; the adversary pushes at {}", times.collect::<Vec<_>>().join(", ")));
        }
        words
    }

    fn to_json(&self) -> Value {
        let Found { number, file, episode, .. } = &self.found;
        let divergence = self.divergence.zip(self.divergent_frame()).map(|(divergence, (frame, secs))| {
            let (kind, program) = (divergence.kind.name(), divergence.program.name());
            json!({ "decision": divergence.decision, "kind": kind, "program": program, "frame": frame, "secs": secs })
        });
        json!({
            "recording": file,
            "episode": number,
            "frames": episode.frames.len(),
            "calls": episode.calls.len(),
            "demonstration": self.demonstration.is_some(),
            "first_divergence": divergence,
            "pushes": episode.pushes.iter().map(|push| push_to_json(episode, push)).collect::<Vec<_>>(),
        })
    }
}

fn push_to_json(episode: &Episode, push: &Push) -> Value {
    let name = |body: &BodyIndex| episode.scene.body(*body).name.as_str();
    json!({
        "frame": push.frames.begin,
        "secs": secs_of(episode, push.frames.begin),
        "body": name(&push.body),
        "impulse_ns": push.impulse_ns,
        "toppled": push.toppled.iter().map(name).collect::<Vec<_>>(),
    })
}

/// The time of a frame since the episode began, in seconds.
fn secs_of(episode: &Episode, frame: u32) -> f64 {
    episode.frames.get(frame as usize).map_or(0.0, |frame| frame.time_nanos as f64 / 1e9)
}
