//! What is known of all trials before the first step: families, tasks, programs that decide, and a hash.

use std::collections::{BTreeMap, BTreeSet};

use sha2::{Digest as _, Sha256};

use crate::artifact;
use crate::dataset::{DatasetTrials, TrialData};
use crate::model::ScopingKind;
use crate::program::Program;
use crate::task::{Family, Split};
use crate::training::TrainError;

/// What is known of all trials.
#[derive(Clone, Debug)]
pub(super) struct Facts {
    /// Hash of what is learned from: a checkpoint belongs to it.
    pub(super) hash: String,
    families: Families,
    pub(super) n_slots: usize,
    /// Frames of the longest trial.
    pub(super) longest: usize,
    /// Ids of the training tasks, in order.
    pub(super) task_ids: Vec<String>,
    /// Programs that call others, and whether each is a root.
    callers: BTreeMap<Program, bool>,
}

/// The families of trials, in the order in which they came.
#[derive(Clone, Debug, Default)]
struct Families {
    all: Vec<Family>,
    /// The first trial that is not of the first family, and its task.
    other: Option<(u32, String)>,
}

/// Facts as trials come.
pub(super) struct Gathered {
    hasher: Sha256,
    families: Families,
    longest: usize,
    task_ids: BTreeSet<String>,
    callers: BTreeMap<Program, bool>,
}

impl Gathered {
    pub(super) fn new() -> Self {
        let (task_ids, callers) = (BTreeSet::new(), BTreeMap::new());
        Self { hasher: Sha256::new(), families: Families::default(), longest: 0, task_ids, callers }
    }

    pub(super) fn add(&mut self, trial: &TrialData) {
        let Families { all, other } = &mut self.families;
        if !all.contains(&trial.family) {
            if !all.is_empty() && other.is_none() {
                *other = Some((trial.trial, trial.task_id.clone()));
            }
            all.push(trial.family);
        }
        self.longest = self.longest.max(trial.n_frames);
        if trial.split == Split::Seen && !self.task_ids.contains(&trial.task_id) {
            self.task_ids.insert(trial.task_id.clone());
        }
        let root = trial.calls.first().map(|call| call.program);
        for caller in trial.calls.iter().filter_map(|call| trial.calls.get(call.caller?.0 as usize)) {
            self.callers.insert(caller.program, Some(caller.program) == root);
        }
        hash(&mut self.hasher, trial);
    }

    /// What came of them.
    ///
    /// # Errors
    ///
    /// When there was none.
    pub(super) fn facts(self, n_slots: usize) -> Result<Facts, TrainError> {
        let Self { hasher, families, longest, task_ids, callers } = self;
        if families.all.is_empty() {
            return Err(TrainError::NoTrials { total: 0 });
        }
        let task_ids = task_ids.into_iter().collect();
        Ok(Facts { hash: artifact::hex(&hasher.finalize()), families, n_slots, longest, task_ids, callers })
    }
}

impl Facts {
    /// The first family, and the others.
    pub(super) fn first_family(&self) -> Result<(Family, Vec<Family>), TrainError> {
        let (first, others) = self.families.all.split_first().ok_or(TrainError::NoTrials { total: 0 })?;
        Ok((*first, others.to_vec()))
    }

    /// Refuses several families for whom cannot learn them together.
    pub(super) fn check_one_family(&self, learner: &str) -> Result<(), TrainError> {
        let Families { all, other } = &self.families;
        match (&all[..], other) {
            ([first, second, ..], Some((trial, task))) => Err(TrainError::MixedFamilies {
                trial: *trial,
                task: task.clone(),
                found: second.name(),
                expected: first.name(),
                variant: learner.to_owned(),
            }),
            _ => Ok(()),
        }
    }

    /// The programs that decide, in the order of the program memory, and whether each is a root.
    pub(super) fn levels(&self, scoping: ScopingKind) -> Vec<(Program, bool)> {
        let decides = |(_, is_root): &(Program, bool)| *is_root || scoping != ScopingKind::Primitives;
        self.callers.iter().map(|(program, is_root)| (*program, *is_root)).filter(decides).collect()
    }
}

fn hash(hasher: &mut Sha256, trial: &TrialData) {
    hasher.update(trial.task_id.as_bytes());
    hasher.update(trial.split.name());
    hasher.update([trial.trial.to_le_bytes(), (trial.n_frames as u32).to_le_bytes()].concat());
    trial.observations.iter().for_each(|value| hasher.update(value.to_le_bytes()));
    let grippers = trial.grippers.iter().flat_map(|gripper| gripper.in_world_m);
    grippers.for_each(|value| hasher.update(value.to_le_bytes()));
    trial.instructions.iter().flat_map(|said| said.words).for_each(|word| hasher.update(word.to_le_bytes()));
}

/// What is known of trials in memory.
pub(super) fn facts_of(data: &DatasetTrials) -> Result<Facts, TrainError> {
    let mut gathered = Gathered::new();
    data.trials.iter().for_each(|trial| gathered.add(trial));
    gathered.facts(data.n_slots)
}
