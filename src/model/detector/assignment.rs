//! Which colour is which slot's: the one from whose place the slot's position follows best.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::model::detector::AXES;

/// What a position is told from: place and mass of a colour and of the robot, and a constant.
const N_FEATURES: usize = 7;
/// Directions of features that vary less than this, of the most that any does, tell nothing.
const LEAST_VARIANCE: f64 = 1e-7;
/// A thing whose squared distance from its mean place is less than this on average, in square metres, stands aside: any
/// colour tells its place, so it takes one of those that are left.
const STILL: f64 = 1e-6;

/// Looks at pictures (`[F, K, width]`: x, y and mass first) beside positions (`[F * N]`), and chooses for
/// each of `n_slots` slots one of the colours behind the first, which is the robot's; each colour is chosen once at most.
/// There must be as many.
pub(super) fn colours_of_slots(
    looks: &[f32],
    [n_colours, width]: [usize; 2],
    positions: &[[f32; AXES]],
    n_slots: usize,
) -> Vec<usize> {
    let n_pictures = looks.len() / (n_colours * width).max(1);
    let positions = DMatrix::from_fn(n_pictures, AXES * n_slots, |picture, column| {
        f64::from(positions[picture * n_slots + column / AXES][column % AXES])
    });
    let variations = errors(&DMatrix::from_element(n_pictures, 1, 1.0), &positions);
    let mut residuals: Vec<(f64, usize, usize)> = Vec::new();
    for colour in 1..n_colours {
        let features = DMatrix::from_fn(n_pictures, N_FEATURES, |picture, feature| {
            let look = |colour: usize, at: usize| f64::from(looks[(picture * n_colours + colour) * width + at]);
            match feature {
                0..3 => look(colour, feature),
                3..6 => look(0, feature - 3),
                _ => 1.0,
            }
        });
        let errors = errors(&features, &positions);
        let left = |slot: usize| match sum_of_slot(&variations, slot) {
            variation if variation > STILL * n_pictures as f64 => sum_of_slot(&errors, slot) / variation,
            _ => f64::INFINITY,
        };
        residuals.extend((0..n_slots).map(|slot| (left(slot), slot, colour)));
    }
    chosen(residuals, n_slots)
}

fn sum_of_slot(columns: &[f64], slot: usize) -> f64 {
    columns.as_chunks::<AXES>().0[slot].iter().sum()
}

/// The squared errors that are left of each column after linear regression on the features.
fn errors(features: &DMatrix<f64>, columns: &DMatrix<f64>) -> Vec<f64> {
    let eigen = SymmetricEigen::new(features.tr_mul(features));
    let projected = eigen.eigenvectors.tr_mul(&features.tr_mul(columns));
    let least = LEAST_VARIANCE * eigen.eigenvalues.max();
    let explained = |column: usize| {
        let parts = eigen.eigenvalues.iter().enumerate().map(|(row, value)| (value, projected[(row, column)]));
        parts.filter(|(value, _)| **value > least).map(|(value, part)| part * part / value).sum::<f64>()
    };
    (0..columns.ncols()).map(|column| columns.column(column).norm_squared() - explained(column)).collect()
}

/// Pairs of slot and colour, the best first, until each slot has one.
fn chosen(mut residuals: Vec<(f64, usize, usize)>, n_slots: usize) -> Vec<usize> {
    residuals.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let mut chosen = vec![None; n_slots];
    for (_, slot, colour) in residuals {
        if chosen[slot].is_none() && !chosen.contains(&Some(colour)) {
            chosen[slot] = Some(colour);
        }
    }
    chosen.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::colours_of_slots;

    #[test]
    fn each_slot_gets_the_colour_that_moves_with_it_and_one_that_stands_aside_what_is_left() {
        let n_pictures = 60;
        let wave = |picture: usize, of: usize| ((picture * (of + 3) * 7 + of * 5) as f32).sin();
        let mut looks = Vec::new();
        let mut rows = Vec::new();
        for picture in 0..n_pictures {
            let places: Vec<[f32; 2]> = (0..4).map(|of| [wave(picture, of), wave(picture, of + 10)]).collect();
            looks.extend(places.iter().flat_map(|&[x, y]| [x, y, 0.5]));
            // The first slot stands aside.
            rows.push([0.5, 0.25, 0.125]);
            // The second is the third colour, the third the first; both are told from the robot.
            for colour in [3, 1] {
                let [x, y] = [0, 1].map(|axis| places[colour][axis] - places[0][axis]);
                rows.push([0.3 * x, -0.2 * y, 0.1 * y]);
            }
        }
        assert_eq!(colours_of_slots(&looks, [4, 3], &rows, 3), [2, 3, 1]);
    }
}
