//! `ntp replay PATH --episode K,…`.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;
use serde_json::{Value, json};

use crate::artifact::{Plan, StageDir};
use crate::cli::ReplayArgs;
use crate::commands::kind::Kind;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::dataset::{Playback, play_back};
use crate::pipeline::{self, PipelineError, Verification};
use crate::recording::{self, ShardReader};
use crate::render::CameraConfig;
use crate::rollout::{Divergence, RolloutRows};
use crate::scene::BodyIndex;
use crate::task::TaskSet;
use crate::trace::{Actor, Episode, Push};
use crate::visualize::{self, Replay};

/// An episode, with what is to be shown beside it.
pub(super) struct Found {
    pub(super) number: u64,
    pub(super) file: PathBuf,
    plan: Plan,
    pub(super) episode: Episode,
    demonstration: Option<Episode>,
    divergence: Option<Divergence>,
    pub(super) cameras: Vec<CameraConfig>,
}

pub(super) fn run(args: &ReplayArgs) -> anyhow::Result<CommandOutcome> {
    if args.path.is_dir() && Kind::of(&args.path)? == Kind::Dataset {
        return run_dataset(args);
    }
    let mut found = find(&args.path, &args.episode)?;
    if args.verify {
        return verify(args, &found);
    }
    found.iter_mut().try_for_each(add_expert)?;
    let replays: Vec<Replay<'_>> = found.iter().map(Found::replay).collect();
    let (summary, place) = match &args.save {
        Some(path) => (visualize::save_replays(&replays, path)?, path.display().to_string()),
        None if args.spawn => (visualize::spawn_replays(&replays)?, "the Rerun viewer".to_owned()),
        None => return Err(UsageError("replay needs one of --save FILE.rrd, --spawn, --verify".to_owned()).into()),
    };
    if args.json {
        let episodes: Vec<Value> = found.iter().map(Found::to_json).collect();
        output::print_json(&json!({ "episodes": episodes, "bytes": summary.bytes, "written": place }))?;
    } else {
        let lines: Vec<String> = found.iter().map(|found| format!("{} → {place}", found.in_words())).collect();
        output::print(&lines.join("\n"))?;
    }
    Ok(CommandOutcome::Done)
}

/// Shows episodes of a dataset: also of one that was annotated elsewhere, of which there is no recording.
fn run_dataset(args: &ReplayArgs) -> anyhow::Result<CommandOutcome> {
    let wrong = |problem: &str| Err(UsageError(problem.to_owned()).into());
    if args.verify {
        return wrong("a dataset cannot be simulated again; --verify takes the recordings that it was made of");
    }
    let playbacks =
        args.episode.iter().map(|&episode| play_back(&args.path, episode)).collect::<Result<Vec<_>, _>>()?;
    let (summary, place) = match &args.save {
        Some(path) => (visualize::save_playbacks(&playbacks, path)?, path.display().to_string()),
        None if args.spawn => (visualize::spawn_playbacks(&playbacks)?, "the Rerun viewer".to_owned()),
        None => return wrong("replay of a dataset needs one of --save FILE.rrd, --spawn"),
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
            format!("episode {episode} of {} ({frames} frames, {calls} calls) → {place}", args.path.display())
        };
        output::print(&playbacks.iter().map(counts).map(line).collect::<Vec<String>>().join("\n"))?;
    }
    Ok(CommandOutcome::Done)
}

fn verify(args: &ReplayArgs, found: &[Found]) -> anyhow::Result<CommandOutcome> {
    let verified = |of: &Found| Ok::<_, PipelineError>((of.number, pipeline::verify(&of.plan, &of.episode)?));
    let verified = found.iter().map(verified).collect::<Result<Vec<_>, _>>()?;
    if args.json {
        let episodes =
            verified.iter().map(|(episode, verification)| VerifiedEpisode { episode: *episode, verification });
        output::print_json(&json!({ "episodes": episodes.collect::<Vec<_>>() }))?;
    } else {
        let line = |(episode, verification): &(u64, Verification)| format!("episode {episode} {verification}");
        output::print(&verified.iter().map(line).collect::<Vec<_>>().join("\n"))?;
    }
    let all_same = verified.iter().all(|(_, verification)| matches!(verification, Verification::Same { .. }));
    Ok(if all_same { CommandOutcome::Done } else { CommandOutcome::CheckFailed })
}

/// What simulating an episode again has shown.
#[derive(Serialize)]
struct VerifiedEpisode<'v> {
    /// Its number.
    episode: u64,
    #[serde(flatten)]
    verification: &'v Verification,
}

impl Found {
    fn replay(&self) -> Replay<'_> {
        let Self { episode, demonstration, divergence, cameras, .. } = self;
        Replay { episode, demonstration: demonstration.as_ref(), divergence: *divergence, cameras }
    }

    /// The frame at which a policy first left the expert's decisions, and its time.
    fn divergent_frame(&self) -> Option<(u32, f64)> {
        let call = self.episode.calls.get(self.divergence?.call().0 as usize)?;
        let frame = self.episode.frames.get(call.frames.begin as usize)?;
        Some((call.frames.begin, frame.time_nanos as f64 / 1e9))
    }

    fn in_words(&self) -> String {
        let Self { number, file, episode, demonstration, divergence, .. } = self;
        let (frames, calls) = (episode.frames.len(), episode.calls.len());
        let mut words = format!("episode {number} of {} ({frames} frames, {calls} calls", file.display());
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
        let divergence = self.divergence.zip(self.divergent_frame()).map(|(divergence, (frame, secs))| {
            let (kind, program) = (divergence.kind.name(), divergence.program.name());
            json!({ "decision": divergence.decision, "kind": kind, "program": program, "frame": frame, "secs": secs })
        });
        json!({
            "recording": self.file,
            "episode": self.number,
            "frames": self.episode.frames.len(),
            "calls": self.episode.calls.len(),
            "demonstration": self.demonstration.is_some(),
            "first_divergence": divergence,
            "pushes": self.episode.pushes.iter().map(|push| push_to_json(&self.episode, push)).collect::<Vec<_>>(),
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

/// The episodes of some numbers, counted through the recording, or through the recordings of a folder in order of
/// names.
pub(super) fn find(path: &Path, numbers: &[u64]) -> anyhow::Result<Vec<Found>> {
    let files = recordings(path)?;
    if let Some(folder) = files[0].parent().filter(|_| path.is_dir()) {
        // Episodes are counted through all recordings, so none of a finished stage may be missing.
        let stage = StageDir::new("recordings", folder);
        stage.manifest()?.map_or(Ok(()), |manifest| stage.check_files(&manifest, false))?;
    }
    let mut found = Vec::new();
    let mut n_episodes = 0;
    for file in &files {
        let mut reader = ShardReader::open(file)?;
        for &number in numbers {
            if !(n_episodes..n_episodes + reader.n_episodes()).contains(&number) {
                continue;
            }
            let plan: Plan = serde_json::from_str(reader.plan_json())
                .with_context(|| format!("the plan attached to {}", file.display()))?;
            let (episode, cameras) = (reader.read_episode(number - n_episodes)?, recording::cameras_of(&plan));
            let (file, demonstration, divergence) = (file.clone(), None, None);
            found.push(Found { number, file, plan, episode, demonstration, divergence, cameras });
        }
        n_episodes += reader.n_episodes();
    }
    match numbers.iter().find(|&&number| number >= n_episodes) {
        Some(number) => anyhow::bail!("no episode {number} among the {n_episodes} of {}", path.display()),
        None => Ok(found),
    }
}

/// Adds to a rollout what the folders around its recording tell: the demonstration that it was given, and where it
/// first left the expert's decisions. A recording that was taken elsewhere is shown by itself.
fn add_expert(found: &mut Found) -> anyhow::Result<()> {
    if found.episode.provenance.actor == Actor::Expert {
        return Ok(());
    }
    let file = found.file.canonicalize().with_context(|| format!("failed to find {}", found.file.display()))?;
    let table = file.ancestors().nth(2).map(|suite| suite.join("rollouts.parquet")).filter(|table| table.is_file());
    if let Some(table) = table {
        found.divergence = RolloutRows::read(&table)?.divergence(found.episode.provenance.index);
    }
    let tasks = file.ancestors().map(|folder| folder.join("tasks/tasks.json")).find(|tasks| tasks.is_file());
    if let Some(tasks) = tasks {
        let demonstration = pipeline::demonstration_of(&found.plan, &TaskSet::read(&tasks)?, &found.episode)?;
        // A model that reads instructions counts sentences, which have no place on a strip of frames.
        found.demonstration = demonstration
            .filter(|shown| shown.boundary_frames().count() == found.episode.specification_frames as usize);
    }
    Ok(())
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
