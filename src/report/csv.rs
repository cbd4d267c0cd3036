//! `results.csv` and `curves.csv`: the figures as tables, by Polars.

use std::collections::BTreeMap;

use polars::prelude::{CsvWriter, DataFrame, SerWriter as _, df};

use crate::report::ReportError;
use crate::report::facts::SuiteFacts;
use crate::report::metrics::{Curve, PARTS};
use crate::report::summary::SuiteResult;

/// Digits behind the point: finer than any interval, coarse enough to read.
const PRECISION: usize = 6;

/// One row for each actor, suite and training seed; causes and what failures are due to as `name=count`
/// with `;` between.
pub(super) fn results(results: &[SuiteResult]) -> Result<Vec<u8>, ReportError> {
    let text = |of: fn(&SuiteResult) -> &str| results.iter().map(of).collect::<Vec<_>>();
    let maybe = |of: fn(&SuiteResult) -> Option<&str>| results.iter().map(of).collect::<Vec<_>>();
    let real = |of: fn(&SuiteResult) -> f64| results.iter().map(of).collect::<Vec<_>>();
    let share = |of: fn(&SuiteResult) -> Option<f64>| results.iter().map(of).collect::<Vec<_>>();
    let fact = |of: fn(&SuiteFacts) -> Option<i64>| results.iter().map(|result| of(&result.facts)).collect::<Vec<_>>();
    let whole = |of: fn(&SuiteResult) -> u64| results.iter().map(of).collect::<Vec<_>>();
    let told = |counts: &BTreeMap<String, u64>| {
        counts.iter().map(|(name, count)| format!("{name}={count}")).collect::<Vec<_>>().join(";")
    };
    let table = df!(
        "experiment" => text(|result| &result.actor.experiment),
        "variant" => text(|result| &result.actor.variant),
        "core" => maybe(|result| result.actor.parts.core.as_deref()),
        "scoping" => maybe(|result| result.actor.parts.scoping.as_deref()),
        "encoder" => maybe(|result| result.actor.parts.encoder.as_deref()),
        "tag" => maybe(|result| result.actor.tag.as_deref()),
        "train_tasks" => results.iter().map(|result| result.actor.train_tasks).collect::<Vec<_>>(),
        "specification" => maybe(|result| result.actor.specification.as_deref()),
        "decoder" => maybe(|result| result.actor.decoder.as_deref()),
        "suite" => text(|result| &result.suite),
        "family" => maybe(|result| result.facts.family.as_deref()),
        "split" => maybe(|result| result.facts.split.as_deref()),
        "blocks" => fact(|facts| facts.blocks),
        "order" => maybe(|result| result.facts.order.as_deref()),
        "adversary_probability" => share(|result| result.facts.adversary_probability),
        "adversary_impulse_ns" => share(|result| result.facts.adversary_impulse_ns),
        "demonstrated_min" => fact(|facts| facts.demonstrated_min),
        "demonstrated_max" => fact(|facts| facts.demonstrated_max),
        "on_table_min" => fact(|facts| facts.on_table_min),
        "on_table_max" => fact(|facts| facts.on_table_max),
        "bowls" => fact(|facts| facts.bowls),
        "objects_min" => fact(|facts| facts.objects_min),
        "objects_max" => fact(|facts| facts.objects_max),
        "seed" => results.iter().map(|result| result.seed).collect::<Vec<_>>(),
        "episodes" => whole(|result| result.episodes),
        "successes" => whole(|result| result.successes),
        "success_rate" => real(|result| result.success_rate),
        "wilson_low" => real(|result| result.wilson_low),
        "wilson_high" => real(|result| result.wilson_high),
        "goals_met" => share(|result| result.goals_met),
        "causes" => results.iter().map(|result| told(&result.causes)).collect::<Vec<_>>(),
        "failures" => results.iter().map(|result| told(&result.failures)).collect::<Vec<_>>(),
        "localisation_mm" => share(|result| result.localisation_mm),
        "mean_calls" => real(|result| result.mean_calls),
        "mean_sim_secs" => real(|result| result.mean_sim_secs),
        "pushes" => results.iter().map(|result| result.pushes).collect::<Vec<_>>(),
        "toppled" => results.iter().map(|result| result.toppled).collect::<Vec<_>>(),
    );
    write(table.map_err(ReportError::Query)?)
}

/// One row for each variant, training seed, level and point; a loss that was not recorded is empty.
pub(super) fn curves(curves: &[Curve]) -> Result<Vec<u8>, ReportError> {
    let points = || curves.iter().flat_map(|curve| curve.points.iter().map(move |point| (curve, point)));
    let table = df!(
        "experiment" => points().map(|(curve, _)| curve.model.experiment.as_str()).collect::<Vec<_>>(),
        "variant" => points().map(|(curve, _)| curve.model.variant.as_str()).collect::<Vec<_>>(),
        "tag" => points().map(|(curve, _)| curve.model.tag.as_deref()).collect::<Vec<_>>(),
        "train_tasks" => points().map(|(curve, _)| curve.model.train_tasks).collect::<Vec<_>>(),
        "specification" => points().map(|(curve, _)| curve.model.specification.as_str()).collect::<Vec<_>>(),
        "seed" => points().map(|(curve, _)| curve.model.seed).collect::<Vec<_>>(),
        "level" => points().map(|(curve, _)| curve.level.as_str()).collect::<Vec<_>>(),
        "step" => points().map(|(_, point)| point.step).collect::<Vec<_>>(),
    );
    let mut table = table.map_err(ReportError::Query)?;
    for (part_idx, part) in PARTS.into_iter().enumerate() {
        let losses: Vec<Option<f64>> = points().map(|(_, point)| point.losses[part_idx]).collect();
        let column = df!(part => losses).map_err(ReportError::Query)?;
        table.hstack_mut(column.columns()).map_err(ReportError::Query)?;
    }
    write(table)
}

fn write(mut table: DataFrame) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Vec::new();
    let writer = CsvWriter::new(&mut bytes).with_float_precision(Some(PRECISION));
    writer.n_threads(1).finish(&mut table).map_err(ReportError::Query)?;
    Ok(bytes)
}
