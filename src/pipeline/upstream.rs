//! The stages before the report, by their units.

use crate::pipeline::unit::Unit;
use crate::pipeline::{Pipeline, Stage, convert, generate, rollout, tasks, train};

/// The units of a stage that comes before the report, in the pipeline file's order.
pub(super) fn units(pipeline: &Pipeline, stage: Stage) -> Vec<Box<dyn Unit + '_>> {
    match stage {
        Stage::Tasks => boxed(tasks::units(pipeline)),
        Stage::Generate => boxed(generate::units(pipeline)),
        Stage::Convert => boxed(convert::units(pipeline)),
        Stage::Train => boxed(train::units(pipeline)),
        Stage::Rollout => boxed(rollout::units(pipeline)),
        Stage::Report => Vec::new(),
    }
}

pub(super) fn boxed<'p, U: Unit + 'p>(units: Vec<U>) -> Vec<Box<dyn Unit + 'p>> {
    units.into_iter().map(|unit| Box::new(unit) as Box<dyn Unit + 'p>).collect()
}
