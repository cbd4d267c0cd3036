//! A trial of a task: what stands on the table, and where it is when the trial begins.
//!
//! # Units and frames
//!
//! Metres; world frame, the table's surface at z = 0.

use rand::Rng as _;
use serde::{Deserialize, Serialize};

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

/// How things are laid out.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Layout {
    /// Over a whole table, for a gripper that flies freely.
    #[default]
    Table,
    /// About an arm that is bolted to the table, where it reaches all of them.
    Bench,
}

/// What stands on the table in a trial of a family.
pub fn scene(family: Family, counts: &[u16]) -> Scene {
    scene_on(Layout::Table, family, counts)
}

/// What stands on the table in a trial of a family, in a layout.
pub fn scene_on(layout: Layout, family: Family, counts: &[u16]) -> Scene {
    let scene = (family.spec().scene)(counts);
    match layout {
        Layout::Table => scene,
        Layout::Bench => Scene { table_half_m: family.spec().bench.table_half_m, ..scene },
    }
}

/// Random initial positions, without overlap, and the gripper open somewhere above.
pub fn initial_state(family: Family, scene: &Scene, seed: Seed) -> SceneState {
    initial_state_on(Layout::Table, family, scene, seed)
}

/// The same in a layout. An arm begins at its home, wherever the gripper is said to be.
pub fn initial_state_on(layout: Layout, family: Family, scene: &Scene, seed: Seed) -> SceneState {
    let mut rng = seed.derive("initial_state", &[]).rng();
    let poses = match layout {
        Layout::Table => family.spec().poses,
        Layout::Bench => family.spec().bench.poses,
    };
    let bodies_in_world = poses(scene, &mut rng);
    let reach = scene.table_half_m.map(|half| 0.5 * half);
    let gripper = Vec3::new(rng.random_range(-reach[0]..reach[0]), rng.random_range(-reach[1]..reach[1]), 0.3);
    SceneState {
        gripper_in_world: upright(gripper, 0.0),
        opening_m: 0.07,
        held: None,
        bodies_in_world,
        joints_rad: None,
    }
}
