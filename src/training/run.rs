//! One network's training from its first or resumed step to its last.

use std::path::Path;

use crate::model::{ComputeDevice, ModelConfig, Network, ScopingKind};
use crate::seed::Seed;
use crate::trace::SpecificationForm;
use crate::training::checkpoint::{Checkpoints, Resumed, Standing};
use crate::training::facts::Facts;
use crate::training::lesson::Lesson;
use crate::training::source::{Held, Pictured, Source};
use crate::training::{Examples, Grain, Hooks, Learner, TrainConfig, TrainError, TrainSummary};

/// A training with everything settled but its network.
pub(super) struct Run<'r> {
    pub(super) on: ComputeDevice,
    pub(super) config: &'r TrainConfig,
    pub(super) source: Source<'r>,
    pub(super) facts: &'r Facts,
    pub(super) specification: SpecificationForm,
    pub(super) scoping: ScopingKind,
    pub(super) grain: Grain,
    pub(super) model: &'r ModelConfig,
    pub(super) folder: &'r Path,
    /// Whether the network has weights that were learned: it is not to get to know its pictures again.
    pub(super) has_begun: bool,
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
        Checkpoints::new(self.folder, self.model, self.facts.hash.clone())
    }

    pub(super) fn train<N: Network>(&self, network: N, hooks: &mut Hooks<'_>) -> Result<(N, Trained), TrainError> {
        let checkpoints = self.checkpoints();
        let device = network.device();
        let fresh = Learner::new(network, device, self.config.clip_norm, !self.on.is_cpu());
        let mut standing_at = checkpoints.resume(fresh)?;
        let resumed_at = standing_at.as_ref().map_or(0, |resumed: &Resumed<N, Standing>| resumed.standing.step);
        let mut held = Held::of(self.source);
        let Resumed { learner, standing } = loop {
            let step = standing_at.as_ref().map_or(0, |resumed| resumed.standing.step);
            let until;
            (held, until) = held.turn_to(step, self.seed)?;
            let examples = self.examples(&held)?;
            let pictures = held.gallery()?;
            let gallery = pictures.as_ref().map(Pictured::as_gallery);
            let until = until.min(self.config.n_steps());
            let lesson = Lesson { config: self.config, examples: &examples, gallery, seed: self.seed, until };
            let begin = |learner| {
                if self.has_begun { Ok(lesson.first_standing(learner)) } else { lesson.begin(learner) }
            };
            let resumed = standing_at.or_else(begin)?;
            let learned = lesson.learn(resumed, &checkpoints, hooks)?;
            if learned.standing.step >= self.config.n_steps() {
                break learned;
            }
            standing_at = Ok(learned);
        };
        Ok((learner.into_module(), Trained { standing, resumed_at }))
    }

    /// What is in memory, indexed. Of a buffer's trials levels and tasks are numbered as those of all.
    fn examples<'h>(&self, held: &'h Held<'_>) -> Result<Examples<'h>, TrainError> {
        let examples = Examples::of(held.data(), self.specification, self.scoping, self.grain)?;
        Ok(match held {
            Held::Here(..) => examples,
            Held::Streamed { .. } => examples.among(&self.facts.levels(self.scoping), &self.facts.task_ids),
        })
    }
}
