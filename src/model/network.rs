//! What training and the learned policy ask of a variant's network.

use burn::module::Module;
use burn::tensor::{Device, Tensor};

use crate::model::pictures::{PictureSample, Pictures};
use crate::model::read_error::ReadError;
use crate::model::running_programs::RunningPrograms;
use crate::model::scoping_kind::{MAX_ARGUMENTS, ScopingKind};
use crate::model::specification_rows::States;
use crate::model::windows::Windows;
use crate::scene::SlotIndex;
use crate::seed::Seed;
use crate::trace::{ObservationRows, Span};

/// What a running program was called with where there is no specification to tell it; other variants do not read it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CalledWith {
    /// For the root: which of the tasks that the model knows by name. `None` for any other.
    pub task: Option<usize>,
    /// The slots it was called with; none for the root.
    pub arguments: [Option<SlotIndex>; MAX_ARGUMENTS],
}

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

/// A variant's network.
///
/// A decision goes through four steps: what depends on the demonstration alone, then the reading of demonstration and
/// state together, the core's decision, and of scope and argument the one that the decision needs.
///
/// # Shapes
///
/// A batch holds the steps of one or more calls, packed: first the first step of every call, then the second of those
/// that have one, and so on; calls with more steps come first. `steps` says how many calls have each step, so it sums
/// to `B`. For a network without memory `[B]` will do.
pub trait Network: Module + Sync + 'static {
    /// Whether a decision depends on the steps before it in the same call.
    const IS_RECURRENT: bool;

    /// What is made of each picture by itself, so that decisions that share pictures share the work; nothing where
    /// observations are read.
    type Percepts: Clone + Send + Sync;
    /// What is computed of a demonstration before any state is seen. The policy keeps it for the whole episode.
    type Demonstration: Clone + Send + Sync;
    /// Demonstration and state, encoded.
    type Reading;
    /// What a running call remembers from one step to the next.
    type Recall: Clone + Send + Sync;

    /// What callees are given to see, and so what is decided.
    fn scoping(&self) -> ScopingKind;

    /// Finds the scene's colours and background before the first step of learning.
    ///
    /// # Errors
    ///
    /// [`ReadError`] when a tensor's numbers cannot be read.
    fn calibrated(self, _sample: &PictureSample, _seed: Seed) -> Result<Self, ReadError> {
        Ok(self)
    }

    /// Looks at pictures.
    ///
    /// # Errors
    ///
    /// [`ReadError`] when a tensor's numbers cannot be read.
    fn perceive(&self, pictures: &Pictures) -> Result<Self::Percepts, ReadError>;

    /// The observations that a detector found in the pictures, a row each; nothing where there is none.
    fn detected(_percepts: &Self::Percepts) -> Option<&ObservationRows> {
        None
    }

    /// The part that does not depend on the state: of every frame by itself, so that windows can be cut from it. With
    /// pictures a window says which of the percepts it shows.
    ///
    /// # Errors
    ///
    /// [`ReadError`] for windows of a form that it does not read.
    fn demonstration(&self, windows: &Windows, percepts: &Self::Percepts) -> Result<Self::Demonstration, ReadError>;

    /// The part of a single demonstration that a program may see.
    fn window(demonstration: &Self::Demonstration, span: Span) -> Self::Demonstration;

    /// Encodes the demonstration and the state beside it: one a window, and so is what each program was called with.
    ///
    /// # Errors
    ///
    /// [`ReadError`] for states that it does not read.
    fn read(
        &self,
        demonstration: &Self::Demonstration,
        states: &States,
        percepts: &Self::Percepts,
        called_with: &[CalledWith],
    ) -> Result<Self::Reading, ReadError>;

    /// The next program and the end of the running one; and what the calls of the last step remember. A call's first
    /// step remembers nothing.
    fn core(
        &self,
        reading: &Self::Reading,
        running: RunningPrograms<'_>,
        steps: &[usize],
        recall: Option<Self::Recall>,
    ) -> (CoreOutput, Self::Recall);

    /// Logits of the scoping labels, `[B, T, 4]`, arbitrary beyond a window; nothing where none are decided.
    fn scope(&self, reading: &Self::Reading, running: RunningPrograms<'_>, core: &CoreOutput) -> Option<Tensor<3>>;

    /// Logits over the slots, a row for each of a decision's arguments: `[B * arguments, N]`, see
    /// [`ScopingKind::n_arguments`].
    fn argument(&self, reading: &Self::Reading, running: RunningPrograms<'_>, core: &CoreOutput) -> Tensor<2>;

    /// Where the parameters are.
    fn device(&self) -> Device;
}
