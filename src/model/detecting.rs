//! A detector before a network that reads positions: NTPVID (Detector).
//!
//! # Invariants
//!
//! The two learn apart: first the detector, then the network behind it on what the finished detector finds. No gradient
//! of a decision reaches the detector, none of a position the network behind it.
//!
//! # Source
//!
//! Paper, section V-D.

use burn::module::{Module, ModuleDisplay};
use burn::tensor::{Device, Tensor};

use crate::model::detector::{self, Detector};
use crate::model::network::{CalledWith, CoreOutput, Network};
use crate::model::pictures::{PictureIndex, Pictures};
use crate::model::read_error::ReadError;
use crate::model::running_programs::RunningPrograms;
use crate::model::scoping_kind::ScopingKind;
use crate::model::specification_rows::States;
use crate::model::windows::Windows;
use crate::trace::{ObservationRows, Span};

/// A detector and a network behind it.
#[derive(Module, Debug)]
pub struct Detecting<D: Module, N: Module> {
    detector: D,
    programmer: N,
    n_slots: usize,
}

/// Observations of pictures, as detected: a row each.
#[derive(Clone, Debug)]
pub struct Detections(ObservationRows);

impl Detections {
    /// The rows of some pictures, one after the other.
    fn of(&self, pictures: &[PictureIndex]) -> Result<ObservationRows, ReadError> {
        let mut rows = ObservationRows::new(self.0.n_slots(), Vec::new());
        for &PictureIndex(picture) in pictures {
            let at = picture as usize;
            if at >= self.0.len() {
                return Err(ReadError::Picture { found: picture, n: self.0.len() });
            }
            rows.append(&self.0.slice(at..at + 1));
        }
        Ok(rows)
    }
}

impl<D: Detector, N: Network<Percepts = ()>> Detecting<D, N> {
    /// Both together, for scenes of `n_slots` slots.
    pub fn new(detector: D, programmer: N, n_slots: usize) -> Self {
        Self { detector, programmer, n_slots }
    }

    /// Each by itself.
    pub fn into_parts(self) -> (D, N) {
        (self.detector, self.programmer)
    }
}

/// Observations of pictures: what a detector for `n_slots` slots finds in them, relative to the grippers beside them.
///
/// # Errors
///
/// [`ReadError`] when a tensor's numbers cannot be read.
pub fn detected_rows<D: Detector>(
    detector: &D,
    pictures: &Pictures,
    n_slots: usize,
) -> Result<ObservationRows, ReadError> {
    if pictures.n == 0 {
        return Ok(ObservationRows::new(n_slots, Vec::new()));
    }
    Ok(detector::rows(detector.detect(pictures)?, &pictures.grippers)?)
}

impl<D: Detector, N: Network<Percepts = ()> + ModuleDisplay> Network for Detecting<D, N> {
    const IS_RECURRENT: bool = N::IS_RECURRENT;

    type Percepts = Detections;
    type Demonstration = N::Demonstration;
    type Reading = N::Reading;
    type Recall = N::Recall;

    fn scoping(&self) -> ScopingKind {
        self.programmer.scoping()
    }

    fn perceive(&self, pictures: &Pictures) -> Result<Detections, ReadError> {
        Ok(Detections(detected_rows(&self.detector, pictures, self.n_slots)?))
    }

    fn detected(percepts: &Detections) -> Option<&ObservationRows> {
        Some(&percepts.0)
    }

    fn demonstration(&self, windows: &Windows, percepts: &Detections) -> Result<N::Demonstration, ReadError> {
        let detected = windows.with_observations(|pictures| percepts.of(pictures))?;
        self.programmer.demonstration(&detected, &())
    }

    fn window(demonstration: &N::Demonstration, span: Span) -> N::Demonstration {
        N::window(demonstration, span)
    }

    fn read(
        &self,
        demonstration: &N::Demonstration,
        states: &States,
        percepts: &Detections,
        called_with: &[CalledWith],
    ) -> Result<N::Reading, ReadError> {
        let states = States::Observations(percepts.of(states.pictures()?)?);
        self.programmer.read(demonstration, &states, &(), called_with)
    }

    fn core(
        &self,
        reading: &N::Reading,
        running: RunningPrograms<'_>,
        steps: &[usize],
        recall: Option<N::Recall>,
    ) -> (CoreOutput, N::Recall) {
        self.programmer.core(reading, running, steps, recall)
    }

    fn scope(&self, reading: &N::Reading, running: RunningPrograms<'_>, core: &CoreOutput) -> Option<Tensor<3>> {
        self.programmer.scope(reading, running, core)
    }

    fn argument(&self, reading: &N::Reading, running: RunningPrograms<'_>, core: &CoreOutput) -> Tensor<2> {
        self.programmer.argument(reading, running, core)
    }

    fn device(&self) -> Device {
        self.programmer.device()
    }
}
