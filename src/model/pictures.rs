//! What a network that sees is given to look at.

use std::borrow::Cow;

use burn::tensor::{Device, Int, Tensor, TensorData};

use crate::model::read_error::ReadError;
use crate::trace::GripperState;

/// Which of some pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PictureIndex(pub u32);

/// Colour pictures of one size, side by side.
///
/// Where several cameras look, a picture is what all of them see at one time, one below the other.
///
/// # Shapes
///
/// `rgb` is `[n, height, width, 3]`, a byte each; `grippers` is `[n]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pictures {
    /// How many.
    pub n: usize,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Row by row from the upper left corner.
    pub rgb: Vec<u8>,
    /// The robot's own state when each was taken, which it need not see. What a detector finds is told from there;
    /// networks that learn from end to end do without it.
    pub grippers: Vec<GripperState>,
}

/// Pictures of some trials, in the order in which they were taken.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PictureSample {
    /// Trial after trial.
    pub pictures: Pictures,
    /// How many pictures each trial has.
    pub lengths: Vec<usize>,
}

impl PictureSample {
    /// What one of `n_cameras` sees of it.
    pub(crate) fn of_camera(&self, camera: usize, n_cameras: usize) -> Self {
        let pictures = self.pictures.of_camera(camera, n_cameras).into_owned();
        Self { pictures, lengths: self.lengths.clone() }
    }
}

impl Pictures {
    /// None yet, of a size.
    pub fn of_size(width: usize, height: usize) -> Self {
        Self { n: 0, width, height, ..Self::default() }
    }

    /// Pixels across and down one that holds the pictures of several cameras, one below the other.
    pub(crate) fn size_of(cameras: impl Iterator<Item = [u32; 2]>) -> (usize, usize) {
        let sizes = cameras.map(|size| size.map(|pixels| pixels as usize));
        sizes.fold((0, 0), |(across, down), [width, height]| (across.max(width), down + height))
    }

    /// Adds one, taken by a robot in a state; all are of one size.
    pub fn push(&mut self, rgb: &[u8], gripper: GripperState) {
        debug_assert_eq!(rgb.len(), self.n_bytes(), "a picture of another size");
        self.rgb.extend_from_slice(rgb);
        self.grippers.push(gripper);
        self.n += 1;
    }

    /// What one of `n_cameras` sees, which are counted from 0 downwards.
    pub(crate) fn of_camera(&self, camera: usize, n_cameras: usize) -> Cow<'_, Self> {
        if n_cameras == 1 {
            return Cow::Borrowed(self);
        }
        let height = self.height / n_cameras;
        let n_bytes = self.width * height * 3;
        let seen = self.iter().filter_map(|picture| picture.get(camera * n_bytes..(camera + 1) * n_bytes));
        let rgb = seen.flatten().copied().collect();
        Cow::Owned(Self { n: self.n, width: self.width, height, rgb, grippers: self.grippers.clone() })
    }

    /// Adds others of the same size; the first ones bring it.
    pub(crate) fn append(&mut self, others: Self) {
        let Self { n, width, height, rgb, grippers } = others;
        (self.width, self.height) = (width, height);
        self.n += n;
        self.rgb.extend(rgb);
        self.grippers.extend(grippers);
    }

    /// Each by itself.
    pub fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.rgb.chunks_exact(self.n_bytes().max(1))
    }

    /// Values from -1 to 1 as convolutions take them: `[n, height, width, 3]`.
    pub(crate) fn to_tensor(&self, device: &Device) -> Tensor<4> {
        let values: Vec<f32> = self.rgb.iter().map(|&value| f32::from(value) / 127.5 - 1.0).collect();
        let shape = [self.n, self.height, self.width, 3];
        Tensor::from_data(TensorData::new(values, shape), device)
    }

    /// The same with a fourth channel: brightness against its surroundings, in their deviations. What is written on a
    /// thing looks alike there in any colour and light. `[n, height, width, 4]`
    pub(crate) fn to_contrast_tensor(&self, device: &Device) -> Tensor<4> {
        let contrasts: Vec<f32> =
            self.iter().flat_map(|picture| contrasts(&brightness(picture), self.width, self.height)).collect();
        let shape = [self.n, self.height, self.width, 1];
        let contrasts = Tensor::<4>::from_data(TensorData::new(contrasts, shape), device);
        Tensor::cat(vec![self.to_tensor(device), contrasts], 3)
    }

    /// Bytes of one.
    pub fn n_bytes(&self) -> usize {
        self.width * self.height * 3
    }
}

/// Rows of percepts by the pictures that they are of.
///
/// # Errors
///
/// [`ReadError::Picture`] for one beyond the `n_pictures` that were shown.
pub(crate) fn picked(
    pictures: &[PictureIndex],
    n_pictures: usize,
    device: &Device,
) -> Result<Tensor<1, Int>, ReadError> {
    if let Some(beyond) = pictures.iter().find(|picture| picture.0 as usize >= n_pictures) {
        return Err(ReadError::Picture { found: beyond.0, n: n_pictures });
    }
    let numbers: Vec<i32> = pictures.iter().map(|picture| picture.0 as i32).collect();
    let n = numbers.len();
    Ok(Tensor::from_data(TensorData::new(numbers, [n]), device))
}

/// Mean of the channels, 0 to 1.
fn brightness(rgb: &[u8]) -> Vec<f32> {
    rgb.as_chunks::<3>().0.iter().map(|rgb| rgb.iter().map(|&value| f32::from(value)).sum::<f32>() / 765.0).collect()
}

/// Pixels to each side that are the surroundings of one.
const REACH: usize = 4;
/// Deviation, of 0 to 1, below which surroundings count as even.
const EVEN: f32 = 0.02;

/// How far each value is above the mean of its surroundings, in their deviations.
fn contrasts(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    let squares: Vec<f32> = values.iter().map(|value| value * value).collect();
    let (means, squares) = (box_means(values, width, height), box_means(&squares, width, height));
    let contrast =
        |((value, mean), square): ((&f32, f32), f32)| (value - mean) / ((square - mean * mean).max(0.0).sqrt() + EVEN);
    values.iter().zip(means).zip(squares).map(contrast).collect()
}

/// Means over the square about each value, as far as it lies in the picture: rows first, then columns.
fn box_means(values: &[f32], width: usize, height: usize) -> Vec<f32> {
    let around = |at: usize, size: usize| at.saturating_sub(REACH)..(at + REACH + 1).min(size);
    let mean = |values: &mut dyn Iterator<Item = f32>, n: usize| values.sum::<f32>() / n as f32;
    let rows: Vec<f32> = (0..width * height)
        .map(|at| {
            let (columns, row) = (around(at % width, width), at / width * width);
            mean(&mut values[row + columns.start..row + columns.end].iter().copied(), columns.len())
        })
        .collect();
    let column = |at: usize| {
        let lines = around(at / width, height);
        let n_lines = lines.len();
        mean(&mut lines.map(|line| rows[line * width + at % width]), n_lines)
    };
    (0..width * height).map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::{Pictures, box_means, contrasts};
    use crate::trace::GripperState;

    #[test]
    fn each_camera_sees_its_part_of_a_picture() {
        let mut pictures = Pictures::of_size(1, 2);
        pictures.push(&[1, 2, 3, 4, 5, 6], GripperState { in_world_m: [0.0; 3], closed: false });
        pictures.push(&[7, 8, 9, 10, 11, 12], GripperState { in_world_m: [0.1; 3], closed: true });
        let lower = pictures.of_camera(1, 2);
        assert_eq!((lower.n, lower.width, lower.height), (2, 1, 1));
        assert_eq!(lower.rgb, [4, 5, 6, 10, 11, 12]);
        assert_eq!(lower.grippers, pictures.grippers);
        assert_eq!(*pictures.of_camera(0, 1), pictures);
    }

    #[test]
    fn a_mean_is_over_what_lies_in_the_picture() {
        let values: Vec<f32> = (0..12).map(|value| value as f32).collect();
        // Six columns, two rows: the first value's surroundings are five columns of both rows.
        assert_eq!(box_means(&values, 6, 2)[0], (2.0 + 8.0) / 2.0);
        assert_eq!(box_means(&values, 6, 2)[5], (3.0 + 9.0) / 2.0);
    }

    #[test]
    fn contrast_is_the_same_in_any_light_and_nothing_on_even_ground() {
        let written: Vec<f32> = (0..400).map(|at| if at % 20 == 10 { 0.2 } else { 0.6 }).collect();
        let darker: Vec<f32> = written.iter().map(|value| value * 0.7).collect();
        let pairs = contrasts(&written, 20, 20).into_iter().zip(contrasts(&darker, 20, 20));
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 0.25));
        assert!(contrasts(&written, 20, 20)[10] < -1.5);
        assert!(contrasts(&[0.4; 100], 10, 10).into_iter().all(|contrast| contrast.abs() < 1e-3));
    }
}
