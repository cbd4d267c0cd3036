//! Sub-tasks and end conditions, and whether a scene meets them. A kind of condition is declared here and nowhere else.
//!
//! # Source
//!
//! The authors' task file: a stacking condition holds when the centres are at most 5 cm apart horizontally and the
//! upper one is above. We also ask that the upper block rests on the lower one.

use std::convert::Infallible;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::geometry::{Vec3, horizontal_distance};
use crate::program::Program;
use crate::scene::{BodyIndex, Mobility, Scene, SceneState, SlotIndex, lies_inside};
use crate::task::Family;

/// One sub-task: bring what `source` shows onto or into what `target` shows. Task files tell slots by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "GoalEntry")]
pub struct Goal<S = SlotIndex> {
    /// The slot to bring, e.g. `block_D`; of a category, all of its instances.
    pub source: S,
    /// The slot to bring it to.
    pub target: S,
}

impl Goal {
    /// What it brings about in a family.
    pub fn brings_about(self, family: Family) -> Condition {
        let brings_about = family.kind(self.source).and_then(|kind| kind.brings_about);
        brings_about.unwrap_or(Condition::on_top)(self.source, self.target)
    }
}

/// Something that must hold in the end. Task files tell slots by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "ConditionEntry")]
pub enum Condition<S = SlotIndex> {
    /// One body rests on another, or in it if that is a bowl or tray.
    OnTop {
        /// The body on top.
        upper: S,
        /// The body below.
        lower: S,
    },
    /// Every instance of a category lies in a container.
    Inside {
        /// The category.
        category: S,
        /// The container.
        container: S,
    },
    /// A part, or one that looks the same, lies on a place, and nothing else does.
    Filled {
        /// The part; of those that look the same the first.
        part: S,
        /// The place.
        place: S,
    },
}

/// The programs that bring a condition about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SubTask {
    /// What the root calls.
    pub program: Program,
    /// What it calls once it has picked something.
    pub put: Program,
    /// Whether it is called until nothing of the source is left to bring.
    pub for_each: bool,
}

impl<S> Condition<S> {
    /// The upper slot's body rests on the lower slot's.
    pub fn on_top(upper: S, lower: S) -> Self {
        Self::OnTop { upper, lower }
    }

    /// Every body of the category's slot lies in the container's.
    pub fn inside(category: S, container: S) -> Self {
        Self::Inside { category, container }
    }

    /// The programs that bring it about.
    pub fn sub_task(&self) -> SubTask {
        match self {
            Self::OnTop { .. } | Self::Filled { .. } => {
                SubTask { program: Program::PickAndPlace, put: Program::Place, for_each: false }
            }
            Self::Inside { .. } => SubTask { program: Program::PickAndDrop, put: Program::Drop, for_each: true },
        }
    }

    /// Bringing it about, in words.
    pub(super) fn in_words(&self, source: &str, target: &str) -> String {
        match self {
            Self::OnTop { .. } | Self::Filled { .. } => format!("put {source} on {target}"),
            Self::Inside { .. } => format!("put every {source} into {target}"),
        }
    }

    /// The same with slots told otherwise; `tell` is given the part that a slot has in it.
    pub(super) fn try_map<T, E>(
        self,
        mut tell: impl FnMut(&'static str, S) -> Result<T, E>,
    ) -> Result<Condition<T>, E> {
        Ok(match self {
            Self::OnTop { upper, lower } => {
                Condition::OnTop { upper: tell("upper", upper)?, lower: tell("lower", lower)? }
            }
            Self::Inside { category, container } => {
                Condition::Inside { category: tell("category", category)?, container: tell("container", container)? }
            }
            Self::Filled { part, place } => {
                Condition::Filled { part: tell("part", part)?, place: tell("place", place)? }
            }
        })
    }

    /// The same with slots told otherwise.
    pub(super) fn map<T>(self, mut tell: impl FnMut(S) -> T) -> Condition<T> {
        let Ok(mapped) = self.try_map(|_part, slot| Ok::<T, Infallible>(tell(slot)));
        mapped
    }
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

/// Whether a body that can be moved lies on a flat one, with its centre above the other's upper side.
fn lies_on(scene: &Scene, state: &SceneState, body: BodyIndex, below: BodyIndex) -> bool {
    let (upper, lower) = (scene.body(body), scene.body(below));
    let center = state.body_in_world(body).translation.vector;
    let on_lower = state.body_in_world(below).inverse_transform_point(&center.into()).coords;
    let half = lower.shape.half_extents_m();
    let height_m = upper.shape.foot_m() + lower.shape.seat_m();
    upper.mobility == Mobility::Movable
        && on_lower.x.abs() <= half.x
        && on_lower.y.abs() <= half.y
        && (on_lower.z - height_m).abs() <= MAX_STACK_HEIGHT_ERROR_M
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
        Condition::Filled { part, place } => bodies(part).zip(bodies(place)).all(|(part, place)| {
            let lying: Vec<BodyIndex> =
                scene.body_indices().filter(|&body| lies_on(scene, state, body, place)).collect();
            let [only] = lying[..] else { return false };
            let (found, wanted) = (scene.body(only), scene.body(part));
            found.shape == wanted.shape && found.color == wanted.color && state.held != Some(only)
        }),
    }
}
