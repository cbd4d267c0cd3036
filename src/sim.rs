//! The tabletop world in rapier3d: bodies, gripper, robot API, recorded frames.
//!
//! # Input and output
//!
//! A [`Scene`] and where everything starts; frames and the causes of what went wrong. No other module knows the
//! physics engine.
//!
//! # Units and frames
//!
//! SI units. World frame: z up, the table's surface at z = 0. The gripper's frame is 2 cm above the centre of what it
//! holds; its fingers close along its y axis and it turns about the vertical alone.
//!
//! # Invariants
//!
//! The same scene, start, settings and actions give the same bits, in any thread and for any number of threads. There
//! is no randomness here but an adversary's, which comes from its seed, and no clock but counted steps. Each action ends
//! with exactly one boundary frame.

mod act;
mod adversary;
mod belief;
mod carry;
mod check;
mod clock;
mod config;
mod drop_spot;
mod engine_shape;
mod error;
mod grasp;
mod gripper;
mod links;
mod motion;
mod mover;
mod sweep;
mod watch;
mod world;

pub use adversary::AdversaryConfig;
pub use config::SimulationConfig;
pub use error::SimError;

use crate::geometry::yaw_rad;
use crate::robot::{Action, RobotApi, RobotKind};
use crate::scene::{BodyIndex, Scene, SceneState, locked_bodies};
use crate::trace::{Cause, Frame, Observation, Push};

use act::Air;
use adversary::Adversary;
use belief::Sight;
use clock::Clock;
use engine_shape::{IntoEngine as _, from_engine};
use gripper::Gripper;
use links::Links;
use motion::Tool;
use mover::{Mover, Stance, Way};
use watch::{Watch, gravest};
use world::World;

/// How long to wait for rest before what only jitters is put to sleep, in simulated seconds.
const PATIENCE_SECS: u32 = 1;

/// A tabletop world with a gripper in it.
pub struct Simulation {
    scene: Scene,
    config: SimulationConfig,
    world: World,
    gripper: Gripper,
    mover: Mover,
    links: Option<Links>,
    watch: Watch,
    clock: Clock,
    frames: Vec<Frame>,
    /// What was just gripped has left what it stood on when the gripper is this high.
    lift_off_z: Option<f32>,
    /// Lost on the way in this action.
    dropped: Option<BodyIndex>,
    adversary: Option<Adversary>,
    /// What the robot sees; without it, it knows where everything is.
    sight: Option<Sight>,
    /// Whether arm or palm have touched something in this action.
    touched: bool,
}

impl Simulation {
    /// Puts everything where it starts, lets it come to rest, and records the first frame.
    ///
    /// # Errors
    ///
    /// [`SimError`] when a setting is not allowed, when a body has no size or lies off the table, when two bodies (or
    /// a body and gripper or table) overlap by more than a millimetre, or when something is held already.
    pub fn new(scene: Scene, initial: &SceneState, config: &SimulationConfig) -> Result<Self, SimError> {
        config.check()?;
        let (mover, tool) = start(initial, config);
        check::check(&scene, initial, &tool)?;
        let mut world = World::new(&scene, initial, config);
        let gripper = Gripper::new(&mut world, tool, config.jaw_m());
        let links = mover.stance().map(|stance| Links::new(&mut world, stance.posture));
        let gripper = if links.is_some() { gripper.below_arm() } else { gripper };
        let clock = Clock::new(config.step_hz, config.frame_hz);
        let watch = Watch::new(initial);
        let mut simulation = Self {
            scene,
            config: config.clone(),
            world,
            gripper,
            mover,
            links,
            watch,
            clock,
            frames: Vec::new(),
            lift_off_z: None,
            dropped: None,
            adversary: None,
            sight: None,
            touched: false,
        };
        simulation.come_to_rest();
        simulation.clock = clock;
        simulation.watch = Watch::new(&simulation.state());
        simulation.record(true);
        Ok(simulation)
    }

    /// The bodies that the slots show now, as far as the robot knows.
    fn locked(&self) -> Vec<BodyIndex> {
        self.locked_in(&self.believed_state())
    }

    fn locked_in(&self, state: &SceneState) -> Vec<BodyIndex> {
        let before = self.frames.last().map(|frame| frame.slots.as_slice());
        locked_bodies(&self.scene, state, before)
    }

    /// One step along a way, in free flight where nothing else can happen, else in the engine.
    fn step_along(&mut self, way: &Way, step: u32, air: Air) {
        let is_clear = match air {
            Air::Clear => true,
            Air::Unknown => false,
            Air::ClearFrom(z) => way.tool(step).position.z >= z,
        };
        if !(is_clear && self.world.is_quiet(self.gripper.held_handle())) {
            let before = self.mover.stance().copied();
            self.mover.stand(way.stance(step));
            self.step_engine_from(before, way.tool(step));
        } else if self.clock.is_due_next() || step == way.n_steps() {
            // What lies between nobody sees.
            self.mover.stand(way.stance(step));
            self.gripper.fly(way.tool(step));
        }
        self.pass();
    }

    /// One step of the engine, with the gripper at a tool that needs no other stance of the arm.
    fn tick(&mut self, tool: Tool) {
        self.step_engine(tool);
        self.pass();
    }

    /// One step in which the gripper stays where it is.
    fn wait(&mut self) {
        if self.world.is_quiet(self.gripper.held_handle()) {
            self.gripper.fly(self.gripper.tool);
            self.pass();
        } else {
            self.tick(self.gripper.tool);
        }
    }

    /// A step has passed.
    fn pass(&mut self) {
        if self.clock.tick() {
            self.record(false);
        }
    }

    fn step_engine(&mut self, tool: Tool) {
        self.step_engine_from(self.mover.stance().copied(), tool);
    }

    fn step_engine_from(&mut self, before: Option<Stance>, tool: Tool) {
        self.gripper.drive(&mut self.world, tool);
        if let (Some(links), Some(before), Some(now)) = (&mut self.links, before, self.mover.stance()) {
            links.drive(&mut self.world, before.posture, now.posture);
        }
        self.world.step();
        self.touched = self.touched || self.sees() && self.has_touched();
        self.drop_what_slipped();
    }

    fn drop_what_slipped(&mut self) {
        if !self.gripper.has_slipped(&self.world) {
            return;
        }
        self.leave();
        if let Some(body) = self.gripper.let_go(&mut self.world) {
            Gripper::part_from(&mut self.world, body);
            self.dropped = Some(body);
        }
    }

    /// Steps the engine, with the gripper where it is, until all is at rest; takes simulated time, records nothing.
    fn come_to_rest(&mut self) {
        for step in 0..self.config.settle_limit_steps() {
            self.step_engine(self.gripper.tool);
            self.clock.tick();
            if self.is_at_rest(step) {
                return;
            }
        }
    }

    /// Whether all but the held body sleeps, after so many steps of waiting for it.
    fn is_at_rest(&mut self, n_steps: u32) -> bool {
        let held = self.gripper.held_handle();
        let is_quiet = self.world.is_quiet(held);
        if !is_quiet && n_steps >= PATIENCE_SECS * self.config.step_hz {
            self.world.calm(held);
        }
        is_quiet
    }

    /// What this action did to the bodies that it should have left alone; `held_before` was in the grasp at its start.
    fn judge(&mut self, held_before: Option<BodyIndex>) -> Option<Cause> {
        let state = self.state();
        let handled: Vec<BodyIndex> = held_before.into_iter().chain(state.held).collect();
        let Self { scene, world, watch, .. } = self;
        watch.judge(scene, &state, &handled, |body| !world.body(body).is_sleeping())
    }

    /// Appends a frame. A frame between boundaries that is due at the very end of an action is the boundary.
    fn record(&mut self, boundary: bool) {
        let time_nanos = self.clock.time_nanos();
        let state = self.state();
        let slots = if self.sees() { self.locked() } else { self.locked_in(&state) };
        let frame = Frame { time_nanos, boundary, state, slots };
        match self.frames.last_mut() {
            Some(last) if last.time_nanos == time_nanos => *last = frame,
            _ => self.frames.push(frame),
        }
    }
}

/// What moves the gripper and where that is when the episode begins: an arm is at home.
fn start(initial: &SceneState, config: &SimulationConfig) -> (Mover, Tool) {
    let opening_m = initial.opening_m.min(config.jaw_m());
    match config.robot {
        RobotKind::Gripper => {
            let tool = Tool {
                position: initial.gripper_in_world.translation.vector.into_engine(),
                yaw_rad: yaw_rad(&initial.gripper_in_world),
                opening_m,
            };
            (Mover::Free, tool)
        }
        RobotKind::Sawyer => {
            let (stance, tool) = Stance::home(opening_m);
            (Mover::Arm(stance), tool)
        }
    }
}

impl RobotApi for Simulation {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn state(&self) -> SceneState {
        let mut bodies_in_world = self.world.bodies_in_world();
        if let Some((body, in_world)) = self.gripper.flown() {
            bodies_in_world[usize::from(body.0)] = from_engine(&in_world);
        }
        SceneState {
            gripper_in_world: from_engine(&self.gripper.tool.in_world()),
            opening_m: self.gripper.tool.opening_m,
            held: self.gripper.held.map(|held| held.body),
            bodies_in_world,
            joints_rad: self.mover.stance().map(|stance| stance.posture.0.map(|angle| angle as f32)),
        }
    }

    fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// See [`Action`]. To grip while holding and to release with nothing held (it opens the fingers) succeed and move
    /// nothing; to move to a slot that the scene does not have fails with [`Cause::UnknownSlot`].
    fn act(&mut self, action: Action) -> Result<(), Cause> {
        let before_nanos = self.clock.time_nanos();
        let held_before = self.gripper.held.map(|held| held.body);
        (self.dropped, self.touched) = (None, false);
        let performed = self.perform(action);
        let touched = self.touched;
        if self.clock.time_nanos() == before_nanos {
            self.wait();
        }
        let broken = self.judge(held_before);
        let released = held_before.filter(|_| action == Action::Release && self.gripper.held.is_none());
        let pushed = released.and_then(|body| self.disturb(body));
        self.look();
        self.record(true);
        let pushed_off = pushed.as_ref().is_some_and(|pushed| pushed.fell_off).then_some(Cause::PushedOffTable);
        pushed.into_iter().for_each(|pushed| self.tell(pushed));
        let dropped = self.dropped.map(|_| Cause::DroppedObject);
        let collided = touched.then_some(Cause::Collided);
        let own = gravest(broken, gravest(dropped, gravest(performed.err(), collided)));
        gravest(own, pushed_off).map_or(Ok(()), Err)
    }

    fn observe(&self) -> Observation {
        let now = self.now();
        if !self.sees() {
            return now.observation();
        }
        Frame { state: self.believed_state(), ..now.clone() }.observation()
    }

    fn is_told_what_it_sees(&self) -> bool {
        self.sees()
    }

    fn pushes(&self) -> Option<&[Push]> {
        self.adversary.as_ref().map(|adversary| adversary.pushes.as_slice())
    }

    fn settle(&mut self) -> Result<SceneState, Cause> {
        self.come_to_rest();
        Ok(self.state())
    }

    fn carry(&mut self, tray: BodyIndex) -> Result<SceneState, Cause> {
        self.carry_away(tray);
        Ok(self.state())
    }
}
