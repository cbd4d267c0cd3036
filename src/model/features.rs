//! What the networks read: numbers from observations that a rectifier network can learn from.
//!
//! # Source
//!
//! Ours, not the paper's, which is silent here. "Straight above" is an even function of x and y, which raw coordinates
//! barely train; the bump makes it linear.

use crate::trace::ObservationRows;

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

/// Each slot's position and the gripper: `[rows, N, OBJECT_WIDTH]`.
pub(crate) fn objects(rows: &ObservationRows) -> Vec<f32> {
    let mut features = Vec::with_capacity(rows.len() * rows.n_slots() * OBJECT_WIDTH);
    for row in rows.iter() {
        for position in row.positions {
            features.extend(position_features(*position, LINEAR_GAIN));
            features.extend_from_slice(row.gripper);
        }
    }
    features
}

/// The displacement of each slot from each other: `[rows, N, N, POSITION_WIDTH]`.
pub(crate) fn pairs(rows: &ObservationRows) -> Vec<f32> {
    let n_slots = rows.n_slots();
    let mut features = vec![0.0; rows.len() * n_slots * n_slots * POSITION_WIDTH];
    let frames = features.as_chunks_mut::<POSITION_WIDTH>().0.chunks_exact_mut((n_slots * n_slots).max(1));
    for (row, pairs) in rows.iter().zip(frames) {
        for (i, a) in row.positions.iter().enumerate() {
            for (k, b) in row.positions[..=i].iter().enumerate() {
                let [x, y, z, bumps @ ..] = position_features([a[0] - b[0], a[1] - b[1], a[2] - b[2]], LINEAR_GAIN);
                pairs[i * n_slots + k] = [x, y, z, bumps[0], bumps[1], bumps[2]];
                pairs[k * n_slots + i] = [-x, -y, -z, bumps[0], bumps[1], bumps[2]];
            }
        }
    }
    features
}

/// (open, closed): `[rows, AGENT_WIDTH]`.
pub(crate) fn agents(rows: &ObservationRows) -> Vec<f32> {
    rows.iter().flat_map(|row| row.gripper.iter().copied()).collect()
}

/// All slots side by side, and behind them with `relations` each pair's displacement: `[rows, flat_width(n_slots)]`. Slots
/// that the rows do not have are zeros, which no position is.
pub(crate) fn flat(rows: &ObservationRows, n_slots: usize, relations: bool) -> Vec<f32> {
    let width = flat_width(n_slots, relations);
    let mut features = Vec::with_capacity(rows.len() * width);
    for (number, row) in rows.iter().enumerate() {
        for position in row.positions {
            features.extend(position_features(*position, FLAT_HEIGHT_GAIN));
        }
        features.resize(number * width + POSITION_WIDTH * n_slots, 0.0);
        features.extend_from_slice(row.gripper);
        for (after, a) in row.positions.iter().enumerate().filter(|_| relations) {
            for b in &row.positions[..after] {
                features.extend(position_features([a[0] - b[0], a[1] - b[1], a[2] - b[2]], FLAT_HEIGHT_GAIN));
            }
        }
        features.resize((number + 1) * width, 0.0);
    }
    features
}

/// Width of [`flat`].
pub(crate) fn flat_width(n_slots: usize, relations: bool) -> usize {
    let n_pairs = if relations { n_slots * n_slots.saturating_sub(1) / 2 } else { 0 };
    POSITION_WIDTH * (n_slots + n_pairs) + AGENT_WIDTH
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
    use super::{OBJECT_WIDTH, POSITION_WIDTH, flat, flat_width, objects, pairs};
    use crate::trace::ObservationRows;

    fn row() -> ObservationRows {
        ObservationRows::new(2, vec![0.1, 0.0, -0.02, 0.1, 0.0, -0.07, 0.0, 1.0])
    }

    #[test]
    fn a_pair_has_the_displacement_and_its_mirror() {
        let pairs = pairs(&row());
        let [upper_lower, lower_upper] = [&pairs[POSITION_WIDTH..][..6], &pairs[2 * POSITION_WIDTH..][..6]];
        assert!((upper_lower[2] - 0.25).abs() < 1e-6 && (lower_upper[2] + 0.25).abs() < 1e-6);
        assert_eq!(upper_lower[3..5], [1.0, 1.0]);
        assert!((upper_lower[5] - (-1.0_f32).exp()).abs() < 1e-6);
        assert_eq!(pairs[..6], [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    }

    #[test]
    fn relations_stand_behind_what_is_read_without_them() {
        let (plain, related) = (flat(&row(), 2, false), flat(&row(), 2, true));
        assert_eq!((plain.len(), related.len()), (flat_width(2, false), flat_width(2, true)));
        assert_eq!((flat_width(8, false), flat_width(8, true)), (50, 218));
        assert_eq!(related[..plain.len()], plain);
        let [x, y, z, bump_x, bump_y, bump_z] = related[plain.len()..] else { panic!("{related:?}") };
        assert_eq!([x, y, bump_x, bump_y], [0.0, 0.0, 1.0, 1.0]);
        assert!((z + 1.0).abs() < 1e-5 && (bump_z - (-1.0_f32).exp()).abs() < 1e-5, "the upper one is 5 cm above");
    }

    #[test]
    fn slots_that_are_not_there_are_zeros() {
        let (own, padded) = (flat(&row(), 2, true), flat(&row(), 3, true));
        assert_eq!(padded.len(), flat_width(3, true));
        assert_eq!(padded[..12], own[..12], "both slots");
        assert_eq!(padded[12..18], [0.0; 6], "the third");
        assert_eq!(padded[18..20], own[12..14], "the gripper");
        assert_eq!(padded[20..26], own[14..], "the one pair");
        assert_eq!(padded[26..], [0.0; 12], "the pairs of the third");
    }

    #[test]
    fn every_object_carries_the_gripper() {
        let objects = objects(&row());
        assert_eq!(objects.len(), 2 * OBJECT_WIDTH);
        assert_eq!(objects[POSITION_WIDTH..OBJECT_WIDTH], [0.0, 1.0]);
        assert_eq!(objects[OBJECT_WIDTH + POSITION_WIDTH..], [0.0, 1.0]);
    }
}
