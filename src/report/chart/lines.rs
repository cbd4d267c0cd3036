//! Success over a quantity: a line for each variant, a bar for each interval, diamonds for the paper. Positions on the
//! horizontal axis are equally far apart, since lengths and numbers of tasks grow by factors.

use serde::Serialize;

use crate::report::chart::scale::{coordinate, percent, short, thousands};
use crate::report::chart::{PANEL, Tick};
use crate::report::figures::{Figure, Series};
use crate::words::counted;

/// One figure of the paper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct LinePlot {
    /// Told where there are several.
    pub(in crate::report) experiment: String,
    pub(in crate::report) title: String,
    pub(in crate::report) source: String,
    pub(in crate::report) x_label: String,
    pub(in crate::report) x_ticks: Vec<Tick>,
    pub(in crate::report) y_ticks: Vec<Tick>,
    pub(in crate::report) lines: Vec<PlotLine>,
    pub(in crate::report) paper: Vec<PaperLine>,
}

/// One variant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct PlotLine {
    pub(in crate::report) label: String,
    pub(in crate::report) color: usize,
    /// Whether it has the paper's encoder, or was trained otherwise on purpose.
    pub(in crate::report) dashed: bool,
    pub(in crate::report) path: String,
    pub(in crate::report) dots: Vec<PlotDot>,
}

/// One point, in units of the panel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct PlotDot {
    pub(in crate::report) x: String,
    pub(in crate::report) y: String,
    pub(in crate::report) low: String,
    pub(in crate::report) high: String,
    pub(in crate::report) tip: String,
}

/// The paper's points of one variant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct PaperLine {
    pub(in crate::report) color: usize,
    pub(in crate::report) path: String,
    pub(in crate::report) marks: Vec<PaperMark>,
}

/// One of the paper's points.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct PaperMark {
    pub(in crate::report) x: String,
    pub(in crate::report) y: String,
    pub(in crate::report) tip: String,
}

/// The quantities that occur, in order: each has a place of its own.
struct Places(Vec<i64>);

impl Places {
    fn of(figure: &Figure) -> Self {
        let ours = figure.series.iter().flat_map(|series| series.ours.iter().map(|point| point.x));
        let paper = figure.series.iter().flat_map(|series| series.paper.iter().map(|point| point.x));
        let mut places: Vec<i64> = ours.chain(paper).collect();
        places.sort_unstable();
        places.dedup();
        Self(places)
    }

    /// Where a quantity is; `shift` from -0.5 to 0.5 is within its place.
    fn x(&self, quantity: i64, shift: f64) -> String {
        let place = self.0.iter().position(|&other| other == quantity).unwrap_or(0);
        coordinate(PANEL.x((place as f64 + 0.5 + shift) / self.0.len() as f64))
    }
}

/// A figure's plot.
pub(in crate::report) fn plot(figure: &Figure) -> LinePlot {
    let places = Places::of(figure);
    let n_series = figure.series.len() as f64;
    // Lines that lie on each other would hide their intervals.
    let shift = |at: usize| 0.3 * ((at as f64 + 0.5) / n_series - 0.5);
    let y_tick = |mark: i32| Tick {
        at: coordinate(PANEL.y(f64::from(mark) / 4.0)),
        label: format!("{} %", short(25.0 * f64::from(mark))),
    };
    let x_tick = |&quantity: &i64| Tick { at: places.x(quantity, 0.0), label: thousands(quantity.max(0) as u64) };
    let lines = figure.series.iter().enumerate();
    let mut paper: Vec<PaperLine> = Vec::new();
    for series in figure.series.iter().filter(|series| !series.paper.is_empty()) {
        let line = paper_line(series, &places);
        if !paper.contains(&line) {
            paper.push(line);
        }
    }
    LinePlot {
        experiment: figure.experiment.clone(),
        title: figure.title.clone(),
        source: figure.source.clone(),
        x_label: figure.x_label.clone(),
        x_ticks: places.0.iter().map(x_tick).collect(),
        y_ticks: (0..=4).map(y_tick).collect(),
        lines: lines.map(|(at, series)| line(series, &places, shift(at))).collect(),
        paper,
    }
}

fn line(series: &Series, places: &Places, shift: f64) -> PlotLine {
    let dots = series.ours.iter().map(|point| PlotDot {
        x: places.x(point.x, shift),
        y: coordinate(PANEL.y(point.success_rate)),
        low: coordinate(PANEL.y(point.wilson_low)),
        high: coordinate(PANEL.y(point.wilson_high)),
        tip: format!(
            "{} at {}: {} %, interval {} to {} %, {}, {}",
            series.variant,
            point.x,
            percent(point.success_rate),
            percent(point.wilson_low),
            percent(point.wilson_high),
            counted(point.episodes, "rollout"),
            counted(point.seeds, "training seed")
        ),
    });
    let dots: Vec<PlotDot> = dots.collect();
    PlotLine {
        label: series.variant.clone(),
        color: series.parts.color(false),
        dashed: series.parts.has_papers_encoder() || series.is_tagged,
        path: path(dots.iter().map(|dot| (&dot.x, &dot.y))),
        dots,
    }
}

fn paper_line(series: &Series, places: &Places) -> PaperLine {
    let marks = series.paper.iter().map(|point| PaperMark {
        x: places.x(point.x, 0.0),
        y: coordinate(PANEL.y(point.success_rate)),
        tip: format!("the paper at {}: {} %", point.x, percent(point.success_rate)),
    });
    let marks: Vec<PaperMark> = marks.collect();
    PaperLine { color: series.parts.color(false), path: path(marks.iter().map(|mark| (&mark.x, &mark.y))), marks }
}

fn path<'a>(points: impl Iterator<Item = (&'a String, &'a String)>) -> String {
    let step = |(at, (x, y)): (usize, (&String, &String))| format!("{}{x} {y}", if at == 0 { 'M' } else { 'L' });
    points.enumerate().map(step).collect()
}
