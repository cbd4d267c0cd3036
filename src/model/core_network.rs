//! The core network: what a running program decides from, with or without a memory of its earlier steps.
//!
//! # Source
//!
//! Paper, section IV: `k, r = f_CN(c, p, s)`, reactive in NTP; NTP (GRU) and Flat (GRU) have a recurrent cell, and the
//! Neural Programmer-Interpreter an LSTM. A cell's state belongs to a program call.

use burn::module::{Module, ModuleDisplay};
use burn::tensor::activation::{sigmoid, tanh};
use burn::tensor::{Device, Tensor};

use crate::model::layers::{Init, Mlp};
use crate::model::linear::Linear;

/// What decides, from specification, program and state.
pub trait Core: Module + ModuleDisplay + Sync + 'static {
    /// Whether it remembers earlier steps of the same call.
    const IS_RECURRENT: bool;
    /// What a call remembers.
    type Recall: Clone + Send + Sync;

    /// A fresh core that reads `n_inputs` features and has layers of the given widths.
    fn new(init: &mut Init, n_inputs: usize, widths: &[usize]) -> Self;

    /// One hidden vector a step; and what the calls of the last step remember. For `steps` see [`super::Network`].
    ///
    /// # Shapes
    ///
    /// `[B, inputs]` → `[B, hidden]`
    fn run(&self, inputs: Tensor<2>, steps: &[usize], recall: Option<Self::Recall>) -> (Tensor<2>, Self::Recall);

    /// The width of [`Core::view`].
    fn view_width(n_state: usize, n_hidden: usize) -> usize;

    /// What the scoping head and the argument decoder take for the state, `[B, view]`.
    fn view(state: Tensor<2>, hidden: Tensor<2>) -> Tensor<2>;
}

/// The core without memory of its own: the same input always gives the same decision.
#[derive(Module, Debug)]
pub struct Reactive {
    hidden: Mlp,
}

impl Core for Reactive {
    const IS_RECURRENT: bool = false;
    type Recall = ();

    fn new(init: &mut Init, n_inputs: usize, widths: &[usize]) -> Self {
        Self { hidden: init.mlp_from(n_inputs, widths) }
    }

    fn run(&self, inputs: Tensor<2>, _steps: &[usize], _recall: Option<()>) -> (Tensor<2>, ()) {
        (self.hidden.forward(inputs), ())
    }

    fn view_width(n_state: usize, _n_hidden: usize) -> usize {
        n_state
    }

    fn view(state: Tensor<2>, _hidden: Tensor<2>) -> Tensor<2> {
        state
    }
}

/// A core with a cell that remembers; what it remembers stands for the state in the heads too.
#[derive(Module, Debug)]
pub struct Recurrent<G: Module> {
    features: Mlp,
    cell: G,
}

/// The core of the GRU variants.
pub type GruCore = Recurrent<Gru>;
/// The core of `npi`.
pub type LstmCore = Recurrent<Lstm>;

/// A recurrent cell.
pub trait Cell: Module + ModuleDisplay + Sync + 'static {
    /// What it remembers, with a row a call.
    type Recall: Clone + Send + Sync;

    /// A fresh cell.
    fn new(init: &mut Init, n_inputs: usize, n_hidden: usize) -> Self;

    /// What `n_calls` calls remember before their first step.
    fn nothing(&self, n_calls: usize, device: &Device) -> Self::Recall;

    /// What the first `n_calls` calls remember.
    fn first(recall: Self::Recall, n_calls: usize) -> Self::Recall;

    /// What the inputs of all steps give to the gates, which needs no memory: one product instead of one a step.
    ///
    /// # Shapes
    ///
    /// `[B, inputs]` → `[B, gates * hidden]`
    fn project(&self, inputs: Tensor<2>) -> Tensor<2>;

    /// One step of each call, by what its inputs give to the gates.
    fn step(&self, projected: Tensor<2>, recall: Self::Recall) -> Self::Recall;

    /// What it shows, `[B, hidden]`.
    fn hidden(recall: &Self::Recall) -> Tensor<2>;
}

impl<G: Cell> Core for Recurrent<G> {
    const IS_RECURRENT: bool = true;
    type Recall = G::Recall;

    fn new(init: &mut Init, n_inputs: usize, widths: &[usize]) -> Self {
        let n_hidden = widths.last().copied().unwrap_or_default();
        Self { features: init.mlp_from(n_inputs, widths), cell: G::new(init, n_hidden, n_hidden) }
    }

    fn run(&self, inputs: Tensor<2>, steps: &[usize], recall: Option<G::Recall>) -> (Tensor<2>, G::Recall) {
        let projected = self.cell.project(self.features.forward(inputs));
        let n_calls = steps.first().copied().unwrap_or_default();
        let mut recall = recall.unwrap_or_else(|| self.cell.nothing(n_calls, &projected.device()));
        let mut hidden = Vec::with_capacity(steps.len());
        let mut begin = 0;
        for &n_calls in steps {
            recall = self.cell.step(projected.clone().narrow(0, begin, n_calls), G::first(recall, n_calls));
            hidden.push(G::hidden(&recall));
            begin += n_calls;
        }
        (Tensor::cat(hidden, 0), recall)
    }

    fn view_width(_n_state: usize, n_hidden: usize) -> usize {
        n_hidden
    }

    fn view(_state: Tensor<2>, hidden: Tensor<2>) -> Tensor<2> {
        hidden
    }
}

/// A gated recurrent unit.
///
/// ```text
/// z = sigmoid(W_z x + U_z h)    r = sigmoid(W_r x + U_r h)
/// n = tanh(W_n x + r * U_n h)   h' = (1 - z) * n + z * h
/// ```
///
/// # Source
///
/// Cho et al., 2014, in the form that resets after the product. burn's own draws its parameters from a global
/// generator and pads its sequences.
#[derive(Module, Debug)]
pub struct Gru {
    /// z, r and n side by side.
    input: Linear,
    /// Likewise.
    recurrent: Linear,
}

impl Gru {
    /// A cell of given layers; both have three times as many outputs as there are hidden features.
    pub fn from_layers(input: Linear, recurrent: Linear) -> Self {
        Self { input, recurrent }
    }
}

impl Cell for Gru {
    type Recall = Tensor<2>;

    fn new(init: &mut Init, n_inputs: usize, n_hidden: usize) -> Self {
        Self { input: init.linear(n_inputs, 3 * n_hidden), recurrent: init.linear(n_hidden, 3 * n_hidden) }
    }

    fn nothing(&self, n_calls: usize, device: &Device) -> Tensor<2> {
        Tensor::zeros([n_calls, self.recurrent.n_inputs()], device)
    }

    fn first(recall: Tensor<2>, n_calls: usize) -> Tensor<2> {
        recall.narrow(0, 0, n_calls)
    }

    fn project(&self, inputs: Tensor<2>) -> Tensor<2> {
        self.input.forward(inputs)
    }

    fn step(&self, projected: Tensor<2>, recall: Tensor<2>) -> Tensor<2> {
        let recurrent = self.recurrent.forward(recall.clone());
        let n_hidden = recall.dims()[1];
        let part = |gates: &Tensor<2>, gate: usize| gates.clone().narrow(1, gate * n_hidden, n_hidden);
        let update = sigmoid(part(&projected, 0) + part(&recurrent, 0));
        let reset = sigmoid(part(&projected, 1) + part(&recurrent, 1));
        let new = tanh(part(&projected, 2) + reset * part(&recurrent, 2));
        new.clone() + update * (recall - new)
    }

    fn hidden(recall: &Tensor<2>) -> Tensor<2> {
        recall.clone()
    }
}

/// A long short-term memory.
///
/// ```text
/// i, f, o = sigmoid(W x + U h)   g = tanh(W_g x + U_g h)
/// c' = f * c + i * g             h' = o * tanh(c')
/// ```
///
/// # Source
///
/// Hochreiter and Schmidhuber, 1997, with a forget gate.
#[derive(Module, Debug)]
pub struct Lstm {
    /// i, f, o and g side by side.
    input: Linear,
    /// Likewise.
    recurrent: Linear,
}

impl Lstm {
    /// A cell of given layers; both have four times as many outputs as there are hidden features.
    pub fn from_layers(input: Linear, recurrent: Linear) -> Self {
        Self { input, recurrent }
    }
}

impl Cell for Lstm {
    /// h and c.
    type Recall = [Tensor<2>; 2];

    fn new(init: &mut Init, n_inputs: usize, n_hidden: usize) -> Self {
        Self { input: init.linear(n_inputs, 4 * n_hidden), recurrent: init.linear(n_hidden, 4 * n_hidden) }
    }

    fn nothing(&self, n_calls: usize, device: &Device) -> Self::Recall {
        let zeros = Tensor::zeros([n_calls, self.recurrent.n_inputs()], device);
        [zeros.clone(), zeros]
    }

    fn first(recall: Self::Recall, n_calls: usize) -> Self::Recall {
        recall.map(|rows| rows.narrow(0, 0, n_calls))
    }

    fn project(&self, inputs: Tensor<2>) -> Tensor<2> {
        self.input.forward(inputs)
    }

    fn step(&self, projected: Tensor<2>, [hidden, memory]: Self::Recall) -> Self::Recall {
        let n_hidden = memory.dims()[1];
        let gates = projected + self.recurrent.forward(hidden);
        let part = |gate: usize| gates.clone().narrow(1, gate * n_hidden, n_hidden);
        let memory = sigmoid(part(1)) * memory + sigmoid(part(0)) * tanh(part(3));
        [sigmoid(part(2)) * tanh(memory.clone()), memory]
    }

    fn hidden([hidden, _]: &Self::Recall) -> Tensor<2> {
        hidden.clone()
    }
}
