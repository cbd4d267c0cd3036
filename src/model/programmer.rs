//! The networks that read a task specification: NTP, its GRU and unscoped forms, and the flat ones. They differ in
//! the types of their parts alone.
//!
//! # Source
//!
//! Paper, section IV, and its baselines in section V.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use crate::model::core_network::{Core, GruCore, Reactive};
use crate::model::decisions::Decisions;
use crate::model::encoder::{ArgumentDecoder as _, Encoder, Widths};
use crate::model::layers::{Init, repeat_row};
use crate::model::linear::Linear;
use crate::model::memory::ProgramMemory;
use crate::model::network::{CoreOutput, Given, Network};
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::scoping::{NoHierarchy, ScopeHead, Scoping, WholeSpecification};
use crate::model::windows::Windows;
use crate::program::Program;
use crate::seed::Seed;
use crate::trace::Span;

/// An encoder, a treatment of windows, a core and an argument decoder, put together.
///
/// # Shapes
///
/// Of every variant below, with the widths that its encoder gives:
///
/// ```text
/// windows of the specification, states [B, N]     ─► frames [B, T, frame], context [B, context], state [B, state]
/// context, program [B, program], state            ─► core: hidden [B, hidden] ─► programs [B, P], end [B, 1]
/// frames, program, view [B, view]                 ─► labels [B, T, 4]; `ntp` and `ntp_gru` alone
/// the specification, program, view or hidden      ─► slots [B, N]
/// ```
///
/// `view` is the state, or the hidden vector of a recurrent core, whose `B` steps of calls are packed as
/// [`Network`] says.
#[derive(Module, Debug)]
pub struct Programmer<E: Module, S: Module, C: Module, A: Module> {
    encoder: E,
    scope: S,
    core: C,
    key_and_end: Linear,
    memory: ProgramMemory,
    argument: A,
}

/// `ntp`: reactive, scoped.
pub type Ntp<E> = Programmer<E, ScopeHead, Reactive, <E as Encoder>::Argument>;
/// `ntp_gru`: recurrent, scoped.
pub type NtpGru<E> = Programmer<E, ScopeHead, GruCore, <E as Encoder>::Argument>;
/// `ntp_no_scope`: reactive, every program sees the whole specification.
pub type NtpNoScope<E> = Programmer<E, WholeSpecification, Reactive, <E as Encoder>::Argument>;
/// `flat`: reactive, primitives alone.
pub type Flat<E> = Programmer<E, NoHierarchy, Reactive, <E as Encoder>::Argument>;
/// `flat_gru`: recurrent, primitives alone.
pub type FlatGru<E> = Programmer<E, NoHierarchy, GruCore, <E as Encoder>::Argument>;

impl<E: Encoder, S: Scoping, C: Core> Programmer<E, S, C, E::Argument> {
    /// A fresh network for scenes of `n_slots` slots; the same seed gives the same parameters.
    pub fn new(config: &E::Config, n_slots: usize, seed: Seed, device: &Device) -> Self {
        Self::drawn(config, n_slots, &mut Init::new(seed, device))
    }

    /// The same with parameters drawn after others.
    pub(crate) fn drawn(config: &E::Config, n_slots: usize, init: &mut Init) -> Self {
        let widths = E::widths(config);
        let Widths { context, state, frame, program, core: layers } = &widths;
        let n_hidden = widths.hidden();
        let n_view = C::view_width(*state, n_hidden);
        Self {
            encoder: E::new(config, n_slots, init),
            scope: S::new(init, *frame, program + n_view, n_hidden),
            core: C::new(init, context + program + state, layers),
            key_and_end: init.linear(n_hidden, program + 1),
            memory: ProgramMemory::new(init, *program),
            argument: E::Argument::new(config, n_slots, n_view, init),
        }
    }

    /// The running program's embedding, a row each.
    fn program(&self, program: Program, n_rows: usize) -> Tensor<2> {
        repeat_row(self.memory.embedding(program), n_rows)
    }
}

impl<E: Encoder, S: Scoping, C: Core> Network for Programmer<E, S, C, E::Argument> {
    const DECISIONS: Decisions = S::DECISIONS;
    const IS_RECURRENT: bool = C::IS_RECURRENT;

    type Percepts = E::Percepts;
    type Demonstration = E::Demonstration;
    type Reading = E::Reading;
    type Recall = C::Recall;

    fn acquainted(mut self, sample: &PictureSample, seed: Seed) -> Self {
        self.encoder = self.encoder.acquainted(sample, seed);
        self
    }

    fn perceive(&self, pictures: &Pictures) -> E::Percepts {
        self.encoder.perceive(pictures)
    }

    fn demonstration(&self, windows: &Windows, percepts: &E::Percepts) -> E::Demonstration {
        self.encoder.demonstration(windows, percepts)
    }

    fn window(demonstration: &E::Demonstration, span: Span) -> E::Demonstration {
        E::window(demonstration, span)
    }

    fn read(
        &self,
        demonstration: &E::Demonstration,
        states: &[f32],
        percepts: &E::Percepts,
        _given: &[Given],
    ) -> E::Reading {
        self.encoder.read(demonstration, states, percepts)
    }

    fn core(
        &self,
        reading: &E::Reading,
        program: Program,
        steps: &[usize],
        recall: Option<C::Recall>,
    ) -> (CoreOutput, C::Recall) {
        let state = E::state(reading);
        let program = self.program(program, state.dims()[0]);
        let input = Tensor::cat(vec![E::context(reading), program, state], 1);
        let (hidden, recall) = self.core.run(input, steps, recall);
        (self.memory.decide(&self.key_and_end, hidden), recall)
    }

    fn scope(&self, reading: &E::Reading, program: Program, core: &CoreOutput) -> Option<Tensor<3>> {
        let view = C::view(E::state(reading), core.hidden.clone());
        let program = self.program(program, view.dims()[0]);
        self.scope.labels(E::frames(reading), Tensor::cat(vec![program, view], 1))
    }

    fn argument(&self, reading: &E::Reading, program: Program, core: &CoreOutput) -> Tensor<2> {
        let hidden = core.hidden.clone();
        let view = C::view(E::state(reading), hidden.clone());
        let program = self.program(program, view.dims()[0]);
        self.argument.forward(reading, program, view, hidden)
    }

    fn device(&self) -> Device {
        self.encoder.device()
    }
}
