//! A trial of a task: what stands on the table, and where it is when the trial begins.
//!
//! # Units and frames
//!
//! Metres; world frame, the table's surface at z = 0.

use rand::Rng as _;

use crate::geometry::{Vec3, upright};
use crate::scene::{Scene, SceneState};
use crate::seed::Seed;
use crate::task::Family;

/// One acting-out of a task: its own initial positions and, where the family has categories, its own counts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Trial {
    /// Number among the task's trials.
    pub index: u32,
    /// How many bodies slots show, where that differs: see [`Task::counts`](crate::task::Task::counts).
    pub counts: Vec<u16>,
    /// What the initial positions are drawn from.
    pub seed: Seed,
}

/// What stands on the table in a trial of a family.
pub fn scene(family: Family, counts: &[u16]) -> Scene {
    (family.spec().scene)(counts)
}

/// Random initial positions, without overlap, and the gripper open somewhere above.
pub fn initial_state(family: Family, scene: &Scene, seed: Seed) -> SceneState {
    let mut rng = seed.derive("initial_state", &[]).rng();
    let bodies_in_world = (family.spec().poses)(scene, &mut rng);
    let reach = scene.table_half_m.map(|half| 0.5 * half);
    let gripper = Vec3::new(rng.random_range(-reach[0]..reach[0]), rng.random_range(-reach[1]..reach[1]), 0.3);
    SceneState { gripper_in_world: upright(gripper, 0.0), opening_m: 0.07, held: None, bodies_in_world }
}
