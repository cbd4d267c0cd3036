//! Whose each pixel is: the share that each colour slot has in it.

use crate::model::colour_slots::foreground::{COLOUR_WIDTH, Foreground};
use crate::model::pictures::Pictures;

/// A pixel that is no background.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Point {
    pub(crate) column: usize,
    pub(crate) row: usize,
    /// Where its shares begin.
    at: usize,
}

/// The pixels of some pictures that are no background.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Claims {
    pub(crate) n_slots: usize,
    /// By picture.
    pub(crate) points: Vec<Vec<Point>>,
    /// `[points, n_slots]`, each row summing to one.
    shares: Vec<f32>,
    /// How much brighter each pixel is than the background, -1 to 1: `[pictures, height, width]`.
    pub(crate) brightness: Vec<f32>,
}

impl Claims {
    /// `prototypes` is `[COLOUR_WIDTH, n_slots]`, `log_sharpness` `[n_slots]`.
    pub(super) fn of(
        pictures: &Pictures,
        background: &[f32],
        seen: &Foreground,
        prototypes: &[f32],
        log_sharpness: &[f32],
    ) -> Self {
        let n_slots = log_sharpness.len();
        let sharpness: Vec<f32> = log_sharpness.iter().map(|log| log.exp()).collect();
        let points = Vec::with_capacity(seen.n_pictures);
        let mut claims = Self { n_slots, points, shares: Vec::new(), brightness: brightness(pictures, background) };
        for points in seen.pictures() {
            let mut of_picture = Vec::with_capacity(points.len());
            for (colour, [x, y]) in points {
                let pixel = |place: f32, size: usize| ((place + 1.0) / 2.0 * size as f32) as usize;
                let (column, row) = (pixel(x, pictures.width), pixel(y, pictures.height));
                of_picture.push(Point { column, row, at: claims.shares.len() });
                claims.claim(colour, prototypes, &sharpness);
            }
            claims.points.push(of_picture);
        }
        claims
    }

    /// How much of a pixel each slot has.
    pub(crate) fn shares(&self, point: &Point) -> &[f32] {
        &self.shares[point.at..point.at + self.n_slots]
    }

    /// Of one picture, point by point.
    #[cfg(test)]
    pub(crate) fn made<const K: usize>(
        n_slots: usize,
        points: Vec<(usize, usize, [f32; K])>,
        brightness: Vec<f32>,
    ) -> Self {
        let at = |idx: usize| idx * n_slots;
        let place = |(idx, &(column, row, _)): (usize, &(usize, usize, [f32; K]))| Point { column, row, at: at(idx) };
        let of_picture = points.iter().enumerate().map(place).collect();
        let shares = points.iter().flat_map(|(_, _, shares)| *shares).collect();
        Self { n_slots, points: vec![of_picture], shares, brightness }
    }

    fn claim(&mut self, colour: &[f32; COLOUR_WIDTH], prototypes: &[f32], sharpness: &[f32]) {
        let begin = self.shares.len();
        self.shares.extend(sharpness.iter().enumerate().map(|(slot, sharpness)| {
            let distance =
                |(feature, value): (usize, &f32)| (value - prototypes[feature * self.n_slots + slot]).powi(2);
            -sharpness * colour.iter().enumerate().map(distance).sum::<f32>()
        }));
        let own = &mut self.shares[begin..];
        let most = own.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        own.iter_mut().for_each(|score| *score = (*score - most).exp());
        let sum: f32 = own.iter().sum();
        own.iter_mut().for_each(|share| *share /= sum);
    }
}

fn brightness(pictures: &Pictures, background: &[f32]) -> Vec<f32> {
    let usual: Vec<f32> = background.as_chunks::<3>().0.iter().map(|rgb| rgb.iter().sum()).collect();
    let mut brightness = Vec::with_capacity(pictures.n * usual.len());
    for picture in pictures.iter() {
        let sums = picture.as_chunks::<3>().0.iter().map(|rgb| rgb.iter().map(|&value| f32::from(value)).sum::<f32>());
        brightness.extend(sums.zip(&usual).map(|(sum, usual)| (sum - usual) / 765.0));
    }
    brightness
}
