//! Simulates a recorded episode again from its seed and compares every frame.
//!
//! Expert or policy, an episode is its trial and its primitive calls in order; so the check needs no policy.

use std::fmt;

use serde::Serialize;

use crate::artifact::Plan;
use crate::pipeline::generate::{disturbed, perceiving};
use crate::pipeline::{PipelineError, Recorded};
use crate::robot::{Action, RobotApi as _};
use crate::sim::Simulation;
use crate::task;
use crate::trace::Episode;
use crate::words::counted;

/// What the second simulation showed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "result", rename_all = "snake_case")]
pub enum Verification {
    /// Every frame is the same, bit for bit.
    Same {
        /// How many frames were compared.
        frames: usize,
    },
    /// They differ.
    Differs {
        /// The first frame that differs.
        frame: usize,
        /// In what.
        problem: String,
    },
    /// The recording does not say how it was simulated.
    Unknown {
        /// What is missing.
        problem: String,
    },
}

impl fmt::Display for Verification {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Same { frames } => write!(f, "simulated again: the same in {}", counted(*frames, "frame")),
            Self::Differs { frame, problem } => write!(f, "simulated again: frame {frame} differs: {problem}"),
            Self::Unknown { problem } => write!(f, "cannot be simulated again: {problem}"),
        }
    }
}

/// Simulates an episode again by the settings in its recording's plan.
///
/// # Errors
///
/// When the world cannot be made.
pub fn verify(plan: &Plan, episode: &Episode) -> Result<Verification, PipelineError> {
    let Some(recorded) = Recorded::of(plan) else {
        let problem = "the plan attached to the recording holds no simulation settings".to_owned();
        return Ok(Verification::Unknown { problem });
    };
    let adversary = recorded.adversary();
    let mut config = recorded.acted_in();
    if episode.frames.iter().all(|frame| frame.boundary) {
        config.frame_hz = 0;
    }
    let provenance = &episode.provenance;
    let layout = config.layout();
    let scene = task::scene_on(layout, provenance.family, &provenance.counts);
    let initial = task::initial_state_on(layout, provenance.family, &scene, provenance.trial().seed);
    let world = Simulation::new(scene, &initial, &config)?;
    let world = disturbed(world, adversary, provenance.trial().seed)?;
    let mut world = perceiving(world, recorded.perception(), provenance.family, provenance.trial().seed)?;
    for call in episode.calls.iter() {
        if let Some(action) = Action::new(call.program, call.argument) {
            // What goes wrong in physics went wrong the first time too; the frames tell.
            let _acted = world.act(action);
        }
    }
    Ok(compare(episode, world.frames()))
}

fn compare(episode: &Episode, again: &[crate::trace::Frame]) -> Verification {
    let pairs = episode.frames.iter().zip(again);
    if let Some((frame, (then, now))) = pairs.enumerate().find(|(_, (then, now))| then != now) {
        let problem = if then.time_nanos != now.time_nanos {
            format!("its time was {} ns and is {} ns", then.time_nanos, now.time_nanos)
        } else if then.state != now.state {
            "a pose or the gripper differs".to_owned()
        } else {
            "the slots show other bodies".to_owned()
        };
        return Verification::Differs { frame, problem };
    }
    let (then, now) = (episode.frames.len(), again.len());
    if then != now {
        return Verification::Differs {
            frame: then.min(now),
            problem: format!("there were {then}, now {now}", then = counted(then, "frame")),
        };
    }
    Verification::Same { frames: now }
}
