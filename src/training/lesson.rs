//! Steps on trials that are in memory.

use crate::model::Network;
use crate::seed::Seed;
use crate::training::checkpoint::{Checkpoints, Resumed, Standing};
use crate::training::curriculum::LevelErrors;
use crate::training::learner::Stepped;
use crate::training::losses::group_losses;
use crate::training::merged::Merged;
use crate::training::{
    Examples, Gallery, Group, Hooks, Learner, Losses, Metric, Part, Progress, TrainConfig, TrainError, draw, seen,
};

/// What a step with this seed draws from pictures.
fn seen_seed(step: Seed) -> Seed {
    step.derive("seen", &[])
}

/// What steps draw from, and up to which.
pub(super) struct Lesson<'l> {
    pub(super) config: &'l TrainConfig,
    pub(super) examples: &'l Examples<'l>,
    pub(super) gallery: Option<&'l dyn Gallery>,
    pub(super) seed: Seed,
    /// The step after which others are in memory, or there is none any more.
    pub(super) until: u32,
}

impl Lesson<'_> {
    /// Goes on to the last step that draws from these trials.
    pub(super) fn learn<N: Network>(
        &self,
        from: Resumed<N, Standing>,
        checkpoints: &Checkpoints<'_>,
        hooks: &mut Hooks<'_>,
    ) -> Result<Resumed<N, Standing>, TrainError> {
        let Resumed { mut learner, mut standing } = from;
        let before = self.config.detector.n_steps();
        while standing.step < self.until {
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
        Ok(Resumed { learner, standing })
    }

    /// Before the first step, with weights that are as they should be.
    pub(super) fn first_standing<N: Network>(&self, learner: Learner<N>) -> Resumed<N, Standing> {
        let errors = LevelErrors::new(self.examples.levels().count());
        let standing = Standing { step: 0, examples: 0, dropped_gradients: 0, errors, metrics: Vec::new() };
        Resumed { learner, standing }
    }

    /// Before the first step of a network that has learned nothing: it gets to know its pictures.
    pub(super) fn begin<N: Network>(&self, learner: Learner<N>) -> Result<Resumed<N, Standing>, TrainError> {
        let Resumed { learner, standing } = self.first_standing(learner);
        let Some(gallery) = self.gallery else { return Ok(Resumed { learner, standing }) };
        let (sample, _) = seen::sample(self.examples.data(), gallery)?;
        let network = learner.module().clone().calibrated(&sample, self.seed.derive("acquainted", &[]))?;
        Ok(Resumed { learner: learner.with_module(network), standing })
    }

    /// One step; the learner after it and the weighed loss.
    fn step<N: Network>(&self, learner: Learner<N>, standing: &mut Standing) -> Result<(Learner<N>, f32), TrainError> {
        let step_seed = self.step_seed(standing.step);
        let learning_rate = self.config.learning_rate_at(standing.step);
        let mut chosen = standing.errors.levels(self.config.curriculum, step_seed.derive("levels", &[]));
        chosen.retain(|&level| self.examples.has_level(level));
        let levels: Vec<_> = self.examples.levels().collect();
        let sizes: Vec<(usize, usize)> =
            chosen.iter().map(|&level| (level, self.batch_size(levels[level].1))).collect();
        let groups = self.draw(&sizes, step_seed)?;
        self.announce(standing.step + 1);
        let step = standing.step + 1;
        let names: Vec<&'static str> = chosen.iter().map(|&level| levels[level].0.name()).collect();
        let Stepped { learner, losses, dropped } = match learner.learns_at_once() {
            true => self.learn_at_once(learner, &groups, &names, step)?,
            false => self.learn_by_group(learner, &groups, chosen.len(), step)?,
        };
        standing.step = step;
        standing.dropped_gradients += u32::from(dropped);
        let mut total = 0.0;
        for (batch_idx, (&level, losses)) in chosen.iter().zip(losses).enumerate() {
            let of_batch = groups.iter().flat_map(|group| &group.parts).filter(|part| part.batch_idx == batch_idx);
            let size: usize = of_batch.map(|part| part.ends.len()).sum();
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

    /// One step on the processor; losses by mini-batch.
    fn learn_by_group<N: Network>(
        &self,
        learner: Learner<N>,
        groups: &[Group],
        n_batches: usize,
        step: u32,
    ) -> Result<Stepped<N, Vec<Losses>>, TrainError> {
        let weights = self.config.loss;
        let lose = |network: &N, group: &Group| group_losses(network, group, weights, step);
        let Stepped { learner, losses, dropped } =
            learner.step(groups, self.config.learning_rate_at(step - 1), lose)?;
        let losses = losses.concat();
        let parts: Vec<&Part> = groups.iter().flat_map(|group| &group.parts).collect();
        let of_batch = |batch_idx: usize| {
            let own = parts.iter().zip(&losses).filter(move |(part, _)| part.batch_idx == batch_idx);
            own.map(|(_, losses)| *losses).fold(Losses::default(), Losses::plus)
        };
        Ok(Stepped { learner, losses: (0..n_batches).map(of_batch).collect(), dropped })
    }

    /// One step on an accelerator; losses by mini-batch.
    fn learn_at_once<N: Network>(
        &self,
        learner: Learner<N>,
        groups: &[Group],
        levels: &[&'static str],
        step: u32,
    ) -> Result<Stepped<N, Vec<Losses>>, TrainError> {
        let weights = self.config.loss;
        let merged = Merged::new(groups, levels.len())?;
        let lose = |network: &N| Ok::<_, TrainError>(merged.losses(network, weights)?);
        let told = |read: &[f32]| {
            let losses = merged.told(read, weights);
            match losses.iter().zip(levels).find(|(losses, _)| !losses.total.is_finite()) {
                Some((losses, level)) => Err(TrainError::NotFinite { step, level, found: losses.total }),
                None => Ok(losses),
            }
        };
        learner.step_at_once(self.config.learning_rate_at(step - 1), lose, told)
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
        if let Some(gallery) = self.gallery.filter(|_| step < self.until) {
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
