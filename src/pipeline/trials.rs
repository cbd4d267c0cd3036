//! Which trial an episode acts: counts and seed from identity alone.

use rand::Rng as _;

use crate::pipeline::CountsSpec;
use crate::seed::Seed;
use crate::task::{Family, Task, Trial};

/// What counts are drawn from when the pipeline file says nothing.
pub(super) const DEFAULT_COUNTS: CountsSpec = CountsSpec { min: 1, max: 3 };

/// The trial `index` of a task for one purpose (`demonstration`, `rollout/stacking_unseen`, …).
pub(super) fn trial(run_seed: u64, purpose: &str, task: &Task, index: u32, counts: Option<CountsSpec>) -> Trial {
    let seed = Seed(run_seed).derive(&format!("{purpose}/{}", task.id), &[u64::from(index)]);
    let counts = match task.family {
        Family::BlockStacking => Vec::new(),
        Family::ObjectSorting => draw_counts(seed, counts.unwrap_or(DEFAULT_COUNTS)),
    };
    Trial { index, counts, seed }
}

fn draw_counts(seed: Seed, CountsSpec { min, max }: CountsSpec) -> Vec<u16> {
    let mut rng = seed.derive("counts", &[]).rng();
    (0..4).map(|_| rng.random_range(min..=max)).collect()
}
