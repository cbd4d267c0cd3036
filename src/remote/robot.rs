//! A robot of others as programs see it.

use crate::remote::error::{RemoteError, RemoteProblem};
use crate::remote::message::{Answer, Call, Observation, StateMessage, Target, Tray};
use crate::remote::session::{CARRY, RESET, Session};
use crate::remote::state::{read_cause, read_joints, read_state, state_message};
use crate::robot::{Action, HOVER_M, RobotApi};
use crate::scene::{BodyIndex, Scene, SceneState, locked_bodies};
use crate::trace::{Cause, Frame};

/// A target is at most this high above the table, and at most this much below its surface, in metres.
const MOST_HEIGHT_M: f32 = 1.0;
const MOST_DEPTH_M: f32 = 0.01;

/// One episode with a robot behind a [`Session`]. What it reports is recorded; its clock starts at 0.
pub struct RemoteRobot {
    session: Session,
    scene: Scene,
    /// The robot's own time of the first frame.
    began_ns: u64,
    frames: Vec<Frame>,
}

impl RemoteRobot {
    /// Begins with the table as it is.
    ///
    /// # Errors
    ///
    /// When the robot is lost.
    pub fn observe(session: &Session) -> Result<Self, RemoteError> {
        Self::begin(session, &Call::Observe)
    }

    /// Begins with everything put where it shall start.
    ///
    /// # Errors
    ///
    /// When the robot is lost, or cannot put things anywhere by itself.
    pub fn reset(session: &Session, initial: &SceneState) -> Result<Self, RemoteError> {
        let call = Call::Reset(state_message(&session.scene(), initial));
        session.lock().must(&call, RESET)?;
        Self::begin(session, &call)
    }

    fn begin(session: &Session, call: &Call) -> Result<Self, RemoteError> {
        let scene = session.scene();
        let first = |Answer { cause: _, observation }| {
            let (time_ns, state) = told(&scene, observation, None)?;
            let slots = locked_bodies(&scene, &state, None);
            Ok((time_ns, Frame { time_nanos: 0, boundary: true, state, slots }))
        };
        let (began_ns, frame) = session.lock().ask(call, &mut |_| Ok(()), first)?;
        Ok(Self { session: session.clone(), scene, began_ns, frames: vec![frame] })
    }

    /// What an action asks of the robot. A target off the table is no request: where the body went nobody shall follow.
    fn call(&self, action: Action) -> Result<Call, Cause> {
        let Action::MoveTo(slot) = action else {
            return Ok(if action == Action::Grip { Call::Grip } else { Call::Release });
        };
        let now = self.now();
        let &body = now.slots.get(usize::from(slot.0)).ok_or(Cause::UnknownSlot)?;
        let position = now.state.body_in_world(body).translation.vector;
        let [half_x, half_y] = self.scene.table_half_m;
        let is_above_table = position.x.abs() <= half_x && position.y.abs() <= half_y;
        if !is_above_table || !(-MOST_DEPTH_M..=MOST_HEIGHT_M).contains(&position.z) {
            return Err(Cause::ObjectOffTable);
        }
        let named = self.scene.body(body);
        Ok(Call::MoveTo(Target {
            slot: self.scene.slot(slot).name.clone(),
            body: named.name.clone(),
            position_m: position.into(),
            hover_m: named.shape.rim_m().unwrap_or(0.0) + HOVER_M,
        }))
    }

    /// Lets the robot do something that is not recorded: the state that it tells then.
    fn unrecorded(&self, call: &Call) -> Result<SceneState, Cause> {
        let taken = |Answer { cause, observation }| {
            let cause = cause.map(|name| read_cause(&name)).transpose()?;
            Ok((cause, told(&self.scene, observation, Some(&self.now().state))?.1))
        };
        let (cause, state) = self.session.lock().ask(call, &mut |_| Ok(()), taken).map_err(|_lost| Cause::RobotLost)?;
        cause.map_or(Ok(state), Err)
    }
}

impl RobotApi for RemoteRobot {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn state(&self) -> SceneState {
        self.now().state.clone()
    }

    fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// See [`Action`]. With a body off the table for a target nothing is sent: [`Cause::ObjectOffTable`].
    fn act(&mut self, action: Action) -> Result<(), Cause> {
        let call = self.call(action)?;
        let Self { session, scene, began_ns, frames } = self;
        let mut reported = Vec::new();
        let last = &frames[frames.len() - 1];
        let record = |reported: &mut Vec<Frame>, observation| {
            let frame = next_frame(scene, *began_ns, reported.last().unwrap_or(last), observation)?;
            reported.push(frame);
            Ok(())
        };
        let asked = session.lock().ask(
            &call,
            &mut |observation| record(&mut reported, observation),
            |Answer { cause, observation }| Ok((cause.map(|name| read_cause(&name)).transpose()?, observation)),
        );
        let ended = asked.and_then(|(cause, observation)| {
            record(&mut reported, observation).map(|()| cause).map_err(|problem| session.lock().lose(&call, problem))
        });
        // Of a robot that was lost the last thing that was seen is a boundary.
        if let Some(last) = reported.last_mut() {
            last.boundary = true;
        }
        frames.append(&mut reported);
        ended.map_or(Err(Cause::RobotLost), |cause| cause.map_or(Ok(()), Err))
    }

    fn settle(&mut self) -> Result<SceneState, Cause> {
        self.unrecorded(&Call::Settle)
    }

    /// A robot that cannot carry a tray is judged where it stands.
    fn carry(&mut self, tray: BodyIndex) -> Result<SceneState, Cause> {
        let can_carry = self.session.lock().can(CARRY);
        let tray = Tray { body: self.scene.body(tray).name.clone() };
        self.unrecorded(&if can_carry { Call::Carry(tray) } else { Call::Settle })
    }
}

/// The frame behind another one, between boundaries.
fn next_frame(scene: &Scene, began_ns: u64, before: &Frame, observation: Observation) -> Result<Frame, RemoteProblem> {
    let (now, state) = told(scene, observation, Some(&before.state))?;
    let last = began_ns.saturating_add(before.time_nanos);
    if now <= last {
        return Err(RemoteProblem::Time { before: last, now });
    }
    let slots = locked_bodies(scene, &state, Some(&before.slots));
    Ok(Frame { time_nanos: now - began_ns, boundary: false, state, slots })
}

/// The time and the state that an observation tells.
fn told(
    scene: &Scene,
    observation: Observation,
    before: Option<&SceneState>,
) -> Result<(u64, SceneState), RemoteProblem> {
    let Observation { time_ns, gripper, bodies, joints_rad } = observation;
    let state = read_state(scene, StateMessage { gripper, bodies }, before)?;
    let told = read_joints(joints_rad)?;
    // A robot that has told them once keeps them, as what stands on the table keeps its place.
    let joints_rad = before.map_or(told, |before| before.joints_rad.map(|known| told.unwrap_or(known)));
    Ok((time_ns, SceneState { joints_rad, ..state }))
}
