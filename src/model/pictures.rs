//! What a network that sees is given to look at.

use burn::tensor::{Device, Tensor, TensorData};

/// Colour pictures of one size, side by side.
///
/// # Shapes
///
/// `rgb` is `[n, height, width, 3]`, a byte each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pictures {
    /// How many.
    pub n: usize,
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Row by row from the upper left corner.
    pub rgb: Vec<u8>,
}

/// Pictures of some trials, in the order in which they were taken.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PictureSample {
    /// Trial after trial.
    pub pictures: Pictures,
    /// How many pictures each trial has.
    pub lengths: Vec<usize>,
}

impl Pictures {
    /// None yet, of a size.
    pub fn of_size(width: usize, height: usize) -> Self {
        Self { n: 0, width, height, rgb: Vec::new() }
    }

    /// Adds one; nothing of another size is taken.
    pub fn push(&mut self, rgb: &[u8]) {
        debug_assert_eq!(rgb.len(), self.n_bytes(), "a picture of another size");
        self.rgb.extend_from_slice(rgb);
        self.n += 1;
    }

    /// Each by itself.
    pub fn iter(&self) -> impl Iterator<Item = &[u8]> {
        self.rgb.chunks_exact(self.n_bytes().max(1))
    }

    /// Values from -1 to 1 as convolutions take them: `[n, 3, height, width]`.
    pub(crate) fn to_tensor(&self, device: &Device) -> Tensor<4> {
        let values: Vec<f32> = self.rgb.iter().map(|&value| f32::from(value) / 127.5 - 1.0).collect();
        let shape = [self.n, self.height, self.width, 3];
        Tensor::<4>::from_data(TensorData::new(values, shape), device).permute([0, 3, 1, 2])
    }

    /// Bytes of one.
    pub fn n_bytes(&self) -> usize {
        self.width * self.height * 3
    }
}
