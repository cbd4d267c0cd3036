//! How near the arm, and what it holds, comes to itself, to the table and to what stands there.
//!
//! # Units and frames
//!
//! Metres in the base's frame. Solids are boxes along its axes, which hold what they stand for.

use crate::arm::kinematics::{Frame, links, tool};
use crate::arm::sawyer::{N_JOINTS, N_PARTS};
use crate::arm::shape::{PlacedCapsule, of_links, self_clearance_m};
use crate::arm::{Posture, Vector};

/// A box along the base's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Its least corner.
    pub least: Vector,
    /// Its greatest corner.
    pub most: Vector,
}

/// Gripper and load as an upright cylinder about the gripper's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load {
    /// Its radius.
    pub radius_m: f64,
    /// From the gripper's reference point down to its lower end.
    pub below_m: f64,
    /// From the gripper's reference point up to its upper end.
    pub above_m: f64,
}

/// What the arm must not touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Obstacles {
    /// Height of the table.
    pub table_z: f64,
    /// What stands on it.
    pub solids: Vec<Solid>,
    /// How far the arm stays from everything.
    pub margin_m: f64,
}

/// Base and first link stand on the table.
const FIRST_MOVING_LINK: usize = 2;
/// The gripper's part of the last link is told by the load.
const WRIST: usize = 7;
/// The lengths within which the nearest place of a line to a box is found: 2 / 3 to this power.
const N_THIRDS: usize = 20;

impl Obstacles {
    /// Nothing but a table.
    pub fn table(table_z: f64, margin_m: f64) -> Self {
        Self { table_z, solids: Vec::new(), margin_m }
    }

    /// Whether the arm in a posture, with what it holds, keeps its margin from itself, from the table and from all
    /// solids.
    pub fn are_clear(&self, posture: &Posture, load: &Load) -> bool {
        let links = links(posture);
        self.load_is_clear(&tool(&links[N_JOINTS - 1]), load) && self.links_are_clear(&links, self.margin_m)
    }

    /// The same for the arm alone, without gripper, with another margin: beside what it grips the arm passes closely.
    pub fn arm_is_clear(&self, posture: &Posture, margin_m: f64) -> bool {
        self.links_are_clear(&links(posture), margin_m)
    }

    fn links_are_clear(&self, links: &[Frame; N_JOINTS], margin_m: f64) -> bool {
        let capsules = of_links(links);
        self.capsules_are_clear(&capsules, margin_m) && self_clearance_m(&capsules, margin_m) >= margin_m
    }

    fn capsules_are_clear(&self, capsules: &[PlacedCapsule; N_PARTS], margin_m: f64) -> bool {
        let moving = capsules.iter().filter(|capsule| (FIRST_MOVING_LINK..WRIST).contains(&capsule.link));
        moving.into_iter().all(|capsule| {
            let room = capsule.radius_m + margin_m;
            let lowest_z = capsule.from.z.min(capsule.to.z);
            lowest_z - room >= self.table_z && self.solids.iter().all(|solid| is_clear(capsule, solid, room))
        })
    }

    /// Whether gripper and load keep the margin, with the gripper upright there.
    pub fn load_is_clear(&self, tool: &Frame, load: &Load) -> bool {
        let [x, y, z] = tool.position.into();
        let (low, high) = (z - load.below_m - self.margin_m, z + load.above_m + self.margin_m);
        let reach = load.radius_m + self.margin_m;
        low >= self.table_z
            && self.solids.iter().all(|solid| {
                let aside = [(x, solid.least.x, solid.most.x), (y, solid.least.y, solid.most.y)]
                    .map(|(at, least, most)| (least - at).max(at - most).max(0.0));
                low > solid.most.z || high < solid.least.z || aside[0] * aside[0] + aside[1] * aside[1] > reach * reach
            })
    }
}

/// Whether a capsule's line keeps a distance from a box.
fn is_clear(capsule: &PlacedCapsule, solid: &Solid, distance_m: f64) -> bool {
    let apart = (0..3).any(|axis| {
        let (from, to) = (capsule.from[axis], capsule.to[axis]);
        from.min(to) - distance_m > solid.most[axis] || from.max(to) + distance_m < solid.least[axis]
    });
    apart || to_box_m(capsule, solid) > distance_m
}

/// The distance of a capsule's line from a box: convex along the line, so thirds are cut off until little is left.
fn to_box_m(capsule: &PlacedCapsule, solid: &Solid) -> f64 {
    let way = capsule.to - capsule.from;
    let at = |share: f64| {
        let point = capsule.from + way * share;
        let aside = |axis: usize| (solid.least[axis] - point[axis]).max(point[axis] - solid.most[axis]).max(0.0);
        let [x, y, z] = [aside(0), aside(1), aside(2)];
        x * x + y * y + z * z
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..N_THIRDS {
        let third = (high - low) / 3.0;
        if at(low + third) <= at(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    libm::sqrt(at((low + high) / 2.0))
}
