//! Batches of decisions that are made from pictures.
//!
//! A group is a few tasks with two trials each: every picture of them that is needed is looked at once, and the
//! decisions of all levels of the hierarchy are gathered from what was seen.

use std::collections::BTreeMap;

use rand::Rng;

use crate::dataset::{DatasetTrials, Wanted};
use crate::model::{PictureIndex, PictureSample, Pictures, SpecificationRows, States};
use crate::seed::Seed;
use crate::training::TrainError;
use crate::training::augment::Views;
use crate::training::batch::{Counts, Group, Run, assemble};
use crate::training::config::TrainConfig;
use crate::training::examples::{Example, Examples};

/// Groups of a step. A fixed number, since the sum of gradients must not depend on the machine.
const GROUPS: usize = 2;
/// Tasks of a group, each with two trials.
const TASKS_OF_GROUP: usize = 3;
/// How often a pair of trials is drawn in which a level's program runs.
const DRAWS: usize = 100;
/// Trials whose pictures a network is calibrated with.
const SAMPLE_TRIALS: usize = 40;

/// The pictures behind the frames of trials.
pub trait Gallery: Sync {
    /// Pixels across and down each picture.
    fn size(&self) -> (usize, usize);

    /// The names of the cameras, the uppermost first; none where nobody named them.
    fn cameras(&self) -> Vec<String> {
        Vec::new()
    }

    /// Adds pictures of a trial's frames, in order, each with the gripper's state.
    ///
    /// # Errors
    ///
    /// When one cannot be read; says which and why.
    fn fetch(&self, wanted: &Wanted, into: &mut Pictures) -> Result<(), String>;

    /// Told which frames of which trials the next step will look at, so that they can be made ready meanwhile.
    fn announce(&self, wanted: &[Wanted]) {
        let _nothing_to_do = wanted;
    }
}

/// Who finds the pictures of trials as they come into memory.
pub trait Galleries: Sync {
    /// Pixels across and down each picture.
    fn size(&self) -> (usize, usize);

    /// The names of the cameras, the uppermost first.
    fn cameras(&self) -> Vec<String>;

    /// The pictures of these trials.
    ///
    /// # Errors
    ///
    /// [`TrainError`] when they cannot be found.
    fn open(&self, trials: &DatasetTrials) -> Result<Box<dyn Gallery>, TrainError>;
}

/// The trials that a step with this seed looks at, each once, and most of their frames.
pub(super) fn wanted(examples: &Examples<'_>, seed: Seed) -> Vec<Wanted> {
    let groups = (0..GROUPS).flat_map(|group| draw_pairs(examples, &mut group_seed(seed, group).rng()));
    let mut trials: Vec<usize> = groups.flatten().collect();
    trials.sort_unstable();
    trials.dedup();
    trials.into_iter().map(|trial| all_frames(examples.data(), trial)).collect()
}

/// Everything of a trial.
pub(super) fn all_frames(data: &DatasetTrials, trial: usize) -> Wanted {
    Wanted { position: trial, frames: (0..data.trials[trial].n_frames).collect() }
}

fn group_seed(seed: Seed, group: usize) -> Seed {
    seed.derive("group", &[group as u64])
}

/// The first that is drawn for a group: whatever else is, these are the trials that it looks at.
fn draw_pairs(examples: &Examples<'_>, rng: &mut impl Rng) -> Vec<[usize; 2]> {
    (0..TASKS_OF_GROUP).map(|_| examples.draw_pair(rng)).collect()
}

/// Draws a step's mini-batches, one of each of `levels`. It depends on nothing but its arguments.
pub(super) fn draw_seen(
    examples: &Examples<'_>,
    gallery: &dyn Gallery,
    config: &TrainConfig,
    sizes: &[(usize, usize)],
    seed: Seed,
) -> Result<Vec<Group>, TrainError> {
    let mut drawn: Vec<Vec<Vec<Example>>> =
        (0..GROUPS).map(|group| draw_group(examples, config, sizes, &mut group_seed(seed, group).rng())).collect();
    let mut groups: Vec<Shown> = drawn.iter().map(|group| Shown::new(group.iter().flatten())).collect();
    let mut parts: Vec<Group> =
        groups.iter_mut().map(|shown| shown.group(examples, gallery)).collect::<Result<_, _>>()?;
    for (batch_idx, &(level_idx, _)) in sizes.iter().enumerate() {
        let views: Vec<Vec<Views>> = (drawn.iter_mut().zip(&groups))
            .map(|(group, shown)| {
                std::mem::take(&mut group[batch_idx])
                    .into_iter()
                    .map(|example| shown.views(examples, example))
                    .collect()
            })
            .collect();
        let counts = Counts::of(views.iter().flatten());
        for (views, group) in views.into_iter().zip(&mut parts).filter(|(views, _)| !views.is_empty()) {
            let runs = views.into_iter().map(|views| Run { decisions: vec![views] }).collect();
            let part = assemble(examples, level_idx, runs, counts)?;
            group.parts.push(crate::training::batch::Part { batch_idx, ..part });
        }
    }
    Ok(parts)
}

/// A group's decisions, level by level.
fn draw_group(
    examples: &Examples<'_>,
    config: &TrainConfig,
    sizes: &[(usize, usize)],
    rng: &mut impl Rng,
) -> Vec<Vec<Example>> {
    let pairs = draw_pairs(examples, rng);
    let decision = |level_idx: usize, rng: &mut _| {
        (0..DRAWS).find_map(|_| {
            let [a, b] = pairs[Rng::random_range(rng, 0..pairs.len())];
            let pair = if Rng::random(rng) { [a, b] } else { [b, a] };
            examples.draw_of_pair(level_idx, pair, config.pairing, rng)
        })
    };
    sizes
        .iter()
        .map(|&(level_idx, size)| (0..size.div_ceil(GROUPS)).filter_map(|_| decision(level_idx, rng)).collect())
        .collect()
}

/// The pictures that a group's decisions look at, numbered.
struct Shown {
    /// By trial and frame.
    numbers: BTreeMap<(usize, usize), u32>,
}

impl Shown {
    fn new<'e>(examples: impl Iterator<Item = &'e Example>) -> Self {
        let mut numbers = BTreeMap::new();
        for example in examples {
            let window = example.window.begin as usize..example.window.end as usize;
            numbers.extend(window.map(|frame| ((example.demonstration, frame), 0)));
            numbers.insert((example.trial, example.frame), 0);
        }
        numbers.values_mut().zip(0..).for_each(|(of_frame, number)| *of_frame = number);
        Self { numbers }
    }

    /// Without parts yet.
    fn group(&self, examples: &Examples<'_>, gallery: &dyn Gallery) -> Result<Group, TrainError> {
        let (width, height) = gallery.size();
        let mut pictures = Pictures::of_size(width, height);
        let mut by_trial: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        self.numbers.keys().for_each(|&(trial, frame)| by_trial.entry(trial).or_default().push(frame));
        for (position, frames) in by_trial {
            fetch(examples.data(), gallery, &Wanted { position, frames }, &mut pictures)?;
        }
        Ok(Group { pictures, parts: Vec::new() })
    }

    fn picture(&self, trial: usize, frame: usize) -> PictureIndex {
        PictureIndex(self.numbers[&(trial, frame)])
    }

    fn views(&self, examples: &Examples<'_>, example: Example) -> Views {
        let window = example.window.begin as usize..example.window.end as usize;
        Views {
            n_slots: examples.data().trials[example.trial].family.n_slots(),
            window: SpecificationRows::Pictures(
                window.map(|frame| self.picture(example.demonstration, frame)).collect(),
            ),
            state: States::Pictures(vec![self.picture(example.trial, example.frame)]),
            example,
        }
    }
}

/// Pictures of trials from all over the dataset, and which trials these are.
pub(super) fn sample(data: &DatasetTrials, gallery: &dyn Gallery) -> Result<(PictureSample, Vec<usize>), TrainError> {
    let every = data.trials.len().div_ceil(SAMPLE_TRIALS).max(1);
    let sampled: Vec<usize> = (0..data.trials.len()).step_by(every).collect();
    let (width, height) = gallery.size();
    let mut sample = PictureSample { pictures: Pictures::of_size(width, height), lengths: Vec::new() };
    for &trial in &sampled {
        let wanted = all_frames(data, trial);
        fetch(data, gallery, &wanted, &mut sample.pictures)?;
        sample.lengths.push(wanted.frames.len());
    }
    Ok((sample, sampled))
}

/// Adds pictures of a trial; an error says of which.
pub(super) fn fetch(
    data: &DatasetTrials,
    gallery: &dyn Gallery,
    wanted: &Wanted,
    into: &mut Pictures,
) -> Result<(), TrainError> {
    gallery.fetch(wanted, into).map_err(|problem| {
        let of = &data.trials[wanted.position];
        TrainError::Trial { task: of.task_id.clone(), trial: of.trial, problem }
    })
}
