//! A push from outside: what an adversary did to the world while an episode was acted.

use crate::scene::BodyIndex;

/// One push on the top of a tower.
#[derive(Clone, Debug, PartialEq)]
pub struct Push {
    /// The boundary frame at which everything rested again: the first that shows what came of it.
    pub frame: u32,
    /// The lowest body that was pushed; all above it were too.
    pub body: BodyIndex,
    /// Force times time on each of them, in newton seconds, along the world's axes.
    pub impulse_ns: [f32; 3],
    /// The bodies that left what they stood on, in the order of the scene.
    pub toppled: Vec<BodyIndex>,
}
