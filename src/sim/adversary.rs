//! An adversary that knocks towers over, by an impulse in the engine.
//!
//! After a placement (a release that sets a body on another movable one) it may push the top of that tower: a body that
//! it chooses among those that stand on another, and all above. The gripper first rises out of the way, to where
//! `move_to` hovers. The action ends when all is at rest again, so its boundary frame shows what came of the push.
//!
//! # Invariants
//!
//! Whether, where and in which direction it pushes depends on its seed and on how many placements came before. Each
//! placement draws from a generator of its own: what one draws changes no other.
//!
//! # Source
//!
//! Paper, section V: after each placement "an adversary knocks over the tower" with a probability of 25 %.

use rand::Rng;
use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use crate::robot::{GRASP_M, HOVER_M, RobotApi as _};
use crate::scene::{BodyIndex, Mobility};
use crate::seed::Seed;
use crate::sim::{SimError, Simulation};
use crate::trace::{Push, Span};

/// Directions that a push is chosen from.
const DIRECTIONS: usize = 16;
/// How far what falls rolls on beyond the tower's height, in metres.
const ROLL_M: f32 = 0.2;
/// Half of the width of its way, in metres.
const WAY_M: f32 = 0.05;
/// A body stands on another when its centre is no more than this above where it would touch it, in metres.
const TOUCH_M: f32 = 0.004;
/// Height of the gripper when it grips a block on the table, in metres.
const GRIPPED_Z_M: f32 = 0.045;
/// Heights that are tried where the gripper cannot rise as far, in metres apart.
const LOWER_M: f32 = 0.02;
/// The strongest push that is allowed.
const MOST_IMPULSE_NS: f32 = 1.0;

/// How often and how hard an adversary pushes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AdversaryConfig {
    /// How likely a push is after each placement, 0 to 1.
    pub probability: f32,
    /// Force times time of a push, on each body from the one that is chosen up to the top of its tower, in newton
    /// seconds; above 0 and at most 1. A stacking block weighs 62.5 g.
    pub impulse_ns: f32,
}

impl Default for AdversaryConfig {
    fn default() -> Self {
        Self { probability: 0.25, impulse_ns: 0.06 }
    }
}

impl AdversaryConfig {
    /// Checks every setting.
    ///
    /// # Errors
    ///
    /// [`SimError::Adversary`] for the first setting that is not allowed.
    pub fn check(&self) -> Result<(), SimError> {
        let Self { probability, impulse_ns } = *self;
        let wrong = |key, found: f32, allowed| Err(SimError::Adversary { key, found, allowed });
        if !(0.0..=1.0).contains(&probability) {
            return wrong("probability", probability, "0 to 1");
        }
        if !(impulse_ns > 0.0 && impulse_ns <= MOST_IMPULSE_NS) {
            return wrong("impulse_ns", impulse_ns, "above 0, at most 1");
        }
        Ok(())
    }
}

/// An adversary at work.
pub(super) struct Adversary {
    config: AdversaryConfig,
    seed: Seed,
    n_placements: u64,
    pub(super) pushes: Vec<Push>,
}

/// What a push did.
pub(super) struct Pushed {
    /// The last frame before it.
    frame_before: u32,
    body: BodyIndex,
    impulse_ns: [f32; 3],
    toppled: Vec<BodyIndex>,
    /// Whether a body fell off the table.
    pub(super) fell_off: bool,
}

impl Simulation {
    /// The same world with an adversary in it, whose pushes depend on `seed` alone.
    ///
    /// # Errors
    ///
    /// As [`AdversaryConfig::check`].
    pub fn with_adversary(mut self, config: AdversaryConfig, seed: Seed) -> Result<Self, SimError> {
        config.check()?;
        self.adversary = Some(Adversary { config, seed, n_placements: 0, pushes: Vec::new() });
        Ok(self)
    }

    /// After a body was released: perhaps a push. What it topples is not the robot's fault.
    pub(super) fn disturb(&mut self, released: BodyIndex) -> Option<Pushed> {
        self.adversary.as_ref()?;
        let supports = self.supports();
        let tower = tower(&supports, released);
        let adversary = self.adversary.as_mut().filter(|_| !tower.is_empty())?;
        let mut rng = adversary.seed.derive("placement", &[adversary.n_placements]).rng();
        adversary.n_placements += 1;
        let [chance, level]: [f32; 2] = rng.random();
        if chance >= adversary.config.probability {
            return None;
        }
        let impulse_ns = adversary.config.impulse_ns;
        let lowest = (level * tower.len() as f32) as usize % tower.len();
        let body = tower[lowest];
        let impulse_ns = self.direction(&tower, &mut rng) * impulse_ns;
        let frame_before = self.push(&tower[..=lowest], impulse_ns);
        let toppled = self.toppled(&supports);
        let state = self.state();
        let fell_off = self.watch.forgive(&self.scene, &state);
        Some(Pushed { frame_before, body, impulse_ns: impulse_ns.to_array(), toppled, fell_off })
    }

    /// Writes down a push, up to the frame that shows what came of it: the newest.
    pub(super) fn tell(&mut self, pushed: Pushed) {
        let Pushed { frame_before, body, impulse_ns, toppled, fell_off: _ } = pushed;
        let frames = Span { begin: frame_before, end: self.frames.len() as u32 };
        self.adversary.iter_mut().for_each(|adversary| {
            adversary.pushes.push(Push { frames, body, impulse_ns, toppled: toppled.clone() });
        });
    }

    /// The gripper gives way, each body gets the impulse, all comes to rest. Gives the last frame before the impulse.
    fn push(&mut self, bodies: &[BodyIndex], impulse_ns: Vector) -> u32 {
        self.give_way();
        let frame_before = (self.frames.len() as u32).saturating_sub(1);
        bodies.iter().for_each(|&body| self.world.push(body, impulse_ns));
        // What does not come to rest in time is seen to move in the frame.
        let _rested = self.rest();
        frame_before
    }

    /// Up to where `move_to` hovers, or as high as an arm can.
    fn give_way(&mut self) {
        let z = self.gripper.tool.position.z;
        let heights = (0..).map(|step| z + HOVER_M - GRASP_M - LOWER_M * step as f32);
        heights.take_while(|&height| height > z).any(|height| self.rise(height).is_ok());
    }

    /// What each body stands on: a movable body, or `None`.
    fn supports(&self) -> Vec<Option<BodyIndex>> {
        self.scene.body_indices().map(|body| self.support(body)).collect()
    }

    fn support(&self, body: BodyIndex) -> Option<BodyIndex> {
        let is_movable = |&body: &BodyIndex| self.scene.body(body).mobility == Mobility::Movable;
        let handle = self.world.handle(body);
        if !is_movable(&body) || self.gripper.held_handle() == Some(handle) {
            return None;
        }
        let hit = self.world.below(self.world.in_world(body).translation, Some(handle))?;
        let reach_m = self.scene.body(body).shape.half_extents_m().z + TOUCH_M;
        hit.body.filter(is_movable).filter(|_| hit.distance_m <= reach_m)
    }

    /// The bodies that stood on another and no longer stand on it.
    fn toppled(&self, before: &[Option<BodyIndex>]) -> Vec<BodyIndex> {
        let after = self.supports();
        let left = |body: &BodyIndex| {
            let place = usize::from(body.0);
            before[place].is_some() && before[place] != after[place]
        };
        self.scene.body_indices().filter(left).collect()
    }

    /// Of some random directions in which what falls stays on the table the one with the fewest bodies in its way;
    /// with none such, towards the table's middle.
    fn direction(&self, tower: &[BodyIndex], rng: &mut impl Rng) -> Vector {
        let drawn: [Vector; DIRECTIONS] = std::array::from_fn(|_| direction(rng));
        let base = tower.last().and_then(|&lowest| self.support(lowest));
        let from = base.map_or(Vector::ZERO, |base| self.world.in_world(base).translation);
        let top_z = tower.first().map_or(from.z, |&top| self.world.in_world(top).translation.z);
        let length_m = top_z - from.z + ROLL_M;
        let others = self.scene.body_indices().filter(|body| !tower.contains(body) && Some(*body) != base);
        let others: Vec<Vector> = others.map(|body| self.world.in_world(body).translation - from).collect();
        let on_table = |&direction: &Vector| {
            let end = from + direction * length_m;
            let [half_x, half_y] = self.scene.table_half_m;
            let is_on = end.x.abs() + WAY_M <= half_x && end.y.abs() + WAY_M <= half_y;
            // What falls out of an arm's reach nobody could build up again.
            is_on && self.mover.reaches(Vector::new(end.x, end.y, GRIPPED_Z_M))
        };
        let in_the_way =
            |direction: &Vector| others.iter().filter(|way| is_in_way(**way, *direction, length_m)).count();
        let best = drawn.into_iter().filter(on_table).min_by_key(in_the_way);
        best.unwrap_or_else(|| Vector::new(-from.x, -from.y, 0.0).normalize_or(drawn[0]))
    }
}

/// The bodies from `top` down that stand on another, without the lowest, which stands on none.
fn tower(supports: &[Option<BodyIndex>], top: BodyIndex) -> Vec<BodyIndex> {
    let below = |body: &BodyIndex| supports[usize::from(body.0)];
    let column = std::iter::successors(Some(top), below).take(supports.len());
    column.filter(|body| below(body).is_some()).collect()
}

/// Whether something stands in a way of some length from the origin.
fn is_in_way(position: Vector, direction: Vector, length_m: f32) -> bool {
    let along_m = position.x * direction.x + position.y * direction.y;
    let aside_m = position.x * direction.y - position.y * direction.x;
    (-WAY_M..=length_m + WAY_M).contains(&along_m) && aside_m.abs() <= 2.0 * WAY_M
}

/// Any horizontal direction, all alike. Without trigonometry: the same bits on every platform.
fn direction(rng: &mut impl Rng) -> Vector {
    loop {
        let [x, y]: [f32; 2] = rng.random();
        let way = Vector::new(2.0 * x - 1.0, 2.0 * y - 1.0, 0.0);
        if (0.1..=1.0).contains(&way.length()) {
            return way.normalize();
        }
    }
}
