//! What a suite and a model are, as columns of `rollouts.parquet`: no reader takes it from their names.

use crate::model::Variant;
use crate::perception::PerceptionConfig;
use crate::scene::{Mobility, Scene};
use crate::task::Family;

/// What a suite asks for: the same in each of its rows.
#[derive(Clone, Debug, PartialEq)]
pub struct SuiteFacts {
    /// The kind of tasks.
    pub family: Family,
    /// Blocks within reach; `None` in a family without blocks.
    pub blocks: Option<u16>,
    /// In which order the sub-tasks are demonstrated: `own` or `shuffled`.
    pub order: &'static str,
    /// Chance of a push of an adversary after each placement; 0 without one.
    pub adversary_probability: f32,
    /// Impulse of a push in newton seconds; 0 without an adversary.
    pub adversary_impulse_ns: f32,
    /// Instances of each category in the demonstration, at least and at most; `None` in a family without categories.
    pub demonstrated: Option<[u16; 2]>,
    /// Instances of each category on the table, at least and at most.
    pub on_table: Option<[u16; 2]>,
    /// Which robot acts; of others what it calls itself.
    pub robot: String,
    /// How far its gripper opens at most, in metres; `None` where nobody knows it.
    pub jaw_m: Option<f32>,
    /// The camera that tells robot and model where things are; `None` where they know it.
    pub perception: Option<PerceptionConfig>,
    /// Bowls that each task asks for; `None` where tasks differ in that, or ask for none.
    pub bowls: Option<u16>,
}

impl SuiteFacts {
    /// Things on the table that may be moved; what is carried away in the end is none of them.
    pub(super) fn objects(&self, scene: &Scene) -> usize {
        let tray = self.family.tray().map(|tray| &scene.slot(tray).bodies);
        let is_tray = |body| tray.is_some_and(|bodies| bodies.contains(&body));
        let is_object = |&body: &_| scene.body(body).mobility == Mobility::Movable && !is_tray(body);
        scene.body_indices().filter(is_object).count()
    }
}

/// The number that a setting was written as: 0.06, not 0.059999998658895.
pub(super) fn decimal(setting: f32) -> f64 {
    setting.to_string().parse().unwrap_or(f64::from(setting))
}

/// The parts of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModelFacts {
    /// How it remembers the steps of a program call: `reactive` (not at all), `gru` or `lstm`.
    pub core: &'static str,
    /// What it decides of the task specification: `scoped` (the part that a callee sees), `unscoped` (every program
    /// sees the whole), `primitives` (there is no hierarchy) or `arguments` (there is no specification).
    pub scoping: &'static str,
    /// How it reads observations.
    pub encoder: &'static str,
}

impl From<Variant> for ModelFacts {
    fn from(variant: Variant) -> Self {
        let [core, scoping, encoder] = [variant.core().name(), variant.scoping().name(), variant.encoder().name()];
        Self { core, scoping, encoder }
    }
}
