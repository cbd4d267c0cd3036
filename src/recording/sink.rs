//! The messages of an episode, in their order, in the library's writer.

use std::collections::BTreeMap;

use mcap::records::{MessageHeader, Metadata, op};
use mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use prost::Message;

use super::calls::{self, Step};
use super::cameras::{Cameras, Filmed};
use super::schema::{CameraTopic, Topic, proto};
use super::{joints, observation, pushes, start, transform, viewer};
use crate::artifact::AtomicFile;
use crate::geometry::Pose;
use crate::program::{KnownPrograms, Program};
use crate::trace::{Episode, Frame};

/// A chunk is closed by the first message that takes it past this size.
const CHUNK_BYTES: u64 = 1 << 20;
/// Fixed, because the library's default may change between versions.
pub(super) const ZSTD_LEVEL: u32 = 3;
/// No message or plan of ours is longer.
const MAX_CONTENT_BYTES: usize = 32 << 20;
/// Name of the metadata record.
pub(super) const METADATA: &str = "ntp.recording";
/// Name of the attachment that holds the stage's plan.
pub(super) const PLAN: &str = "plan.json";
/// Calibration, place and pictures.
const TOPICS_PER_CAMERA: usize = 3;

/// Log times of an episode.
pub(super) struct Times {
    pub(super) start_nanos: u64,
    pub(super) end_nanos: u64,
    pub(super) next_start_nanos: u64,
}

/// The library's writer with one channel a topic.
pub(super) struct Sink {
    mcap: Writer<AtomicFile>,
    /// Next sequence number of each topic, then of those of each camera.
    sequences: Vec<u32>,
    buffer: Vec<u8>,
    /// The channel of joints, behind those of cameras.
    joints_channel: usize,
}

impl Sink {
    pub(super) fn new(file: AtomicFile) -> Result<Self, McapError> {
        let options = WriteOptions::new()
            .profile("")
            .library(format!("ntp/{} {}", env!("CARGO_PKG_VERSION"), mcap::LIBRARY_IDENTIFIER))
            .compression(Some(Compression::Zstd))
            .compression_level(ZSTD_LEVEL)
            // The default is as many as the machine has: the bytes would depend on it.
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES));
        let mcap = options.create(file)?;
        let joints_channel = Topic::ALL.len();
        Ok(Self { mcap, sequences: vec![0; joints_channel + 1], buffer: Vec::new(), joints_channel })
    }

    /// Makes room for the channels of so many cameras.
    pub(super) fn set_cameras(&mut self, n_cameras: usize) {
        self.joints_channel = camera_channel(n_cameras, 0);
        self.sequences.resize(self.joints_channel + 1, 0);
    }

    /// Writes what stands before the first message.
    pub(super) fn declare(
        &mut self,
        known: KnownPrograms,
        metadata: BTreeMap<String, String>,
        cameras: &Cameras,
        has_joints: bool,
    ) -> Result<(), McapError> {
        self.mcap.write_metadata(&Metadata { name: METADATA.to_owned(), metadata })?;
        for topic in Topic::ALL {
            let schema = self.mcap.add_schema(topic.message(), "protobuf", topic.descriptor(known))?;
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
        if has_joints {
            let topic = Topic::JointStates;
            let schema = self.mcap.add_schema(topic.message(), "protobuf", topic.descriptor(known))?;
            let id = self.joints_channel as u16 + 1;
            self.mcap.add_channel_with_id(id, schema, topic.name(), "protobuf", &BTreeMap::new())?;
        }
        Ok(())
    }

    /// Writes an episode that has been checked.
    pub(super) fn episode(
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
        if let Some(joints_rad) = &frame.state.joints_rad {
            self.put_message(self.joints_channel, log_time_nanos, &joints::encode(log_time_nanos, joints_rad))?;
        }
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
        self.put_message(topic as usize, log_time_nanos, message)
    }

    fn put_message(&mut self, channel: usize, log_time_nanos: u64, message: &impl Message) -> Result<(), McapError> {
        let mut buffer = std::mem::take(&mut self.buffer);
        buffer.clear();
        message.encode_raw(&mut buffer);
        let written = self.put_channel(channel, log_time_nanos, &buffer);
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

    /// Writes what stands behind the last message.
    pub(super) fn close(mut self, plan_json: &str) -> Result<AtomicFile, McapError> {
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

/// What a reader would refuse is not written: its limit leaves room for the rest of a record and of a chunk.
fn check_size(opcode: u8, content: &[u8]) -> Result<(), McapError> {
    match content.len() {
        0..=MAX_CONTENT_BYTES => Ok(()),
        len => Err(McapError::RecordTooLarge { opcode, len: len as u64 }),
    }
}

/// Position among all channels of a camera's calibration (0), place (1) or pictures (2).
fn camera_channel(camera: usize, kind: usize) -> usize {
    Topic::ALL.len() + TOPICS_PER_CAMERA * camera + kind
}

fn channel_id(topic: Topic) -> u16 {
    topic as u16 + 1
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
