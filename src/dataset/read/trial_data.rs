//! What a learner reads from a dataset: boundary observations and call trees, nothing else.

use crate::task::{Family, Split};
use crate::trace::{GripperState, Instruction, ProgramCall};

/// One episode as a learner sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialData {
    /// The task's id: trials of the same task are paired.
    pub task_id: String,
    /// Its family.
    pub family: Family,
    /// Its split; a learner takes [`Split::Seen`] alone.
    pub split: Split,
    /// Which trial of its task.
    pub trial: u32,
    /// Its episode in the dataset, from 0.
    pub episode: usize,
    /// How many boundary frames.
    pub n_frames: usize,
    /// Which rows of the episode its boundary frames are, in order: where its pictures are.
    pub rows: Vec<u32>,
    /// `[n_frames, 3 * n_slots + 2]`, row by row: [`crate::trace::Observation::to_flat`] of each boundary frame.
    pub observations: Vec<f32>,
    /// The gripper in each boundary frame.
    pub grippers: Vec<GripperState>,
    /// The call tree; spans count boundary frames.
    pub calls: Vec<ProgramCall>,
    /// What was done, in words, in the order of the calls.
    pub instructions: Vec<Instruction>,
}

/// A dataset in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct DatasetTrials {
    /// Slots of every scene in it; of several datasets the most.
    pub n_slots: usize,
    /// Its successful episodes in order of index.
    pub trials: Vec<TrialData>,
}

impl DatasetTrials {
    /// Several datasets as one, to be learned together.
    #[must_use]
    pub fn together(datasets: Vec<Self>) -> Self {
        let n_slots = datasets.iter().map(|dataset| dataset.n_slots).max().unwrap_or_default();
        Self { n_slots, trials: datasets.into_iter().flat_map(|dataset| dataset.trials).collect() }
    }
}
