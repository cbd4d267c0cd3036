//! How an episode ended, with a named cause for every way to fail.

use std::fmt;

use serde::{Deserialize, Serialize};

/// How an episode ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Outcome {
    /// The actor ended by itself and the goal holds at rest.
    Success,
    /// It did not; the first cause that was noticed.
    Failure(Cause),
}

/// Why an episode failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The fingers closed on air.
    MissedGrasp,
    /// A body that the robot was not holding was moved out of place.
    KnockedTower,
    /// A body left the table.
    ObjectOffTable,
    /// An adversary pushed a body off the table.
    PushedOffTable,
    /// The held body was lost on the way.
    DroppedObject,
    /// The action names a slot that the scene does not have.
    UnknownSlot,
    /// A motion did not come to its end in time.
    TimeLimit,
    /// The actor ended its root program although the goal did not hold.
    EndedEarly,
    /// The actor did not end its root program within the allowed calls.
    NeverEnded,
    /// The goal held at rest, but not after the tray was carried away.
    FellWhenCarried,
    /// The robot found no way to where it was to go.
    NoPath,
    /// The robot touched something on its way, or itself.
    Collided,
    /// The robot does not see what it was to handle.
    NotSeen,
    /// The robot did not answer, or not as the protocol asks.
    RobotLost,
}

impl Cause {
    /// Every cause.
    pub const ALL: [Self; 14] = [
        Self::MissedGrasp,
        Self::KnockedTower,
        Self::ObjectOffTable,
        Self::PushedOffTable,
        Self::DroppedObject,
        Self::UnknownSlot,
        Self::TimeLimit,
        Self::EndedEarly,
        Self::NeverEnded,
        Self::FellWhenCarried,
        Self::NoPath,
        Self::Collided,
        Self::NotSeen,
        Self::RobotLost,
    ];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::MissedGrasp => "missed_grasp",
            Self::KnockedTower => "knocked_tower",
            Self::ObjectOffTable => "object_off_table",
            Self::PushedOffTable => "pushed_off_table",
            Self::DroppedObject => "dropped_object",
            Self::UnknownSlot => "unknown_slot",
            Self::TimeLimit => "time_limit",
            Self::EndedEarly => "ended_early",
            Self::NeverEnded => "never_ended",
            Self::FellWhenCarried => "fell_when_carried",
            Self::NoPath => "no_path",
            Self::Collided => "collided",
            Self::NotSeen => "not_seen",
            Self::RobotLost => "robot_lost",
        }
    }

    /// The cause of a name, if it is one.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }
}

impl Outcome {
    /// Whether it succeeded.
    pub fn is_success(self) -> bool {
        self == Self::Success
    }

    /// The cause of a failure; `None` for a success.
    pub fn cause(self) -> Option<Cause> {
        match self {
            Self::Success => None,
            Self::Failure(cause) => Some(cause),
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Success => f.write_str("success"),
            Self::Failure(cause) => f.write_str(cause.name()),
        }
    }
}
