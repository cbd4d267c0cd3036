//! The windows that networks read: parts of specifications, padded to a batch.

use burn::tensor::{Device, Tensor, TensorData};

use crate::model::features::Rows;
use crate::trace::{MAX_WORDS, Observation};

/// A score that no softmax lets through.
const HIDDEN_SCORE: f32 = 1e4;

/// A batch of specification windows, padded at their ends to the longest.
#[derive(Clone, Debug, PartialEq)]
pub struct Windows {
    n_slots: usize,
    n_frames: usize,
    lengths: Vec<usize>,
    rows: Vec<f32>,
}

impl Windows {
    /// Stacks windows, each of observation rows of `n_slots` slots.
    pub fn new(n_slots: usize, windows: &[&[f32]]) -> Self {
        Self::stack(n_slots, Observation::width(n_slots), windows)
    }

    fn stack(n_slots: usize, width: usize, windows: &[&[f32]]) -> Self {
        let lengths: Vec<usize> = windows.iter().map(|window| window.len() / width).collect();
        let n_frames = lengths.iter().copied().max().unwrap_or(0);
        let mut rows = vec![0.0; windows.len() * n_frames * width];
        for (window, padded) in windows.iter().zip(rows.chunks_exact_mut((n_frames * width).max(1))) {
            padded[..window.len()].copy_from_slice(window);
        }
        Self { n_slots, n_frames, lengths, rows }
    }

    /// How many windows.
    pub fn n_windows(&self) -> usize {
        self.lengths.len()
    }

    /// Frames of the longest window.
    pub fn n_frames(&self) -> usize {
        self.n_frames
    }

    /// Slots of each observation.
    pub fn n_slots(&self) -> usize {
        self.n_slots
    }

    /// Stacks windows of instructions: rows of [`crate::trace::Words`], as numbers.
    pub fn of_instructions(n_slots: usize, windows: &[&[f32]]) -> Self {
        Self::stack(n_slots, MAX_WORDS, windows)
    }

    /// Stacks windows of a video: rows of one number each, which says which of some percepts the frame shows.
    pub fn of_pictures(n_slots: usize, windows: &[&[f32]]) -> Self {
        Self::stack(n_slots, 1, windows)
    }

    /// The same frames with other rows for the pictures that they show.
    pub(crate) fn with_rows(&self, width: usize, rows: impl Fn(&[f32]) -> Vec<f32>) -> Self {
        let windows = self.rows.chunks_exact(self.n_frames.max(1)).zip(&self.lengths);
        let shown: Vec<Vec<f32>> = windows.map(|(pictures, &length)| rows(&pictures[..length])).collect();
        let slices: Vec<&[f32]> = shown.iter().map(Vec::as_slice).collect();
        Self::stack(self.n_slots, width, &slices)
    }

    /// The number of each frame's picture, `[windows * frames]`; zero beyond a window.
    pub(crate) fn picture_rows(&self) -> &[f32] {
        &self.rows
    }

    /// The numbers of the pictures that each window shows, without padding.
    pub(crate) fn pictures(&self) -> Vec<Vec<i32>> {
        let windows = self.rows.chunks_exact(self.n_frames.max(1)).zip(&self.lengths);
        windows.map(|(rows, &length)| rows[..length].iter().map(|&row| row as i32).collect()).collect()
    }

    /// Which words of a vocabulary of `n_words` each sentence has: `[windows * frames, n_words]`.
    pub(crate) fn bags_of_words(&self, n_words: usize) -> Vec<f32> {
        let mut bags = vec![0.0; self.rows.len() / MAX_WORDS * n_words];
        for (sentence, bag) in self.rows.chunks_exact(MAX_WORDS).zip(bags.chunks_exact_mut(n_words)) {
            for &word in sentence.iter().filter(|word| **word > 0.0) {
                if let Some(has) = bag.get_mut(word as usize) {
                    *has = 1.0;
                }
            }
        }
        bags
    }

    pub(crate) fn rows(&self) -> Rows<'_> {
        Rows { n_slots: self.n_slots, values: &self.rows }
    }

    /// The masks; nothing when no window is padded.
    pub(crate) fn padding(&self, device: &Device) -> Option<Padding> {
        let padded = self.lengths.iter().any(|&length| length != self.n_frames);
        padded.then(|| {
            let column = |wanted: fn(usize, usize) -> bool| {
                let frames = self.lengths.iter().flat_map(|&length| (0..self.n_frames).map(move |t| (t, length)));
                let values: Vec<f32> = frames.map(|(t, length)| f32::from(u8::from(wanted(t, length)))).collect();
                Tensor::from_data(TensorData::new(values, [self.n_windows(), self.n_frames, 1]), device)
            };
            Padding { valid: column(|t, length| t < length), last: column(|t, length| t + 1 == length) }
        })
    }
}

/// Which frames of padded windows count.
#[derive(Clone, Debug)]
pub(crate) struct Padding {
    /// One within the window, `[B, T, 1]`.
    valid: Tensor<3>,
    /// One at the window's last frame, `[B, T, 1]`.
    last: Tensor<3>,
}

impl Padding {
    /// Zero beyond the window.
    pub(crate) fn mask(padding: Option<&Self>, frames: Tensor<3>) -> Tensor<3> {
        match padding {
            Some(padding) => frames * padding.valid.clone(),
            None => frames,
        }
    }

    /// Zero beyond the window; objects have a dimension of their own.
    pub(crate) fn mask_objects(padding: Option<&Self>, objects: Tensor<4>) -> Tensor<4> {
        match padding {
            Some(padding) => objects * padding.valid.clone().unsqueeze_dim(3),
            None => objects,
        }
    }

    /// Far below zero beyond the window, for a softmax over frames.
    pub(crate) fn hide(padding: Option<&Self>, scores: Tensor<3>) -> Tensor<3> {
        match padding {
            Some(padding) => scores + (padding.valid.clone() - 1.0) * HIDDEN_SCORE,
            None => scores,
        }
    }

    /// The window's last frame: `[B, T, H]` → `[B, H]`.
    pub(crate) fn last_frame(padding: Option<&Self>, frames: Tensor<3>) -> Tensor<2> {
        match padding {
            Some(padding) => (frames * padding.last.clone()).sum_dim(1).squeeze_dim(1),
            None => {
                let n_frames = frames.dims()[1];
                frames.narrow(1, n_frames - 1, 1).squeeze_dim(1)
            }
        }
    }

    /// The window's last frame: `[B, T, N, H]` → `[B, N, H]`.
    pub(crate) fn last_objects(padding: Option<&Self>, objects: Tensor<4>) -> Tensor<3> {
        match padding {
            Some(padding) => (objects * padding.last.clone().unsqueeze_dim(3)).sum_dim(1).squeeze_dim(1),
            None => {
                let n_frames = objects.dims()[1];
                objects.narrow(1, n_frames - 1, 1).squeeze_dim(1)
            }
        }
    }
}
