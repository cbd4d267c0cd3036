//! Success by suite and model.

use minijinja::Value;
use serde::Serialize;

use crate::report::chart::dots::{self, DotPlot};
use crate::report::section::{Contents, Section};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "success.html.j2",
    template: include_str!("success.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Success {
    dots: Option<DotPlot>,
}

fn fill(of: &Contents<'_>) -> Success {
    Success { dots: dots::plot(&of.leading, &of.report.results, &of.names) }
}
