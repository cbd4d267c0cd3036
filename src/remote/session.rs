//! One conversation with a robot: questions, their answers, and the end at the first thing that is wrong.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::progress::Stopwatch;
use crate::remote::error::{LinkProblem, RemoteError, RemoteProblem};
use crate::remote::message::{Answer, Call, Hello, Incoming, Observation, PROTOCOL_VERSION, Request, Welcome};
use crate::remote::state::{check_names, read_scene, scene_message};
use crate::remote::wire::Wire;
use crate::scene::Scene;
use crate::task::Family;

/// The most frames that a robot may report in one action.
const MOST_FRAMES: usize = 10_000;

/// A robot that has said what it is. Its clones are the same conversation.
#[derive(Clone)]
pub struct Session(Arc<Mutex<Conversation>>);

/// What a robot can do beyond moving.
pub(super) const RESET: &str = "reset";
/// See [`RESET`].
pub(super) const CARRY: &str = "carry";

pub(super) struct Conversation {
    /// `None` once the robot is lost.
    wire: Option<Box<dyn Wire>>,
    /// Where it is.
    address: String,
    /// What it calls itself.
    robot: String,
    capabilities: Vec<String>,
    pub(super) scene: Scene,
    deadline: Duration,
    /// The last request's id.
    id: u64,
    lost: Option<RemoteError>,
}

impl Session {
    /// Greets the robot that is behind a wire and asks it for a scene of a family. Each answer may take as long as
    /// `deadline`.
    ///
    /// # Errors
    ///
    /// When it does not answer as the protocol asks, or has another scene.
    pub fn begin(
        wire: Box<dyn Wire>,
        address: &str,
        family: Family,
        scene: Scene,
        deadline: Duration,
    ) -> Result<Self, RemoteError> {
        let asked = Hello { protocol: PROTOCOL_VERSION, family, scene: scene_message(&scene) };
        let (robot, capabilities) = (address.to_owned(), Vec::new());
        let (wire, address, lost) = (Some(wire), address.to_owned(), None);
        let mut conversation = Conversation { wire, address, robot, capabilities, scene, deadline, id: 0, lost };
        conversation.greet(&Call::Hello(asked))?;
        Ok(Self(Arc::new(Mutex::new(conversation))))
    }

    /// What the robot calls itself.
    pub fn robot(&self) -> String {
        self.lock().robot.clone()
    }

    /// What stands on its table.
    pub fn scene(&self) -> Scene {
        self.lock().scene.clone()
    }

    /// What it can do beyond moving.
    pub fn capabilities(&self) -> Vec<String> {
        self.lock().capabilities.clone()
    }

    /// Why it was lost, if it was.
    pub fn lost(&self) -> Option<RemoteError> {
        self.lock().lost.clone()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Conversation> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Conversation {
    fn greet(&mut self, hello: &Call) -> Result<(), RemoteError> {
        let answer = self.answer(hello, &mut |_| Ok(()));
        answer.and_then(|value| self.welcome(value)).map_err(|problem| self.lose(hello, problem))
    }

    fn welcome(&mut self, value: Value) -> Result<(), RemoteProblem> {
        let Welcome { protocol, robot, capabilities, scene } = parse("answer to hello", value)?;
        if protocol != PROTOCOL_VERSION {
            return Err(RemoteProblem::Protocol { found: protocol, expected: PROTOCOL_VERSION });
        }
        if let Some(scene) = scene {
            let scene = read_scene(scene)?;
            check_names(&scene, &self.scene)?;
            self.scene = scene;
        }
        (self.robot, self.capabilities) = (robot, capabilities);
        Ok(())
    }

    pub(super) fn can(&self, capability: &str) -> bool {
        self.capabilities.iter().any(|able| able == capability)
    }

    /// Refuses what the robot cannot do, before anything is sent.
    pub(super) fn must(&self, call: &Call, capability: &'static str) -> Result<(), RemoteError> {
        if self.can(capability) {
            return Ok(());
        }
        let able = if self.capabilities.is_empty() { "nothing more".into() } else { self.capabilities.join(", ") };
        Err(self.error(call, RemoteProblem::Incapable { capability, able }))
    }

    /// Asks, and hands on what is reported until the answer is there, which is `taken` last. The first thing that is
    /// wrong ends the conversation.
    pub(super) fn ask<T>(
        &mut self,
        call: &Call,
        frame: &mut dyn FnMut(Observation) -> Result<(), RemoteProblem>,
        taken: impl FnOnce(Answer) -> Result<T, RemoteProblem>,
    ) -> Result<T, RemoteError> {
        if let Some(lost) = &self.lost {
            return Err(lost.clone());
        }
        let answer = self.answer(call, frame).and_then(|value| parse("answer", value));
        answer.and_then(taken).map_err(|problem| self.lose(call, problem))
    }

    fn answer(
        &mut self,
        call: &Call,
        frame: &mut dyn FnMut(Observation) -> Result<(), RemoteProblem>,
    ) -> Result<Value, RemoteProblem> {
        let wire = self.wire.as_mut().ok_or(LinkProblem::Gone)?;
        self.id += 1;
        wire.send(&Request::new(Some(self.id), call).line())?;
        let asked = Stopwatch::start();
        let mut n_frames = 0;
        loop {
            let waited = Duration::try_from_secs_f64(asked.taken().wall_secs).unwrap_or_default();
            let left = self.deadline.checked_sub(waited).ok_or(LinkProblem::Late(self.deadline.as_secs()))?;
            let line = wire.receive(left).map_err(|problem| match problem {
                LinkProblem::Late(_) => LinkProblem::Late(self.deadline.as_secs()),
                other => other,
            })?;
            match read(&line, self.id)? {
                Line::Answer(value) => return Ok(value),
                Line::Other => {}
                Line::Frame(observation) if n_frames < MOST_FRAMES => {
                    n_frames += 1;
                    frame(observation)?;
                }
                Line::Frame(_) => return Err(RemoteProblem::TooManyFrames { most: MOST_FRAMES }),
            }
        }
    }

    /// Tells the robot to stop and hangs up.
    pub(super) fn lose(&mut self, call: &Call, problem: RemoteProblem) -> RemoteError {
        if let Some(mut wire) = self.wire.take() {
            // Nothing is left to do where it has gone already.
            let _gone = wire.send(&Request::new(None, &Call::Stop).line());
        }
        let error = self.error(call, problem);
        self.lost = Some(error.clone());
        error
    }

    fn error(&self, call: &Call, problem: RemoteProblem) -> RemoteError {
        RemoteError { robot: self.address.clone(), method: call.method(), problem }
    }
}

/// What a line is.
enum Line {
    Answer(Value),
    Frame(Observation),
    /// A notification that this version does not know.
    Other,
}

fn read(line: &str, id: u64) -> Result<Line, RemoteProblem> {
    let incoming: Incoming =
        serde_json::from_str(line).map_err(|error| RemoteProblem::Json { problem: error.to_string() })?;
    match incoming {
        Incoming { id: None, method: Some(method), params, .. } if method == "frame" => {
            Ok(Line::Frame(parse("frame", params)?))
        }
        Incoming { id: None, method: Some(_), .. } => Ok(Line::Other),
        Incoming { error: Some(error), id: found, .. } if found.is_none_or(|found| found == id) => {
            Err(RemoteProblem::Refused { message: error.message })
        }
        Incoming { id: Some(found), result: Some(value), .. } if found == id => Ok(Line::Answer(value)),
        Incoming { id: found, .. } if found != Some(id) => Err(RemoteProblem::Id { found, expected: id }),
        _ => Err(RemoteProblem::Part { part: "answer", problem: "neither result nor error".to_owned() }),
    }
}

fn parse<T: DeserializeOwned>(part: &'static str, value: Value) -> Result<T, RemoteProblem> {
    serde_json::from_value(value).map_err(|error| RemoteProblem::Part { part, problem: error.to_string() })
}
