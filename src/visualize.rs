//! Episodes into Rerun: scene, running programs, scopes and probabilities over time.
//!
//! # Input and output
//!
//! [`Episode`]s, each with the demonstration it was given where one is at hand, become one Rerun recording each, in an
//! `.rrd` file or in a spawned viewer, together with a blueprint that lays them out. Rerun is used here alone, and
//! what is shown is read from the episode, never from physics.
//!
//! # Entities
//!
//! ```text
//! world/{table, bodies/<name>, gripper/{palm, fingers}, target}   the scene
//! world/arm/link_<n>                the arm, where there is one: the base and its links
//! joints/<joint>                    the angles of its joints, in radians
//! world/adversary, adversary        pushes of an adversary, where there are any: an arrow and a lane
//! camera/{front, wrist}             what cameras see
//! filmed/<camera>                   what the recording's own cameras saw, the first of them what a policy that sees saw
//! programs/depth_<n>                the stack of running programs, a lane a depth
//! programs_of_expert/depth_<n>      the same of the demonstration, beside a rollout
//! agreement                         whether a rollout's decisions are the expert's, until the first that is not
//! specification/…                   which part of the specification each running program may see
//! probability/{end_of_program, program}/depth_<n>                 what a learned policy thought
//! observation/<slot>                distance of what each slot shows from the gripper, in metres
//! calls                             every call in words
//! episode                           task, provenance and outcome in words
//! ```
//!
//! Timelines are `sim_time` (the episode's own clock) and `frame` (position among its recorded frames).
//!
//! An episode of a dataset (a [`Playback`]) has `programs`, `calls` and `episode` as well, `camera/<name>` for each of
//! the dataset's cameras, and `numbers/<feature>/<dimension>`; its timelines are `timestamp` and `frame`.
//!
//! # Invariants
//!
//! The same replays give the same bytes: ids come from content, never from a clock.

mod agreement;
mod arm;
mod blueprint;
mod calls;
mod clock;
mod gripper;
mod lanes;
mod layout;
mod palette;
mod pictures;
mod playback;
mod pushes;
mod rrd;
mod series;
mod specification;
mod store;
mod text;
mod viewer;
mod world;

use std::path::{Path, PathBuf};

use rerun::log::ChunkError;

use crate::artifact::IoError;
use crate::dataset::Playback;
use crate::render::CameraConfig;
use crate::rollout::Divergence;
use crate::trace::{Actor, Episode};
use crate::video::VideoError;
use crate::visualize::rrd::RrdFile;
use crate::visualize::store::Store;
use crate::words::counted;

/// What all recordings of this project have in common in Rerun.
pub const APPLICATION_ID: &str = "ntp";

/// One recording to show.
#[derive(Clone, Copy, Debug)]
pub struct Replay<'e> {
    /// What was done.
    pub episode: &'e Episode,
    /// The demonstration that a policy was given, to be shown beside its rollout. `None` when it is not at hand; an
    /// expert's episode is its own.
    pub demonstration: Option<&'e Episode>,
    /// Where a policy first left the expert's decisions; `None` when it never did, and for an expert.
    pub divergence: Option<Divergence>,
    /// The cameras that filmed the episode. A policy that sees looked with the first of them.
    pub cameras: &'e [CameraConfig],
}

impl<'e> From<&'e Episode> for Replay<'e> {
    fn from(episode: &'e Episode) -> Self {
        Self { episode, demonstration: None, divergence: None, cameras: &[] }
    }
}

/// What was shown or written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VisualizeSummary {
    /// Recordings.
    pub episodes: usize,
    /// Frames of all episodes.
    pub frames: usize,
    /// Program calls of all episodes.
    pub calls: usize,
    /// Size of the file; 0 when it went into a viewer.
    pub bytes: u64,
}

/// Why an episode cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum VisualizeError {
    /// No episode was given.
    #[error("no episode was chosen to be shown")]
    NoEpisodes,
    /// The demonstration is of another length than the one that the rollout was given.
    #[error(
        "episode {episode} was given a specification of {expected}, but the demonstration to show beside it \
         (episode {demonstration}) has {found} boundary frames", expected = counted(*expected, "frame"))]
    ForeignDemonstration {
        /// Number of the rollout.
        episode: u64,
        /// Number of the demonstration.
        demonstration: u64,
        /// Frames of the specification that the rollout was given.
        expected: u32,
        /// Boundary frames of the demonstration.
        found: usize,
    },
    /// Rerun refuses the data of an entity.
    #[error("failed to put {entity} into Rerun's form: {source}")]
    Data {
        /// Path of the entity.
        entity: String,
        /// What Rerun said.
        source: Box<ChunkError>,
    },
    /// The recording cannot be encoded.
    #[error("failed to encode a Rerun recording: {source}: {}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What Rerun said.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A picture cannot be drawn.
    #[error(transparent)]
    Picture(#[from] VideoError),
    /// The file cannot be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// There is no viewer on this machine.
    #[error(
        "the Rerun viewer is not installed: no `rerun` on the PATH; get it by `pip install rerun-sdk=={version}` or \
         `cargo binstall rerun-cli@{version}`, or save to a file"
    )]
    NoViewer {
        /// The version that reads what is written here.
        version: String,
    },
    /// The viewer does not start or does not listen.
    #[error("failed to send to the Rerun viewer: {message}")]
    Viewer {
        /// What Rerun said.
        message: String,
    },
}

/// Writes episodes into an `.rrd` file, one recording each. The file is whole or not there.
///
/// # Errors
///
/// See [`VisualizeError`].
pub fn save(episodes: &[Episode], path: &Path) -> Result<VisualizeSummary, VisualizeError> {
    save_replays(&replays(episodes), path)
}

/// As [`save()`], with demonstrations beside the rollouts.
///
/// # Errors
///
/// See [`VisualizeError`].
pub fn save_replays(replays: &[Replay<'_>], path: &Path) -> Result<VisualizeSummary, VisualizeError> {
    let mut file = RrdFile::create(path)?;
    let summary = each_store(replays, |store| file.append(store))?;
    let bytes = file.finish()?;
    Ok(VisualizeSummary { bytes, ..summary })
}

/// Shows episodes in the Rerun viewer, which is started when none listens.
///
/// # Errors
///
/// [`VisualizeError::NoViewer`] when there is no viewer on this machine; else see [`VisualizeError`].
pub fn spawn(episodes: &[Episode]) -> Result<VisualizeSummary, VisualizeError> {
    spawn_replays(&replays(episodes))
}

/// As [`spawn()`], with demonstrations beside the rollouts.
///
/// # Errors
///
/// As [`spawn()`].
pub fn spawn_replays(replays: &[Replay<'_>]) -> Result<VisualizeSummary, VisualizeError> {
    let viewer = viewer::connect()?;
    let summary = each_store(replays, |store| {
        viewer.send(store);
        Ok(())
    })?;
    viewer.flush()?;
    Ok(summary)
}

/// Writes episodes of datasets into an `.rrd` file, one recording each. The file is whole or not there.
///
/// # Errors
///
/// See [`VisualizeError`].
pub fn save_playbacks(playbacks: &[Playback], path: &Path) -> Result<VisualizeSummary, VisualizeError> {
    let mut file = RrdFile::create(path)?;
    let summary = playback::each_store(playbacks, |store| file.append(store))?;
    let bytes = file.finish()?;
    Ok(VisualizeSummary { bytes, ..summary })
}

/// Shows episodes of datasets in the Rerun viewer.
///
/// # Errors
///
/// As [`spawn()`].
pub fn spawn_playbacks(playbacks: &[Playback]) -> Result<VisualizeSummary, VisualizeError> {
    let viewer = viewer::connect()?;
    let summary = playback::each_store(playbacks, |store| {
        viewer.send(store);
        Ok(())
    })?;
    viewer.flush()?;
    Ok(summary)
}

/// The name of an episode's recording, as people see it: `stack_0012/ep-000042`.
pub fn recording_name(episode: &Episode) -> String {
    format!("{}/ep-{:06}", episode.provenance.task_id, episode.provenance.index)
}

fn replays(episodes: &[Episode]) -> Vec<Replay<'_>> {
    episodes.iter().map(Replay::from).collect()
}

/// Builds the blueprint, then one recording after the other, and hands each on before the next is begun.
fn each_store(
    replays: &[Replay<'_>],
    mut emit: impl FnMut(Store) -> Result<(), VisualizeError>,
) -> Result<VisualizeSummary, VisualizeError> {
    if replays.is_empty() {
        return Err(VisualizeError::NoEpisodes);
    }
    emit(blueprint::blueprint(replays)?)?;
    let mut summary = VisualizeSummary::default();
    for replay in replays {
        emit(recording(replay)?)?;
        summary.episodes += 1;
        summary.frames += replay.episode.frames.len();
        summary.calls += replay.episode.calls.len();
    }
    Ok(summary)
}

fn recording(replay: &Replay<'_>) -> Result<Store, VisualizeError> {
    let &Replay { episode, demonstration, divergence, cameras: _ } = replay;
    let specification = specification_of(episode, demonstration)?;
    let mut store = Store::recording(&text::recording_id(replay));
    text::put_properties(&mut store, replay)?;
    text::put_document(&mut store, replay)?;
    world::put(&mut store, episode)?;
    gripper::put(&mut store, episode)?;
    arm::put(&mut store, episode)?;
    pushes::put(&mut store, episode)?;
    pictures::put(&mut store, replay)?;
    calls::put(&mut store, replay)?;
    lanes::put(&mut store, "programs", episode)?;
    if let Some(demonstration) = demonstration {
        lanes::put(&mut store, "programs_of_expert", demonstration)?;
        agreement::put(&mut store, episode, divergence)?;
    }
    specification::put(&mut store, episode, specification.as_ref())?;
    series::put(&mut store, episode)?;
    Ok(store)
}

/// The demonstration with boundary frames alone, whose positions are what spans of a specification count.
fn specification_of(episode: &Episode, demonstration: Option<&Episode>) -> Result<Option<Episode>, VisualizeError> {
    let Some(demonstration) = demonstration else {
        return Ok((episode.provenance.actor == Actor::Expert).then(|| episode.clone().boundaries_only()));
    };
    let specification = demonstration.clone().boundaries_only();
    if specification.frames.len() != episode.specification_frames as usize {
        return Err(VisualizeError::ForeignDemonstration {
            episode: episode.provenance.index,
            demonstration: demonstration.provenance.index,
            expected: episode.specification_frames,
            found: specification.frames.len(),
        });
    }
    Ok(Some(specification))
}
