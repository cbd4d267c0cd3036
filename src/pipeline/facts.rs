//! What a suite asks for, told by its settings and not by its name.

use crate::pipeline::{CountsSpec, PipelineSpec, SuiteSpec};
use crate::rollout::SuiteFacts;

/// The facts that stand in each row of a suite's rollouts.
pub(super) fn of_suite(spec: &PipelineSpec, suite: &SuiteSpec) -> SuiteFacts {
    let family = spec.tasks.family;
    let simulation = suite.simulation(&spec.generate.simulation);
    let ends = |counts: CountsSpec| family.has_categories().then_some([counts.min, counts.max]);
    SuiteFacts {
        family,
        blocks: family.max_blocks().map(|most| spec.tasks.blocks.unwrap_or(most)),
        order: suite.order.name(),
        adversary_probability: suite.adversary.map_or(0.0, |adversary| adversary.probability),
        adversary_impulse_ns: suite.adversary.map_or(0.0, |adversary| adversary.impulse_ns),
        demonstrated: ends(suite.demonstrated()),
        on_table: ends(suite.on_table.unwrap_or(suite.demonstrated())),
        bowls: suite.bowls,
        robot: simulation.robot.name().to_owned(),
        jaw_m: Some(simulation.jaw_m()),
        perception: suite.perception.clone(),
    }
}
