//! What a callee gets to see of its caller's window.
//!
//! # Source
//!
//! Paper, section IV: scoping labels from `h_j = [p; y_j; s]`. "NTP (no scope)" and the flat models have none.

use burn::module::{Module, ModuleDisplay};
use burn::tensor::Tensor;
use burn::tensor::activation::relu;

use crate::model::decisions::Decisions;
use crate::model::layers::Init;
use crate::model::linear::Linear;
use crate::trace::ScopingLabel;

/// How a variant treats windows.
pub trait Scoping: Module + ModuleDisplay + Sync + 'static {
    /// What is decided beside it.
    const DECISIONS: Decisions;

    /// A fresh head for frames of `n_frame` and a context of `n_context` features.
    fn new(init: &mut Init, n_frame: usize, n_context: usize, n_hidden: usize) -> Self;

    /// Logits of the scoping labels, if there are any; for shapes see [`ScopeHead::forward`].
    fn labels(&self, frames: Tensor<3>, context: Tensor<2>) -> Option<Tensor<3>>;
}

/// The four scoping labels of each frame. One hidden layer: a linear softmax of the concatenation could not compare a
/// frame with the state.
#[derive(Module, Debug)]
pub struct ScopeHead {
    frame: Linear,
    context: Linear,
    labels: Linear,
}

impl ScopeHead {
    /// A head of given layers; `frame` and `context` have equally many outputs, `labels` has four.
    pub fn from_layers(frame: Linear, context: Linear, labels: Linear) -> Self {
        Self { frame, context, labels }
    }

    /// # Shapes
    ///
    /// frames `[B, T, frame]`, context (program and state) `[B, context]` → logits `[B, T, 4]`
    pub fn forward(&self, frames: Tensor<3>, context: Tensor<2>) -> Tensor<3> {
        let context: Tensor<3> = self.context.forward(context).unsqueeze_dim(1); // [B, 1, hidden]
        self.labels.forward(relu(self.frame.forward(frames) + context))
    }
}

impl Scoping for ScopeHead {
    const DECISIONS: Decisions = Decisions::Scoped;

    fn new(init: &mut Init, n_frame: usize, n_context: usize, n_hidden: usize) -> Self {
        Self {
            frame: init.part(n_frame, n_hidden, n_frame + n_context),
            context: init.linear(n_context, n_hidden),
            labels: init.linear(n_hidden, ScopingLabel::ALL.len()),
        }
    }

    fn labels(&self, frames: Tensor<3>, context: Tensor<2>) -> Option<Tensor<3>> {
        Some(self.forward(frames, context))
    }
}

/// Every callee sees the whole specification.
#[derive(Module, Debug)]
pub struct WholeSpecification;

impl Scoping for WholeSpecification {
    const DECISIONS: Decisions = Decisions::Unscoped;

    fn new(_init: &mut Init, _n_frame: usize, _n_context: usize, _n_hidden: usize) -> Self {
        Self
    }

    fn labels(&self, _frames: Tensor<3>, _context: Tensor<2>) -> Option<Tensor<3>> {
        None
    }
}

/// There is no callee but primitives.
#[derive(Module, Debug)]
pub struct NoHierarchy;

impl Scoping for NoHierarchy {
    const DECISIONS: Decisions = Decisions::Primitives;

    fn new(_init: &mut Init, _n_frame: usize, _n_context: usize, _n_hidden: usize) -> Self {
        Self
    }

    fn labels(&self, _frames: Tensor<3>, _context: Tensor<2>) -> Option<Tensor<3>> {
        None
    }
}
