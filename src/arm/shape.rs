//! The arm's collision capsules, where they are, and how near it comes to itself.

use std::sync::LazyLock;

use crate::arm::kinematics::{Frame, links};
use crate::arm::sawyer::{N_JOINTS, N_PARTS, PARTS};
use crate::arm::{Posture, Vector};
use crate::geometry::{Pose, Rotation, Vec3};

/// A capsule in the frame of a link: all points that are no farther than the radius from a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// 0 for the base, then the links in order.
    pub link: usize,
    /// One end of the line.
    pub from_m: [f64; 3],
    /// The other.
    pub to_m: [f64; 3],
    /// The radius in metres.
    pub radius_m: f64,
}

impl Capsule {
    /// Length of its line, and the pose in the link in which the line goes up from the origin.
    pub fn standing(&self) -> (f32, Pose) {
        let from = Vec3::from(self.from_m.map(|at| at as f32));
        let way = Vec3::from(self.to_m.map(|at| at as f32)) - from;
        // Of the two ways to turn the z axis upside down either does.
        let upside_down = Rotation::from_quaternion(nalgebra::Quaternion::new(0.0, 1.0, 0.0, 0.0));
        let turn = Rotation::rotation_between(&Vec3::z(), &way).unwrap_or(upside_down);
        (way.norm(), Pose::from_parts(from.into(), turn))
    }
}

/// A capsule in the base's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedCapsule {
    /// 0 for the base, then the links in order.
    pub link: usize,
    /// One end of the line.
    pub from: Vector,
    /// The other.
    pub to: Vector,
    /// The radius in metres.
    pub radius_m: f64,
}

/// Links that are so far from each other can meet; neighbours overlap where they are joined.
const APART: usize = 2;

/// All capsules of the arm, of base and gripper's body too.
pub fn capsules() -> impl ExactSizeIterator<Item = Capsule> {
    PARTS.iter().map(|part| Capsule { link: part.link, from_m: part.from_m, to_m: part.to_m, radius_m: part.radius_m })
}

/// Where the capsules are.
pub fn placed(posture: &Posture) -> [PlacedCapsule; N_PARTS] {
    of_links(&links(posture))
}

/// Where the capsules are with the links there.
pub(super) fn of_links(links: &[Frame; N_JOINTS]) -> [PlacedCapsule; N_PARTS] {
    let base = Frame::identity();
    std::array::from_fn(|number| {
        let part = &PARTS[number];
        let frame = part.link.checked_sub(1).map_or(&base, |link| &links[link]);
        let (from, to) = (frame.point(part.from_m), frame.point(part.to_m));
        PlacedCapsule { link: part.link, from, to, radius_m: part.radius_m }
    })
}

/// Pairs of capsules that can meet.
static PAIRS: LazyLock<Vec<(usize, usize)>> = LazyLock::new(|| {
    let pairs = (0..N_PARTS).flat_map(|first| (first + 1..N_PARTS).map(move |second| (first, second)));
    pairs.filter(|&(first, second)| PARTS[second].link - PARTS[first].link >= APART).collect()
});

/// Distance between the nearest parts of the arm that are at least two links apart, in metres; what is farther than
/// `enough_m` counts as that far.
pub(super) fn self_clearance_m(capsules: &[PlacedCapsule; N_PARTS], enough_m: f64) -> f64 {
    PAIRS.iter().fold(enough_m, |nearest, &(first, second)| {
        let (first, second) = (&capsules[first], &capsules[second]);
        let radii = first.radius_m + second.radius_m;
        if are_farther(first, second, radii + nearest) {
            return nearest;
        }
        nearest.min(between_segments_m([first.from, first.to], [second.from, second.to]) - radii)
    })
}

/// Distance between the nearest parts of the arm that are at least two links apart, in metres, below 0 where they
/// overlap; at most 1.
pub fn self_clearance(posture: &Posture) -> f64 {
    self_clearance_m(&placed(posture), 1.0)
}

/// Whether two capsules' lines are surely farther from each other: the balls around them are.
fn are_farther(first: &PlacedCapsule, second: &PlacedCapsule, distance_m: f64) -> bool {
    let middles = ((first.from + first.to) - (second.from + second.to)).norm_squared() / 4.0;
    let halves = ((first.to - first.from).norm() + (second.to - second.from).norm()) / 2.0;
    let reach = halves + distance_m;
    middles > reach * reach
}

/// The distance of two lines between their ends.
///
/// With p(s) = a + s·u and q(t) = b + t·v: the nearest s for all t, held within 0 and 1, then the nearest t for it, and
/// where that had to be held, the nearest s again.
pub(super) fn between_segments_m([a, a_end]: [Vector; 2], [b, b_end]: [Vector; 2]) -> f64 {
    let (u, v, w) = (a_end - a, b_end - b, a - b);
    let (uu, uv, vv, uw, vw) = (u.dot(&u), u.dot(&v), v.dot(&v), u.dot(&w), v.dot(&w));
    let held = |value: f64| value.clamp(0.0, 1.0);
    let divided = |above: f64, below: f64| if below > 0.0 { above / below } else { 0.0 };
    let mut s = held(divided(uv * vw - vv * uw, uu * vv - uv * uv));
    let mut t = divided(uv * s + vw, vv);
    if !(0.0..=1.0).contains(&t) {
        t = held(t);
        s = held(divided(uv * t - uw, uu));
    }
    (w + u * s - v * t).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance_m(ends: [[f64; 3]; 4]) -> f64 {
        let [a, a_end, b, b_end] = ends.map(Vector::from);
        between_segments_m([a, a_end], [b, b_end])
    }

    #[test]
    fn lines_between_their_ends_are_as_far_apart_as_drawn() {
        let cross = [[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.3], [0.0, 1.0, 0.3]];
        assert!((distance_m(cross) - 0.3).abs() < 1e-12);
        let beside = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.2, 0.4, 0.0], [0.7, 0.4, 0.0]];
        assert!((distance_m(beside) - 0.4).abs() < 1e-12);
        // The ends (1, 0, 0) and (4, 4, 0) are the nearest places: 3 and 4 apart.
        let ends = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [4.0, 4.0, 0.0], [9.0, 9.0, 0.0]];
        assert!((distance_m(ends) - 5.0).abs() < 1e-12);
        let points = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 3.0, 4.0], [0.0, 3.0, 4.0]];
        assert!((distance_m(points) - 5.0).abs() < 1e-12);
        let point_and_line = [[0.5, 2.0, 0.0], [0.5, 2.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert!((distance_m(point_and_line) - 2.0).abs() < 1e-12);
    }
}
