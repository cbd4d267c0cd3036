//! The messages of the protocol as serde sees them: `schemas/robot.md`.
//!
//! Types of the edge: the scene's own types promise no form in a file or on a wire.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::arm::N_JOINTS;
use crate::scene::{Bowl, Shape};
use crate::task::Family;
use crate::trace::Cause;

/// The version of the protocol.
pub const PROTOCOL_VERSION: u32 = 1;

/// The causes that a robot may name: what can go wrong in an action.
pub(super) const CAUSES: [Cause; 9] = [
    Cause::MissedGrasp,
    Cause::KnockedTower,
    Cause::ObjectOffTable,
    Cause::PushedOffTable,
    Cause::DroppedObject,
    Cause::TimeLimit,
    Cause::NoPath,
    Cause::Collided,
    Cause::NotSeen,
];

/// What a robot is asked.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "method", content = "params", rename_all = "snake_case")]
pub(super) enum Call {
    Hello(Hello),
    Reset(StateMessage),
    Observe,
    MoveTo(Target),
    Grip,
    Release,
    Settle,
    Carry(Tray),
    Stop,
}

impl Call {
    pub(super) fn method(&self) -> &'static str {
        match self {
            Self::Hello(_) => "hello",
            Self::Reset(_) => "reset",
            Self::Observe => "observe",
            Self::MoveTo(_) => "move_to",
            Self::Grip => "grip",
            Self::Release => "release",
            Self::Settle => "settle",
            Self::Carry(_) => "carry",
            Self::Stop => "stop",
        }
    }
}

/// A call on the wire; without an id no answer is waited for.
#[derive(Debug, Serialize)]
pub(super) struct Request<'c> {
    jsonrpc: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<u64>,
    #[serde(flatten)]
    call: &'c Call,
}

impl<'c> Request<'c> {
    pub(super) fn new(id: Option<u64>, call: &'c Call) -> Self {
        Self { jsonrpc: "2.0", id, call }
    }

    /// One line, without its end.
    pub(super) fn line(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// Whatever comes over the wire, from either side.
#[derive(Debug, Deserialize)]
pub(super) struct Incoming {
    pub(super) id: Option<u64>,
    pub(super) method: Option<String>,
    #[serde(default)]
    pub(super) params: Value,
    pub(super) result: Option<Value>,
    pub(super) error: Option<ErrorMessage>,
}

/// An answer that something is wrong with a request.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct ErrorMessage {
    pub(super) code: i64,
    pub(super) message: String,
}

/// A line of a robot.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub(super) enum Outgoing {
    Frame { jsonrpc: &'static str, method: &'static str, params: Observation },
    Welcome { jsonrpc: &'static str, id: u64, result: Box<Welcome> },
    Result { jsonrpc: &'static str, id: u64, result: Answer },
    Error { jsonrpc: &'static str, id: Option<u64>, error: ErrorMessage },
}

/// `hello`: who asks, and for what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Hello {
    pub(super) protocol: u32,
    pub(super) family: Family,
    /// What shall stand on the table.
    pub(super) scene: SceneMessage,
}

/// The answer to `hello`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Welcome {
    pub(super) protocol: u32,
    pub(super) robot: String,
    #[serde(default)]
    pub(super) capabilities: Vec<String>,
    /// What stands on the table, where sizes or colours differ from what was asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) scene: Option<SceneMessage>,
}

/// The answer to everything else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Answer {
    /// What went wrong in the action.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) cause: Option<String>,
    pub(super) observation: Observation,
}

/// `move_to`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Target {
    pub(super) slot: String,
    pub(super) body: String,
    /// Where the body's centre was last reported.
    pub(super) position_m: [f32; 3],
    /// How high above that centre the gripper shall be.
    pub(super) hover_m: f32,
}

/// `carry`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Tray {
    pub(super) body: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SceneMessage {
    pub(super) table_half_m: [f32; 2],
    pub(super) bodies: Vec<BodyMessage>,
    pub(super) slots: Vec<SlotMessage>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct BodyMessage {
    pub(super) name: String,
    #[serde(with = "ShapeMessage")]
    pub(super) shape: Shape,
    #[serde(default)]
    pub(super) fixed: bool,
    #[serde(default = "grey")]
    pub(super) color: [u8; 3],
}

fn grey() -> [u8; 3] {
    [128; 3]
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SlotMessage {
    pub(super) name: String,
    /// Names of bodies.
    pub(super) bodies: Vec<String>,
}

/// The form of [`Shape`] on the wire.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Shape", rename_all = "snake_case", deny_unknown_fields)]
enum ShapeMessage {
    Cuboid {
        half_extents_m: [f32; 3],
    },
    Cylinder {
        radius_m: f32,
        half_height_m: f32,
    },
    Ball {
        radius_m: f32,
    },
    OpenBox {
        inner_m: [f32; 3],
        wall_m: f32,
    },
    #[serde(with = "BowlMessage")]
    Bowl(Bowl),
}

/// The form of [`Bowl`] on the wire.
#[derive(Serialize, Deserialize)]
#[serde(remote = "Bowl", deny_unknown_fields)]
struct BowlMessage {
    floor_radius_m: f32,
    rim_radius_m: f32,
    height_m: f32,
    wall_m: f32,
    foot_radius_m: f32,
    foot_height_m: f32,
}

/// Everything that a robot reports of one instant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Observation {
    pub(super) time_ns: u64,
    pub(super) gripper: GripperMessage,
    pub(super) bodies: BTreeMap<String, PoseMessage>,
    /// Angles of an arm's joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) joints_rad: Option<[f32; N_JOINTS]>,
}

/// Where everything is to be put: `reset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct StateMessage {
    pub(super) gripper: GripperMessage,
    pub(super) bodies: BTreeMap<String, PoseMessage>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct GripperMessage {
    pub(super) position_m: [f32; 3],
    #[serde(default = "upright", skip_serializing_if = "is_upright")]
    pub(super) orientation_xyzw: [f32; 4],
    pub(super) opening_m: f32,
    /// The name of the body between the fingers.
    #[serde(default)]
    pub(super) holds: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PoseMessage {
    pub(super) position_m: [f32; 3],
    #[serde(default = "upright", skip_serializing_if = "is_upright")]
    pub(super) orientation_xyzw: [f32; 4],
}

const UPRIGHT: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

fn upright() -> [f32; 4] {
    UPRIGHT
}

/// Bit for bit: a zero may have a sign.
fn is_upright(orientation: &[f32; 4]) -> bool {
    orientation.map(f32::to_bits) == UPRIGHT.map(f32::to_bits)
}
