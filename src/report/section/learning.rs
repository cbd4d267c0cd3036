//! Learning curves.

use minijinja::Value;
use serde::Serialize;

use crate::report::chart::curves::{self, CurveGrid};
use crate::report::chart::scale::many;
use crate::report::chart::{Key, PANEL, Panel, once_each};
use crate::report::metrics;
use crate::report::section::{Contents, Section};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "learning.html.j2",
    template: include_str!("learning.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Learning {
    curves: Vec<CurveGrid>,
    /// Most training steps behind a point of a curve.
    steps_per_point: String,
    variants: Vec<Key>,
    panel: Panel,
}

fn fill(of: &Contents<'_>) -> Learning {
    let trained = of.curves.iter().map(|curve| Key::of_model(&curve.model.variant, &curve.model.parts));
    let last_step = of.curves.iter().flat_map(|curve| &curve.points).map(|point| point.step).max().unwrap_or(0);
    Learning {
        curves: curves::grids(of.curves),
        steps_per_point: many(metrics::steps_per_bin(last_step) as u64, "step"),
        variants: once_each(trained, |a, b| a == b),
        panel: PANEL,
    }
}
