//! What surrounds a thing in a picture: a square of pixels about it, told by whose they are.
//!
//! # Shapes
//!
//! A patch is `side * side` cells of [`CHANNELS`] numbers, row by row: how much of the pixel is of the thing itself, of
//! another thing, of the robot, and how much brighter it is than the background. Beyond the picture all are zero.
//!
//! # Invariants
//!
//! Places and colours are data here: no gradient passes through a patch.

use crate::model::colour_slots::Claims;
use crate::model::pictures::Pictures;

/// Numbers of a cell.
pub(super) const CHANNELS: usize = 4;
/// Most of a patch is background, where all numbers are zero; the others are scaled so that a few of them tell.
const GAIN: f32 = 3.0;

/// Pictures whose pixels are claimed by colour slots, the robot's first.
pub(super) struct Claimed<'p> {
    pub(super) pictures: &'p Pictures,
    pub(super) claims: &'p Claims,
    /// How many of the slots, from the second on, are things; what is behind them is letters and shadows.
    pub(super) n_things: usize,
}

impl Claimed<'_> {
    /// The patch of a slot in each picture, about the pixels `centres` of each.
    ///
    /// # Shapes
    ///
    /// `[F, side * side * CHANNELS]`
    pub(super) fn patches(&self, slot: usize, centres: &[[f32; 2]], side: usize) -> Vec<f32> {
        let n_cells = side * side * CHANNELS;
        let mut patches = vec![0.0; centres.len() * n_cells];
        for ((picture, centre), patch) in centres.iter().enumerate().zip(patches.chunks_exact_mut(n_cells.max(1))) {
            let corner = centre.map(|pixel| pixel.floor() as i64 - side as i64 / 2);
            self.brightness(picture, corner, side, patch);
            self.claims(picture, slot, corner, side, patch);
        }
        patches
    }

    fn brightness(&self, picture: usize, corner: [i64; 2], side: usize, patch: &mut [f32]) {
        let Pictures { width, height, .. } = *self.pictures;
        let of_picture = &self.claims.brightness[picture * width * height..][..width * height];
        for (cell, values) in patch.chunks_exact_mut(CHANNELS).enumerate() {
            let [column, row] = [corner[0] + (cell % side) as i64, corner[1] + (cell / side) as i64];
            if (0..width as i64).contains(&column) && (0..height as i64).contains(&row) {
                values[3] = GAIN * of_picture[row as usize * width + column as usize];
            }
        }
    }

    fn claims(&self, picture: usize, slot: usize, corner: [i64; 2], side: usize, patch: &mut [f32]) {
        for point in &self.claims.points[picture] {
            let [x, y] = [point.column as i64 - corner[0], point.row as i64 - corner[1]];
            if !(0..side as i64).contains(&x) || !(0..side as i64).contains(&y) {
                continue;
            }
            let values = &mut patch[(y as usize * side + x as usize) * CHANNELS..][..CHANNELS];
            let shares = self.claims.shares(point);
            let things: f32 = shares[1..=self.n_things].iter().sum();
            values[0] = GAIN * shares[slot];
            values[1] = GAIN * if slot == 0 { things } else { things - shares[slot] };
            values[2] = if slot == 0 { 0.0 } else { GAIN * shares[0] };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Claimed, GAIN};
    use crate::model::colour_slots::Claims;
    use crate::model::pictures::Pictures;
    use crate::trace::GripperState;

    #[test]
    fn a_patch_tells_whose_the_pixels_about_a_place_are() {
        let mut pictures = Pictures::of_size(4, 4);
        pictures.push(&[0; 48], GripperState::default());
        // The second of two things at (2, 1), the robot at (3, 1), half the first thing's at (2, 2).
        let points = vec![(2, 1, [0.0, 0.0, 1.0]), (3, 1, [1.0, 0.0, 0.0]), (2, 2, [0.0, 0.5, 0.5])];
        let claims = Claims::made(3, points, vec![0.2; 16]);
        let claimed = Claimed { pictures: &pictures, claims: &claims, n_things: 2 };
        let first = claimed.patches(1, &[[2.0, 2.0]], 2);
        let second = claimed.patches(2, &[[3.8, 2.0]], 2);
        let bright = GAIN * 0.2;
        assert_eq!(first[..4], [0.0, 0.0, 0.0, bright]);
        assert_eq!(first[4..8], [0.0, GAIN, 0.0, bright]);
        assert_eq!(first[12..], [0.5 * GAIN, 0.5 * GAIN, 0.0, bright]);
        assert_eq!(second[..4], [GAIN, 0.0, 0.0, bright]);
        assert_eq!(second[4..8], [0.0, 0.0, GAIN, bright]);
        // Of the robot all things are one.
        let robot = claimed.patches(0, &[[2.0, 2.0]], 2);
        assert_eq!(robot[4..8], [0.0, GAIN, 0.0, bright]);
    }
}
