//! What a callee gets to see of its caller's window.
//!
//! # Source
//!
//! Paper, section IV: scoping labels from `h_j = [p; y_j; s]`. "NTP (no scope)" and the flat models have none.

use burn::module::Module;
use burn::tensor::Tensor;
use burn::tensor::activation::relu;

use crate::model::layers::Init;
use crate::model::linear::Linear;
use crate::trace::ScopingLabel;

/// The four scoping labels of each frame. One hidden layer: a linear softmax of the concatenation could not compare a
/// frame with the state.
#[derive(Module, Debug)]
pub struct ScopeHead {
    frame: Linear,
    context: Linear,
    labels: Linear,
}

impl ScopeHead {
    /// A fresh head for frames of `n_frame` and a context of `n_context` features.
    pub(crate) fn new(init: &mut Init, n_frame: usize, n_context: usize, n_hidden: usize) -> Self {
        Self {
            frame: init.part(n_frame, n_hidden, n_frame + n_context),
            context: init.linear(n_context, n_hidden),
            labels: init.linear(n_hidden, ScopingLabel::ALL.len()),
        }
    }

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
