//! The training of a detector, before and apart from the network behind it.
//!
//! # Source
//!
//! Paper, section V-D: the detector is trained separately, by regression on positions.

use std::path::Path;

use burn::tensor::Tensor;
use rand::Rng as _;
use rand::seq::SliceRandom as _;
use rayon::iter::{IntoParallelIterator as _, IntoParallelRefIterator as _, ParallelIterator as _};
use serde::{Deserialize, Serialize};

use crate::dataset::{DatasetTrials, Wanted};
use crate::model::{
    ComputeDevice, Detector, ModelConfig, PictureSample, Pictures, detected_rows, detection_loss, loss_and_distance,
    positions_in_world, scalar,
};
use crate::seed::Seed;
use crate::trace::{Observation, ObservationRows};
use crate::training::checkpoint::{Checkpoints, Resumed, Stands};
use crate::training::config::TrainConfig;
use crate::training::detector_metrics::DetectorMetric;
use crate::training::learner::{Learner, Stepped};
use crate::training::seen::{all_frames, fetch, sample};
use crate::training::{Gallery, Hooks, Progress, TrainError};

/// Groups of a step. A fixed number, since the sum of gradients must not depend on the machine.
const GROUPS: usize = 2;
/// Pictures of a trial in a group, at most. They show much the same, which slows a network of VGG16's shape; colour slots
/// learn as well from more of them.
const OF_TRIAL: usize = 2;

/// Trials whose pictures are in memory at a time while a finished detector looks at all of them; as many are made ready.
const PORTION: usize = 64;

/// What the training of a detector is beyond its weights.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DetectorStanding {
    step: u32,
    /// Gradients that were no numbers and were left out.
    #[serde(default)]
    pub(super) dropped_gradients: u32,
    pub(super) metrics: Vec<DetectorMetric>,
}

impl Stands for DetectorStanding {
    fn step(&self) -> u32 {
        self.step
    }
}

/// The training of a detector with everything settled but the detector itself.
pub(super) struct DetectorRun<'r> {
    pub(super) config: &'r TrainConfig,
    pub(super) data: &'r DatasetTrials,
    pub(super) on: ComputeDevice,
    /// Of the data.
    pub(super) hash: String,
    pub(super) gallery: &'r dyn Gallery,
    pub(super) model: &'r ModelConfig,
    pub(super) folder: &'r Path,
    pub(super) seed: Seed,
}

/// Pictures, and what is to be seen in them.
struct Shown {
    pictures: Pictures,
    /// Of all slots in the world, in metres: `[F * N]`.
    positions: Vec<[f32; 3]>,
}

impl DetectorRun<'_> {
    /// Trains a detector, or goes on where a checkpoint stands; its learning curve beside it.
    pub(super) fn train<D: Detector>(
        &self,
        detector: D,
        hooks: &mut Hooks<'_>,
    ) -> Result<(D, DetectorStanding), TrainError> {
        if let Some(empty) = self.data.trials.iter().find(|trial| trial.n_frames == 0) {
            let (task, problem) = (empty.task_id.clone(), "has no frames".to_owned());
            return Err(TrainError::Trial { task, trial: empty.trial, problem });
        }
        let checkpoints = Checkpoints::of_detector(self.folder, self.model, self.hash.clone());
        let device = detector.device();
        let fresh = Learner::new(detector, device, self.config.clip_norm, !self.on.is_cpu());
        let (mut learner, mut standing) = match checkpoints.resume(fresh)? {
            Ok(Resumed { learner, standing }) => (learner, standing),
            Err(learner) => (self.calibrated(learner)?, DetectorStanding::default()),
        };
        let n_steps = self.config.detector.n_steps();
        let mut is_saved = standing.step == n_steps;
        while standing.step < n_steps {
            if (hooks.should_stop)() {
                checkpoints.save(&learner, &standing)?;
                return Err(TrainError::Stopped { step: standing.step });
            }
            let loss;
            (learner, loss) = self.step(learner, &mut standing)?;
            (hooks.on_progress)(Progress { step: standing.step, steps: self.config.n_steps_in_all(), loss });
            is_saved = standing.step.is_multiple_of(self.config.checkpoint_every);
            if is_saved {
                checkpoints.save(&learner, &standing)?;
            }
        }
        if !is_saved {
            checkpoints.save(&learner, &standing)?;
        }
        Ok((learner.into_module(), standing))
    }

    /// Before the first step.
    fn calibrated<D: Detector>(&self, learner: Learner<D>) -> Result<Learner<D>, TrainError> {
        let (sample, trials): (PictureSample, _) = sample(self.data, self.gallery)?;
        let rows = trials.iter().flat_map(|&trial| &self.data.trials[trial].observations).copied().collect();
        let rows = ObservationRows::new(self.data.n_slots, rows);
        let seed = self.seed.derive("acquainted", &[]);
        let positions = positions_in_world(&rows, &sample.pictures.grippers);
        let detector = learner.module().clone().calibrated(&sample, &positions, seed)?;
        Ok(learner.with_module(detector))
    }

    /// One step; the learner after it and the loss.
    fn step<D: Detector>(
        &self,
        learner: Learner<D>,
        standing: &mut DetectorStanding,
    ) -> Result<(Learner<D>, f32), TrainError> {
        let groups: Vec<Shown> = self
            .draw(standing.step)
            .into_par_iter()
            .map(|drawn| self.show(&drawn))
            .collect::<Result<_, TrainError>>()?;
        if standing.step + 1 < self.config.detector.n_steps() {
            self.gallery.announce(&self.draw(standing.step + 1).concat());
        }
        let learning_rate = self.config.detector_learning_rate_at(standing.step);
        let step = standing.step + 1;
        let pictures = groups.iter().map(|shown| shown.pictures.n as u32).sum();
        let Stepped { learner, losses: [loss, distance_m], dropped } = match learner.learns_at_once() {
            true => learn_at_once(learner, groups, learning_rate, step)?,
            false => learn_by_group(learner, &groups, learning_rate, step)?,
        };
        standing.step = step;
        standing.dropped_gradients += u32::from(dropped);
        if standing.step.is_multiple_of(self.config.metrics_every) || standing.step == self.config.detector.n_steps() {
            standing.metrics.push(DetectorMetric { step: standing.step, loss, distance_m, learning_rate, pictures });
        }
        Ok((learner, loss))
    }

    /// What a step looks at, group by group: some trials, and a few frames of each.
    fn draw(&self, step: u32) -> Vec<Vec<Wanted>> {
        let seed = self.seed.derive("detector_step", &[u64::from(step)]);
        let of_group = |group: usize| {
            let mut rng = seed.derive("group", &[group as u64]).rng();
            let mut n_left = self.config.detector.n_pictures().div_ceil(GROUPS);
            let mut drawn = Vec::new();
            while n_left > 0 {
                let trial = rng.random_range(0..self.data.trials.len());
                let Wanted { position, mut frames } = all_frames(self.data, trial);
                frames.shuffle(&mut rng);
                frames.truncate(OF_TRIAL.min(n_left));
                frames.sort_unstable();
                n_left -= frames.len();
                drawn.push(Wanted { position, frames });
            }
            drawn
        };
        (0..GROUPS).map(of_group).collect()
    }

    /// A group's pictures with what is to be seen in them.
    fn show(&self, drawn: &[Wanted]) -> Result<Shown, TrainError> {
        let (n_slots, width) = (self.data.n_slots, Observation::width(self.data.n_slots));
        let (across, down) = self.gallery.size();
        let (mut pictures, mut rows) = (Pictures::of_size(across, down), Vec::new());
        for wanted in drawn {
            fetch(self.data, self.gallery, wanted, &mut pictures)?;
            let observations = &self.data.trials[wanted.position].observations;
            rows.extend(wanted.frames.iter().flat_map(|&frame| &observations[frame * width..][..width]));
        }
        let positions = positions_in_world(&ObservationRows::new(n_slots, rows), &pictures.grippers);
        Ok(Shown { pictures, positions })
    }
}

/// One step on the processor; the loss and the mean distance in metres.
fn learn_by_group<D: Detector>(
    learner: Learner<D>,
    groups: &[Shown],
    learning_rate: f64,
    step: u32,
) -> Result<Stepped<D, [f32; 2]>, TrainError> {
    let weight = 1.0 / GROUPS as f32;
    let lose = |detector: &D, shown: &Shown| -> Result<_, TrainError> {
        let loss = detection_loss(detector.detect(&shown.pictures)?, &shown.positions)?;
        let total: Tensor<1> = loss.total * weight;
        let found = finite(scalar(total.clone())?, step)?;
        Ok(([found, loss.distance_m * weight], Some(total)))
    };
    let Stepped { learner, losses, dropped } = learner.step(groups, learning_rate, lose)?;
    let losses = [0, 1].map(|at| losses.iter().map(|losses| losses[at]).sum::<f32>());
    Ok(Stepped { learner, losses, dropped })
}

/// One step on an accelerator, with the pictures of all groups, which are equally many, together.
fn learn_at_once<D: Detector>(
    learner: Learner<D>,
    groups: Vec<Shown>,
    learning_rate: f64,
    step: u32,
) -> Result<Stepped<D, [f32; 2]>, TrainError> {
    let mut all = Shown { pictures: Pictures::default(), positions: Vec::new() };
    for Shown { pictures, positions } in groups {
        all.pictures.append(pictures);
        all.positions.extend(positions);
    }
    let lose = |detector: &D| -> Result<_, TrainError> {
        let [loss, distance] = loss_and_distance(detector.detect(&all.pictures)?, &all.positions);
        Ok((Tensor::cat(vec![loss.clone(), distance], 0), loss))
    };
    let told = |read: &[f32]| match *read {
        [loss, distance_m] => Ok([finite(loss, step)?, distance_m]),
        _ => Err(TrainError::NotFinite { step, level: "detector", found: f32::NAN }),
    };
    learner.step_at_once(learning_rate, lose, told)
}

/// A loss that is none ends the training.
fn finite(found: f32, step: u32) -> Result<f32, TrainError> {
    if found.is_finite() { Ok(found) } else { Err(TrainError::NotFinite { step, level: "detector", found }) }
}

/// The same trials as a detector sees them: observations are what it finds in their pictures.
pub(super) fn detected<D: Detector>(
    detector: &D,
    data: &DatasetTrials,
    gallery: &dyn Gallery,
) -> Result<DatasetTrials, TrainError> {
    let detector = detector.clone().valid();
    let (width, height) = gallery.size();
    let of_trial = |wanted: &Wanted| {
        let mut pictures = Pictures::of_size(width, height);
        fetch(data, gallery, wanted, &mut pictures)?;
        Ok(detected_rows(&detector, &pictures, data.n_slots)?.into_values())
    };
    let trials: Vec<Wanted> = (0..data.trials.len()).map(|trial| all_frames(data, trial)).collect();
    let mut observations: Vec<Vec<f32>> = Vec::with_capacity(trials.len());
    let mut portions = trials.chunks(PORTION).peekable();
    portions.peek().into_iter().for_each(|first| gallery.announce(first));
    while let Some(portion) = portions.next() {
        // What was announced before the last is let go.
        gallery.announce(portions.peek().copied().unwrap_or_default());
        observations.extend(portion.par_iter().map(of_trial).collect::<Result<Vec<_>, TrainError>>()?);
    }
    let mut detected = data.clone();
    detected.trials.iter_mut().zip(observations).for_each(|(trial, rows)| trial.observations = rows);
    Ok(detected)
}
