//! Results summed up over training seeds.

use std::collections::BTreeMap;

use crate::report::PaperValue;
use crate::report::interval::{student, wilson};
use crate::report::summary::{Aggregate, SuiteResult};

/// Sums results over training seeds. They stand sorted, so those of one actor and suite are neighbours.
pub(super) fn aggregates(results: &[SuiteResult], paper: &[PaperValue]) -> Vec<Aggregate> {
    let same = |a: &SuiteResult, b: &SuiteResult| (&a.actor, &a.suite) == (&b.actor, &b.suite);
    let mut aggregates: Vec<Aggregate> = results.chunk_by(same).map(aggregate).collect();
    for row in &mut aggregates {
        row.paper_success_rate = paper.iter().find(|value| value.is_met_by(row)).map(|value| value.success_rate);
    }
    aggregates
}

fn aggregate(seeds: &[SuiteResult]) -> Aggregate {
    let (actor, suite) = (seeds[0].actor.clone(), seeds[0].suite.clone());
    let rates: Vec<f64> = seeds.iter().map(|seed| seed.success_rate).collect();
    let of_seeds = student(&rates);
    let sum = |count: fn(&SuiteResult) -> Option<u64>| seeds.iter().filter_map(count).reduce(|sum, count| sum + count);
    let episodes = seeds.iter().map(|seed| seed.episodes).sum();
    let successes = seeds.iter().map(|seed| seed.successes).sum();
    let (wilson_low, wilson_high) = wilson(successes, episodes);
    let mean = |share: fn(&SuiteResult) -> Option<f64>| {
        let shares: Option<Vec<f64>> = seeds.iter().map(share).collect();
        shares.map(|shares| shares.iter().sum::<f64>() / shares.len() as f64)
    };
    // Where seeds differ in what they were asked, nothing is known of it.
    let facts = seeds.iter().all(|seed| seed.facts == seeds[0].facts).then(|| seeds[0].facts.clone());
    Aggregate {
        actor,
        suite,
        facts: facts.unwrap_or_default(),
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
        goals_met: mean(|seed| seed.goals_met),
        causes: counts(seeds, |seed| &seed.causes),
        failures: counts(seeds, |seed| &seed.failures),
        localisation_mm: mean(|seed| seed.localisation_mm),
        pushes: sum(|seed| seed.pushes),
        toppled: sum(|seed| seed.toppled),
        paper_success_rate: None,
    }
}

/// Counts of all seeds together.
fn counts(seeds: &[SuiteResult], of: fn(&SuiteResult) -> &BTreeMap<String, u64>) -> BTreeMap<String, u64> {
    let mut sums = BTreeMap::new();
    for (name, count) in seeds.iter().flat_map(of) {
        *sums.entry(name.clone()).or_default() += count;
    }
    sums
}
