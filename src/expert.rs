//! Scripted programs that act through the robot API and yield checked episodes.
//!
//! ```text
//! block_stacking ─► pick_and_place ─► pick  ─► move_to, grip
//!                                  └► place ─► move_to, release
//! object_sorting ─► pick_and_drop  ─► pick  ─► move_to, grip
//!                                  └► drop  ─► move_to, release
//! table_cleanup  ─► pick_and_place (bowls), pick_and_drop (forks)
//! ```
//!
//! # Invariants
//!
//! The expert knows its task, never the physics: it acts through [`RobotApi`] alone.
//!
//! # Source
//!
//! Paper, section V ("an expert policy is an agent with hard-coded rules that call programs") and figure 3. The last
//! call of a program is a tail call (its step ends the program); a root ends with a step of its own that calls nothing.

use crate::program::Program;
use crate::robot::{Action, RobotApi, judge};
use crate::scene::{SceneState, SlotIndex, lies_in_any_container};
use crate::task::{Goal, SubTask, Task};
use crate::trace::{CallRecorder, Cause, Episode, EpisodeParts, NewCall, Outcome, Provenance, Span, TraceError};

/// Acts out a task once. What goes wrong in physics is the episode's outcome, not an error.
///
/// # Errors
///
/// [`TraceError`] when the world broke a rule of traces: a bug in the world.
pub fn demonstrate(task: &Task, world: &mut dyn RobotApi, provenance: Provenance) -> Result<Episode, TraceError> {
    let whole = Span { begin: 0, end: 1 };
    let mut run = Run { world, calls: CallRecorder::new(task.family.root_program(), whole) };
    let acted = run.root(task);
    let Run { world, calls } = run;
    let cause = acted.err().or_else(|| judge(task, world).cause);
    let outcome = cause.map_or(Outcome::Success, Outcome::Failure);
    let frames = world.frames().to_vec();
    let n_frames = frames.len() as u32;
    Episode::new(EpisodeParts {
        provenance,
        scene: world.scene().clone(),
        frames,
        specification_frames: n_frames,
        calls: calls.finish_demonstration(n_frames.saturating_sub(1)),
        pushes: world.pushes().unwrap_or_default().to_vec(),
        outcome,
    })
}

/// One acting-out: the world and the calls so far.
struct Run<'w> {
    world: &'w mut dyn RobotApi,
    calls: CallRecorder,
}

/// Whether the caller ends with a call.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Then {
    Continue,
    End,
}

impl Run<'_> {
    fn root(&mut self, task: &Task) -> Result<(), Cause> {
        for goal in &task.goals {
            let sub_task = goal.brings_about(task.family).sub_task();
            if sub_task.for_each {
                self.bring_each(*goal, sub_task)?;
            } else {
                self.bring(*goal, sub_task)?;
            }
        }
        self.call(Program::None, None, Then::End);
        self.returned();
        Ok(())
    }

    /// Brings every instance of a category into its container.
    fn bring_each(&mut self, goal: Goal, sub_task: SubTask) -> Result<(), Cause> {
        while self.n_unsorted(goal.source) > 0 {
            let before = self.n_unsorted(goal.source);
            self.bring(goal, sub_task)?;
            if self.n_unsorted(goal.source) >= before {
                return Err(Cause::DroppedObject);
            }
        }
        Ok(())
    }

    fn n_unsorted(&self, category: SlotIndex) -> usize {
        let state: SceneState = self.world.state();
        let scene = self.world.scene();
        let bodies = scene.slot(category).bodies.iter();
        bodies.filter(|&&body| !lies_in_any_container(scene, &state, body)).count()
    }

    /// One sub-task: pick the source, then put it down at the target.
    fn bring(&mut self, goal: Goal, sub_task: SubTask) -> Result<(), Cause> {
        self.call(sub_task.program, None, Then::Continue);
        self.call(Program::Pick, None, Then::Continue);
        self.act(Program::MoveTo, Some(goal.source), Then::Continue)?;
        self.act(Program::Grip, None, Then::End)?;
        self.call(sub_task.put, None, Then::End);
        self.act(Program::MoveTo, Some(goal.target), Then::Continue)?;
        self.act(Program::Release, None, Then::End)
    }

    fn call(&mut self, program: Program, argument: Option<SlotIndex>, then: Then) {
        let new = NewCall { program, argument, scope: None, end_of_program: then == Then::End, prediction: None };
        self.calls.call(new, self.frame());
    }

    fn act(&mut self, program: Program, argument: Option<SlotIndex>, then: Then) -> Result<(), Cause> {
        self.call(program, argument, then);
        let action = Action::new(program, argument).expect("the script calls primitives with their arguments");
        let acted = self.world.act(action);
        self.returned();
        acted
    }

    fn returned(&mut self) {
        self.calls.returned(self.frame());
    }

    /// The newest frame.
    fn frame(&self) -> u32 {
        (self.world.frames().len() as u32).saturating_sub(1)
    }
}
