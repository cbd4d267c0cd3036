//! What the networks read: numbers from observations that a rectifier network can learn from.
//!
//! # Shapes
//!
//! Rows are [`crate::trace::Observation::to_flat`]: x, y, z of each slot relative to the gripper, then (open, closed).
//!
//! # Source
//!
//! Ours, not the paper's, which is silent here. "Straight above" is an even function of x and y, which raw coordinates
//! barely train; the bump makes it linear.

use crate::trace::Observation;

/// Features of one position or displacement: three linear, three bumps at zero.
pub(crate) const POSITION_WIDTH: usize = 6;
/// Features of one slot: its position, and whether the gripper is open or closed.
pub(crate) const OBJECT_WIDTH: usize = POSITION_WIDTH + AGENT_WIDTH;
/// One-hot (open, closed).
pub(crate) const AGENT_WIDTH: usize = 2;

/// Scale of the linear features, per metre.
const LINEAR_GAIN: f32 = 5.0;
/// The flattened form needs heights apart that differ by one block.
const FLAT_HEIGHT_GAIN: f32 = 20.0;
/// A bump has fallen to 1/e at 5 cm.
const BUMP_GAIN: f32 = 20.0;

/// Observation rows of one or more windows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'r> {
    pub(crate) n_slots: usize,
    pub(crate) values: &'r [f32],
}

impl<'r> Rows<'r> {
    fn iter(self) -> impl Iterator<Item = (&'r [f32], &'r [f32])> {
        let n_coordinates = 3 * self.n_slots;
        self.values.chunks_exact(Observation::width(self.n_slots)).map(move |row| row.split_at(n_coordinates))
    }

    fn n_rows(self) -> usize {
        self.values.len() / Observation::width(self.n_slots)
    }

    /// Each slot's position and the gripper: `[rows, N, OBJECT_WIDTH]`.
    pub(crate) fn objects(self) -> Vec<f32> {
        let mut features = Vec::with_capacity(self.n_rows() * self.n_slots * OBJECT_WIDTH);
        for (coordinates, agent) in self.iter() {
            for position in coordinates.as_chunks::<3>().0 {
                features.extend(position_features(*position, LINEAR_GAIN));
                features.extend_from_slice(agent);
            }
        }
        features
    }

    /// The displacement of each slot from each other: `[rows, N, N, POSITION_WIDTH]`.
    pub(crate) fn pairs(self) -> Vec<f32> {
        let n_slots = self.n_slots;
        let mut features = vec![0.0; self.n_rows() * n_slots * n_slots * POSITION_WIDTH];
        let frames = features.as_chunks_mut::<POSITION_WIDTH>().0.chunks_exact_mut(n_slots * n_slots);
        for ((coordinates, _), pairs) in self.iter().zip(frames) {
            let positions = coordinates.as_chunks::<3>().0;
            for (i, a) in positions.iter().enumerate() {
                for (k, b) in positions[..=i].iter().enumerate() {
                    let [x, y, z, bumps @ ..] = position_features([a[0] - b[0], a[1] - b[1], a[2] - b[2]], LINEAR_GAIN);
                    pairs[i * n_slots + k] = [x, y, z, bumps[0], bumps[1], bumps[2]];
                    pairs[k * n_slots + i] = [-x, -y, -z, bumps[0], bumps[1], bumps[2]];
                }
            }
        }
        features
    }

    /// (open, closed): `[rows, AGENT_WIDTH]`.
    pub(crate) fn agents(self) -> Vec<f32> {
        self.iter().flat_map(|(_, agent)| agent).copied().collect()
    }

    /// All slots side by side: `[rows, flat_width(N)]`.
    pub(crate) fn flat(self) -> Vec<f32> {
        let mut features = Vec::with_capacity(self.n_rows() * flat_width(self.n_slots));
        for (coordinates, agent) in self.iter() {
            for position in coordinates.as_chunks::<3>().0 {
                features.extend(position_features(*position, FLAT_HEIGHT_GAIN));
            }
            features.extend_from_slice(agent);
        }
        features
    }
}

/// Width of [`Rows::flat`].
pub(crate) fn flat_width(n_slots: usize) -> usize {
    POSITION_WIDTH * n_slots + AGENT_WIDTH
}

fn position_features([x, y, z]: [f32; 3], height_gain: f32) -> [f32; POSITION_WIDTH] {
    [LINEAR_GAIN * x, LINEAR_GAIN * y, height_gain * z, bump(x), bump(y), bump(z)]
}

fn bump(distance_m: f32) -> f32 {
    let scaled = BUMP_GAIN * distance_m;
    (-scaled * scaled).exp()
}

#[cfg(test)]
mod tests {
    use super::{OBJECT_WIDTH, POSITION_WIDTH, Rows};

    const ROW: [f32; 8] = [0.1, 0.0, -0.02, 0.1, 0.0, -0.07, 0.0, 1.0];

    #[test]
    fn a_pair_has_the_displacement_and_its_mirror() {
        let pairs = Rows { n_slots: 2, values: &ROW }.pairs();
        let [upper_lower, lower_upper] = [&pairs[POSITION_WIDTH..][..6], &pairs[2 * POSITION_WIDTH..][..6]];
        assert!((upper_lower[2] - 0.25).abs() < 1e-6 && (lower_upper[2] + 0.25).abs() < 1e-6);
        assert_eq!(upper_lower[3..5], [1.0, 1.0]);
        assert!((upper_lower[5] - (-1.0_f32).exp()).abs() < 1e-6);
        assert_eq!(pairs[..6], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn every_object_carries_the_gripper() {
        let objects = Rows { n_slots: 2, values: &ROW }.objects();
        assert_eq!(objects.len(), 2 * OBJECT_WIDTH);
        assert_eq!(objects[POSITION_WIDTH..OBJECT_WIDTH], [0.0, 1.0]);
        assert_eq!(objects[OBJECT_WIDTH + POSITION_WIDTH..], [0.0, 1.0]);
    }
}
