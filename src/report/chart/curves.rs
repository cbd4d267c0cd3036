//! Learning curves: a panel for each program level, a line for each training, the loss on a logarithmic scale.

use serde::Serialize;

use crate::report::actor::model_name;
use crate::report::chart::scale::{coordinate, nice_step, power_of_ten, thousands};
use crate::report::chart::{PANEL, Tick, distinct};
use crate::report::metrics::{Curve, CurvePoint, PARTS};
use crate::words::counted;

/// No decade below this is drawn: what is smaller lies on the axis.
const LOWEST_EXPONENT: i32 = -6;

/// Panels of one part of the loss, with the same axes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct CurveGrid {
    pub(in crate::report) experiment: String,
    pub(in crate::report) part: String,
    pub(in crate::report) panels: Vec<CurvePanel>,
}

/// One program level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct CurvePanel {
    pub(in crate::report) title: String,
    pub(in crate::report) x_ticks: Vec<Tick>,
    pub(in crate::report) y_ticks: Vec<Tick>,
    pub(in crate::report) lines: Vec<Line>,
}

/// One training.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct Line {
    pub(in crate::report) color: usize,
    pub(in crate::report) dashed: bool,
    /// An SVG path.
    pub(in crate::report) path: String,
    pub(in crate::report) tip: String,
}

/// The range of both axes.
struct Axes {
    last_step: f64,
    low: i32,
    high: i32,
}

/// A grid for each part of the loss that was recorded, the total first, in each experiment: levels of the same name
/// learn other things there.
pub(in crate::report) fn grids(curves: &[Curve]) -> Vec<CurveGrid> {
    let mut experiments = distinct(curves.iter().map(|curve| &curve.model.experiment));
    experiments.sort();
    let of_part = |part: usize| {
        let grid = |name: &String| {
            let own: Vec<&Curve> = curves.iter().filter(|curve| curve.model.experiment == *name).collect();
            grid(&own, part, name)
        };
        experiments.iter().filter_map(grid).collect::<Vec<_>>()
    };
    (0..PARTS.len()).flat_map(of_part).collect()
}

fn grid(curves: &[&Curve], part: usize, experiment: &str) -> Option<CurveGrid> {
    let axes = axes(curves, part)?;
    let levels = distinct(curves.iter().map(|curve| &curve.level));
    let panels = levels.iter().map(|level| panel(curves, part, level, &axes));
    Some(CurveGrid {
        experiment: experiment.to_owned(),
        part: PARTS[part].trim_start_matches("loss_").to_owned(),
        panels: panels.filter(|panel| !panel.lines.is_empty()).collect(),
    })
}

fn axes(curves: &[&Curve], part: usize) -> Option<Axes> {
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let losses = || points().filter_map(|point| point.losses[part]).filter(|&loss| loss > 0.0);
    let low = losses().reduce(f64::min)?.log10().floor() as i32;
    let high = losses().reduce(f64::max)?.log10().ceil() as i32;
    let low = low.max(LOWEST_EXPONENT);
    let last_step = points().map(|point| point.step).max()?.max(1) as f64;
    Some(Axes { last_step, low, high: high.max(low + 1) })
}

fn panel(curves: &[&Curve], part: usize, level: &str, axes: &Axes) -> CurvePanel {
    let line = |curve: &Curve| {
        let model = &curve.model;
        let path = path(&curve.points, part, axes);
        let last = curve.points.iter().rev().find_map(|point| point.losses[part])?;
        let tip = format!(
            "{}, {}, training seed {}: {last:.4} in the end",
            model_name(&model.variant, &model.specification, model.tag.as_deref()),
            counted(model.train_tasks, "task"),
            model.seed
        );
        Some(Line { color: model.parts.color(false), dashed: model.parts.has_papers_encoder(), path, tip })
    };
    let step = nice_step(axes.last_step, 4.0);
    let x_tick = |mark: usize| {
        let value = mark as f64 * step;
        Tick { at: coordinate(PANEL.x(value / axes.last_step)), label: thousands(value as u64) }
    };
    // Eight decades would be eight lines of text in a small panel.
    let stride = if axes.high - axes.low > 5 { 2 } else { 1 };
    let y_tick = |exponent: i32| Tick { at: coordinate(axes.y(exponent.into())), label: power_of_ten(exponent) };
    CurvePanel {
        title: level.to_owned(),
        x_ticks: (0..=(axes.last_step / step) as usize).map(x_tick).collect(),
        y_ticks: (axes.low..=axes.high).step_by(stride).map(y_tick).collect(),
        lines: curves.iter().copied().filter(|curve| curve.level == level).filter_map(line).collect(),
    }
}

impl Axes {
    fn y(&self, exponent: f64) -> f64 {
        let share = (exponent - f64::from(self.low)) / f64::from(self.high - self.low);
        PANEL.y(share.clamp(0.0, 1.0))
    }
}

/// A line that is broken where no loss was recorded.
fn path(points: &[CurvePoint], part: usize, axes: &Axes) -> String {
    let mut path = String::new();
    let mut pen = 'M';
    for point in points {
        let Some(loss) = point.losses[part] else {
            pen = 'M';
            continue;
        };
        let x = coordinate(PANEL.x(point.step as f64 / axes.last_step));
        let y = coordinate(axes.y(loss.max(f64::MIN_POSITIVE).log10()));
        path.push_str(&format!("{pen}{x} {y}"));
        if pen == 'M' {
            // A point that stays alone is a dot.
            path.push_str("h0");
        }
        pen = 'L';
    }
    path
}
