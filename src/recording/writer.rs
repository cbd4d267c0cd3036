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

use mcap::records::{MessageHeader, Metadata, op};
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use prost::Message;

use super::calls::{self, Step};
use super::cameras::{Cameras, Filmed};
use super::container::{MAX_RECORD_BYTES, NoSummary, Summary};
use super::error::{EpisodeProblem, RecordingError};
use super::schema::{CameraTopic, SCHEMA_VERSION, Topic, proto};
use super::{observation, pushes, start, transform, viewer};
use crate::artifact::{AtomicFile, IoError};
use crate::geometry::Pose;
use crate::program::{Program, vocabulary_hash};
use crate::render::CameraConfig;
use crate::task::Family;
use crate::trace::{Episode, Frame};

/// Simulated time between an episode's end and the next one's start.
const GAP_NANOS: u64 = 1_000_000_000;
/// A chunk is closed by the first message that takes it past this size.
const CHUNK_BYTES: u64 = 1 << 20;
/// Fixed, because the library's default may change between versions.
const ZSTD_LEVEL: u32 = 3;
const HALF_RECORD_BYTES: usize = MAX_RECORD_BYTES / 2;
/// Name of the metadata record.
pub(super) const METADATA: &str = "ntp.recording";
/// Name of the attachment that holds the stage's plan.
pub(super) const PLAN: &str = "plan.json";

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
        let options = WriteOptions::new()
            .profile("")
            .library(format!("ntp/{} {}", env!("CARGO_PKG_VERSION"), mcap::LIBRARY_IDENTIFIER))
            .compression(Some(Compression::Zstd))
            .compression_level(ZSTD_LEVEL)
            // The default is as many as the machine has: the bytes would depend on it.
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES));
        let mcap = options.create(file).map_err(|error| failed(path, error))?;
        Ok(Self {
            path: path.to_owned(),
            plan_json: plan_json.to_owned(),
            sink: Sink { mcap, sequences: vec![0; Topic::ALL.len()], buffer: Vec::new() },
            cameras: Cameras::default(),
            family: None,
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
        let n_topics = Topic::ALL.len() + TOPICS_PER_CAMERA * cameras.declared().len();
        self.sink.sequences.resize(n_topics, 0);
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
        let mut file = self.sink.close(&self.plan_json).map_err(|error| failed(&self.path, error))?;
        let io = |action| IoError::system(action, &self.path);
        let summary = Summary::read(&mut file).map_err(|error| match error {
            NoSummary::Io(source) => io("read back")(source),
            // The library has just written it.
            _ => io("read back the summary of")(std::io::ErrorKind::InvalidData.into()),
        })?;
        summary.write_in_order(&mut file).map_err(io("write"))?;
        file.commit()?;
        Ok(self.summary)
    }

    /// Writes what stands before the first message.
    fn declare(&mut self) -> Result<(), RecordingError> {
        let mut metadata = BTreeMap::from([
            ("schema_version".to_owned(), SCHEMA_VERSION.to_string()),
            ("vocabulary_hash".to_owned(), vocabulary_hash()),
            ("programs".to_owned(), Program::ALL.map(Program::name).join(",")),
        ]);
        if let Some(family) = self.family {
            metadata.insert("task_family".to_owned(), family.name().to_owned());
        }
        self.sink.declare(metadata, &self.cameras).map_err(|error| failed(&self.path, error))
    }

    /// Whether an episode can be told, and when it happens.
    fn check(&self, episode: &Episode) -> Result<Times, EpisodeProblem> {
        let found = episode.provenance.family;
        if let Some(expected) = self.family.filter(|&expected| expected != found) {
            return Err(EpisodeProblem::Family { found: found.name(), expected: expected.name() });
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

/// Log times of an episode.
struct Times {
    start_nanos: u64,
    end_nanos: u64,
    next_start_nanos: u64,
}

/// The library's writer with one channel a topic.
struct Sink {
    mcap: Writer<AtomicFile>,
    /// Next sequence number of each topic, then of those of each camera.
    sequences: Vec<u32>,
    buffer: Vec<u8>,
}

impl Sink {
    fn declare(&mut self, metadata: BTreeMap<String, String>, cameras: &Cameras) -> Result<(), McapError> {
        self.mcap.write_metadata(&Metadata { name: METADATA.to_owned(), metadata })?;
        for topic in Topic::ALL {
            let schema = self.mcap.add_schema(topic.message(), "protobuf", topic.descriptor())?;
            let id = channel_id(topic);
            self.mcap.add_channel_with_id(id, schema, topic.name(), "protobuf", &BTreeMap::new())?;
        }
        for (number, (camera, format)) in cameras.declared().iter().enumerate() {
            let pictures = CameraTopic::pictures(*format);
            for (kind, topic) in [CameraTopic::Calibration, CameraTopic::Transform, pictures].into_iter().enumerate() {
                let schema = self.mcap.add_schema(topic.message(), "protobuf", topic.descriptor())?;
                let id = camera_channel(number, kind) as u16 + 1;
                self.mcap.add_channel_with_id(id, schema, &topic.name(camera), "protobuf", &BTreeMap::new())?;
            }
        }
        Ok(())
    }

    fn episode(
        &mut self,
        times: &Times,
        episode: &Episode,
        steps: &[(u32, Step)],
        mut filmed: Vec<Filmed>,
    ) -> Result<(), McapError> {
        let start_nanos = times.start_nanos;
        self.put(Topic::EpisodeStart, start_nanos, &start::encode(episode))?;
        self.put(Topic::Scene, start_nanos, &viewer::scene(start_nanos, episode))?;
        self.put(Topic::Log, start_nanos, &viewer::start_log(start_nanos, episode))?;
        for (number, camera) in filmed.iter().enumerate() {
            self.put_channel(camera_channel(number, 0), start_nanos, &camera.calibration(start_nanos))?;
            self.put_channel(camera_channel(number, 1), start_nanos, &camera.transform(start_nanos))?;
        }
        let mut steps = steps.iter().copied().peekable();
        let mut running = Vec::new();
        for (position, frame) in episode.frames.iter().enumerate() {
            let before = position.checked_sub(1).map(|before| &episode.frames[before]);
            self.frame(start_nanos, episode, position as u32, frame, before)?;
            for (number, camera) in filmed.iter_mut().enumerate() {
                let log_time_nanos = start_nanos + frame.time_nanos;
                let picture = camera.picture(log_time_nanos, position);
                self.put_channel(camera_channel(number, 2), log_time_nanos, &picture)?;
            }
            let mut changed = false;
            while let Some((_, step)) = steps.next_if(|&(at, _)| at == position as u32) {
                self.step(start_nanos, episode, step, &mut running)?;
                changed = true;
            }
            if changed {
                self.put(Topic::Stack, start_nanos + frame.time_nanos, &viewer::stack(&running))?;
            }
            for push in episode.pushes.iter().filter(|push| push.frames.begin as usize == position) {
                let log_time_nanos = start_nanos + frame.time_nanos;
                self.put(Topic::Push, log_time_nanos, &pushes::encode(push))?;
                self.put(Topic::Log, log_time_nanos, &viewer::push_log(log_time_nanos, &episode.scene, push))?;
            }
        }
        self.put(Topic::Log, times.end_nanos, &viewer::end_log(times.end_nanos, episode))?;
        self.put(Topic::EpisodeEnd, times.end_nanos, &encode_end(episode))
    }

    fn frame(
        &mut self,
        start_nanos: u64,
        episode: &Episode,
        position: u32,
        frame: &Frame,
        before: Option<&Frame>,
    ) -> Result<(), McapError> {
        let log_time_nanos = start_nanos + frame.time_nanos;
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        encode_transforms(log_time_nanos, episode, frame, before, &mut buffer);
        let written = self.put_bytes(Topic::Transforms, log_time_nanos, &buffer);
        self.buffer = buffer;
        written?;
        self.put(Topic::Observation, log_time_nanos, &observation::encode(position, frame))
    }

    fn step(
        &mut self,
        start_nanos: u64,
        episode: &Episode,
        step: Step,
        running: &mut Vec<Program>,
    ) -> Result<(), McapError> {
        let time = |frame: u32| start_nanos + episode.frames[frame as usize].time_nanos;
        match step {
            Step::Call(position) => {
                let call = &episode.calls[position];
                running.push(call.program);
                self.put(Topic::Call, time(call.frames.begin), &calls::encode_call(call))
            }
            Step::Return(position) => {
                let call = &episode.calls[position];
                running.pop();
                let (begin, end) = (time(call.frames.begin), time(call.frames.last()));
                self.put(Topic::Return, end, &calls::encode_return(call))?;
                self.put(Topic::Event, end, &viewer::event(begin, end, &episode.scene, call))
            }
        }
    }

    fn put(&mut self, topic: Topic, log_time_nanos: u64, message: &impl Message) -> Result<(), McapError> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        message.encode_raw(&mut buffer);
        let written = self.put_bytes(topic, log_time_nanos, &buffer);
        self.buffer = buffer;
        written
    }

    fn put_bytes(&mut self, topic: Topic, log_time_nanos: u64, message: &[u8]) -> Result<(), McapError> {
        self.put_channel(topic as usize, log_time_nanos, message)
    }

    fn put_channel(&mut self, channel: usize, log_time_nanos: u64, message: &[u8]) -> Result<(), McapError> {
        check_size(op::MESSAGE, message)?;
        let sequence = &mut self.sequences[channel];
        let header = MessageHeader {
            channel_id: channel as u16 + 1,
            sequence: *sequence,
            log_time: log_time_nanos,
            publish_time: log_time_nanos,
        };
        *sequence = sequence.wrapping_add(1);
        self.mcap.write_to_known_channel(&header, message)
    }

    fn close(mut self, plan_json: &str) -> Result<AtomicFile, McapError> {
        check_size(op::ATTACHMENT, plan_json.as_bytes())?;
        self.mcap.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: PLAN.to_owned(),
            media_type: "application/json".to_owned(),
            data: plan_json.as_bytes().into(),
        })?;
        self.mcap.finish()?;
        Ok(self.mcap.into_inner())
    }
}

/// What a reader would refuse is not written. Half of its limit leaves room for the rest of a record and of a chunk.
fn check_size(opcode: u8, content: &[u8]) -> Result<(), McapError> {
    match content.len() {
        0..=HALF_RECORD_BYTES => Ok(()),
        len => Err(McapError::RecordTooLarge { opcode, len: len as u64 }),
    }
}

/// Calibration, place and pictures.
const TOPICS_PER_CAMERA: usize = 3;

/// Position among all channels of a camera's calibration (0), place (1) or pictures (2).
fn camera_channel(camera: usize, kind: usize) -> usize {
    Topic::ALL.len() + TOPICS_PER_CAMERA * camera + kind
}

fn channel_id(topic: Topic) -> u16 {
    topic as u16 + 1
}

fn failed(path: &Path, error: McapError) -> RecordingError {
    match error {
        McapError::Io(source) => IoError::system("write", path)(source).into(),
        error => RecordingError::Write { path: path.to_owned(), source: Box::new(error) },
    }
}

/// The gripper, and the bodies that are elsewhere than in the frame before.
fn encode_transforms(
    log_time_nanos: u64,
    episode: &Episode,
    frame: &Frame,
    before: Option<&Frame>,
    buffer: &mut Vec<u8>,
) {
    transform::encode(log_time_nanos, transform::GRIPPER, &frame.state.gripper_in_world, buffer);
    for (position, (body, pose)) in episode.scene.bodies.iter().zip(&frame.state.bodies_in_world).enumerate() {
        if before.is_none_or(|before| bits(&before.state.bodies_in_world[position]) != bits(pose)) {
            transform::encode(log_time_nanos, &body.name, pose, buffer);
        }
    }
}

fn bits(pose: &Pose) -> [u32; 7] {
    let [x, y, z] = pose.translation.vector.into();
    let [i, j, k, w] = pose.rotation.coords.into();
    [x, y, z, i, j, k, w].map(f32::to_bits)
}

fn encode_end(episode: &Episode) -> proto::EpisodeEnd {
    proto::EpisodeEnd {
        index: episode.provenance.index,
        success: episode.outcome.is_success(),
        cause: episode.outcome.cause().map_or("", crate::trace::Cause::name).to_owned(),
        frames: episode.frames.len() as u32,
        boundary_frames: episode.boundary_frames().count() as u32,
        calls: episode.calls.len() as u32,
        pushes: episode.pushes.len() as u32,
    }
}
