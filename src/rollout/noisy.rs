//! A policy that is told where things are, but not exactly.
//!
//! # Invariants
//!
//! What it is told depends on the episode's seed and the decision alone. World, expert and judge know where things are.

use std::sync::Arc;

use crate::model::{Pictures, ScopingKind, SpecificationRows};
use crate::rollout::{Decision, Policy, PolicyError, Query, Specification};
use crate::seed::Seed;
use crate::trace::{ObservationNoise, ObservationRows, SpecificationForm};

/// A policy behind noise.
pub struct Noisy {
    policy: Box<dyn Policy>,
    noise: ObservationNoise,
    /// Of each episode.
    seeds: Vec<Seed>,
    /// What each episode was told of its task, once it was told.
    specifications: Vec<Option<Arc<Specification>>>,
}

impl Noisy {
    /// A policy that acts episodes with these seeds, in their order.
    pub fn new(policy: Box<dyn Policy>, noise: ObservationNoise, seeds: Vec<Seed>) -> Self {
        let specifications = vec![None; seeds.len()];
        Self { policy, noise, seeds, specifications }
    }

    fn told(&mut self, query: &Query) -> Query {
        let seed = self.seeds.get(query.episode).copied().unwrap_or(Seed(0)).derive("noise", &[]);
        let mut query = query.clone();
        let noise = self.noise;
        noise.put_off(&mut query.observation.slots_m, u64::from(query.decision), seed.derive("world", &[]));
        if let Some(known) = self.specifications.get_mut(query.episode) {
            let told = known.get_or_insert_with(|| Arc::new(put_off(noise, &query.specification, seed)));
            query.specification = Arc::clone(told);
        }
        query
    }
}

/// A specification whose positions are off, where it has some.
fn put_off(noise: ObservationNoise, specification: &Specification, seed: Seed) -> Specification {
    let mut specification = specification.clone();
    let seed = seed.derive("demonstration", &[]);
    if let SpecificationRows::Observations(rows) = &mut specification.rows {
        let frames = ObservationRows::iter_mut(rows).enumerate();
        frames.for_each(|(frame, row)| noise.put_off(row.positions, frame as u64, seed));
    }
    specification
}

impl Policy for Noisy {
    fn name(&self) -> &str {
        self.policy.name()
    }

    fn scoping(&self) -> ScopingKind {
        self.policy.scoping()
    }

    fn reads(&self) -> SpecificationForm {
        self.policy.reads()
    }

    fn detect(&self, pictures: &Pictures) -> Result<Option<ObservationRows>, PolicyError> {
        self.policy.detect(pictures)
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        let told: Vec<Query> = queries.iter().map(|query| self.told(query)).collect();
        self.policy.decide(&told)
    }
}
