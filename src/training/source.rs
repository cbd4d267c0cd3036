//! What is learned from: trials in memory, or a buffer that goes through those on disk.
//!
//! # Invariants
//!
//! Trials that are in memory are all there in every step, as they always were.

use crate::dataset::DatasetTrials;
use crate::seed::Seed;
use crate::training::TrainError;
use crate::training::facts::{Facts, facts_of};
use crate::training::seen::{Galleries, Gallery};
use crate::training::stream::{Buffer, TrialStream};

/// Steps between two shards: reading one then takes about a twentieth of the time.
const ROUND_STEPS: u32 = 200;
/// What is learned from.
#[derive(Clone, Copy)]
pub enum Source<'s> {
    /// All trials, and the pictures of their frames for a variant that sees.
    Here(&'s DatasetTrials, Option<&'s dyn Gallery>),
    /// A buffer of trials on disk, and who finds pictures.
    Streamed(&'s TrialStream, Option<&'s dyn Galleries>),
}

impl Source<'_> {
    /// What is known of all trials.
    ///
    /// # Errors
    ///
    /// [`TrainError`] when there is none.
    pub(super) fn facts(&self) -> Result<Facts, TrainError> {
        match self {
            Self::Here(data, _) => facts_of(data),
            Self::Streamed(stream, _) => Ok(stream.facts.clone()),
        }
    }

    /// Pixels across and down each picture; nothing without pictures.
    pub(super) fn picture_size(&self) -> Option<(usize, usize)> {
        match self {
            Self::Here(_, gallery) => gallery.map(Gallery::size),
            Self::Streamed(_, galleries) => galleries.map(Galleries::size),
        }
    }

    /// The names of the cameras that took them.
    pub(super) fn cameras(&self) -> Vec<String> {
        match self {
            Self::Here(_, gallery) => gallery.map(Gallery::cameras).unwrap_or_default(),
            Self::Streamed(_, galleries) => galleries.map(Galleries::cameras).unwrap_or_default(),
        }
    }

    /// The same for a variant that does not see.
    pub(super) fn without_pictures(self) -> Self {
        match self {
            Self::Here(data, _) => Self::Here(data, None),
            Self::Streamed(stream, _) => Self::Streamed(stream, None),
        }
    }
}

/// What is in memory now.
pub(super) enum Held<'s> {
    Here(&'s DatasetTrials, Option<&'s dyn Gallery>),
    Streamed { stream: &'s TrialStream, galleries: Option<&'s dyn Galleries>, buffer: Buffer },
}

impl<'s> Held<'s> {
    pub(super) fn of(source: Source<'s>) -> Self {
        match source {
            Source::Here(data, gallery) => Self::Here(data, gallery),
            Source::Streamed(stream, galleries) => {
                Self::Streamed { stream, galleries, buffer: Buffer::new(stream.n_slots()) }
            }
        }
    }

    /// Makes sure that what a step draws from is in memory; gives the step at which something else will be.
    pub(super) fn turn_to(self, step: u32, seed: Seed) -> Result<(Self, u32), TrainError> {
        match self {
            Self::Here(..) => Ok((self, u32::MAX)),
            Self::Streamed { stream, galleries, buffer } => {
                let round = step / ROUND_STEPS;
                let buffer = buffer.turned(stream, u64::from(round), seed)?;
                Ok((Self::Streamed { stream, galleries, buffer }, (round + 1).saturating_mul(ROUND_STEPS)))
            }
        }
    }

    pub(super) fn data(&self) -> &DatasetTrials {
        match self {
            Self::Here(data, _) => data,
            Self::Streamed { buffer, .. } => &buffer.data,
        }
    }

    /// The pictures of these trials, where they are looked at.
    pub(super) fn gallery(&self) -> Result<Option<Pictured<'_>>, TrainError> {
        match self {
            Self::Here(_, gallery) => Ok(gallery.map(Pictured::Here)),
            Self::Streamed { galleries: None, .. } => Ok(None),
            Self::Streamed { galleries: Some(galleries), buffer, .. } => {
                Ok(Some(Pictured::Opened(galleries.open(&buffer.data)?)))
            }
        }
    }
}

/// A gallery, whoever has it.
pub(super) enum Pictured<'g> {
    Here(&'g dyn Gallery),
    Opened(Box<dyn Gallery>),
}

impl Pictured<'_> {
    pub(super) fn as_gallery(&self) -> &dyn Gallery {
        match self {
            Self::Here(gallery) => *gallery,
            Self::Opened(gallery) => gallery.as_ref(),
        }
    }
}
