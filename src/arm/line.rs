//! A straight line in the space of joints, as fast as the joints allow.
//!
//! # Source
//!
//! The minimum-jerk profile s(u) = 10 u³ − 15 u⁴ + 6 u⁵ over the duration: it begins and ends at rest. Its peaks are
//! [`PEAK_SPEED`] and [`PEAK_ACCELERATION`] where way and duration are 1.

use crate::arm::Posture;
use crate::arm::sawyer::JOINTS;

/// Peak speed of a minimum-jerk motion of length 1 and duration 1: at half of it, 15/8.
pub const PEAK_SPEED: f64 = 1.875;
/// Its peak acceleration: 10 / √3, at (1 ± 1/√3) / 2.
pub const PEAK_ACCELERATION: f64 = 5.773_502_691_896_258;

/// The share of its way that a minimum-jerk motion has gone after a share of its duration.
pub fn min_jerk(share: f64) -> f64 {
    let u = share.clamp(0.0, 1.0);
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// A little more time than the differences between a few postures ask for: those between are not looked at.
const SPARE: f64 = 1.02;

/// The time in which the arm passes through postures at even shares of the duration, at rest at both ends, so that no
/// joint exceeds its greatest speed or acceleration, in seconds.
pub fn duration_through_secs(postures: &[Posture]) -> f64 {
    let share = 1.0 / (postures.len().max(2) - 1) as f64;
    let mut longest = 0.0_f64;
    for (joint, limits) in JOINTS.iter().enumerate() {
        let mut before = 0.0;
        let ways = postures.windows(2).map(|pair| pair[1].0[joint] - pair[0].0[joint]);
        for way in ways.chain([0.0]) {
            let by_speed = (way / share).abs() / limits.rad_per_s;
            let by_acceleration = libm::sqrt(((way - before) / (share * share)).abs() / limits.rad_per_s2);
            longest = longest.max(by_speed).max(by_acceleration);
            before = way;
        }
    }
    SPARE * longest
}

/// A straight line between two postures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Where it begins.
    pub from: Posture,
    /// Where it ends.
    pub to: Posture,
}

impl Line {
    /// The shortest time in which no joint exceeds its greatest speed or acceleration, in seconds.
    pub fn duration_secs(&self) -> f64 {
        let ways = self.from.0.iter().zip(&self.to.0).zip(&JOINTS);
        ways.map(|((from, to), joint)| {
            let way = (to - from).abs();
            (PEAK_SPEED * way / joint.rad_per_s).max(libm::sqrt(PEAK_ACCELERATION * way / joint.rad_per_s2))
        })
        .fold(0.0, f64::max)
    }

    /// The posture after a share of the duration.
    pub fn at(&self, share: f64) -> Posture {
        self.from.between(&self.to, min_jerk(share))
    }
}
