//! The networks that read a task specification: NTP, its GRU and unscoped forms, and the flat ones. They differ in
//! the types of their parts alone.
//!
//! # Source
//!
//! Paper, section IV, and its baselines in section V.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use crate::model::core_network::{Core, GruCore, Reactive};
use crate::model::encoder::{ArgumentDecoder as _, Encoder, Widths};
use crate::model::layers::Init;
use crate::model::linear::Linear;
use crate::model::memory::ProgramMemory;
use crate::model::network::{CalledWith, CoreOutput, Network};
use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::running_programs::RunningPrograms;
use crate::model::scoping::ScopeHead;
use crate::model::scoping_kind::ScopingKind;
use crate::model::specification_rows::States;
use crate::model::windows::Windows;
use crate::seed::Seed;
use crate::trace::Span;

/// An encoder, a scoping, a core and an argument decoder, put together.
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
pub struct Programmer<E: Module, C: Module, A: Module> {
    encoder: E,
    /// Where callees are given a part of the specification.
    scope: Option<ScopeHead>,
    core: C,
    key_and_end: Linear,
    memory: ProgramMemory,
    argument: A,
    #[module(skip)]
    scoping: ScopingKind,
}

/// With a reactive core: `ntp`, `ntp_no_scope`, `flat`.
pub type Ntp<E> = Programmer<E, Reactive, <E as Encoder>::Argument>;
/// With a recurrent one: `ntp_gru`, `flat_gru`.
pub type NtpGru<E> = Programmer<E, GruCore, <E as Encoder>::Argument>;

impl<E: Encoder, C: Core> Programmer<E, C, E::Argument> {
    /// A fresh scoped network for scenes of `n_slots` slots; the same seed gives the same parameters.
    pub fn new(config: &E::Config, n_slots: usize, seed: Seed, device: &Device) -> Self {
        Self::drawn(ScopingKind::Scoped, config, n_slots, &mut Init::new(seed, device))
    }

    /// The same of a scoping that gives callees a specification, with parameters drawn after others.
    pub(crate) fn drawn(scoping: ScopingKind, config: &E::Config, n_slots: usize, init: &mut Init) -> Self {
        let widths = E::widths(config);
        let Widths { context, state, frame, program, core: layers } = &widths;
        let n_hidden = widths.hidden();
        let n_view = C::view_width(*state, n_hidden);
        Self {
            encoder: E::new(config, n_slots, init),
            scope: scoping.has_scopes().then(|| ScopeHead::new(init, *frame, program + n_view, n_hidden)),
            core: C::new(init, context + program + state, layers),
            key_and_end: init.linear(n_hidden, program + 1),
            memory: ProgramMemory::new(init, *program),
            argument: E::Argument::new(config, n_slots, n_view, init),
            scoping,
        }
    }
}

impl<E: Encoder, C: Core> Network for Programmer<E, C, E::Argument> {
    const IS_RECURRENT: bool = C::IS_RECURRENT;

    type Percepts = E::Percepts;
    type Demonstration = E::Demonstration;
    type Reading = E::Reading;
    type Recall = C::Recall;

    fn scoping(&self) -> ScopingKind {
        self.scoping
    }

    fn calibrated(mut self, sample: &PictureSample, seed: Seed) -> Result<Self, ReadError> {
        self.encoder = self.encoder.calibrated(sample, seed)?;
        Ok(self)
    }

    fn perceive(&self, pictures: &Pictures) -> Result<E::Percepts, ReadError> {
        self.encoder.perceive(pictures)
    }

    fn demonstration(&self, windows: &Windows, percepts: &E::Percepts) -> Result<E::Demonstration, ReadError> {
        self.encoder.demonstration(windows, percepts)
    }

    fn window(demonstration: &E::Demonstration, span: Span) -> E::Demonstration {
        E::window(demonstration, span)
    }

    fn read(
        &self,
        demonstration: &E::Demonstration,
        states: &States,
        percepts: &E::Percepts,
        _called_with: &[CalledWith],
    ) -> Result<E::Reading, ReadError> {
        self.encoder.read(demonstration, states, percepts)
    }

    fn core(
        &self,
        reading: &E::Reading,
        running: RunningPrograms<'_>,
        steps: &[usize],
        recall: Option<C::Recall>,
    ) -> (CoreOutput, C::Recall) {
        let state = E::state(reading);
        let program = self.memory.rows(running, state.dims()[0]);
        let input = Tensor::cat(vec![E::context(reading), program, state], 1);
        let (hidden, recall) = self.core.run(input, steps, recall);
        (self.memory.decide(&self.key_and_end, hidden), recall)
    }

    fn scope(&self, reading: &E::Reading, running: RunningPrograms<'_>, core: &CoreOutput) -> Option<Tensor<3>> {
        let view = C::view(E::state(reading), core.hidden.clone());
        let program = self.memory.rows(running, view.dims()[0]);
        let head = self.scope.as_ref()?;
        Some(head.forward(E::frames(reading), Tensor::cat(vec![program, view], 1)))
    }

    fn argument(&self, reading: &E::Reading, running: RunningPrograms<'_>, core: &CoreOutput) -> Tensor<2> {
        let hidden = core.hidden.clone();
        let view = C::view(E::state(reading), hidden.clone());
        let program = self.memory.rows(running, view.dims()[0]);
        self.argument.forward(reading, program, view, hidden)
    }

    fn device(&self) -> Device {
        self.encoder.device()
    }
}
