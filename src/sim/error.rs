//! Why a simulation cannot begin.

use crate::words::counted;

/// A scene, a start or a setting that the simulation refuses. Bodies are named as in the scene.
#[expect(missing_docs, reason = "the messages say what each field is")]
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimError {
    #[error("simulation.{key} is {found}; allowed: {allowed}")]
    Config { key: &'static str, found: String, allowed: String },
    #[error("adversary.{key} is {found}; allowed: {allowed}")]
    Adversary { key: &'static str, found: f32, allowed: &'static str },
    #[error("{found} body poses, but the scene has {expected}", expected = counted(*expected, "body"))]
    BodyCount { found: usize, expected: usize },
    #[error("{name}: every size must be a finite number above 0")]
    Size { name: String },
    #[error("slot {name}: it must show at least one body of the scene, and shows {bodies:?}")]
    Slot { name: String, bodies: Vec<u16> },
    #[error("{name}: its pose is not finite")]
    NotFinite { name: String },
    #[error("{name} starts at {position_m:?}, off the table, which reaches to {table_half_m:?}")]
    OffTable { name: String, position_m: [f32; 3], table_half_m: [f32; 2] },
    #[error("{first} and {second} overlap by {depth_m} m at the start")]
    Overlap { first: String, second: String, depth_m: f32 },
    #[error("{name} is held at the start; the gripper must start empty")]
    HeldAtStart { name: String },
    #[error("the gripper starts {found_m} m open; allowed: 0 to {allowed_m}")]
    Opening { found_m: f32, allowed_m: f32 },
    #[error("perception.{0}")]
    Perception(#[from] crate::perception::PerceptionError),
}

impl SimError {
    /// Whether it is of a setting of the simulation.
    pub fn is_of(&self, setting: &str) -> bool {
        matches!(self, Self::Config { key, .. } if *key == setting)
    }
}
