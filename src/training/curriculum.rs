//! Which levels of the hierarchy a step learns from.
//!
//! # Source
//!
//! Paper, section IV: "the frequency of each mini-batch being fetched is proportional to the model's prediction error
//! with respect to the corresponding program".

use rand::Rng as _;
use serde::{Deserialize, Serialize};

use crate::seed::Seed;
use crate::training::config::Curriculum;

/// How fast a level's error follows its losses.
const FOLLOW: f32 = 0.1;
/// Added to every error, so that no level is forgotten.
const LEAST_ERROR: f32 = 0.01;

/// The errors of all levels, as far as they are known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LevelErrors(pub(crate) Vec<f32>);

impl LevelErrors {
    pub(crate) fn new(n_levels: usize) -> Self {
        Self(vec![1.0; n_levels])
    }

    /// The levels of a step, as many as there are; a level may come twice.
    pub(crate) fn levels(&self, curriculum: Curriculum, seed: Seed) -> Vec<usize> {
        let n_levels = self.0.len();
        match curriculum {
            Curriculum::Equal => (0..n_levels).collect(),
            Curriculum::Adaptive => {
                let mut rng = seed.rng();
                (0..n_levels).map(|_| self.proportional(rng.random())).collect()
            }
        }
    }

    /// The level at a share (0 to 1) of the sum of errors.
    fn proportional(&self, share: f32) -> usize {
        let total: f32 = self.0.iter().map(|error| error + LEAST_ERROR).sum();
        let mut left = share * total;
        let within = |error: &f32| {
            left -= error + LEAST_ERROR;
            left < 0.0
        };
        self.0.iter().position(within).unwrap_or(self.0.len() - 1)
    }

    /// Takes in a mini-batch's loss.
    pub(crate) fn update(&mut self, level: usize, loss: f32) {
        self.0[level] += FOLLOW * (loss - self.0[level]);
    }
}

#[cfg(test)]
mod tests {
    use super::{Curriculum, LevelErrors, Seed};

    #[test]
    fn adaptive_levels_come_in_proportion_to_their_errors() {
        let mut errors = LevelErrors::new(2);
        for _ in 0..200 {
            errors.update(0, 3.0);
            errors.update(1, 1.0);
        }
        let drawn: Vec<usize> =
            (0..500).flat_map(|step| errors.levels(Curriculum::Adaptive, Seed(1).derive("step", &[step]))).collect();
        let share = drawn.iter().filter(|&&level| level == 0).count() as f32 / drawn.len() as f32;
        assert!((share - 0.75).abs() < 0.05, "{share}");
        assert_eq!(errors.levels(Curriculum::Equal, Seed(1)), [0, 1]);
    }
}
