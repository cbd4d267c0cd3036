//! The windows that networks read: parts of specifications, padded to a batch.

use burn::tensor::{Device, Tensor, TensorData};

use crate::model::pictures::PictureIndex;
use crate::model::read_error::ReadError;
use crate::model::specification_rows::SpecificationRows;
use crate::trace::{ObservationRows, Words};

/// A score that no softmax lets through.
const HIDDEN_SCORE: f32 = 1e4;

/// A batch of specification windows, padded at their ends to the longest.
#[derive(Clone, Debug, PartialEq)]
pub struct Windows {
    n_slots: usize,
    n_frames: usize,
    lengths: Vec<usize>,
    /// `[windows * frames]`
    rows: SpecificationRows,
}

impl Windows {
    /// Stacks windows of scenes with `n_slots` slots, all of the first one's form.
    ///
    /// # Errors
    ///
    /// [`ReadError::Form`] when one is of another form.
    pub fn new(n_slots: usize, windows: &[&SpecificationRows]) -> Result<Self, ReadError> {
        let lengths: Vec<usize> = windows.iter().map(|window| window.len()).collect();
        let n_frames = lengths.iter().copied().max().unwrap_or(0);
        let rows = match windows.first() {
            None => SpecificationRows::Pictures(Vec::new()),
            Some(SpecificationRows::Observations(_)) => {
                let mut rows = ObservationRows::new(n_slots, Vec::new());
                for window in windows {
                    rows.append(window.observations()?);
                    (window.len()..n_frames).for_each(|_| rows.push_nothing());
                }
                SpecificationRows::Observations(rows)
            }
            Some(SpecificationRows::Sentences(_)) => {
                let windows = windows.iter().map(|window| window.sentences()).collect::<Result<Vec<_>, _>>()?;
                SpecificationRows::Sentences(padded(&windows, n_frames))
            }
            Some(SpecificationRows::Pictures(_)) => {
                let windows = windows.iter().map(|window| window.pictures()).collect::<Result<Vec<_>, _>>()?;
                SpecificationRows::Pictures(padded(&windows, n_frames))
            }
        };
        Ok(Self { n_slots, n_frames, lengths, rows })
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

    /// The same frames with observations in the place of the pictures that they show.
    pub(crate) fn with_observations(
        &self,
        rows: impl Fn(&[PictureIndex]) -> Result<ObservationRows, ReadError>,
    ) -> Result<Self, ReadError> {
        let shown = self.shown()?.into_iter().map(|pictures| Ok(SpecificationRows::Observations(rows(pictures)?)));
        let shown: Vec<SpecificationRows> = shown.collect::<Result<_, ReadError>>()?;
        Self::new(self.n_slots, &shown.iter().collect::<Vec<_>>())
    }

    /// Row by row, `[windows * frames]`; zeros beyond a window.
    pub(crate) fn observations(&self) -> Result<&ObservationRows, ReadError> {
        self.rows.observations()
    }

    /// The picture of each frame, `[windows * frames]`; the first beyond a window.
    pub(crate) fn pictures(&self) -> Result<&[PictureIndex], ReadError> {
        self.rows.pictures()
    }

    /// One of the windows, without padding.
    pub(crate) fn window(&self, number: usize) -> SpecificationRows {
        let length = self.lengths.get(number).copied().unwrap_or_default();
        let begin = number * self.n_frames;
        let frames = begin..begin + length;
        match &self.rows {
            SpecificationRows::Observations(rows) => SpecificationRows::Observations(rows.slice(frames)),
            SpecificationRows::Sentences(sentences) => SpecificationRows::Sentences(sentences[frames].to_vec()),
            SpecificationRows::Pictures(pictures) => SpecificationRows::Pictures(pictures[frames].to_vec()),
        }
    }

    /// The pictures that each window shows, without padding.
    pub(crate) fn shown(&self) -> Result<Vec<&[PictureIndex]>, ReadError> {
        let windows = self.pictures()?.chunks_exact(self.n_frames.max(1)).zip(&self.lengths);
        Ok(windows.map(|(pictures, &length)| &pictures[..length]).collect())
    }

    /// Which words of a vocabulary of `n_words` each sentence has: `[windows * frames, n_words]`.
    pub(crate) fn bags_of_words(&self, n_words: usize) -> Result<Vec<f32>, ReadError> {
        let sentences = self.rows.sentences()?;
        let mut bags = vec![0.0; sentences.len() * n_words];
        for (sentence, bag) in sentences.iter().zip(bags.chunks_exact_mut(n_words.max(1))) {
            fill_bag(sentence, bag);
        }
        Ok(bags)
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

/// Windows one after another, each with nothing behind it up to the longest.
fn padded<T: Copy + Default>(windows: &[&[T]], n_frames: usize) -> Vec<T> {
    let padding = |window: &[T]| std::iter::repeat_n(T::default(), n_frames - window.len());
    windows.iter().flat_map(|window| window.iter().copied().chain(padding(window))).collect()
}

/// One for each word of a sentence; the empty word is none.
fn fill_bag(sentence: &Words, bag: &mut [f32]) {
    for &word in sentence.iter().filter(|word| **word > 0) {
        if let Some(has) = bag.get_mut(usize::from(word)) {
            *has = 1.0;
        }
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
