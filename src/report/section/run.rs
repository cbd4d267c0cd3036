//! What else there is to say of each experiment.

use minijinja::Value;
use serde::Serialize;

use crate::report::section::{Contents, Section};
use crate::report::summary::Fact;

/// The section.
pub(super) const SECTION: Section =
    Section { name: "run.html.j2", template: include_str!("run.html.j2"), fill: |of| Value::from_serialize(fill(of)) };

#[derive(Serialize)]
struct Run<'a> {
    facts: Vec<FactGroup<'a>>,
}

/// What there is to say of one experiment.
#[derive(Serialize)]
struct FactGroup<'a> {
    experiment: &'a str,
    facts: &'a [Fact],
}

fn fill<'a>(of: &Contents<'a>) -> Run<'a> {
    let groups = of.report.facts.chunk_by(|a, b| a.experiment == b.experiment);
    Run { facts: groups.map(|facts| FactGroup { experiment: &facts[0].experiment, facts }).collect() }
}
