//! What the interpreter asks and what a policy answers.

use std::sync::Arc;

use crate::model::{Decisions, Pictures};
use crate::program::Program;
use crate::scene::SlotIndex;
use crate::trace::{Episode, Observation, Prediction, Span, SpecificationForm, instructions};

/// A task specification as a policy sees it: a demonstration's boundary observations, or its instructions.
#[derive(Clone, Debug, PartialEq)]
pub struct Specification {
    /// The name of the task, for a policy that knows tasks by name. It says nothing of what is to be done.
    pub task_id: String,
    /// Slots of each observation.
    pub n_slots: usize,
    /// In which form it is given.
    pub form: SpecificationForm,
    /// Boundary frames, or sentences.
    pub n_frames: usize,
    /// `[n_frames, 3 * n_slots + 2]`, or `[n_frames, MAX_WORDS]` of words as numbers, row by row.
    /// With pictures `[n_frames]`, which of them each frame shows.
    pub rows: Vec<f32>,
    /// The pictures of a video; none in another form.
    pub pictures: Pictures,
}

impl Specification {
    /// The whole of it.
    pub fn whole(&self) -> Span {
        Span { begin: 0, end: self.n_frames as u32 }
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
    /// Whether the running program ends with this step.
    pub end_of_program: bool,
    /// The probabilities behind it, for viewers; `None` where there are none.
    pub prediction: Option<Prediction>,
}

/// Decides for many episodes at once.
pub trait Policy {
    /// The variant's name, as in reports.
    fn name(&self) -> &str;

    /// What it decides.
    fn decides(&self) -> Decisions {
        Decisions::Scoped
    }

    /// The form of task specification that it reads.
    fn reads(&self) -> SpecificationForm {
        SpecificationForm::Trajectories
    }

    /// The observation rows that a detector finds in pictures, `[F, 3 N + 2]`; nothing from a policy without one.
    fn detect(&self, _pictures: &Pictures) -> Option<Vec<f32>> {
        None
    }

    /// One decision a query, in order. Must not depend on which queries come together, but may on earlier ones of the
    /// same running call.
    fn decide(&mut self, queries: &[Query]) -> Vec<Decision>;
}

impl Decision {
    /// To call nothing and end.
    pub fn end(query: &Query) -> Self {
        Self { program: Program::None, scope: query.window, argument: None, end_of_program: true, prediction: None }
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
        let n_frames = episode.boundary_frames().count();
        Self {
            form: SpecificationForm::Video,
            n_frames,
            rows: (0..n_frames).map(|frame| frame as f32).collect(),
            pictures,
            ..Self::of(episode)
        }
    }

    /// The instructions of an episode.
    pub fn instructions(episode: &Episode) -> Self {
        let instructions = instructions(&episode.calls, &episode.scene.slots);
        let rows = instructions.iter().flat_map(|instruction| instruction.words).map(f32::from).collect();
        let (n_slots, n_frames) = (episode.scene.slots.len(), instructions.len());
        let task_id = episode.provenance.task_id.clone();
        Self { task_id, n_slots, form: SpecificationForm::Instructions, n_frames, rows, pictures: Pictures::default() }
    }

    /// The boundary frames of an episode.
    pub fn of(episode: &Episode) -> Self {
        let rows: Vec<f32> = episode.boundary_frames().flat_map(|(_, frame)| frame.observation().to_flat()).collect();
        let n_slots = episode.scene.slots.len();
        let n_frames = rows.len() / Observation::width(n_slots);
        let task_id = episode.provenance.task_id.clone();
        Self { task_id, n_slots, form: SpecificationForm::Trajectories, n_frames, rows, pictures: Pictures::default() }
    }
}
