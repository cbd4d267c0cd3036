//! Errors of observed positions.
//!
//! # Invariants
//!
//! What is drawn depends on the seed, the frame and the slot alone.

use rand::Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::seed::Seed;

/// The largest deviation that makes sense on a table of blocks of 5 cm, in metres.
const MOST_M: f32 = 0.1;

/// How far observed positions of slots are off: standard deviations of normal distributions, along each axis, in metres
/// (0 to 0.1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObservationNoise {
    /// Drawn anew for each slot whenever it is looked at.
    pub frame_m: f32,
    /// Drawn once for each slot: once for a demonstration, and once for the world that is acted in.
    pub offset_m: f32,
}

/// A setting that is not allowed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{key} is {found}; allowed: from 0 to {MOST_M}")]
pub struct NoiseError {
    /// Its key.
    pub key: &'static str,
    /// As found.
    pub found: f32,
}

impl ObservationNoise {
    /// Checks every setting.
    ///
    /// # Errors
    ///
    /// [`NoiseError`] for the first that is not allowed.
    pub fn check(&self) -> Result<(), NoiseError> {
        let Self { frame_m, offset_m } = *self;
        let wrong = [("frame_m", frame_m), ("offset_m", offset_m)].into_iter();
        let mut wrong = wrong.filter(|(_, found)| !(0.0..=MOST_M).contains(found));
        wrong.next().map_or(Ok(()), |(key, found)| Err(NoiseError { key, found }))
    }

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Puts the positions of a frame off, those of its slots in order.
    pub fn put_off(&self, positions: &mut [[f32; 3]], frame: u64, seed: Seed) {
        if self.is_none() {
            return;
        }
        let (mut once, mut now) = (seed.derive("offset", &[]).rng(), seed.derive("frame", &[frame]).rng());
        for coordinate in positions.iter_mut().flatten() {
            *coordinate += self.offset_m * normal(&mut once) + self.frame_m * normal(&mut now);
        }
    }
}

/// From the standard normal distribution, by Box and Muller.
fn normal(rng: &mut impl Rng) -> f32 {
    let (radius, turn): (f32, f32) = (1.0 - rng.random::<f32>(), rng.random());
    (-2.0 * radius.ln()).sqrt() * (std::f32::consts::TAU * turn).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and standard deviation.
    fn spread(values: &[f32]) -> (f32, f32) {
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f32>() / values.len() as f32).sqrt())
    }

    #[test]
    fn positions_are_off_by_as_much_as_is_asked_for() {
        let noise = ObservationNoise { frame_m: 0.01, offset_m: 0.0 };
        let mut positions = vec![[0.0; 3]; 5000];
        noise.put_off(&mut positions, 3, Seed(1));
        let (mean, deviation) = spread(positions.as_flattened());
        assert!(mean.abs() < 3e-4 && (deviation - 0.01).abs() < 2e-4, "{mean} {deviation}");
    }

    #[test]
    fn an_offset_stays_from_frame_to_frame_and_the_rest_does_not() {
        let off = |noise: ObservationNoise, frame| {
            let mut positions = vec![[0.0; 3]; 4];
            noise.put_off(&mut positions, frame, Seed(2));
            positions
        };
        let (offset, frame) =
            (ObservationNoise { frame_m: 0.0, offset_m: 0.02 }, ObservationNoise { frame_m: 0.02, offset_m: 0.0 });
        assert_eq!(off(offset, 0), off(offset, 1));
        assert_ne!(off(frame, 0), off(frame, 1));
        assert_eq!(off(frame, 1), off(frame, 1));
    }

    #[test]
    fn what_is_negative_too_much_or_no_number_is_refused_by_name() {
        for found in [-0.01, 0.11, f32::NAN, f32::INFINITY] {
            let error = ObservationNoise { frame_m: 0.0, offset_m: found }.check().unwrap_err();
            assert_eq!(error.to_string(), format!("offset_m is {found}; allowed: from 0 to 0.1"));
        }
        assert_eq!(ObservationNoise { frame_m: 0.1, offset_m: 0.0 }.check(), Ok(()));
    }
}
