//! How far off detectors are.

use minijinja::Value;
use serde::Serialize;

use crate::report::chart::scale::{percent, short, thousands};
use crate::report::detections::{DetectionError, InSight};
use crate::report::section::{Contents, Section};
use crate::report::suite_names::SuiteNames;

/// The section.
pub(super) const SECTION: Section = Section {
    name: "detectors.html.j2",
    template: include_str!("detectors.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Detectors {
    detections: Vec<DetectionRow>,
}

/// The errors of a detector.
#[derive(Serialize)]
struct DetectionRow {
    suite: String,
    variant: String,
    color: usize,
    tasks: String,
    seeds: u64,
    in_sight: &'static str,
    /// Whether it is of one part of the row above that tells of all.
    is_part: bool,
    detections: String,
    median: String,
    mean_absolute: [String; 3],
    deviation: String,
    percentiles: [String; 2],
    over: String,
    paper: Option<String>,
}

fn fill(of: &Contents<'_>) -> Detectors {
    Detectors { detections: of.report.detections.iter().map(|error| row(error, &of.names)).collect() }
}

fn row(error: &DetectionError, names: &SuiteNames) -> DetectionRow {
    let cm = |value: f64| format!("{value:.2}");
    DetectionRow {
        suite: names.tell(&error.suite, &error.experiment),
        variant: error.model(),
        color: error.parts.color(false),
        tasks: thousands(error.train_tasks.max(0) as u64),
        seeds: error.seeds,
        in_sight: error.in_sight.words(),
        is_part: error.in_sight != InSight::All,
        detections: thousands(error.detections),
        median: cm(error.median_cm),
        mean_absolute: error.mean_absolute_cm.map(cm),
        deviation: cm(error.deviation_cm),
        percentiles: [error.percentile_95_cm, error.percentile_99_cm].map(cm),
        over: percent(error.over_2_cm),
        paper: error.paper_deviation_cm.map(short),
    }
}
