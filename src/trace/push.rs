//! A push from outside: what an adversary did to the world while an episode was acted.

use crate::scene::{BodyIndex, Scene};
use crate::trace::Span;

/// One push on the top of a tower.
#[derive(Clone, Debug, PartialEq)]
pub struct Push {
    /// From the last frame before the impulse to the boundary at which everything rested again, which is the first
    /// that programs see of it.
    pub frames: Span,
    /// The lowest body that was pushed; all above it were too.
    pub body: BodyIndex,
    /// Force times time on each of them, in newton seconds, along the world's axes.
    pub impulse_ns: [f32; 3],
    /// The bodies that left what they stood on, in the order of the scene.
    pub toppled: Vec<BodyIndex>,
}

impl Push {
    /// Length of the impulse, in newton seconds.
    pub fn strength_ns(&self) -> f32 {
        self.impulse_ns.iter().map(|part| part * part).sum::<f32>().sqrt()
    }

    /// `adversary: pushes block_C with 0.060 N s; block_C, block_D topple`.
    pub fn in_words(&self, scene: &Scene) -> String {
        let pushed = format!("adversary: pushes {} with {:.3} N s", scene.body(self.body).name, self.strength_ns());
        let toppled: Vec<&str> = self.toppled.iter().map(|&body| scene.body(body).name.as_str()).collect();
        match toppled.as_slice() {
            [] => format!("{pushed}; nothing topples"),
            [one] => format!("{pushed}; {one} topples"),
            several => format!("{pushed}; {} topple", several.join(", ")),
        }
    }
}
