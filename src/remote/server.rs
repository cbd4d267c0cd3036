//! Our simulation as a robot behind the protocol: the yardstick for others' robots, and a stand-in for them.

use std::collections::VecDeque;
use std::io::{BufRead, Write};
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::remote::error::{LinkProblem, RemoteProblem};
use crate::remote::message::{
    Answer, ErrorMessage, Hello, Incoming, Outgoing, PROTOCOL_VERSION, StateMessage, Target, Tray, Welcome,
};
use crate::remote::session::{CARRY, RESET};
use crate::remote::state::{check_names, observation, read_scene, read_state, scene_message};
use crate::remote::wire::{Wire, read_line};
use crate::robot::{Action, RobotApi as _, RobotKind};
use crate::scene::{BodyIndex, Mobility, Scene, SceneState, Slot, SlotIndex};
use crate::seed::Seed;
use crate::sim::{Simulation, SimulationConfig};
use crate::task::{self, Bodies, Family};
use crate::trace::{Cause, Frame};

const NAME: &str = "ntp-simulation";
/// How high a target may be, and the gripper above it, in metres: what `ntp_robot.py` allows.
const HIGHEST_M: f32 = 1.0;
const METHODS: &str = "hello, reset, observe, move_to, grip, release, settle, carry, stop";

/// JSON-RPC's codes, and one for what cannot be done now.
const NO_JSON: i64 = -32700;
const NO_REQUEST: i64 = -32600;
const NO_METHOD: i64 = -32601;
const NO_PARAMS: i64 = -32602;
const NOT_NOW: i64 = -32000;

/// A table in physics that answers lines.
pub struct SimulatedRobot {
    family: Family,
    config: SimulationConfig,
    seed: Seed,
    /// How the table is set, if that is known.
    standing: Option<SceneState>,
    /// What was asked for.
    scene: Option<Scene>,
    world: Option<Simulation>,
    /// After `stop` nothing moves until the next `reset`.
    stopped: bool,
}

/// Why a request is refused: a code and what is wrong.
type Refusal = (i64, String);

/// What a request comes to: frames on the way, then the answer.
type Reply = Result<(Vec<Frame>, Answer), Refusal>;

impl SimulatedRobot {
    /// For one family; where nobody says how the table is set, things start where the seed says.
    pub fn new(family: Family, config: SimulationConfig, seed: Seed) -> Self {
        Self { family, config, seed, standing: None, scene: None, world: None, stopped: false }
    }

    /// The same, with a table that is set already.
    pub fn standing(self, standing: SceneState) -> Self {
        Self { standing: Some(standing), ..self }
    }

    /// The lines that answer a line, in order; none to a notification.
    pub fn answer(&mut self, line: &str) -> Vec<String> {
        let outgoing = match serde_json::from_str::<Incoming>(line) {
            Ok(incoming) => self.outgoing(incoming),
            Err(error) => vec![refused(None, (NO_JSON, format!("no message: {error}")))],
        };
        outgoing.iter().map(|line| serde_json::to_string(line).unwrap_or_default()).collect()
    }

    fn outgoing(&mut self, incoming: Incoming) -> Vec<Outgoing> {
        let Incoming { id, method, params, .. } = incoming;
        let Some(method) = method else {
            return vec![refused(id, (NO_REQUEST, "a request without a method".to_owned()))];
        };
        self.stopped |= method == "stop";
        let Some(id) = id else { return Vec::new() };
        if method == "hello" {
            return vec![match self.hello(params) {
                Ok(result) => Outgoing::Welcome { jsonrpc: "2.0", id, result: Box::new(result) },
                Err(refusal) => refused(Some(id), refusal),
            }];
        }
        match self.reply(&method, params) {
            Ok((frames, result)) => {
                let scene = self.scene.as_ref();
                let told = frames.iter().filter_map(|frame| Some(observation(scene?, &frame.state, frame.time_nanos)));
                let frames = told.map(|params| Outgoing::Frame { jsonrpc: "2.0", method: "frame", params });
                frames.chain([Outgoing::Result { jsonrpc: "2.0", id, result }]).collect()
            }
            Err(refusal) => vec![refused(Some(id), refusal)],
        }
    }

    fn hello(&mut self, params: Value) -> Result<Welcome, Refusal> {
        let Hello { protocol, family, scene } = parse(params)?;
        if protocol != PROTOCOL_VERSION {
            return Err((NO_PARAMS, format!("protocol {protocol}; allowed: {PROTOCOL_VERSION}")));
        }
        if family != self.family {
            return Err((NO_PARAMS, format!("family {}; allowed: {}", family.name(), self.family.name())));
        }
        let asked = read_scene(scene).map_err(wrong)?;
        let layout = self.config.layout();
        let own = task::scene_on(layout, family, &counts(family, &asked));
        check_names(&asked, &own).map_err(wrong)?;
        // An arm stands before a table of its own, from which it reaches all that is on it.
        let (scene, told) = match self.config.robot {
            RobotKind::Gripper => (asked, None),
            RobotKind::Sawyer => (own.clone(), Some(scene_message(&own))),
        };
        let standing = self.standing.take().filter(|state| state.bodies_in_world.len() == scene.bodies.len());
        let initial = standing.unwrap_or_else(|| task::initial_state_on(layout, family, &scene, self.seed));
        self.set_table(&scene, &initial)?;
        self.scene = Some(scene);
        let capabilities = [RESET, CARRY].map(str::to_owned).to_vec();
        let robot = match self.config.robot {
            RobotKind::Gripper => NAME.to_owned(),
            RobotKind::Sawyer => format!("{NAME}-{}", self.config.robot.name()),
        };
        Ok(Welcome { protocol, robot, capabilities, scene: told })
    }

    fn set_table(&mut self, scene: &Scene, initial: &SceneState) -> Result<(), Refusal> {
        let world = Simulation::new(scene.clone(), initial, &self.config);
        self.world = Some(world.map_err(|error| (NO_PARAMS, error.to_string()))?);
        self.stopped = false;
        Ok(())
    }

    fn reply(&mut self, method: &str, params: Value) -> Reply {
        let not_greeted = || (NOT_NOW, format!("{method} before hello"));
        let scene = self.scene.as_ref().ok_or_else(not_greeted)?;
        let action = match method {
            "reset" => {
                let initial = read_state(scene, parse::<StateMessage>(params)?, None).map_err(wrong)?;
                let scene = scene.clone();
                self.set_table(&scene, &initial)?;
                return self.still(None);
            }
            "observe" | "stop" => return self.still(None),
            "settle" => {
                let settled = self.moving(method)?.settle();
                return self.still(Some(settled));
            }
            "carry" => {
                let Tray { body } = parse(params)?;
                let names = scene.bodies.iter().map(|body| body.name.as_str());
                let body = BodyIndex(position("body", &body, names)?);
                let carried = self.moving(method)?.carry(body);
                return self.still(Some(carried));
            }
            "move_to" => {
                let target: Target = parse(params)?;
                Action::MoveTo(slot_of(scene, &target)?)
            }
            "grip" => Action::Grip,
            "release" => Action::Release,
            _ => return Err((NO_METHOD, format!("method {method}; allowed: {METHODS}"))),
        };
        self.act(method, action)
    }

    /// The world, unless it was stopped.
    fn moving(&mut self, method: &str) -> Result<&mut Simulation, Refusal> {
        if self.stopped {
            return Err((NOT_NOW, format!("{method} after stop; allowed: reset, observe")));
        }
        self.world.as_mut().ok_or_else(|| (NOT_NOW, format!("{method} before hello")))
    }

    /// What is told where nothing is recorded: the table as it is, or as an unrecorded motion has left it.
    fn still(&self, left: Option<Result<SceneState, Cause>>) -> Reply {
        let (Some(scene), Some(world)) = (&self.scene, &self.world) else {
            return Err((NOT_NOW, "no table".to_owned()));
        };
        let now = world.now();
        let cause = left.as_ref().and_then(|left| left.as_ref().err()).map(|cause| cause.name().to_owned());
        let state = left.and_then(Result::ok).unwrap_or_else(|| now.state.clone());
        Ok((Vec::new(), Answer { cause, observation: observation(scene, &state, now.time_nanos) }))
    }

    fn act(&mut self, method: &str, action: Action) -> Reply {
        let world = self.moving(method)?;
        let n_before = world.frames().len();
        let cause = world.act(action).err().map(|cause| cause.name().to_owned());
        let frames = world.frames();
        let on_the_way = frames[n_before.min(frames.len() - 1)..frames.len() - 1].to_vec();
        let Answer { observation, .. } = self.still(None)?.1;
        Ok((on_the_way, Answer { cause, observation }))
    }
}

/// The slot of a target, whose body must be one of its bodies, and over the table.
fn slot_of(scene: &Scene, target: &Target) -> Result<SlotIndex, Refusal> {
    let Target { slot, body, position_m, hover_m } = target;
    let names = scene.slots.iter().map(|slot| slot.name.as_str());
    let index = SlotIndex(position("slot", slot, names)?);
    let of_slot = &scene.slots[usize::from(index.0)].bodies;
    let bodies: Vec<&str> = of_slot.iter().map(|body| scene.body(*body).name.as_str()).collect();
    if !bodies.contains(&body.as_str()) {
        return Err((NO_PARAMS, format!("body {body} of slot {slot}; allowed: {}", bodies.join(", "))));
    }
    let [x, y] = scene.table_half_m;
    let is_over = position_m.iter().zip([x, y, HIGHEST_M]).all(|(part, limit)| part.abs() <= limit);
    if !(is_over && (0.0..=HIGHEST_M).contains(hover_m)) {
        let allowed = format!("{x} m, {y} m and {HIGHEST_M} m either way, 0 to {HIGHEST_M} m above");
        return Err((NO_PARAMS, format!("target {position_m:?}, {hover_m} m above; allowed: {allowed}")));
    }
    Ok(index)
}

/// The counts of a trial that has such a scene: of each slot that is counted its bodies, but 0 for a single one that
/// stands aside.
fn counts(family: Family, scene: &Scene) -> Vec<u16> {
    let counted = family.kinds_with_slots().filter(|(kind, _)| kind.bodies != Bodies::One).flat_map(|(_, slots)| slots);
    let count = |slot: &Slot| match slot.bodies.as_slice() {
        [one] if scene.body(*one).mobility == Mobility::Fixed => 0,
        several => several.len() as u16,
    };
    counted.filter_map(|slot| scene.slots.get(slot)).map(count).collect()
}

fn refused(id: Option<u64>, (code, message): Refusal) -> Outgoing {
    Outgoing::Error { jsonrpc: "2.0", id, error: ErrorMessage { code, message } }
}

fn wrong(problem: RemoteProblem) -> Refusal {
    (NO_PARAMS, problem.to_string())
}

fn parse<T: DeserializeOwned>(params: Value) -> Result<T, Refusal> {
    serde_json::from_value(params).map_err(|error| (NO_PARAMS, format!("params: {error}")))
}

fn position<'n>(what: &str, found: &str, mut names: impl Iterator<Item = &'n str> + Clone) -> Result<u16, Refusal> {
    let allowed = || names.clone().collect::<Vec<_>>().join(", ");
    let unknown = (NO_PARAMS, format!("{what} {found:?}; allowed: {}", allowed()));
    names.position(|name| name == found).map(|position| position as u16).ok_or(unknown)
}

/// Answers line by line until the other side has gone.
///
/// # Errors
///
/// When an answer cannot be sent.
pub fn serve(robot: &mut SimulatedRobot, mut input: impl BufRead, mut output: impl Write) -> std::io::Result<()> {
    loop {
        let line = match read_line(&mut input) {
            Ok(line) => line,
            Err(LinkProblem::Gone) => return Ok(()),
            Err(problem) => return Err(std::io::Error::other(problem)),
        };
        for answer in robot.answer(&line) {
            writeln!(output, "{answer}")?;
        }
        output.flush()?;
    }
}

/// A simulated robot in this process.
pub struct InProcess {
    robot: SimulatedRobot,
    waiting: VecDeque<String>,
}

impl InProcess {
    /// The wire to it.
    pub fn new(robot: SimulatedRobot) -> Self {
        Self { robot, waiting: VecDeque::new() }
    }
}

impl Wire for InProcess {
    fn send(&mut self, line: &str) -> Result<(), LinkProblem> {
        self.waiting.extend(self.robot.answer(line));
        Ok(())
    }

    fn receive(&mut self, within: Duration) -> Result<String, LinkProblem> {
        self.waiting.pop_front().ok_or(LinkProblem::Late(within.as_secs()))
    }
}
