//! What a network is given to read: a task specification in one of its forms, and what is seen now.

use crate::model::pictures::PictureIndex;
use crate::model::read_error::ReadError;
use crate::trace::{ObservationRowMut, ObservationRows, SpecificationForm, Words};

/// A task specification, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub enum SpecificationRows {
    /// An observation for each frame.
    Observations(ObservationRows),
    /// Sentences, each as the numbers of its words.
    Sentences(Vec<Words>),
    /// Which of some pictures each frame shows.
    Pictures(Vec<PictureIndex>),
}

/// What is seen now, for one or more decisions.
#[derive(Clone, Debug, PartialEq)]
pub enum States {
    /// An observation for each.
    Observations(ObservationRows),
    /// Which of some pictures each sees.
    Pictures(Vec<PictureIndex>),
}

impl SpecificationRows {
    /// Frames or sentences.
    pub fn len(&self) -> usize {
        match self {
            Self::Observations(rows) => rows.len(),
            Self::Sentences(sentences) => sentences.len(),
            Self::Pictures(pictures) => pictures.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// In which form they are.
    pub fn form(&self) -> SpecificationForm {
        match self {
            Self::Observations(_) => SpecificationForm::Trajectories,
            Self::Sentences(_) => SpecificationForm::Instructions,
            Self::Pictures(_) => SpecificationForm::Video,
        }
    }

    /// The same with pictures that are counted from another one on.
    pub(crate) fn counted_from(self, first: u32) -> Self {
        match self {
            Self::Pictures(pictures) => Self::Pictures(counted_from(pictures, first)),
            other => other,
        }
    }

    /// Observations, to be changed; none in another form.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = ObservationRowMut<'_>> {
        let rows = match self {
            Self::Observations(rows) => Some(rows),
            Self::Sentences(_) | Self::Pictures(_) => None,
        };
        rows.into_iter().flat_map(ObservationRows::iter_mut)
    }

    /// Of a network that reads observations.
    ///
    /// # Errors
    ///
    /// [`ReadError::Form`] for another form.
    pub fn observations(&self) -> Result<&ObservationRows, ReadError> {
        match self {
            Self::Observations(rows) => Ok(rows),
            other => Err(ReadError::Form { found: other.form().name(), allowed: "trajectories" }),
        }
    }

    /// Of a network that reads sentences.
    ///
    /// # Errors
    ///
    /// As [`Self::observations`].
    pub fn sentences(&self) -> Result<&[Words], ReadError> {
        match self {
            Self::Sentences(sentences) => Ok(sentences),
            other => Err(ReadError::Form { found: other.form().name(), allowed: "instructions" }),
        }
    }

    /// Of a network that sees.
    ///
    /// # Errors
    ///
    /// As [`Self::observations`].
    pub fn pictures(&self) -> Result<&[PictureIndex], ReadError> {
        match self {
            Self::Pictures(pictures) => Ok(pictures),
            other => Err(ReadError::Form { found: other.form().name(), allowed: "video" }),
        }
    }
}

impl States {
    /// How many decisions they are for.
    pub fn len(&self) -> usize {
        match self {
            Self::Observations(rows) => rows.len(),
            Self::Pictures(pictures) => pictures.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// That of one decision.
    pub(crate) fn decision(&self, number: usize) -> Self {
        match self {
            Self::Observations(rows) => Self::Observations(rows.slice(number..number + 1)),
            Self::Pictures(pictures) => Self::Pictures(vec![pictures[number]]),
        }
    }

    /// The same with pictures that are counted from another one on.
    pub(crate) fn counted_from(self, first: u32) -> Self {
        match self {
            Self::Pictures(pictures) => Self::Pictures(counted_from(pictures, first)),
            observations @ Self::Observations(_) => observations,
        }
    }

    /// Of a network that reads observations.
    ///
    /// # Errors
    ///
    /// [`ReadError::Form`] for pictures.
    pub fn observations(&self) -> Result<&ObservationRows, ReadError> {
        match self {
            Self::Observations(rows) => Ok(rows),
            Self::Pictures(_) => Err(ReadError::Form { found: "pictures", allowed: "observations" }),
        }
    }

    /// Of a network that sees.
    ///
    /// # Errors
    ///
    /// [`ReadError::Form`] for observations.
    pub fn pictures(&self) -> Result<&[PictureIndex], ReadError> {
        match self {
            Self::Pictures(pictures) => Ok(pictures),
            Self::Observations(_) => Err(ReadError::Form { found: "observations", allowed: "pictures" }),
        }
    }

    /// Observations, to be changed; none where pictures are seen.
    pub(crate) fn iter_mut(&mut self) -> impl Iterator<Item = ObservationRowMut<'_>> {
        let rows = match self {
            Self::Observations(rows) => Some(rows),
            Self::Pictures(_) => None,
        };
        rows.into_iter().flat_map(ObservationRows::iter_mut)
    }

    /// All of some, one after another; of the first one's kind.
    ///
    /// # Errors
    ///
    /// [`ReadError::Form`] when one is of another kind.
    pub(crate) fn concat<'s>(states: impl Iterator<Item = &'s Self>) -> Result<Self, ReadError> {
        let mut all: Option<Self> = None;
        for state in states {
            match &mut all {
                None => all = Some(state.clone()),
                Some(Self::Observations(rows)) => rows.append(state.observations()?),
                Some(Self::Pictures(pictures)) => pictures.extend(state.pictures()?),
            }
        }
        Ok(all.unwrap_or_else(|| Self::Pictures(Vec::new())))
    }
}

fn counted_from(pictures: Vec<PictureIndex>, first: u32) -> Vec<PictureIndex> {
    pictures.into_iter().map(|picture| PictureIndex(picture.0 + first)).collect()
}
