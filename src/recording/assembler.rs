//! Messages in, episodes out: puts an episode together from what is read of it.

use prost::Message as _;

use super::cameras::{Filmed, PicturesBeingRead};
use super::error::MessageProblem;
use super::observation::Observed;
use super::schema::{CameraTopic, Topic, foxglove, proto};
use super::start::{self, Start};
use super::transform::{self, GRIPPER};
use super::{calls, joints, observation, pushes};
use crate::geometry::Pose;
use crate::scene::SceneState;
use crate::trace::{Cause, EpisodeParts, Frame, Outcome, ProgramCall, Push, RecordedFrames};

/// Which frames an episode is put together from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Keep {
    #[default]
    All,
    Boundaries,
}

/// The parts of an episode; its spans count all frames, kept or not.
pub(super) struct Assembled {
    pub(super) parts: EpisodeParts,
    pub(super) recorded: RecordedFrames,
    /// Of the kept frames; empty when they are not wanted.
    pub(super) cameras: Vec<Filmed>,
}

/// Episodes being put together, one at a time. Its buffers are used again from message to message.
#[derive(Default)]
pub(super) struct Assembler {
    keep: Keep,
    /// The cameras whose pictures each episode must have; `None` when none are wanted.
    cameras: Option<Vec<String>>,
    building: Option<Box<Building>>,
    call: proto::ProgramCall,
    returned: proto::ProgramReturn,
    observed: Observed,
}

/// An episode of which the start has been read.
struct Building {
    start: Start,
    start_nanos: u64,
    state: SceneState,
    /// Bodies of which no pose has been read yet.
    unplaced: usize,
    placed: Vec<bool>,
    /// Transforms for this time have been read, but no observation.
    transforms_at_nanos: Option<u64>,
    /// Where the search for a body's name begins: transforms come in the order of bodies.
    next_body: usize,
    keep: Keep,
    frames: Vec<Frame>,
    /// Times of all frames since the start.
    times_nanos: Vec<u64>,
    /// Positions of the boundary frames among all.
    boundaries: Vec<u32>,
    calls: Vec<ProgramCall>,
    pushes: Vec<Push>,
    pictures: PicturesBeingRead,
}

impl Assembler {
    pub(super) fn new(keep: Keep) -> Self {
        Self { keep, ..Self::default() }
    }

    /// With the pictures of the frames that are kept, of these cameras and any others that there are.
    pub(super) fn with_pictures(self, cameras: Vec<String>) -> Self {
        Self { cameras: Some(cameras), ..self }
    }

    /// Whether pictures are wanted.
    pub(super) fn wants_pictures(&self) -> bool {
        self.cameras.is_some()
    }

    /// Takes a message of a camera.
    pub(super) fn camera_message(
        &mut self,
        camera: &str,
        topic: CameraTopic,
        data: &[u8],
    ) -> Result<(), MessageProblem> {
        let building = self.building.as_mut().ok_or(MessageProblem::OutOfPlace("no episode has started"))?;
        let n_frames = building.times_nanos.len();
        let is_boundary = building.boundaries.last().is_some_and(|&last| last as usize + 1 == n_frames);
        let is_kept = building.keep == Keep::All || is_boundary;
        building.pictures.message(camera, topic, data, n_frames, is_kept)
    }

    /// Whether an episode has begun and not ended.
    pub(super) fn is_building(&self) -> bool {
        self.building.is_some()
    }

    /// Takes a message; gives the episode that it ends.
    pub(super) fn message(
        &mut self,
        topic: Topic,
        log_time_nanos: u64,
        data: &[u8],
    ) -> Result<Option<Assembled>, MessageProblem> {
        if topic == Topic::EpisodeStart {
            if self.building.is_some() {
                return Err(MessageProblem::OutOfPlace("the episode before has not ended"));
            }
            self.building = Some(Box::new(Building::new(self.keep, self.cameras.as_deref(), log_time_nanos, data)?));
            return Ok(None);
        }
        let Some(building) = &mut self.building else {
            return Err(MessageProblem::OutOfPlace("no episode has started"));
        };
        match topic {
            Topic::Transforms => building.transforms(log_time_nanos, data)?,
            Topic::Observation => {
                observation::decode(data, &mut self.observed)?;
                building.observation(log_time_nanos, &self.observed)?;
            }
            Topic::Call => {
                self.call.clear();
                self.call.merge(data)?;
                building.call(log_time_nanos, &mut self.call)?;
            }
            Topic::Return => {
                self.returned.clear();
                self.returned.merge(data)?;
                building.check_time(log_time_nanos, self.returned.frame)?;
                calls::decode_return(&self.returned, &mut building.calls)?;
            }
            Topic::EpisodeEnd => {
                let end = proto::EpisodeEnd::decode(data)?;
                building.check_end(&end)?;
                let outcome = decode_outcome(&end)?;
                return self.building.take().map(|building| building.assembled(outcome)).transpose();
            }
            Topic::JointStates => {
                let states = foxglove::JointStates::decode(data)?;
                building.joints(log_time_nanos, &states)?;
            }
            Topic::Push => {
                let push = proto::Push::decode(data)?;
                building.check_time(log_time_nanos, push.frames.map_or(0, |frames| frames.begin))?;
                building.pushes.push(pushes::decode(push)?);
            }
            Topic::EpisodeStart | Topic::Stack | Topic::Scene | Topic::Event | Topic::Log => {}
        }
        Ok(None)
    }
}

impl Building {
    fn new(keep: Keep, cameras: Option<&[String]>, start_nanos: u64, data: &[u8]) -> Result<Self, MessageProblem> {
        let start = start::decode(proto::EpisodeStart::decode(data)?)?;
        let n_bodies = start.scene.bodies.len();
        let state = SceneState {
            gripper_in_world: Pose::identity(),
            opening_m: 0.0,
            held: None,
            bodies_in_world: vec![Pose::identity(); n_bodies],
            joints_rad: None,
        };
        Ok(Self {
            start,
            start_nanos,
            state,
            // The gripper is the last one.
            unplaced: n_bodies + 1,
            placed: vec![false; n_bodies + 1],
            transforms_at_nanos: None,
            next_body: 0,
            keep,
            frames: Vec::new(),
            times_nanos: Vec::new(),
            boundaries: Vec::new(),
            calls: Vec::new(),
            pushes: Vec::new(),
            pictures: PicturesBeingRead::new(cameras.unwrap_or_default()),
        })
    }

    fn transforms(&mut self, log_time_nanos: u64, data: &[u8]) -> Result<(), MessageProblem> {
        if self.transforms_at_nanos.replace(log_time_nanos).is_some() {
            return Err(MessageProblem::OutOfPlace("the transforms before have no observation"));
        }
        transform::decode(log_time_nanos, data, |child, pose| {
            let position = self.place(child, pose)?;
            self.unplaced -= usize::from(!std::mem::replace(&mut self.placed[position], true));
            Ok(())
        })
    }

    /// Joints stand between the transforms and the observation of their frame.
    fn joints(&mut self, log_time_nanos: u64, states: &foxglove::JointStates) -> Result<(), MessageProblem> {
        let transforms_nanos = self.transforms_at_nanos.ok_or(MessageProblem::Missing { field: "transforms" })?;
        expect("log time", log_time_nanos, transforms_nanos)?;
        self.state.joints_rad = Some(joints::decode(states)?);
        Ok(())
    }

    fn place(&mut self, child: &[u8], pose: Pose) -> Result<usize, MessageProblem> {
        let bodies = &self.start.scene.bodies;
        if child == GRIPPER.as_bytes() {
            self.state.gripper_in_world = pose;
            return Ok(bodies.len());
        }
        let mut candidates = (self.next_body..bodies.len()).chain(0..self.next_body);
        let position = candidates.find(|&position| bodies[position].name.as_bytes() == child);
        let position = position.ok_or_else(|| MessageProblem::UnknownFrame { frame: transform::text(child) })?;
        self.next_body = position + 1;
        self.state.bodies_in_world[position] = pose;
        Ok(position)
    }

    fn observation(&mut self, log_time_nanos: u64, observed: &Observed) -> Result<(), MessageProblem> {
        let Observed { frame, boundary, opening_m, held, ref slots } = *observed;
        let transforms_nanos =
            self.transforms_at_nanos.take().ok_or(MessageProblem::Missing { field: "transforms" })?;
        expect("log time", log_time_nanos, transforms_nanos)?;
        expect("frame", u64::from(frame), self.times_nanos.len() as u64)?;
        if self.unplaced > 0 {
            return Err(MessageProblem::Missing { field: "transform of a body" });
        }
        let joints_rad = self.state.joints_rad.take();
        let time_nanos = log_time_nanos - self.start_nanos;
        self.times_nanos.push(time_nanos);
        if boundary {
            self.boundaries.push(frame);
        }
        if boundary || self.keep == Keep::All {
            let state = SceneState { opening_m, held, joints_rad, ..self.state.clone() };
            self.frames.push(Frame { time_nanos, boundary, state, slots: slots.clone() });
        }
        Ok(())
    }

    fn call(&mut self, log_time_nanos: u64, message: &mut proto::ProgramCall) -> Result<(), MessageProblem> {
        expect("call", u64::from(message.call), self.calls.len() as u64)?;
        self.check_time(log_time_nanos, message.frame)?;
        self.calls.push(calls::decode_call(message)?);
        Ok(())
    }

    /// Messages of a frame stand at its time.
    fn check_time(&self, log_time_nanos: u64, frame: u32) -> Result<(), MessageProblem> {
        let out_of_range = MessageProblem::OutOfRange { field: "frame", found: u64::from(frame) };
        let time_nanos = self.times_nanos.get(frame as usize).ok_or(out_of_range)?;
        expect("log time", log_time_nanos, self.start_nanos + time_nanos)
    }

    fn check_end(&self, message: &proto::EpisodeEnd) -> Result<(), MessageProblem> {
        expect("index", message.index, self.start.provenance.index)?;
        expect("number of frames", self.times_nanos.len() as u64, u64::from(message.frames))?;
        expect("number of boundary frames", self.boundaries.len() as u64, u64::from(message.boundary_frames))?;
        expect("number of calls", self.calls.len() as u64, u64::from(message.calls))?;
        expect("number of pushes", self.pushes.len() as u64, u64::from(message.pushes))?;
        if self.transforms_at_nanos.is_some() {
            return Err(MessageProblem::OutOfPlace("the transforms before have no observation"));
        }
        if !self.calls.iter().all(calls::has_returned) {
            return Err(MessageProblem::OutOfPlace("a call has not returned"));
        }
        Ok(())
    }

    fn assembled(self, outcome: Outcome) -> Result<Assembled, MessageProblem> {
        let Self { start, frames, times_nanos, boundaries, calls, pushes, pictures, .. } = self;
        let cameras = pictures.finish(times_nanos.len())?;
        let Start { provenance, scene, specification_frames } = start;
        let recorded = RecordedFrames {
            positions: boundaries,
            count: times_nanos.len() as u32,
            end_nanos: times_nanos.last().copied().unwrap_or(0),
        };
        let parts = EpisodeParts { provenance, scene, frames, specification_frames, calls, pushes, outcome };
        Ok(Assembled { parts, recorded, cameras })
    }
}

fn decode_outcome(message: &proto::EpisodeEnd) -> Result<Outcome, MessageProblem> {
    match (message.success, message.cause.as_str()) {
        (true, "") => Ok(Outcome::Success),
        (true, _) => Err(MessageProblem::OutOfPlace("a success has no cause")),
        (false, word) => Cause::from_name(word)
            .map(Outcome::Failure)
            .ok_or_else(|| MessageProblem::UnknownWord { field: "cause", word: word.to_owned() }),
    }
}

fn expect(field: &'static str, found: u64, expected: u64) -> Result<(), MessageProblem> {
    if found == expected { Ok(()) } else { Err(MessageProblem::Unexpected { field, found, expected }) }
}
