//! The checked whole: provenance, scene, frames, calls, outcome.

use std::ops::Deref;

use crate::scene::Scene;
use crate::seed::Seed;
use crate::task::{Family, Split, Task, Trial};
use crate::trace::rules::{check_calls, check_frames, check_pushes, check_slots};
use crate::trace::{Frame, Outcome, ProgramCall, Push, Span, TraceError};

/// Who acted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Actor {
    /// The scripted expert.
    Expert,
    /// A policy, by its variant's name (`oracle`, `ntp`, …).
    Policy(String),
}

impl Actor {
    /// `expert`, or the variant's name.
    pub fn name(&self) -> &str {
        match self {
            Self::Expert => "expert",
            Self::Policy(variant) => variant,
        }
    }
}

/// Where an episode comes from: enough to simulate it again.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// Its number in its recordings, from 0.
    pub index: u64,
    /// The family of its task.
    pub family: Family,
    /// The task's id.
    pub task_id: String,
    /// The task in a sentence, for people and for tables of task texts.
    pub task_text: String,
    /// Whether the task may be trained on.
    pub split: Split,
    /// Which of the task's trials it is: another trial has other initial positions.
    pub trial: u32,
    /// The seed of the trial that was acted in the end.
    pub seed: u64,
    /// Instances of each category; empty where the family has none.
    pub counts: Vec<u16>,
    /// Who acted.
    pub actor: Actor,
}

/// The parts of an episode before they are checked.
#[derive(Clone, Debug, PartialEq)]
pub struct EpisodeParts {
    /// Where it comes from.
    pub provenance: Provenance,
    /// What stands on the table.
    pub scene: Scene,
    /// At least one; times strictly increase; the first is a boundary.
    pub frames: Vec<Frame>,
    /// How many frames the specification has. Equal to `frames.len()` for an expert, whose episode is its own.
    pub specification_frames: u32,
    /// In the order of calling; the first is the root.
    pub calls: Vec<ProgramCall>,
    /// What an adversary did, in order; empty as well in a world without one.
    pub pushes: Vec<Push>,
    /// How it ended.
    pub outcome: Outcome,
}

/// A checked episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Episode(EpisodeParts);

impl Deref for Episode {
    type Target = EpisodeParts;

    fn deref(&self) -> &EpisodeParts {
        &self.0
    }
}

impl Episode {
    /// Checks the parts.
    ///
    /// # Errors
    ///
    /// The first rule that does not hold. A failed episode may leave calls unended: the last ones, on the path from
    /// the root to where it was broken off.
    pub fn new(parts: EpisodeParts) -> Result<Self, TraceError> {
        let EpisodeParts { provenance: _, scene, frames, specification_frames, calls, pushes, outcome } = &parts;
        check_slots(scene)?;
        check_frames(scene, frames)?;
        check_calls(scene.slots.len(), frames.len() as u32, *specification_frames, calls, *outcome)?;
        check_pushes(scene.bodies.len(), frames, pushes)?;
        Ok(Self(parts))
    }

    /// Takes the parts out again.
    pub fn into_parts(self) -> EpisodeParts {
        self.0
    }

    /// The same demonstration without the frames between boundaries; spans count boundary frames then. Calls begin and
    /// return at boundaries, so nothing of the tree is lost.
    ///
    /// Only an expert's episode is its own specification, so only its windows are counted anew.
    #[must_use]
    pub fn boundaries_only(self) -> Self {
        let Self(mut parts) = self;
        // How many boundaries there are up to each frame.
        let counts: Vec<u32> = parts
            .frames
            .iter()
            .scan(0, |count, frame| {
                *count += u32::from(frame.boundary);
                Some(*count)
            })
            .collect();
        let position = |frame: u32| counts.get(frame as usize).map_or(0, |count| count - 1);
        let moved = |span: Span| Span { begin: position(span.begin), end: position(span.last()) + 1 };
        let own_specification = parts.provenance.actor == Actor::Expert;
        parts.pushes.iter_mut().for_each(|push| push.frames = moved(push.frames));
        for call in &mut parts.calls {
            call.frames = moved(call.frames);
            if own_specification {
                call.input = moved(call.input);
                call.output = call.output.map(moved);
            }
        }
        parts.frames.retain(|frame| frame.boundary);
        if own_specification {
            parts.specification_frames = parts.frames.len() as u32;
        }
        Self(parts)
    }

    /// The frames that programs see, with their positions among all frames.
    pub fn boundary_frames(&self) -> impl Iterator<Item = (usize, &Frame)> {
        self.frames.iter().enumerate().filter(|(_, frame)| frame.boundary)
    }
}

impl Provenance {
    /// Of a trial of a task.
    pub fn new(task: &Task, trial: &Trial, actor: Actor, index: u64) -> Self {
        Self {
            index,
            family: task.family,
            task_id: task.id.clone(),
            task_text: task.text(),
            split: task.split,
            trial: trial.index,
            seed: trial.seed.0,
            counts: trial.counts.clone(),
            actor,
        }
    }

    /// The trial that was acted.
    pub fn trial(&self) -> Trial {
        Trial { index: self.trial, counts: self.counts.clone(), seed: Seed(self.seed) }
    }
}
