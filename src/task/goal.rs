//! Sub-tasks and end conditions, and whether a scene meets them.
//!
//! # Source
//!
//! The authors' task file: a stacking condition holds when the centres are at most 5 cm apart horizontally and the
//! upper one is above. We also ask that the upper block rests on the lower one.

use crate::geometry::{Vec3, horizontal_distance};
use crate::scene::{Scene, SceneState, SlotIndex, lies_inside};
use crate::task::Family;
use crate::task::layout::cleanup::FORK;

/// One sub-task: bring what `source` shows onto or into what `target` shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Goal {
    /// The slot to bring; of a category all of its instances.
    pub source: SlotIndex,
    /// The slot to bring it to.
    pub target: SlotIndex,
}

impl Goal {
    /// What it brings about in a family.
    pub fn brings_about(self, family: Family) -> Condition {
        let Self { source, target } = self;
        let is_category = match family {
            Family::BlockStacking => false,
            Family::ObjectSorting => true,
            Family::TableCleanup => source == FORK,
        };
        if is_category {
            Condition::Inside { category: source, container: target }
        } else {
            Condition::OnTop { upper: source, lower: target }
        }
    }
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

/// Largest horizontal distance between the centres of two stacked bodies, in metres (the authors' value).
/// Bowls nest, so their walls keep them much nearer.
const MAX_STACK_OFFSET_M: f32 = 0.05;
/// Largest deviation from the height that a stacked body should have above its lower one, in metres.
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
            let expected = scene.body(upper).shape.foot_m() + scene.body(lower).shape.seat_m();
            rests_on(&above, &below, expected) && state.held != Some(upper)
        }),
        Condition::Inside { category, container } => bodies(container).all(|container| {
            bodies(category).all(|body| lies_inside(scene, state, body, container) && state.held != Some(body))
        }),
    }
}
