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

use crate::model::decisions::Decisions;
use crate::model::detector::{self, Detector};
use crate::model::network::{CoreOutput, Given, Network};
use crate::model::pictures::Pictures;
use crate::model::windows::Windows;
use crate::program::Program;
use crate::trace::{Observation, Span};

/// A detector and a network behind it.
#[derive(Module, Debug)]
pub struct Detecting<D: Module, N: Module> {
    detector: D,
    programmer: N,
    n_slots: usize,
}

/// Observation rows of pictures, as detected.
#[derive(Clone, Debug)]
pub struct Detections {
    width: usize,
    rows: Vec<f32>,
}

impl Detections {
    /// The rows of some pictures, one after the other.
    fn of(&self, pictures: &[f32]) -> Vec<f32> {
        let row =
            |&picture: &f32| self.rows.get(picture as usize * self.width..).and_then(|rows| rows.get(..self.width));
        pictures.iter().filter_map(row).flatten().copied().collect()
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

/// Observation rows of pictures: what a detector finds in them, relative to the grippers beside them: `[F, 3 N + 2]` in
/// metres.
pub fn detected_rows<D: Detector>(detector: &D, pictures: &Pictures) -> Vec<f32> {
    if pictures.n > 0 { detector::rows(detector.detect(pictures), &pictures.grippers) } else { Vec::new() }
}

impl<D: Detector, N: Network<Percepts = ()> + ModuleDisplay> Network for Detecting<D, N> {
    const DECISIONS: Decisions = N::DECISIONS;
    const IS_RECURRENT: bool = N::IS_RECURRENT;

    type Percepts = Detections;
    type Demonstration = N::Demonstration;
    type Reading = N::Reading;
    type Recall = N::Recall;

    fn perceive(&self, pictures: &Pictures) -> Detections {
        Detections { width: Observation::width(self.n_slots), rows: detected_rows(&self.detector, pictures) }
    }

    fn detected(percepts: &Detections) -> Option<&[f32]> {
        Some(&percepts.rows)
    }

    fn demonstration(&self, windows: &Windows, percepts: &Detections) -> N::Demonstration {
        let detected = windows.with_rows(percepts.width, |pictures| percepts.of(pictures));
        self.programmer.demonstration(&detected, &())
    }

    fn window(demonstration: &N::Demonstration, span: Span) -> N::Demonstration {
        N::window(demonstration, span)
    }

    fn read(
        &self,
        demonstration: &N::Demonstration,
        states: &[f32],
        percepts: &Detections,
        given: &[Given],
    ) -> N::Reading {
        self.programmer.read(demonstration, &percepts.of(states), &(), given)
    }

    fn core(
        &self,
        reading: &N::Reading,
        program: Program,
        steps: &[usize],
        recall: Option<N::Recall>,
    ) -> (CoreOutput, N::Recall) {
        self.programmer.core(reading, program, steps, recall)
    }

    fn scope(&self, reading: &N::Reading, program: Program, core: &CoreOutput) -> Option<Tensor<3>> {
        self.programmer.scope(reading, program, core)
    }

    fn argument(&self, reading: &N::Reading, program: Program, core: &CoreOutput) -> Tensor<2> {
        self.programmer.argument(reading, program, core)
    }

    fn device(&self) -> Device {
        self.programmer.device()
    }
}
