//! Sub-tasks and end conditions, and whether a scene meets them.
//!
//! # Source
//!
//! The authors' task file: a stacking condition holds when the centres are at most 5 cm apart horizontally and the
//! upper one is above. We also ask that the upper block rests on the lower one.

use crate::geometry::{Vec3, horizontal_distance};
use crate::scene::{Scene, SceneState, SlotIndex, lies_inside};

/// One sub-task: bring what `source` shows onto or into what `target` shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Goal {
    /// The slot to bring; of a category all of its instances.
    pub source: SlotIndex,
    /// The slot to bring it to.
    pub target: SlotIndex,
}

/// Something that must hold in the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Condition {
    /// The upper slot's body rests on the lower slot's.
    OnTop {
        /// The body on top.
        upper: SlotIndex,
        /// The body below.
        lower: SlotIndex,
    },
    /// Every body of the category's slot lies in the container's.
    Inside {
        /// The slot of a category.
        category: SlotIndex,
        /// The slot of a container.
        container: SlotIndex,
    },
}

/// Largest horizontal distance between the centres of two stacked blocks, in metres (the authors' value).
const MAX_STACK_OFFSET_M: f32 = 0.05;
/// Largest deviation from the height that a stacked block should have above its lower one, in metres.
const MAX_STACK_HEIGHT_ERROR_M: f32 = 0.01;

/// Whether a body rests on another, by their centres, which are `height_m` above each other when it does.
pub fn rests_on(above: &Vec3, below: &Vec3, height_m: f32) -> bool {
    horizontal_distance(above, below) <= MAX_STACK_OFFSET_M
        && (above.z - below.z - height_m).abs() <= MAX_STACK_HEIGHT_ERROR_M
}

/// Whether one condition holds.
pub fn condition_holds(scene: &Scene, state: &SceneState, condition: &Condition) -> bool {
    let bodies = |slot: SlotIndex| scene.slot(slot).bodies.iter().copied();
    match *condition {
        Condition::OnTop { upper, lower } => bodies(upper).zip(bodies(lower)).all(|(upper, lower)| {
            let above = state.body_in_world(upper).translation.vector;
            let below = state.body_in_world(lower).translation.vector;
            let expected = scene.body(upper).shape.half_extents_m().z + scene.body(lower).shape.half_extents_m().z;
            rests_on(&above, &below, expected) && state.held != Some(upper)
        }),
        Condition::Inside { category, container } => bodies(container).all(|container| {
            bodies(category).all(|body| lies_inside(scene, state, body, container) && state.held != Some(body))
        }),
    }
}

/// Whether all conditions hold.
pub fn goal_holds(scene: &Scene, state: &SceneState, conditions: &[Condition]) -> bool {
    conditions.iter().all(|condition| condition_holds(scene, state, condition))
}
