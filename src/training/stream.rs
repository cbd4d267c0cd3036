//! Trials on disk, and the buffer that goes through them.
//!
//! ```text
//! trials on disk ─► shards of whole tasks, in an order that the seed shuffles ─► a buffer of some shards
//! ```
//!
//! In each round the buffer's oldest shard gives way to the next one. What it holds follows from the seed and the round's
//! number, so a training that is resumed sees the same.
//!
//! # Invariants
//!
//! Memory grows with the buffer.

use std::collections::BTreeMap;
use std::ops::Range;

use rand::seq::SliceRandom as _;

use crate::dataset::{DatasetTrials, TrialData, TrialSpool};
use crate::seed::Seed;
use crate::training::TrainError;
use crate::training::facts::{Facts, Gathered};

/// Frames of a shard, at least; a task is not divided, unless it has twice as many. Fewer where less is allowed.
const SHARD_FRAMES: u64 = 50_000;
/// Shards of the buffer: together some 400 000 frames, 200 MB.
const BUFFER_SHARDS: usize = 8;

/// Trials on disk, cut into shards.
#[derive(Debug)]
pub struct TrialStream {
    trials: TrialSpool,
    shards: Vec<Range<usize>>,
    pub(super) facts: Facts,
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

    /// Slots of their scenes.
    pub(super) fn n_slots(&self) -> usize {
        self.trials.n_slots
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
    pub(super) data: DatasetTrials,
}

impl Buffer {
    /// With nothing in it, for a stream's trials.
    pub(super) fn new(n_slots: usize) -> Self {
        Self { held: Vec::new(), data: DatasetTrials { n_slots, trials: Vec::new() } }
    }

    /// The trials of a round; those that are held already are not read again.
    pub(super) fn turned(self, stream: &TrialStream, round: u64, seed: Seed) -> Result<Self, TrainError> {
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
