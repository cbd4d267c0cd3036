//! The paper's table of a real robot: successes, failures of the model and of manipulation, ours beside the paper's.
//!
//! # Source
//!
//! Xu et al., section V-D: 20 trials of Block Stacking and 10 of Object Sorting, on a real Sawyer with a Kinect. Ours is a
//! simulated Sawyer with a simulated camera.

use schemars::JsonSchema;
use serde::Serialize;

use crate::arm;
use crate::report::facts::{BLOCK_STACKING, OBJECT_SORTING};
use crate::report::interval::wilson;
use crate::report::summary::Aggregate;
use crate::rollout::Failure;

/// A share of rollouts with its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Share {
    /// How many.
    pub count: u64,
    /// As a share.
    pub rate: f64,
    /// Lower end of its interval.
    pub wilson_low: f64,
    /// Upper end of its interval.
    pub wilson_high: f64,
}

impl Share {
    fn of(count: u64, episodes: u64) -> Self {
        let (wilson_low, wilson_high) = wilson(count, episodes);
        Self { count, rate: count as f64 / episodes.max(1) as f64, wilson_low, wilson_high }
    }
}

/// An actor in a suite whose robot has to see.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct RobotRow {
    /// Of which experiment.
    pub experiment: String,
    /// The set of evaluation tasks.
    pub suite: String,
    /// The model.
    pub model: String,
    /// What the suite asks for, in words.
    pub facts: String,
    /// How many rollouts.
    pub episodes: u64,
    /// Those that succeeded.
    pub success: Share,
    /// Those whose first error is a decision, as the paper counts them; null where it was not told.
    pub ntp: Option<Share>,
    /// Those of them in which the model decides rightly when it is told true places.
    pub localisation: Option<Share>,
    /// Those in which physics went wrong first.
    pub manipulation: Option<Share>,
    /// Share of a task's goals that hold in the end.
    pub goals_met: Option<f64>,
    /// Level distance of what the model was told from true places, in millimetres.
    pub localisation_mm: Option<f64>,
    /// The paper's, of the same family; null where it has none.
    pub paper: Option<PaperRobot>,
}

/// A line of the paper's table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct PaperRobot {
    /// Of which tasks.
    pub tasks: &'static str,
    /// How many trials.
    pub trials: u64,
    /// Share of successes.
    pub success: f64,
    /// Share of "NTP failures".
    pub ntp: f64,
    /// Share of "manipulation failures".
    pub manipulation: f64,
}

/// By family.
const PAPER: [(&str, PaperRobot); 2] = [
    (BLOCK_STACKING, PaperRobot { tasks: "Block Stacking", trials: 20, success: 0.90, ntp: 0.05, manipulation: 0.05 }),
    (OBJECT_SORTING, PaperRobot { tasks: "Object Sorting", trials: 10, success: 0.80, ntp: 0.0, manipulation: 0.20 }),
];

/// The rows whose robot has to see.
pub(super) fn rows(aggregates: &[Aggregate]) -> Vec<RobotRow> {
    aggregates.iter().filter(|row| row.facts.camera.is_some()).map(row).collect()
}

fn row(row: &Aggregate) -> RobotRow {
    let count = |failure: Failure| row.failures.get(failure.name()).copied().unwrap_or(0);
    let is_told = row.failures.values().sum::<u64>() == row.episodes - row.successes;
    let share = |count: u64| is_told.then(|| Share::of(count, row.episodes));
    let family = row.facts.family.as_deref();
    let is_arm = row.facts.robot.as_deref() == Some(arm::NAME);
    let paper = PAPER.into_iter().find(|(of, _)| Some(*of) == family && is_arm);
    RobotRow {
        experiment: row.actor.experiment.clone(),
        suite: row.suite.clone(),
        model: row.actor.words(),
        facts: row.facts.words(),
        episodes: row.episodes,
        success: Share::of(row.successes, row.episodes),
        ntp: share(count(Failure::Ntp) + count(Failure::Localisation)),
        localisation: share(count(Failure::Localisation)),
        manipulation: share(count(Failure::Manipulation)),
        goals_met: row.goals_met,
        localisation_mm: row.localisation_mm,
        paper: paper.map(|(_, paper)| paper),
    }
}
