//! Causes of failure, and where rollouts first left the expert's decisions.

use minijinja::Value;
use serde::Serialize;

use crate::report::chart::bars::{self, BarPlot};
use crate::report::chart::histogram::{self, Histograms};
use crate::report::chart::{PANEL, Panel};
use crate::report::section::{Contents, Section};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "failures.html.j2",
    template: include_str!("failures.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Failures {
    has_rollouts: bool,
    bars: Option<BarPlot>,
    divergence: Option<Histograms>,
    panel: Panel,
    is_study: bool,
}

fn fill(of: &Contents<'_>) -> Failures {
    let report = of.report;
    Failures {
        has_rollouts: !report.aggregates.is_empty(),
        bars: bars::plot(&of.leading, &of.names),
        divergence: histogram::plot(&report.divergences, &report.errors, &report.aggregates),
        panel: PANEL,
        is_study: of.is_study,
    }
}
