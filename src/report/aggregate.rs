//! Results summed up over training seeds.

use std::collections::BTreeMap;

use crate::report::PaperValue;
use crate::report::interval::{student, wilson};
use crate::report::summary::{Aggregate, SuiteResult};

/// Sums results over training seeds. They stand sorted, so those of one actor and suite are neighbours.
pub(super) fn aggregates(results: &[SuiteResult], paper: &[PaperValue]) -> Vec<Aggregate> {
    let same = |a: &SuiteResult, b: &SuiteResult| (&a.actor, &a.suite) == (&b.actor, &b.suite);
    let most_tasks = |of: &SuiteResult| {
        let own = |other: &&SuiteResult| {
            other.suite == of.suite
                && (&other.actor.experiment, other.actor.model()) == (&of.actor.experiment, of.actor.model())
        };
        results.iter().filter(own).map(|result| result.actor.train_tasks).max()
    };
    let of_seeds = |seeds: &[SuiteResult]| {
        // The paper's figures are of its largest numbers of tasks.
        let has_most = most_tasks(&seeds[0]) == Some(seeds[0].actor.train_tasks);
        aggregate(seeds, if has_most { paper } else { &[] })
    };
    results.chunk_by(same).map(of_seeds).collect()
}

fn aggregate(seeds: &[SuiteResult], paper: &[PaperValue]) -> Aggregate {
    let (actor, suite) = (seeds[0].actor.clone(), seeds[0].suite.clone());
    let rates: Vec<f64> = seeds.iter().map(|seed| seed.success_rate).collect();
    let of_seeds = student(&rates);
    let sum = |count: fn(&SuiteResult) -> Option<u64>| seeds.iter().filter_map(count).reduce(|sum, count| sum + count);
    let episodes = seeds.iter().map(|seed| seed.episodes).sum();
    let successes = seeds.iter().map(|seed| seed.successes).sum();
    let (wilson_low, wilson_high) = wilson(successes, episodes);
    let mut causes = BTreeMap::new();
    for (cause, count) in seeds.iter().flat_map(|seed| &seed.causes) {
        *causes.entry(cause.clone()).or_default() += count;
    }
    let paper_success_rate = paper
        .iter()
        .find(|value| actor.is_the_papers() && value.is_for(&actor.variant, &suite))
        .map(|value| value.success_rate);
    Aggregate {
        actor,
        suite,
        seeds: seeds.len() as u64,
        episodes,
        successes,
        mean_success_rate: rates.iter().sum::<f64>() / rates.len() as f64,
        lowest_success_rate: rates.iter().copied().fold(1.0, f64::min),
        highest_success_rate: rates.iter().copied().fold(0.0, f64::max),
        seeds_low: of_seeds.map(|(low, _)| low),
        seeds_high: of_seeds.map(|(_, high)| high),
        wilson_low,
        wilson_high,
        causes,
        pushes: sum(|seed| seed.pushes),
        toppled: sum(|seed| seed.toppled),
        paper_success_rate,
    }
}
