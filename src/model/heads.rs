//! What every variant decides by: the reactive core and the scoping head.
//!
//! # Source
//!
//! Paper, section IV: `k, r = f_CN(c, p, s)`; scoping labels from `h_j = [p; y_j; s]`.

use burn::module::Module;
use burn::nn::Linear;
use burn::tensor::Tensor;
use burn::tensor::activation::relu;

use crate::model::layers::{Init, Mlp};
use crate::model::memory::ProgramMemory;
use crate::trace::ScopingLabel;

/// What the core decides.
#[derive(Clone, Debug)]
pub struct CoreOutput {
    /// Logits of the next program, `[B, programs]`.
    pub programs: Tensor<2>,
    /// Logit of the end of the running program, `[B, 1]`.
    pub end: Tensor<2>,
    /// What it decided from, `[B, hidden]`.
    pub hidden: Tensor<2>,
}

/// The core network without memory of its own: the same input always gives the same decision.
#[derive(Module, Debug)]
pub(crate) struct ReactiveCore {
    hidden: Mlp,
    key_and_end: Linear,
}

impl ReactiveCore {
    pub(crate) fn new(init: &mut Init, widths: &[usize], n_key: usize) -> Self {
        let n_hidden = widths.last().copied().unwrap_or_default();
        Self { hidden: init.mlp(widths), key_and_end: init.linear(n_hidden, n_key + 1) }
    }

    /// # Shapes
    ///
    /// `[B, context + program + state]`
    pub(crate) fn forward(&self, input: Tensor<2>, memory: &ProgramMemory) -> CoreOutput {
        let hidden = self.hidden.forward(input);
        let output = self.key_and_end.forward(hidden.clone());
        let n_key = output.dims()[1] - 1;
        let programs = memory.address(output.clone().narrow(1, 0, n_key));
        CoreOutput { programs, end: output.narrow(1, n_key, 1), hidden }
    }
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
