//! A way round what stands there: RRT-Connect over the first, second and fourth joint.
//!
//! The gripper stays upright throughout: the sixth joint follows from the second and the fourth. The last joint turns
//! evenly over the way.
//!
//! # Source
//!
//! Kuffner and `LaValle`, "RRT-Connect", ICRA 2000: two trees, from the start and from the goal; one grows towards a drawn
//! place, the other as far as it can towards the first one's new end.
//!
//! # Invariants
//!
//! The same query and seed give the same way: it ends by the number of nodes, never by a clock.

use std::f64::consts::FRAC_PI_2;

use rand::Rng as _;
use rand_chacha::ChaCha8Rng;

use crate::arm::sawyer::JOINTS;
use crate::arm::{ArmError, Load, Obstacles, Posture};
use crate::seed::Seed;

/// How a way is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannerConfig {
    /// The longest branch that a tree grows at once, in radians.
    pub step_rad: f64,
    /// Postures between are checked at least so densely, in radians.
    pub check_rad: f64,
    /// It is given up after so many nodes of both trees.
    pub most_nodes: usize,
    /// How often two places of the way are tried to be joined straight.
    pub shortcuts: usize,
}

impl Default for PlannerConfig {
    fn default() -> Self {
        Self { step_rad: 0.3, check_rad: 0.05, most_nodes: 2000, shortcuts: 24 }
    }
}

/// A way: postures that are joined by lines.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// From start to goal, both among them.
    pub postures: Vec<Posture>,
    /// How many nodes it took; 0 where the straight line is free.
    pub n_nodes: usize,
}

/// First, second and fourth joint.
type Bent = [f64; 3];
/// Where they are in a posture.
const JOINT_OF: [usize; 3] = [0, 1, 3];

/// A free way between two postures that hold the gripper upright with the third and fifth joint at 0.
///
/// # Errors
///
/// [`ArmError::NoPath`] when an end is not free, or when no way was found within the allowed nodes.
pub fn plan(
    from: &Posture,
    to: &Posture,
    load: &Load,
    obstacles: &Obstacles,
    config: &PlannerConfig,
    seed: Seed,
) -> Result<Plan, ArmError> {
    let space = Space { obstacles, load, last: to.0[6], config };
    let ends = [bent(from), bent(to)];
    if !ends.iter().all(|end| space.is_free(end)) {
        return Err(ArmError::NoPath);
    }
    if space.is_line_free(&ends[0], &ends[1]) {
        return Ok(Plan { postures: vec![*from, *to], n_nodes: 0 });
    }
    let mut rng = seed.derive("rrt_connect", &[]).rng();
    let (mut way, n_nodes) = space.connect(ends, &mut rng).ok_or(ArmError::NoPath)?;
    space.shorten(&mut way, &mut rng);
    Ok(Plan { postures: with_turns(&way, from, to), n_nodes })
}

fn bent(posture: &Posture) -> Bent {
    JOINT_OF.map(|joint| posture.0[joint])
}

fn upright([first, second, fourth]: Bent, last: f64) -> Posture {
    Posture([first, second, 0.0, fourth, 0.0, FRAC_PI_2 - second - fourth, last])
}

fn distance(a: &Bent, b: &Bent) -> f64 {
    libm::sqrt(a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
}

fn between(a: &Bent, b: &Bent, share: f64) -> Bent {
    std::array::from_fn(|at| a[at] + (b[at] - a[at]) * share)
}

/// The way with the last joint turning evenly over it.
fn with_turns(way: &[Bent], from: &Posture, to: &Posture) -> Vec<Posture> {
    let lengths: Vec<f64> = way.windows(2).map(|pair| distance(&pair[0], &pair[1])).collect();
    let whole: f64 = lengths.iter().sum();
    let mut gone = 0.0;
    let mut postures = vec![*from];
    for (place, length) in way[1..].iter().zip(lengths) {
        gone += length;
        postures.push(upright(*place, from.0[6] + (to.0[6] - from.0[6]) * gone / whole));
    }
    if let Some(end) = postures.last_mut() {
        *end = *to;
    }
    postures
}

/// What is free, and how it is looked for.
struct Space<'a> {
    obstacles: &'a Obstacles,
    load: &'a Load,
    /// The last joint, which moves nothing that is checked.
    last: f64,
    config: &'a PlannerConfig,
}

/// A tree: places with what they grew from; the root grew from itself.
struct Tree {
    nodes: Vec<(Bent, usize)>,
}

/// How far a tree came.
enum Grown {
    /// To the place itself, which is the node of this number.
    There(usize),
    /// Towards it.
    Towards(usize),
    Not,
}

impl Space<'_> {
    fn is_free(&self, place: &Bent) -> bool {
        let posture = upright(*place, self.last);
        posture.is_within_limits() && self.obstacles.are_clear(&posture, self.load)
    }

    /// Whether all between two free places is free.
    fn is_line_free(&self, a: &Bent, b: &Bent) -> bool {
        let n_parts = (distance(a, b) / self.config.check_rad).ceil().max(1.0) as usize;
        (1..n_parts).all(|part| self.is_free(&between(a, b, part as f64 / n_parts as f64)))
    }

    /// The way and how many nodes it took.
    fn connect(&self, [start, goal]: [Bent; 2], rng: &mut ChaCha8Rng) -> Option<(Vec<Bent>, usize)> {
        let mut trees = [Tree { nodes: vec![(start, 0)] }, Tree { nodes: vec![(goal, 0)] }];
        let mut growing = 0;
        let n_nodes = |trees: &[Tree; 2]| trees[0].nodes.len() + trees[1].nodes.len();
        // A draw that grows nothing costs a little too.
        let mut n_draws = 0;
        while n_nodes(&trees) < self.config.most_nodes && n_draws < 4 * self.config.most_nodes {
            n_draws += 1;
            let drawn = drawn(rng);
            if let Grown::There(new) | Grown::Towards(new) = trees[growing].grow(self, &drawn) {
                let place = trees[growing].nodes[new].0;
                if let Some(met) = trees[1 - growing].connect(self, &place) {
                    let [own, other] = [trees[growing].way(new), trees[1 - growing].way(met)];
                    let (mut way, mut back) = if growing == 0 { (own, other) } else { (other, own) };
                    way.reverse();
                    // Both end at the place where they met.
                    way.extend(back.drain(1..));
                    return Some((way, n_nodes(&trees)));
                }
            }
            growing = 1 - growing;
        }
        None
    }

    /// Joins places of the way straight where that is free.
    fn shorten(&self, way: &mut Vec<Bent>, rng: &mut ChaCha8Rng) {
        for _ in 0..self.config.shortcuts {
            if way.len() < 3 {
                return;
            }
            let first = rng.random_range(0..way.len() - 2);
            let second = rng.random_range(first + 2..way.len());
            if self.is_line_free(&way[first], &way[second]) {
                way.drain(first + 1..second);
            }
        }
    }
}

/// Anywhere within the limits.
fn drawn(rng: &mut ChaCha8Rng) -> Bent {
    JOINT_OF.map(|joint| {
        let joint = &JOINTS[joint];
        joint.least_rad + (joint.most_rad - joint.least_rad) * rng.random::<f64>()
    })
}

impl Tree {
    /// One branch towards a place.
    fn grow(&mut self, space: &Space<'_>, to: &Bent) -> Grown {
        let squared = |place: &Bent| place.iter().zip(to).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let nodes = self.nodes.iter().enumerate().map(|(number, (place, _))| (number, squared(place)));
        let Some((nearest, _)) = nodes.min_by(|a, b| a.1.total_cmp(&b.1)) else { return Grown::Not };
        let from = self.nodes[nearest].0;
        let length = distance(&from, to);
        let step = space.config.step_rad;
        let end = if length <= step { *to } else { between(&from, to, step / length) };
        if !space.is_free(&end) || !space.is_line_free(&from, &end) {
            return Grown::Not;
        }
        self.nodes.push((end, nearest));
        let new = self.nodes.len() - 1;
        if length <= step { Grown::There(new) } else { Grown::Towards(new) }
    }

    /// Branches towards a place until it is reached or something is in the way.
    fn connect(&mut self, space: &Space<'_>, to: &Bent) -> Option<usize> {
        while self.nodes.len() < space.config.most_nodes {
            match self.grow(space, to) {
                Grown::There(new) => return Some(new),
                Grown::Towards(_) => {}
                Grown::Not => return None,
            }
        }
        None
    }

    /// From a node down to the root.
    fn way(&self, mut node: usize) -> Vec<Bent> {
        let mut way = vec![self.nodes[node].0];
        while self.nodes[node].1 != node {
            node = self.nodes[node].1;
            way.push(self.nodes[node].0);
        }
        way
    }
}
