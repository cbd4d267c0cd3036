//! `ntp replay PATH --episode RANGES`.

#[cfg(feature = "viewer")]
mod show;

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::Serialize;
use serde_json::json;

use crate::artifact::{Plan, StageDir};
use crate::cli::ReplayArgs;
use crate::commands::kind::Kind;
use crate::commands::{CommandOutcome, UsageError, output};
use crate::dataset::edit::EpisodeRange;
use crate::pipeline::{self, PipelineError, Verification};
use crate::recording::{self, ShardReader};
use crate::render::CameraConfig;
use crate::trace::Episode;

/// An episode that was found.
pub(super) struct Found {
    pub(super) number: u64,
    pub(super) file: PathBuf,
    plan: Plan,
    pub(super) episode: Episode,
    pub(super) cameras: Vec<CameraConfig>,
}

pub(super) fn run(args: &ReplayArgs) -> anyhow::Result<CommandOutcome> {
    args.save.iter().try_for_each(|path| output::refuse_replacing(&args.path, "--save", path))?;
    let is_dataset = args.path.is_dir() && Kind::of(&args.path)? == Kind::Dataset;
    match (args.verify, is_dataset) {
        (true, true) => {
            let problem = "a dataset cannot be simulated again; --verify takes the recordings that it was made of";
            Err(UsageError(problem.to_owned()).into())
        }
        (true, false) => verify(args, &find(&args.path, &args.episode)?),
        (false, _) => show(args, is_dataset),
    }
}

#[cfg(feature = "viewer")]
fn show(args: &ReplayArgs, is_dataset: bool) -> anyhow::Result<CommandOutcome> {
    if is_dataset { show::dataset(args) } else { show::recordings(args) }
}

#[cfg(not(feature = "viewer"))]
fn show(_args: &ReplayArgs, _is_dataset: bool) -> anyhow::Result<CommandOutcome> {
    Err(crate::feature::NotBuiltIn(crate::feature::Feature::Viewer).into())
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

/// The episodes of some numbers, counted through the recording, or through the recordings of a folder in order of
/// names.
pub(super) fn find(path: &Path, ranges: &[EpisodeRange]) -> anyhow::Result<Vec<Found>> {
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
        let end = n_episodes + reader.n_episodes();
        let own = |range: &EpisodeRange| {
            let numbers = range.numbers();
            (*numbers.start()).max(n_episodes)..numbers.end().saturating_add(1).min(end)
        };
        for number in ranges.iter().flat_map(own) {
            let plan: Plan = serde_json::from_str(reader.plan_json())
                .with_context(|| format!("the plan attached to {}", file.display()))?;
            let (episode, cameras) = (reader.read_episode(number - n_episodes)?, recording::cameras_of(&plan));
            found.push(Found { number, file: file.clone(), plan, episode, cameras });
        }
        n_episodes = end;
    }
    match ranges.iter().map(|range| *range.numbers().end()).find(|&last| last >= n_episodes) {
        Some(number) => anyhow::bail!("no episode {number} among the {n_episodes} of {}", path.display()),
        None => {
            // In the order in which they are asked for.
            found.sort_by_key(|of| ranges.iter().position(|range| range.numbers().contains(&of.number)));
            Ok(found)
        }
    }
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
