//! What the interpreter asks and what a policy answers.

use std::sync::Arc;

use crate::model::{PictureIndex, Pictures, ReadError, ScopingKind, SpecificationRows};
use crate::program::Program;
use crate::scene::SlotIndex;
use crate::trace::{Episode, Observation, ObservationRows, Prediction, Span, SpecificationForm, instructions};
use crate::words::counted;

/// A task specification as a policy sees it: a demonstration's boundary observations, or its instructions.
#[derive(Clone, Debug, PartialEq)]
pub struct Specification {
    /// The name of the task, for a policy that knows tasks by name. It says nothing of what is to be done.
    pub task_id: String,
    /// Slots of each observation.
    pub n_slots: usize,
    /// Boundary frames, or sentences.
    pub rows: SpecificationRows,
    /// The pictures of a video; none in another form.
    pub pictures: Pictures,
}

impl Specification {
    /// The whole of it.
    pub fn whole(&self) -> Span {
        Span { begin: 0, end: self.rows.len() as u32 }
    }
}

/// One decision that is asked for: the program on top of an episode's stack.
#[derive(Clone, Debug)]
pub struct Query {
    /// Which of the episodes that run side by side; stays the same from an episode's first query to its last.
    pub episode: usize,
    /// Decisions made in this episode before.
    pub decision: u32,
    /// Depth of the running program, 0 for the root: with `episode` it names a frame of the call stack.
    pub depth: u8,
    /// Steps the running call has made before; 0 right after it was called.
    pub step: u16,
    /// The whole demonstration.
    pub specification: Arc<Specification>,
    /// The part that the running program may see.
    pub window: Span,
    /// The running program.
    pub program: Program,
    /// Where things are now.
    pub observation: Observation,
    /// The picture of now with the gripper's state, for a policy that sees, which is given it in place of the
    /// observation; none for another.
    pub seen: Arc<Pictures>,
    /// What the answer may be; anything where nothing is known.
    pub allowed: Option<Allowed>,
}

/// What an answer may be, where whoever asks knows what happened next. A policy that weighs its answers gives the
/// likeliest of these; what it says of its probabilities is of all.
#[derive(Clone, Debug, PartialEq)]
pub struct Allowed {
    /// The programs that may be called; all where there is none.
    pub programs: Vec<Program>,
    /// The first frame of a callee's part.
    pub begin: u32,
    /// Its last frame, one of these that lie in the window, not before `begin`; any where there is none.
    pub lasts: Vec<u32>,
    /// What the argument cannot be.
    pub not_argument: Option<SlotIndex>,
}

/// The answer: one step of the running program.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// What to call; [`Program::None`] to call nothing and end.
    pub program: Program,
    /// The part the callee may see; inside the query's window. For a primitive the window itself.
    pub scope: Span,
    /// For `move_to`.
    pub argument: Option<SlotIndex>,
    /// How likely the argument is among all; 1 without one, and where nothing is weighed.
    pub argument_probability: f32,
    /// Whether the running program ends with this step.
    pub end_of_program: bool,
    /// The probabilities behind it, for viewers; `None` where there are none.
    pub prediction: Option<Prediction>,
}

/// Decides for many episodes at once.
pub trait Policy {
    /// The variant's name, as in reports.
    fn name(&self) -> &str;

    /// What it gives callees to see.
    fn scoping(&self) -> ScopingKind {
        ScopingKind::Scoped
    }

    /// The form of task specification that it reads.
    fn reads(&self) -> SpecificationForm {
        SpecificationForm::Trajectories
    }

    /// The observations that a detector finds in pictures, a row each; nothing from a policy without one.
    ///
    /// # Errors
    ///
    /// [`PolicyError`] when its numbers cannot be read.
    fn detect(&self, _pictures: &Pictures) -> Result<Option<ObservationRows>, PolicyError> {
        Ok(None)
    }

    /// One decision a query, in order. Must not depend on which queries come together, but may on earlier ones of the
    /// same episode, which a query with decision 0 begins anew.
    ///
    /// # Errors
    ///
    /// [`PolicyError`] when one cannot be decided; nothing is decided by default.
    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError>;
}

/// A decision that cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PolicyError {
    /// The network cannot read what it is given, or says what is no number.
    #[error("policy {policy} cannot decide in task {task_id}: {problem}")]
    Read {
        /// The variant's name.
        policy: String,
        /// The task's id.
        task_id: String,
        /// Why.
        problem: ReadError,
    },
    /// A detector's numbers cannot be read.
    #[error("policy {policy} cannot detect anything in pictures: {problem}")]
    Detect {
        /// The variant's name.
        policy: String,
        /// Why.
        problem: ReadError,
    },
    /// The policy answered another number of queries than it was asked.
    #[error("policy {policy} made {found}; asked for were {expected}", found = counted(*found, "decision"))]
    Count {
        /// The variant's name.
        policy: String,
        /// Decisions made.
        found: usize,
        /// Queries asked.
        expected: usize,
    },
}

impl Decision {
    /// To call nothing and end.
    pub fn end(query: &Query) -> Self {
        Self {
            program: Program::None,
            scope: query.window,
            argument: None,
            argument_probability: 1.0,
            end_of_program: true,
            prediction: None,
        }
    }
}

impl Specification {
    /// What an episode specifies, in the form that is asked for.
    pub fn in_form(form: SpecificationForm, episode: &Episode) -> Self {
        match form {
            SpecificationForm::Trajectories => Self::of(episode),
            SpecificationForm::Instructions => Self::instructions(episode),
            SpecificationForm::Video => Self::video(episode, Pictures::default()),
        }
    }

    /// The video of an episode: pictures of its boundary frames.
    pub fn video(episode: &Episode, pictures: Pictures) -> Self {
        let n_frames = episode.boundary_frames().count() as u32;
        let rows = SpecificationRows::Pictures((0..n_frames).map(PictureIndex).collect());
        Self { rows, pictures, ..Self::of(episode) }
    }

    /// The instructions of an episode.
    pub fn instructions(episode: &Episode) -> Self {
        let said = instructions(&episode.calls, &episode.scene.slots);
        let rows = SpecificationRows::Sentences(said.iter().map(|instruction| instruction.words).collect());
        Self { rows, ..Self::of(episode) }
    }

    /// Observations of a demonstration of a task without a name.
    pub fn observed(rows: ObservationRows) -> Self {
        let n_slots = rows.n_slots();
        let (task_id, pictures) = (String::new(), Pictures::default());
        Self { task_id, n_slots, rows: SpecificationRows::Observations(rows), pictures }
    }

    /// The boundary frames of an episode.
    pub fn of(episode: &Episode) -> Self {
        let n_slots = episode.scene.slots.len();
        let observations: Vec<Observation> = episode.boundary_frames().map(|(_, frame)| frame.observation()).collect();
        let rows = SpecificationRows::Observations(ObservationRows::of(n_slots, &observations));
        Self { task_id: episode.provenance.task_id.clone(), n_slots, rows, pictures: Pictures::default() }
    }
}
