//! Pixels that are not background, with their colours.

use std::collections::BTreeMap;

use crate::model::pictures::Pictures;

/// Features of a colour: shares of red, green and blue, and brightness, which matters less since light changes it.
pub(super) const COLOUR_WIDTH: usize = 4;
/// Scale of the shares: what is one colour to the eye then lies within a distance of about one.
const SHARE_GAIN: f32 = 20.0;
/// Scale of the brightness.
const BRIGHTNESS_GAIN: f32 = 6.0;
/// How much a channel must differ from the background.
const THRESHOLD: f32 = 24.0;
/// Channel values that count as the same when the most frequent colour of a pixel is looked for.
const BIN: u8 = 16;

/// Points of some pictures, padded to as many as the fullest has.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Foreground {
    pub(super) n_pictures: usize,
    pub(super) n_points: usize,
    /// How many points each picture has.
    pub(super) lengths: Vec<usize>,
    /// `[n_pictures, n_points, COLOUR_WIDTH]`
    pub(super) colours: Vec<f32>,
    /// x and y of each point, from -1 to 1: `[n_pictures, n_points]`
    pub(super) xy: Vec<[f32; 2]>,
}

impl Foreground {
    /// Zero for each point, `score` for padding: `[n_pictures, n_points]`.
    pub(super) fn hidden(&self, score: f32) -> Vec<f32> {
        let of_picture =
            |&length: &usize| (0..self.n_points).map(move |point| if point < length { 0.0 } else { score });
        self.lengths.iter().flat_map(of_picture).collect()
    }

    /// All x, then all y of each picture: `[n_pictures, 2, n_points]`.
    pub(super) fn places(&self) -> Vec<f32> {
        let of_picture =
            |points: &[[f32; 2]]| (0..2).flat_map(|axis| points.iter().map(move |xy| xy[axis])).collect::<Vec<_>>();
        self.xy.chunks_exact(self.n_points).flat_map(of_picture).collect()
    }

    /// The points of each picture: colour and place.
    pub(super) fn pictures(&self) -> impl Iterator<Item = Vec<(&[f32; COLOUR_WIDTH], [f32; 2])>> {
        let colours = self.colours.as_chunks::<COLOUR_WIDTH>().0.chunks_exact(self.n_points);
        let points = colours.zip(self.xy.chunks_exact(self.n_points)).zip(&self.lengths);
        points.map(|((colours, xy), &length)| colours.iter().zip(xy.iter().copied()).take(length).collect())
    }
}

/// The most frequent colour of each pixel over all pictures, `[height, width, 3]`: unlike a median it is not moved by
/// what lies there now and then.
pub(super) fn background(pictures: &Pictures) -> Vec<f32> {
    (0..pictures.width * pictures.height).flat_map(|pixel| most_frequent(pictures, 3 * pixel)).collect()
}

/// The mean of the most frequent bin; of equally frequent ones the darkest.
fn most_frequent(pictures: &Pictures, at: usize) -> [f32; 3] {
    let mut bins: BTreeMap<[u8; 3], (u32, [u32; 3])> = BTreeMap::new();
    for picture in pictures.iter() {
        let colour: [u8; 3] = std::array::from_fn(|channel| picture[at + channel]);
        let (count, sums) = bins.entry(colour.map(|value| value / BIN)).or_default();
        *count += 1;
        sums.iter_mut().zip(colour).for_each(|(sum, value)| *sum += u32::from(value));
    }
    let most = bins.into_values().reduce(|most, other| if other.0 > most.0 { other } else { most });
    most.map_or([0.0; 3], |(count, sums)| sums.map(|sum| sum as f32 / count as f32))
}

/// The points that differ from the background. A picture without any gets its middle, so that there is a point to
/// look at.
pub(super) fn foreground(pictures: &Pictures, background: &[f32]) -> Foreground {
    let points: Vec<Vec<([f32; COLOUR_WIDTH], [f32; 2])>> =
        pictures.iter().map(|picture| points(picture, background, pictures.width, pictures.height)).collect();
    let n_points = points.iter().map(Vec::len).max().unwrap_or(1);
    let lengths = points.iter().map(Vec::len).collect();
    let nothing = ([0.0; COLOUR_WIDTH], [0.0; 2]);
    let padded = points.into_iter().flat_map(|points| {
        let missing = n_points - points.len();
        points.into_iter().chain(std::iter::repeat_n(nothing, missing))
    });
    let (colours, xy): (Vec<[f32; COLOUR_WIDTH]>, Vec<[f32; 2]>) = padded.unzip();
    Foreground { n_pictures: pictures.n, n_points, lengths, colours: colours.into_flattened(), xy }
}

fn points(picture: &[u8], background: &[f32], width: usize, height: usize) -> Vec<([f32; COLOUR_WIDTH], [f32; 2])> {
    let pixels = picture.as_chunks::<3>().0.iter().zip(background.as_chunks::<3>().0).enumerate();
    let differs = |colour: &[u8; 3], usual: &[f32; 3]| {
        colour.iter().zip(usual).any(|(&value, usual)| (f32::from(value) - usual).abs() > THRESHOLD)
    };
    let place = |idx: usize, size: usize| (idx as f32 + 0.5) / size as f32 * 2.0 - 1.0;
    let mut points: Vec<_> = pixels
        .filter(|(_, (colour, usual))| differs(colour, usual))
        .map(|(at, (&rgb, _))| (colour(rgb), [place(at % width, width), place(at / width, height)]))
        .collect();
    if points.is_empty() {
        points.push((colour([0; 3]), [0.0; 2]));
    }
    points
}

fn colour(rgb: [u8; 3]) -> [f32; COLOUR_WIDTH] {
    let [red, green, blue] = rgb.map(f32::from);
    let sum = red + green + blue;
    let share = |value: f32| SHARE_GAIN * value / (sum + 24.0);
    [share(red), share(green), share(blue), BRIGHTNESS_GAIN * sum / 765.0]
}

#[cfg(test)]
mod tests {
    use super::{background, foreground};
    use crate::model::pictures::Pictures;
    use crate::trace::GripperState;

    /// Two by two pixels: grey, but for one pixel.
    fn picture(at: usize, colour: [u8; 3]) -> Vec<u8> {
        (0..4).flat_map(|pixel| if pixel == at { colour } else { [100; 3] }).collect()
    }

    fn pictures() -> Pictures {
        let mut pictures = Pictures::of_size(2, 2);
        [(0, [200, 0, 0]), (0, [0, 200, 0]), (0, [0, 0, 200]), (3, [200, 0, 0]), (1, [100; 3]), (2, [100; 3])]
            .into_iter()
            .for_each(|(at, colour)| pictures.push(&picture(at, colour), GripperState::default()));
        pictures
    }

    #[test]
    fn the_background_is_what_a_pixel_mostly_shows() {
        assert_eq!(background(&pictures()), vec![100.0; 12]);
    }

    #[test]
    fn points_are_what_differs_with_places_in_the_picture() {
        let seen = foreground(&pictures(), &[100.0; 12]);
        assert_eq!((seen.n_pictures, seen.n_points), (6, 1));
        assert_eq!(seen.xy[0], [-0.5, -0.5]);
        assert_eq!(seen.xy[3], [0.5, 0.5]);
        assert_eq!(seen.xy[4], [0.0, 0.0]);
    }
}
