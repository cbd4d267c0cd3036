//! Writes a shard: one MCAP file with episodes back to back.
//!
//! # Input and output
//!
//! [`Episode`]s in; a file of `schemas/mcap`'s messages out, which appears under its name only when it is whole.
//!
//! # Invariants
//!
//! The same episodes and plan give the same bytes: no clock, no thread, no hash-map order. Log times start at 0 and
//! never go back. Each message is written only after all of its episode has been checked, so that a refused episode
//! leaves no trace.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use mcap::McapError;

use super::calls;
use super::cameras::{Cameras, Filmed};
use super::container::{NoSummary, Summary};
use super::error::{EpisodeProblem, RecordingError};
use super::schema::SCHEMA_VERSION;
use super::sink::{Sink, Times};
use super::transform;
use crate::artifact::{AtomicFile, IoError};
use crate::program::KnownPrograms;
use crate::render::CameraConfig;
use crate::task::Family;
use crate::trace::Episode;

/// Simulated time between an episode's end and the next one's start.
const GAP_NANOS: u64 = 1_000_000_000;

/// What a finished shard holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShardSummary {
    /// Episodes.
    pub episodes: u64,
    /// Episodes that did not succeed.
    pub failed: u64,
    /// Frames of all episodes.
    pub frames: u64,
    /// Program calls of all episodes.
    pub calls: u64,
}

/// A shard being written. Dropped without [`ShardWriter::finish`] it leaves nothing behind.
pub struct ShardWriter {
    path: PathBuf,
    plan_json: String,
    sink: Sink,
    cameras: Cameras,
    /// Family of the first episode; all others are of it too.
    family: Option<Family>,
    /// Whether the first episode's robot has joints; all others' have them too, or have none.
    has_joints: bool,
    /// Log time of the next episode's start.
    next_start_nanos: u64,
    summary: ShardSummary,
}

impl ShardWriter {
    /// Begins a shard that shall be at `path`, with the plan of its stage to be kept in it.
    ///
    /// # Errors
    ///
    /// When the file cannot be made.
    pub fn create(path: &Path, plan_json: &str) -> Result<Self, RecordingError> {
        let file = AtomicFile::create(path)?;
        let sink = Sink::new(file).map_err(|error| failed(path, error))?;
        Ok(Self {
            path: path.to_owned(),
            plan_json: plan_json.to_owned(),
            sink,
            cameras: Cameras::default(),
            family: None,
            has_joints: false,
            next_start_nanos: 0,
            summary: ShardSummary::default(),
        })
    }

    /// Keeps another plan in it than the one that it began with.
    pub(super) fn set_plan(&mut self, plan_json: String) {
        self.plan_json = plan_json;
    }

    /// Films every episode with these cameras. To be said before the first one is written.
    #[must_use]
    pub fn with_cameras(mut self, cameras: &[CameraConfig]) -> Self {
        self.set_cameras(Cameras::new(cameras));
        self
    }

    fn set_cameras(&mut self, cameras: Cameras) {
        self.sink.set_cameras(cameras.declared().len());
        self.cameras = cameras;
    }

    /// Writes one episode behind those before.
    ///
    /// # Errors
    ///
    /// [`RecordingError::Unrecordable`] when it cannot be told in the file's terms; the shard is as before then, and
    /// others can still be written. [`RecordingError::Io`] when the disk is full; the shard is of no use then.
    pub fn write(&mut self, episode: &Episode) -> Result<(), RecordingError> {
        self.write_with(episode, |cameras| cameras.film(episode))
    }

    /// Writes one episode with what cameras saw of it, those of the first episode.
    ///
    /// # Errors
    ///
    /// As [`ShardWriter::write`].
    pub(super) fn write_filmed(&mut self, episode: &Episode, filmed: Vec<Filmed>) -> Result<(), RecordingError> {
        if self.family.is_none() {
            self.set_cameras(Cameras::of(&filmed));
        }
        self.write_with(episode, |cameras| cameras.check(&filmed).map(|()| filmed))
    }

    fn write_with(
        &mut self,
        episode: &Episode,
        film: impl FnOnce(&mut Cameras) -> Result<Vec<Filmed>, EpisodeProblem>,
    ) -> Result<(), RecordingError> {
        let times = self.check(episode).map_err(|problem| self.unrecordable(episode, problem))?;
        let steps = calls::steps(&episode.calls).map_err(|problem| self.unrecordable(episode, problem))?;
        let filmed = film(&mut self.cameras).map_err(|problem| self.unrecordable(episode, problem))?;
        if self.family.is_none() {
            self.family = Some(episode.provenance.family);
            self.has_joints = has_joints(episode);
            self.declare()?;
        }
        self.sink.episode(&times, episode, &steps, filmed).map_err(|error| failed(&self.path, error))?;
        self.next_start_nanos = times.next_start_nanos;
        self.summary.episodes += 1;
        self.summary.failed += u64::from(!episode.outcome.is_success());
        self.summary.frames += episode.frames.len() as u64;
        self.summary.calls += episode.calls.len() as u64;
        Ok(())
    }

    /// Closes the file and gives it its name.
    ///
    /// # Errors
    ///
    /// When the disk is full or the name cannot be taken.
    pub fn finish(mut self) -> Result<ShardSummary, RecordingError> {
        if self.family.is_none() {
            self.declare()?;
        }
        let file = self.sink.close(&self.plan_json).map_err(|error| failed(&self.path, error))?;
        commit_in_order(file, &self.path)?;
        Ok(self.summary)
    }

    /// Writes what stands before the first message.
    fn declare(&mut self) -> Result<(), RecordingError> {
        let known = self.family.map_or(KnownPrograms::FIRST, Family::programs);
        let mut metadata = BTreeMap::from([
            ("schema_version".to_owned(), SCHEMA_VERSION.to_string()),
            ("vocabulary_hash".to_owned(), known.hash()),
            ("programs".to_owned(), known.names().collect::<Vec<_>>().join(",")),
        ]);
        if let Some(family) = self.family {
            metadata.insert("task_family".to_owned(), family.name().to_owned());
        }
        self.sink.declare(known, metadata, &self.cameras, self.has_joints).map_err(|error| failed(&self.path, error))
    }

    /// Whether an episode can be told, and when it happens.
    fn check(&self, episode: &Episode) -> Result<Times, EpisodeProblem> {
        let found = episode.provenance.family;
        if let Some(expected) = self.family.filter(|&expected| expected != found) {
            return Err(EpisodeProblem::Family { found: found.name(), expected: expected.name() });
        }
        if self.family.is_some() && self.has_joints != has_joints(episode) {
            return Err(EpisodeProblem::Joints);
        }
        let names: Vec<&str> = episode.scene.bodies.iter().map(|body| body.name.as_str()).collect();
        let is_taken = |&position: &usize| {
            let name = names[position];
            name == transform::WORLD || name == transform::GRIPPER || names[..position].contains(&name)
        };
        if let Some(position) = (0..names.len()).find(is_taken) {
            return Err(EpisodeProblem::NameTaken { name: names[position].to_owned() });
        }
        let start_nanos = self.next_start_nanos;
        let last = episode.frames.last().map_or(0, |frame| frame.time_nanos);
        let end_nanos = start_nanos.checked_add(last).ok_or(EpisodeProblem::TimeOverflow)?;
        let next_start_nanos = end_nanos.checked_add(GAP_NANOS).ok_or(EpisodeProblem::TimeOverflow)?;
        Ok(Times { start_nanos, end_nanos, next_start_nanos })
    }

    fn unrecordable(&self, episode: &Episode, problem: EpisodeProblem) -> RecordingError {
        RecordingError::Unrecordable { path: self.path.clone(), episode: episode.provenance.index, problem }
    }
}

/// Whether its robot has joints: then each of its frames tells them.
fn has_joints(episode: &Episode) -> bool {
    episode.frames.first().is_some_and(|frame| frame.state.joints_rad.is_some())
}

/// Puts the summary of a file that the library has ended into a fixed order, and gives the file its name.
pub(super) fn commit_in_order(mut file: AtomicFile, path: &Path) -> Result<(), RecordingError> {
    let io = |action| IoError::system(action, path);
    let summary = Summary::read(&mut file).map_err(|error| match error {
        NoSummary::Io(source) => io("read back")(source),
        // The library has just written it.
        _ => io("read back the summary of")(std::io::ErrorKind::InvalidData.into()),
    })?;
    summary.write_in_order(&mut file).map_err(io("write"))?;
    Ok(file.commit()?)
}

pub(super) fn failed(path: &Path, error: McapError) -> RecordingError {
    match error {
        McapError::Io(source) => IoError::system("write", path)(source).into(),
        error => RecordingError::Write { path: path.to_owned(), source: Box::new(error) },
    }
}
