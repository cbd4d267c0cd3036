//! What is learned from: trials in memory, or a buffer that goes through those on disk.
//!
//! ```text
//! trials on disk ─► shards of whole tasks, in an order that the seed shuffles ─► a buffer of some shards
//! ```
//!
//! Every [`ROUND_STEPS`] steps the buffer's oldest shard gives way to the next one. What a step draws from follows from
//! the seed and the step's number, so a training that is resumed sees the same.
//!
//! # Invariants
//!
//! Memory grows with the buffer. Trials that are in memory are all there in every step, as they always were.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use rand::seq::SliceRandom as _;
use sha2::{Digest as _, Sha256};

use crate::artifact;
use crate::dataset::{DatasetTrials, TrialData, TrialSpool};
use crate::model::ScopingKind;
use crate::program::Program;
use crate::seed::Seed;
use crate::task::{Family, Split};
use crate::training::TrainError;
use crate::training::seen::{Galleries, Gallery};

/// Steps between two shards: reading one then takes about a twentieth of the time.
const ROUND_STEPS: u32 = 200;
/// Frames of a shard, at least; a task is not divided, unless it has twice as many. Fewer where less is allowed.
const SHARD_FRAMES: u64 = 50_000;
/// Shards of the buffer: together some 400 000 frames, 200 MB.
const BUFFER_SHARDS: usize = 8;

/// What is learned from.
#[derive(Clone, Copy)]
pub enum Source<'s> {
    /// All trials, and the pictures of their frames for a variant that sees.
    Here(&'s DatasetTrials, Option<&'s dyn Gallery>),
    /// A buffer of trials on disk, and who finds pictures.
    Streamed(&'s TrialStream, Option<&'s dyn Galleries>),
}

/// Trials on disk, cut into shards.
#[derive(Debug)]
pub struct TrialStream {
    trials: TrialSpool,
    shards: Vec<Range<usize>>,
    facts: Facts,
}

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
struct Gathered {
    hasher: Sha256,
    families: Families,
    longest: usize,
    task_ids: BTreeSet<String>,
    callers: BTreeMap<Program, bool>,
}

impl Gathered {
    fn new() -> Self {
        let (task_ids, callers) = (BTreeSet::new(), BTreeMap::new());
        Self { hasher: Sha256::new(), families: Families::default(), longest: 0, task_ids, callers }
    }

    fn add(&mut self, trial: &TrialData) {
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

    fn facts(self, n_slots: usize) -> Result<Facts, TrainError> {
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

impl TrialStream {
    /// Goes through trials once, and cuts them into shards, so that a buffer holds at most about `most_frames`.
    ///
    /// # Errors
    ///
    /// When there is none, they are of several families, or they cannot be read.
    pub fn new(trials: TrialSpool, most_frames: u64) -> Result<Self, TrainError> {
        let n_frames = (most_frames / BUFFER_SHARDS as u64).clamp(1, SHARD_FRAMES);
        let shards = cut(&trials, n_frames as usize);
        let mut gathered = Gathered::new();
        for shard in &shards {
            trials.read(shard.clone())?.iter().for_each(|trial| gathered.add(trial));
        }
        let facts = gathered.facts(trials.n_slots)?;
        facts.check_one_family("of any kind, from trials that are streamed from disk,")?;
        Ok(Self { trials, shards, facts })
    }

    /// How many trials.
    pub fn n_trials(&self) -> usize {
        self.trials.len()
    }

    /// Which shards the buffer holds in a round, from the oldest; all of them where they are few.
    fn shards_of_round(&self, round: u64, seed: Seed) -> Vec<usize> {
        let n = self.shards.len() as u64;
        if n <= BUFFER_SHARDS as u64 {
            return (0..self.shards.len()).collect();
        }
        let mut held: Vec<usize> = Vec::new();
        for place in round..round + BUFFER_SHARDS as u64 {
            let shard = shuffled(self.shards.len(), seed, place / n)[(place % n) as usize];
            // Where one order ends and the next begins a shard may come twice.
            if !held.contains(&shard) {
                held.push(shard);
            }
        }
        held
    }
}

/// The order of shards in one pass over all.
fn shuffled(n_shards: usize, seed: Seed, pass: u64) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n_shards).collect();
    order.shuffle(&mut seed.derive("shards", &[pass]).rng());
    order
}

/// Runs of trials with at least so many frames, which end where a task ends, or at twice as many.
fn cut(trials: &TrialSpool, least_frames: usize) -> Vec<Range<usize>> {
    let (mut shards, mut begin, mut n_frames) = (Vec::new(), 0, 0);
    for trial in 0..trials.len() {
        let is_enough = n_frames >= least_frames && !trials.continues_task(trial) || n_frames >= 2 * least_frames;
        if is_enough {
            shards.push(begin..trial);
            (begin, n_frames) = (trial, 0);
        }
        n_frames += trials.n_frames(trial);
    }
    if begin < trials.len() {
        shards.push(begin..trials.len());
    }
    shards
}

/// The trials in memory, shard by shard from the oldest.
pub(super) struct Buffer {
    /// Numbers of the shards, and how many trials each has.
    held: Vec<(usize, usize)>,
    data: DatasetTrials,
}

impl Buffer {
    /// With nothing in it.
    fn new(n_slots: usize) -> Self {
        Self { held: Vec::new(), data: DatasetTrials { n_slots, trials: Vec::new() } }
    }

    /// The trials of a round; those that are held already are not read again.
    fn turned(self, stream: &TrialStream, round: u64, seed: Seed) -> Result<Self, TrainError> {
        let Self { held, data: DatasetTrials { n_slots, trials } } = self;
        let mut rest = trials.into_iter();
        let mut before: BTreeMap<usize, Vec<TrialData>> =
            held.into_iter().map(|(shard, n)| (shard, rest.by_ref().take(n).collect())).collect();
        let (mut held, mut trials) = (Vec::new(), Vec::new());
        let shards = stream.shards_of_round(round, seed);
        before.retain(|shard, _| shards.contains(shard));
        for shard in shards {
            let own = match before.remove(&shard) {
                Some(own) => own,
                None => stream.trials.read(stream.shards[shard].clone())?,
            };
            held.push((shard, own.len()));
            trials.extend(own);
        }
        Ok(Self { held, data: DatasetTrials { n_slots, trials } })
    }
}

/// What is in memory now.
pub(super) enum Held<'s> {
    Here(&'s DatasetTrials, Option<&'s dyn Gallery>),
    Streamed { stream: &'s TrialStream, galleries: Option<&'s dyn Galleries>, buffer: Buffer },
}

impl<'s> Held<'s> {
    pub(super) fn of(source: Source<'s>) -> Self {
        match source {
            Source::Here(data, gallery) => Self::Here(data, gallery),
            Source::Streamed(stream, galleries) => {
                Self::Streamed { stream, galleries, buffer: Buffer::new(stream.trials.n_slots) }
            }
        }
    }

    /// Makes sure that what a step draws from is in memory; gives the step at which something else will be.
    pub(super) fn turn_to(self, step: u32, seed: Seed) -> Result<(Self, u32), TrainError> {
        match self {
            Self::Here(..) => Ok((self, u32::MAX)),
            Self::Streamed { stream, galleries, buffer } => {
                let round = step / ROUND_STEPS;
                let buffer = buffer.turned(stream, u64::from(round), seed)?;
                Ok((Self::Streamed { stream, galleries, buffer }, (round + 1).saturating_mul(ROUND_STEPS)))
            }
        }
    }

    pub(super) fn data(&self) -> &DatasetTrials {
        match self {
            Self::Here(data, _) => data,
            Self::Streamed { buffer, .. } => &buffer.data,
        }
    }

    /// The pictures of these trials, where they are looked at.
    pub(super) fn gallery(&self) -> Result<Option<Pictured<'_>>, TrainError> {
        match self {
            Self::Here(_, gallery) => Ok(gallery.map(Pictured::Here)),
            Self::Streamed { galleries: None, .. } => Ok(None),
            Self::Streamed { galleries: Some(galleries), buffer, .. } => {
                Ok(Some(Pictured::Opened(galleries.open(&buffer.data)?)))
            }
        }
    }
}

/// A gallery, whoever has it.
pub(super) enum Pictured<'g> {
    Here(&'g dyn Gallery),
    Opened(Box<dyn Gallery>),
}

impl Pictured<'_> {
    pub(super) fn as_gallery(&self) -> &dyn Gallery {
        match self {
            Self::Here(gallery) => *gallery,
            Self::Opened(gallery) => gallery.as_ref(),
        }
    }
}

impl Source<'_> {
    /// What is known of all trials.
    ///
    /// # Errors
    ///
    /// [`TrainError`] when there is none.
    pub(super) fn facts(&self) -> Result<Facts, TrainError> {
        match self {
            Self::Here(data, _) => facts_of(data),
            Self::Streamed(stream, _) => Ok(stream.facts.clone()),
        }
    }

    /// Pixels across and down each picture; nothing without pictures.
    pub(super) fn picture_size(&self) -> Option<(usize, usize)> {
        match self {
            Self::Here(_, gallery) => gallery.map(Gallery::size),
            Self::Streamed(_, galleries) => galleries.map(Galleries::size),
        }
    }

    /// The same for a variant that does not see.
    pub(super) fn without_pictures(self) -> Self {
        match self {
            Self::Here(data, _) => Self::Here(data, None),
            Self::Streamed(stream, _) => Self::Streamed(stream, None),
        }
    }
}

/// What is known of trials in memory.
pub(super) fn facts_of(data: &DatasetTrials) -> Result<Facts, TrainError> {
    let mut gathered = Gathered::new();
    data.trials.iter().for_each(|trial| gathered.add(trial));
    gathered.facts(data.n_slots)
}

#[cfg(test)]
mod tests {
    use super::{BUFFER_SHARDS, Buffer, Seed, TrialStream};
    use crate::dataset::{TrialData, TrialSpool};
    use crate::task::{Family, Split};

    /// Without anything to learn from.
    fn trial(task: usize, number: u32) -> TrialData {
        TrialData {
            task_id: format!("task_{task:03}"),
            family: Family::ALL[0],
            split: Split::Seen,
            trial: number,
            episode: task * 3 + number as usize,
            n_frames: 2,
            rows: vec![0, 4],
            observations: vec![task as f32, 0.5, 1.0, 0.0, task as f32, 0.25, 0.0, 1.0],
            grippers: Vec::new(),
            calls: Vec::new(),
            instructions: Vec::new(),
        }
    }

    /// Three trials of two frames of each task: a shard a task.
    fn stream(n_tasks: usize) -> (Vec<TrialData>, TrialStream) {
        let trials: Vec<TrialData> = (0..n_tasks).flat_map(|task| (0..3).map(move |n| trial(task, n))).collect();
        let folder = std::env::temp_dir();
        let spool = TrialSpool::of(&folder, 2, &trials).expect("written");
        (trials, TrialStream::new(spool, 6 * BUFFER_SHARDS as u64).expect("read"))
    }

    #[test]
    fn a_shard_is_of_whole_tasks_and_every_shard_comes_once_before_any_comes_again() {
        let (_, stream) = stream(20);
        assert_eq!(stream.shards.len(), 20);
        assert!(stream.shards.iter().all(|shard| shard.len() == 3));
        let newest = |round: u64| stream.shards_of_round(round, Seed(1)).last().copied().expect("a shard");
        let mut first: Vec<usize> = stream.shards_of_round(0, Seed(1));
        first.extend((1..=20 - BUFFER_SHARDS as u64).map(newest));
        let in_order: Vec<usize> = (0..20).collect();
        assert_ne!(first, in_order);
        first.sort_unstable();
        assert_eq!(first, in_order);
        assert_ne!(stream.shards_of_round(0, Seed(1)), stream.shards_of_round(0, Seed(2)));
    }

    #[test]
    fn a_buffer_that_was_turned_round_by_round_holds_what_a_fresh_one_holds() {
        let (trials, stream) = stream(11);
        let turned = |buffer: Buffer, round: u64| buffer.turned(&stream, round, Seed(5)).expect("read");
        let mut buffer = Buffer::new(2);
        for round in 0..30 {
            buffer = turned(buffer, round);
            assert_eq!(buffer.data, turned(Buffer::new(2), round).data, "round {round}");
            assert!(buffer.data.trials.iter().all(|trial| trials.contains(trial)));
            assert!(buffer.data.trials.len() <= 3 * BUFFER_SHARDS);
        }
    }

    #[test]
    fn a_buffer_of_few_shards_holds_all_of_them() {
        let (trials, stream) = stream(4);
        let buffer = Buffer::new(2).turned(&stream, 9, Seed(5)).expect("read");
        assert_eq!(buffer.data.trials, trials);
    }
}
