//! Results summed up over training seeds.

use std::collections::BTreeMap;

use crate::report::PaperValue;
use crate::report::interval::wilson;
use crate::report::summary::{Aggregate, SuiteResult};

/// Sums results over training seeds. They stand sorted, so those of one actor and suite are neighbours.
pub(super) fn aggregates(results: &[SuiteResult], paper: &[PaperValue]) -> Vec<Aggregate> {
    let same = |a: &SuiteResult, b: &SuiteResult| (&a.actor, &a.suite) == (&b.actor, &b.suite);
    results.chunk_by(same).map(|seeds| aggregate(seeds, paper)).collect()
}

fn aggregate(seeds: &[SuiteResult], paper: &[PaperValue]) -> Aggregate {
    let (actor, suite) = (seeds[0].actor.clone(), seeds[0].suite.clone());
    let rates = || seeds.iter().map(|seed| seed.success_rate);
    let episodes = seeds.iter().map(|seed| seed.episodes).sum();
    let successes = seeds.iter().map(|seed| seed.successes).sum();
    let (wilson_low, wilson_high) = wilson(successes, episodes);
    let mut causes = BTreeMap::new();
    for (cause, count) in seeds.iter().flat_map(|seed| &seed.causes) {
        *causes.entry(cause.clone()).or_default() += count;
    }
    let paper_success_rate = paper
        .iter()
        .find(|value| actor.is_demonstrated() && value.is_for(&actor.variant, &suite))
        .map(|value| value.success_rate);
    Aggregate {
        actor,
        suite,
        seeds: seeds.len() as u64,
        episodes,
        successes,
        mean_success_rate: rates().sum::<f64>() / seeds.len() as f64,
        lowest_success_rate: rates().fold(1.0, f64::min),
        highest_success_rate: rates().fold(0.0, f64::max),
        wilson_low,
        wilson_high,
        causes,
        paper_success_rate,
    }
}
