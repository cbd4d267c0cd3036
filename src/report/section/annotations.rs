//! How well labels that models made agree with true ones.

use minijinja::Value;
use serde::Serialize;

use crate::report::AnnotationResult;
use crate::report::section::{Contents, Section};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "annotations.html.j2",
    template: include_str!("annotations.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Annotations {
    annotations: Vec<LevelRow>,
}

/// One level of an annotated dataset.
#[derive(Serialize)]
pub(in crate::report) struct LevelRow {
    pub(in crate::report) name: String,
    /// Whether it is the dataset's first.
    pub(in crate::report) is_first: bool,
    pub(in crate::report) episodes: u64,
    pub(in crate::report) exact: u64,
    pub(in crate::report) calls: String,
    pub(in crate::report) level: String,
    pub(in crate::report) frames: String,
    pub(in crate::report) iou: String,
    /// By growing tolerance.
    pub(in crate::report) boundary_f1: Vec<String>,
    pub(in crate::report) edit: String,
}

fn fill(of: &Contents<'_>) -> Annotations {
    Annotations { annotations: rows(&of.report.annotations) }
}

/// A row a level, those of a dataset one after another.
pub(in crate::report) fn rows(annotations: &[AnnotationResult]) -> Vec<LevelRow> {
    annotations.iter().flat_map(levels).collect()
}

fn levels(of: &AnnotationResult) -> impl Iterator<Item = LevelRow> {
    let share = |share: f64| format!("{share:.3}");
    of.measured.levels.iter().enumerate().map(move |(at, (level, measured))| LevelRow {
        name: of.name.clone(),
        is_first: at == 0,
        episodes: of.measured.episodes,
        exact: of.measured.episodes_exact,
        calls: share(of.measured.call_accuracy()),
        level: level.replace('_', " "),
        frames: share(measured.frame_accuracy),
        iou: share(measured.iou),
        boundary_f1: measured.boundary_f1.values().copied().map(share).collect(),
        edit: share(measured.edit_score),
    })
}
