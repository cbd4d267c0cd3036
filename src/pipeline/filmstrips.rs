//! Filmstrips for the report, drawn from what was recorded: the first demonstration, the first success, and each suite's
//! first failures.

use std::path::PathBuf;

use crate::artifact::StageDir;
use crate::pipeline::rollout::{self, MOST_FAILURES};
use crate::pipeline::{PipelineError, demonstration_of};
use crate::recording::ShardReader;
use crate::render::{CameraConfig, PictureQuality, Viewpoint};
use crate::report::{Filmstrip, Shows, StripPicture};
use crate::rollout::{Divergence, DivergenceKind, RolloutRows};
use crate::task::TaskSet;
use crate::trace::{Episode, ProgramCall, sentence};
use crate::video::{Film, Rgb, encode_jpeg};

/// Pictures of a strip.
const N_PICTURES: usize = 6;
/// Width and height: a sixth of the page on a screen of one and a half times its density.
const SIZE_PX: [u32; 2] = [240, 180];
/// Failures of an experiment that are shown.
const MOST_FAILURES_IN_ALL: usize = 12;

/// The rollouts of a model in a suite.
pub(super) struct Rollouts {
    pub(super) suite: String,
    /// The model in words.
    pub(super) actor: String,
    pub(super) dir: StageDir,
    /// The folder as seen from the run's.
    pub(super) place: String,
}

/// An episode that was recorded.
struct Found {
    episode: Episode,
    /// Its position among the recordings of its folder.
    position: u64,
    divergence: Option<Divergence>,
}

/// The strips of an experiment. Models come in their order, episodes in that of their suite.
///
/// # Errors
///
/// When a recording cannot be read, or a picture cannot be encoded.
pub(super) fn of_experiment(
    experiment: &str,
    tasks: &TaskSet,
    rollouts: &[Rollouts],
) -> Result<Vec<Filmstrip>, PipelineError> {
    let mut strips = Strips { experiment, tasks, demonstration: None, success: None, failures: Vec::new() };
    for of in rollouts {
        strips.search(of)?;
    }
    let Strips { demonstration, success, failures, .. } = strips;
    Ok(demonstration.into_iter().chain(success).chain(failures).collect())
}

/// Strips as they are found.
struct Strips<'a> {
    experiment: &'a str,
    tasks: &'a TaskSet,
    demonstration: Option<Filmstrip>,
    success: Option<Filmstrip>,
    failures: Vec<Filmstrip>,
}

impl Strips<'_> {
    /// Reads the recordings of a model in a suite until nothing more of them is to be shown.
    fn search(&mut self, of: &Rollouts) -> Result<(), PipelineError> {
        let manifest = of.dir.finished()?;
        let has_failures = manifest.failed > 0;
        let recordings = manifest.files.iter().filter(|file| file.path.ends_with(".mcap"));
        let recordings: Vec<PathBuf> = recordings.map(|file| of.dir.path().join(&file.path)).collect();
        let table = RolloutRows::read(&of.dir.path().join(rollout::TABLE))?;
        let mut position = 0;
        for file in recordings {
            for episode in ShardReader::open(&file)? {
                if !(self.success.is_none() || has_failures && self.lacks_failures(&of.suite)) {
                    return Ok(());
                }
                let episode = episode?;
                let divergence = table.divergence(episode.provenance.index);
                self.add(of, &Found { episode, position, divergence })?;
                position += 1;
            }
        }
        Ok(())
    }

    fn lacks_failures(&self, suite: &str) -> bool {
        let own = self.failures.iter().filter(|strip| strip.suite == suite).count();
        own < MOST_FAILURES && self.failures.len() < MOST_FAILURES_IN_ALL
    }

    fn add(&mut self, of: &Rollouts, found: &Found) -> Result<(), PipelineError> {
        let is_success = found.episode.outcome.is_success();
        if self.demonstration.is_none()
            && let Some(plan) = of.dir.plan()?
            && let Some(episode) = demonstration_of(&plan, self.tasks, &found.episode)?
        {
            let shown = Found { episode, position: found.position, divergence: None };
            self.demonstration = Some(self.strip(of, Shows::Demonstration, &shown)?);
        }
        if is_success && self.success.is_none() {
            self.success = Some(self.strip(of, Shows::Success, found)?);
        } else if !is_success && self.lacks_failures(&of.suite) {
            self.failures.push(self.strip(of, Shows::Failure, found)?);
        }
        Ok(())
    }

    fn strip(&self, of: &Rollouts, shows: Shows, found: &Found) -> Result<Filmstrip, PipelineError> {
        let Found { episode, position, divergence } = found;
        let is_demonstration = shows == Shows::Demonstration;
        Ok(Filmstrip {
            experiment: self.experiment.to_owned(),
            suite: of.suite.clone(),
            shows,
            actor: if is_demonstration { "expert".to_owned() } else { of.actor.clone() },
            episode: episode.provenance.index,
            task: episode.provenance.task_text.clone(),
            cause: episode.outcome.cause().map(|cause| cause.name().to_owned()),
            left: divergence.and_then(|divergence| left(episode, divergence)),
            replay: format!("ntp replay {} --episode {position} --spawn", of.place),
            pictures: pictures(episode, *divergence)?,
        })
    }
}

/// Boundary frames, evenly far apart from the first to the last; where the expert's decisions were left, the nearest of
/// them gives way to that frame.
fn shown_frames(episode: &Episode, departure: Option<usize>) -> Vec<usize> {
    let boundaries: Vec<usize> = episode.boundary_frames().map(|(frame, _)| frame).collect();
    let last = boundaries.len().saturating_sub(1);
    let mut shown: Vec<usize> = (0..N_PICTURES).map(|at| at * last / (N_PICTURES - 1)).collect();
    if let Some(departure) = departure {
        let place = boundaries.partition_point(|&frame| frame < departure).min(last);
        if let Some(nearest) = shown.iter_mut().min_by_key(|shown| shown.abs_diff(place)) {
            *nearest = place;
        }
    }
    shown.dedup();
    shown.into_iter().filter_map(|place| boundaries.get(place).copied()).collect()
}

fn pictures(episode: &Episode, divergence: Option<Divergence>) -> Result<Vec<StripPicture>, PipelineError> {
    let departure = divergence.and_then(|divergence| episode.calls.get(divergence.call().0 as usize));
    let departure = departure.map(|call| call.frames.begin as usize);
    let camera = CameraConfig { quality: PictureQuality::Fine, ..CameraConfig::new(Viewpoint::Front, SIZE_PX) };
    let mut film = Film::new(&camera);
    film.begin_episode(episode)?;
    let mut pictures = Vec::new();
    for frame in shown_frames(episode, departure) {
        let recorded = &episode.frames[frame];
        let drawn = film.draw(&episode.scene, &recorded.state);
        let picture = Rgb { size_px: [drawn.width, drawn.height], bytes: drawn.rgb.clone() };
        pictures.push(StripPicture {
            time_ms: recorded.time_nanos / 1_000_000,
            call: ended_at(episode, frame),
            is_departure: departure == Some(frame),
            size_px: SIZE_PX,
            jpeg: encode_jpeg(&picture)?,
        });
    }
    Ok(pictures)
}

/// The call that ended at a frame, in words: the sentence of its caller if it has one, else its own program.
fn ended_at(episode: &Episode, frame: usize) -> String {
    let calls = &episode.calls;
    let is_last = |call: &&ProgramCall| call.program.is_primitive() && call.frames.last() as usize == frame;
    let Some(call) = calls.iter().rfind(is_last).filter(|_| frame > 0) else { return "start".to_owned() };
    let name = |slot: usize| episode.scene.slots.get(slot).map_or("", |slot| slot.name.as_str());
    let caller = call.caller.and_then(|caller| sentence(calls, caller.0 as usize, name));
    caller.unwrap_or_else(|| words(episode, call))
}

/// A call as it would be written: `move_to(block_D)`.
fn words(episode: &Episode, call: &ProgramCall) -> String {
    match call.argument {
        Some(slot) => format!("{}({})", call.program, episode.scene.slot(slot).name),
        None => call.program.to_string(),
    }
}

/// Where and how an episode left the expert's decisions.
fn left(episode: &Episode, divergence: Divergence) -> Option<String> {
    let call = episode.calls.get(divergence.call().0 as usize)?;
    let secs = episode.frames.get(call.frames.begin as usize)?.time_nanos as f64 / 1e9;
    let Divergence { decision: _, kind, program } = divergence;
    let made = words(episode, call);
    let how = match kind {
        DivergenceKind::Program => format!("called {made}, another program than the expert"),
        DivergenceKind::Argument => format!("called {made}, with another argument than the expert"),
        DivergenceKind::Scope => format!("called {made} on another part of the demonstration than the expert"),
        DivergenceKind::EarlyEnd => format!("ended with {made}, where the expert goes on"),
        DivergenceKind::LateEnd => format!("called {made} and went on, where the expert ends"),
    };
    Some(format!("call {} of {}, at {secs:.1} s: {program} {how}", call.id.0, episode.calls.len()))
}
