//! The paper's robot API, as a trait that any robot in any world can implement.
//!
//! # Source
//!
//! Paper, section III: `move_to` takes an object index and moves the gripper to above that object; `grip` closes the
//! gripper, `release` opens it.

mod judge;

pub use judge::{Judgement, judge};

use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::program::Program;
use crate::scene::{BodyIndex, Scene, SceneState, SlotIndex};
use crate::task::{Layout, UnknownName};
use crate::trace::{Cause, Frame, Observation, Push};

/// Which robot acts.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum RobotKind {
    /// A gripper that flies freely.
    #[default]
    Gripper,
    /// Rethink Robotics' Sawyer with the same gripper.
    Sawyer,
}

impl RobotKind {
    /// Every robot.
    pub const ALL: [Self; 2] = [Self::Gripper, Self::Sawyer];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gripper => "gripper",
            Self::Sawyer => crate::arm::NAME,
        }
    }

    /// Whether it is the one that acts where nobody names one.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// How things are laid out so that it reaches them all.
    pub fn layout(self) -> Layout {
        match self {
            Self::Gripper => Layout::Table,
            Self::Sawyer => Layout::Bench,
        }
    }
}

impl FromStr for RobotKind {
    type Err = UnknownName;

    fn from_str(word: &str) -> Result<Self, UnknownName> {
        let unknown = || UnknownName::new("robot", word, &Self::ALL.map(Self::name));
        Self::ALL.into_iter().find(|kind| kind.name() == word).ok_or_else(unknown)
    }
}

/// A call of the robot API.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    /// Up, across above everything that stands, and down to hover [`HOVER_M`] above the centre of what the slot shows,
    /// of an open box or bowl above the middle of its rim. Higher, if something stands in between. A bowl in the
    /// gripper, which is held at its rim, comes to hang above that middle itself.
    MoveTo(SlotIndex),
    /// Down onto what lies below, close the fingers, hold it if it is between them. A bowl is gripped at its rim, at
    /// the side that is nearest to the gripper's y.
    Grip,
    /// Down until what is held rests on (or hangs just above) what lies below, and open the fingers. Over an open box
    /// or bowl what is held goes first to where it will lie lowest.
    Release,
}

/// Height of the gripper above the centre (of an open box or bowl: the rim) of the object that `move_to` names, in metres.
/// Half-way between levels of a tower: with 2 cm + a multiple of 5 cm a gripper that has just released on a tower would
/// seem to hover above one of its lower blocks.
pub const HOVER_M: f32 = 0.145;
/// Height of the gripper above the centre of what it holds, in metres. Bowls are held at the rim.
pub const GRASP_M: f32 = 0.02;

impl Action {
    /// The action of a primitive call; `None` when program and argument are no such call.
    pub fn new(program: Program, argument: Option<SlotIndex>) -> Option<Self> {
        match (program, argument) {
            (Program::MoveTo, Some(slot)) => Some(Self::MoveTo(slot)),
            (Program::Grip, None) => Some(Self::Grip),
            (Program::Release, None) => Some(Self::Release),
            _ => None,
        }
    }
}

/// A world with a robot in it, and the record of what happened.
pub trait RobotApi {
    /// What stands on the table.
    fn scene(&self) -> &Scene;

    /// Where everything is now.
    fn state(&self) -> SceneState;

    /// What was recorded: the initial boundary frame, then what each action added. Each action ends with exactly one
    /// boundary frame, the last one.
    fn frames(&self) -> &[Frame];

    /// Acts until the action has ended, well or not, and records it.
    ///
    /// # Errors
    ///
    /// What went wrong in this action. The world goes on: a reactive policy may still recover. With
    /// [`Cause::RobotLost`] it does not, and the action may end without a frame.
    fn act(&mut self, action: Action) -> Result<(), Cause>;

    /// The pushes from outside so far, in order; `None` in a world without an adversary.
    fn pushes(&self) -> Option<&[Push]> {
        None
    }

    /// Lets the world come to rest without recording, to judge the outcome: the state at rest.
    ///
    /// # Errors
    ///
    /// [`Cause::RobotLost`] where the world can no longer be reached.
    fn settle(&mut self) -> Result<SceneState, Cause>;

    /// Lifts a tray with all that is on it and carries it without recording, to judge the outcome: the state at rest
    /// where it was carried to.
    ///
    /// # Errors
    ///
    /// As [`RobotApi::settle`].
    fn carry(&mut self, tray: BodyIndex) -> Result<SceneState, Cause>;

    /// What a policy is told of the last boundary frame: where things are, or where a robot that sees takes them to be.
    fn observe(&self) -> Observation {
        self.now().observation()
    }

    /// Whether that is what the robot sees, and not where things are.
    fn is_told_what_it_sees(&self) -> bool {
        false
    }

    /// The last boundary frame.
    fn now(&self) -> &Frame {
        let frames = self.frames();
        &frames[frames.len() - 1]
    }
}
