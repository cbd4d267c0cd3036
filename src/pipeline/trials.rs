//! Which trial an episode acts: counts and seed from identity alone.

use rand::Rng as _;

use crate::pipeline::CountsSpec;
use crate::seed::Seed;
use crate::task::{Task, Trial};

/// What counts are drawn from when the pipeline file says nothing.
pub(super) const DEFAULT_COUNTS: CountsSpec = CountsSpec { min: 1, max: 3 };

/// The trial `index` of a task for one purpose (`demonstration`, `rollout/stacking_unseen`, …).
pub(super) fn trial(run_seed: u64, purpose: &str, task: &Task, index: u32, counts: Option<CountsSpec>) -> Trial {
    let seed = Seed(run_seed).derive(&format!("{purpose}/{}", task.id), &[u64::from(index)]);
    let CountsSpec { min, max } = counts.unwrap_or(DEFAULT_COUNTS);
    let mut rng = seed.derive("counts", &[]).rng();
    Trial { index, counts: task.counts(|| rng.random_range(min..=max)), seed }
}
