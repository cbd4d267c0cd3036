//! One network's training from its first or resumed step to its last.

use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::artifact;
use crate::dataset::DatasetTrials;
use crate::model::{ModelConfig, Network};
use crate::seed::Seed;
use crate::training::checkpoint::{Checkpoints, Resumed, Standing};
use crate::training::curriculum::LevelErrors;
use crate::training::learner::{Stepped, group_losses};
use crate::training::{
    Examples, Gallery, Group, Hooks, Learner, Losses, Metric, Part, Progress, TrainConfig, TrainError, TrainSummary,
    draw, seen,
};

/// Hash of what is learned from: a checkpoint belongs to it.
pub(super) fn dataset_hash(data: &DatasetTrials) -> String {
    let mut hasher = Sha256::new();
    for trial in &data.trials {
        hasher.update(trial.task_id.as_bytes());
        hasher.update(trial.split.name());
        hasher.update([trial.trial.to_le_bytes(), (trial.n_frames as u32).to_le_bytes()].concat());
        trial.observations.iter().for_each(|value| hasher.update(value.to_le_bytes()));
        let grippers = trial.grippers.iter().flat_map(|gripper| gripper.in_world_m);
        grippers.for_each(|value| hasher.update(value.to_le_bytes()));
        trial.instructions.iter().flat_map(|said| said.words).for_each(|word| hasher.update(word.to_le_bytes()));
    }
    artifact::hex(&hasher.finalize())
}

/// What a step with this seed draws from pictures.
fn seen_seed(step: Seed) -> Seed {
    step.derive("seen", &[])
}

/// A training with everything settled but its network.
pub(super) struct Run<'r> {
    pub(super) config: &'r TrainConfig,
    pub(super) examples: &'r Examples<'r>,
    pub(super) gallery: Option<&'r dyn Gallery>,
    pub(super) model: &'r ModelConfig,
    pub(super) folder: &'r Path,
    pub(super) seed: Seed,
}

/// A training that has come to its end.
pub(super) struct Trained {
    pub(super) standing: Standing,
    resumed_at: u32,
}

impl Trained {
    pub(super) fn summary(self) -> TrainSummary {
        let Standing { step, examples, dropped_gradients, metrics, errors: _ } = self.standing;
        TrainSummary { steps: step, examples, dropped_gradients, resumed_at: self.resumed_at, metrics }
    }
}

impl Run<'_> {
    pub(super) fn checkpoints(&self) -> Checkpoints<'_> {
        Checkpoints::new(self.folder, self.model, dataset_hash(self.examples.data()))
    }

    pub(super) fn train<N: Network>(&self, network: N, hooks: &mut Hooks<'_>) -> Result<(N, Trained), TrainError> {
        let checkpoints = self.checkpoints();
        let device = network.device();
        let fresh = Learner::new(network, device, self.config.clip_norm);
        let Resumed { mut learner, mut standing } = match checkpoints.resume(fresh)? {
            Ok(resumed) => resumed,
            Err(learner) => self.begin(learner)?,
        };
        let resumed_at = standing.step;
        let before = self.config.detector.n_steps();
        while standing.step < self.config.n_steps() {
            if (hooks.should_stop)() {
                checkpoints.save(&learner, &standing)?;
                return Err(TrainError::Stopped { step: before + standing.step });
            }
            let loss;
            (learner, loss) = self.step(learner, &mut standing)?;
            let steps = self.config.n_steps_in_all();
            (hooks.on_progress)(Progress { step: before + standing.step, steps, loss });
            if standing.step.is_multiple_of(self.config.checkpoint_every) && standing.step < self.config.n_steps() {
                checkpoints.save(&learner, &standing)?;
            }
        }
        Ok((learner.into_module(), Trained { standing, resumed_at }))
    }

    /// Before the first step.
    fn begin<N: Network>(&self, learner: Learner<N>) -> Result<Resumed<N, Standing>, TrainError> {
        let errors = LevelErrors::new(self.examples.levels().count());
        let standing = Standing { step: 0, examples: 0, dropped_gradients: 0, errors, metrics: Vec::new() };
        let Some(gallery) = self.gallery else { return Ok(Resumed { learner, standing }) };
        let (sample, _) = seen::sample(self.examples.data(), gallery)?;
        let network = learner.module().clone().calibrated(&sample, self.seed.derive("acquainted", &[]))?;
        Ok(Resumed { learner: learner.with_module(network), standing })
    }

    /// One step; the learner after it and the weighed loss.
    fn step<N: Network>(&self, learner: Learner<N>, standing: &mut Standing) -> Result<(Learner<N>, f32), TrainError> {
        let step_seed = self.step_seed(standing.step);
        let learning_rate = self.config.learning_rate_at(standing.step);
        let chosen = standing.errors.levels(self.config.curriculum, step_seed.derive("levels", &[]));
        let levels: Vec<_> = self.examples.levels().collect();
        let sizes: Vec<(usize, usize)> =
            chosen.iter().map(|&level| (level, self.batch_size(levels[level].1))).collect();
        let groups = self.draw(&sizes, step_seed)?;
        self.announce(standing.step + 1);
        let weights = self.config.loss;
        let step = standing.step + 1;
        let lose = |network: &N, group: &Group| group_losses(network, group, weights, step);
        let Stepped { learner, losses, dropped } = learner.step(&groups, learning_rate, lose)?;
        let losses = losses.concat();
        standing.step = step;
        standing.dropped_gradients += u32::from(dropped);
        let parts: Vec<&Part> = groups.iter().flat_map(|group| &group.parts).collect();
        let mut total = 0.0;
        for (batch_idx, &level) in chosen.iter().enumerate() {
            let of_batch = || parts.iter().zip(&losses).filter(move |(part, _)| part.batch_idx == batch_idx);
            let losses = of_batch().map(|(_, losses)| *losses).fold(Losses::default(), Losses::plus);
            let size: usize = of_batch().map(|(part, _)| part.ends.len()).sum();
            total += losses.total;
            standing.examples += size as u64;
            standing.errors.update(level, losses.total);
            if standing.step.is_multiple_of(self.config.metrics_every) || standing.step == self.config.n_steps() {
                let program = levels[level].0;
                standing.metrics.push(Metric::new(standing.step, program, losses, learning_rate, size as u32));
            }
        }
        Ok((learner, total))
    }

    /// A step's mini-batches: of each level its size.
    fn draw(&self, sizes: &[(usize, usize)], seed: Seed) -> Result<Vec<Group>, TrainError> {
        if let Some(gallery) = self.gallery {
            return seen::draw_seen(self.examples, gallery, self.config, sizes, seen_seed(seed));
        }
        let mut groups = Vec::new();
        for (batch_idx, &(level, size)) in sizes.iter().enumerate() {
            let parts = draw(self.examples, self.config, level, size, seed.derive("batch", &[batch_idx as u64]))?;
            groups.extend(parts.into_iter().map(|part| Group::from(Part { batch_idx, ..part })));
        }
        Ok(groups)
    }

    /// Lets pictures be made ready for a step while the one before it is computed.
    fn announce(&self, step: u32) {
        if let Some(gallery) = self.gallery.filter(|_| step < self.config.n_steps()) {
            gallery.announce(&seen::wanted(self.examples, seen_seed(self.step_seed(step))));
        }
    }

    fn step_seed(&self, step: u32) -> Seed {
        self.seed.derive("step", &[u64::from(step)])
    }

    fn batch_size(&self, is_root: bool) -> usize {
        let batch = self.config.batch as usize;
        if is_root { batch } else { batch.div_ceil(2) }
    }
}
