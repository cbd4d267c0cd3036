//! Which part of the specification each running program may see: a strip with a row a depth and a column a frame.
//!
//! Where the demonstration is at hand its own calls lie dimmed behind, so a scope can be seen to fit or not. Where a
//! policy gave probabilities of a scope's start and end, they are drawn as curves over the row of the callee.
//!
//! # Units
//!
//! The strip is [`WIDTH`] units wide whatever the number of frames, x to the right, y down.

use rerun::{LineStrip2D, LineStrips2D, Points2D};

use crate::program::Program;
use crate::trace::{Episode, ProgramCall, Span, calls_by_depth};
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, clock, lanes, palette};

/// Width of the whole specification.
pub(super) const WIDTH: f32 = 100.0;
/// Space left of the strip for names.
pub(super) const MARGIN: f32 = 20.0;
/// Distance of the middles of two rows.
pub(super) const ROW_PITCH: f32 = 5.0;
/// How far above the middle of its row a name's anchor is; Rerun writes below the anchor.
const NAME_RISE: f32 = 1.6;
/// Height of a row.
const ROW_HEIGHT: f32 = 4.0;
/// What is left of a demonstration's colours behind a scope.
const BEHIND: f32 = 0.42;

/// Logs the strip at all frames. `specification` has boundary frames alone.
pub(super) fn put(store: &mut Store, episode: &Episode, specification: Option<&Episode>) -> Result<(), VisualizeError> {
    // An expert's spans count all of its frames; its boundary form counts as a policy's do.
    let own = specification.filter(|specification| specification.provenance == episode.provenance);
    let strip = Strip { n_frames: own.map_or(episode.specification_frames, |own| own.specification_frames) };
    let spans = own.unwrap_or(episode);
    let n_rows = n_rows(episode).max(specification.map_or(0, n_rows));
    put_rows(store, strip, n_rows)?;
    if let Some(specification) = specification {
        put_demonstration(store, strip, specification)?;
    }
    for (depth, calls) in calls_by_depth(episode) {
        let events = lanes::events(&episode.frames, calls);
        put_scopes(store, strip, depth, &Running { episode, spans, events: &events })?;
        put_probabilities(store, strip, depth, &Running { episode, spans, events: &events })?;
    }
    Ok(())
}

/// How many rows an episode's strip has.
pub(super) fn n_rows(episode: &Episode) -> u8 {
    episode.calls.iter().map(|call| call.depth + 1).max().unwrap_or(0)
}

/// What runs at one depth: when, and which call. `spans` has the same calls as `episode`, with the spans to draw.
struct Running<'e> {
    episode: &'e Episode,
    spans: &'e Episode,
    events: &'e [(usize, Option<&'e ProgramCall>)],
}

impl Running<'_> {
    fn times(&self) -> [rerun::log::TimeColumn; 2] {
        let positions: Vec<usize> = self.events.iter().map(|&(position, _)| position).collect();
        clock::times(&self.episode.frames, &positions)
    }

    /// The running calls as they are to be drawn, in the order of events.
    fn drawn(&self) -> impl Iterator<Item = Option<&ProgramCall>> {
        self.events.iter().map(|(_, call)| call.map(|call| &self.spans.calls[call.id.0 as usize]))
    }
}

/// Where frames and depths lie.
#[derive(Clone, Copy)]
struct Strip {
    n_frames: u32,
}

impl Strip {
    fn x(self, frame: f32) -> f32 {
        frame * WIDTH / self.n_frames.max(1) as f32
    }

    fn y(depth: u8) -> f32 {
        f32::from(depth) * ROW_PITCH
    }

    /// A bar over a span: a line and its radius. Rerun rounds the ends of lines, so the line is shorter by a radius at
    /// both ends, and upright where the span is narrower than the row is high.
    fn bar(self, span: Span, depth: u8) -> (LineStrip2D, f32) {
        let (begin, end, y) = (self.x(span.begin as f32), self.x(span.end as f32), Self::y(depth));
        let radius = (end - begin).min(ROW_HEIGHT) / 2.0;
        let (middle, half_x, half_y) = ((begin + end) / 2.0, (end - begin) / 2.0 - radius, ROW_HEIGHT / 2.0 - radius);
        (LineStrip2D::from_iter([[middle - half_x, y - half_y], [middle + half_x, y + half_y]]), radius)
    }

    /// Bars over many spans.
    fn bars(self, spans: impl IntoIterator<Item = (Span, u8)>) -> LineStrips2D {
        let (lines, radii): (Vec<_>, Vec<_>) = spans.into_iter().map(|(span, depth)| self.bar(span, depth)).unzip();
        LineStrips2D::new(lines).with_radii(radii)
    }

    /// A curve over the frames of a window: 0 at the lower side of the row, 1 at its upper side.
    fn curve(self, window: Span, probabilities: &[f32], depth: u8) -> LineStrip2D {
        let floor = Self::y(depth) + ROW_HEIGHT / 2.0;
        let point = |(frame, probability): (u32, &f32)| [self.x(frame as f32 + 0.5), floor - ROW_HEIGHT * probability];
        LineStrip2D::from_iter((window.begin..window.end).zip(probabilities).map(point))
    }
}

fn put_rows(store: &mut Store, strip: Strip, n_rows: u8) -> Result<(), VisualizeError> {
    let whole = Span { begin: 0, end: strip.n_frames.max(1) };
    let rows = strip
        .bars((0..n_rows).map(|depth| (whole, depth)))
        .with_colors([palette::color(palette::BACKGROUND)])
        .with_draw_order(0.0);
    store.put_static("specification/frames", &rows)
}

fn put_demonstration(store: &mut Store, strip: Strip, demonstration: &Episode) -> Result<(), VisualizeError> {
    let calls: Vec<&ProgramCall> = demonstration.calls.iter().filter(|call| call.program != Program::None).collect();
    let bars = strip
        .bars(calls.iter().map(|call| (call.frames, call.depth)))
        .with_colors(calls.iter().map(|call| palette::dimmed(call.color(&demonstration.scene), BEHIND)))
        .with_draw_order(1.0);
    store.put_static("specification/demonstration", &bars)
}

fn put_scopes(store: &mut Store, strip: Strip, depth: u8, running: &Running<'_>) -> Result<(), VisualizeError> {
    let path = format!("specification/scope/depth_{depth}");
    let style = LineStrips2D::update_fields().with_draw_order(2.0);
    store.put_static(path.as_str(), &style)?;
    let scene = &running.episode.scene;
    let scoped: Vec<Option<(Span, &ProgramCall)>> =
        running.drawn().map(|call| call.and_then(|call| Some((call.output?, call)))).collect();
    let lengths: Vec<usize> = scoped.iter().map(|scope| usize::from(scope.is_some())).collect();
    let shown: Vec<(Span, &ProgramCall)> = scoped.into_iter().flatten().collect();
    let bars = strip
        .bars(shown.iter().map(|&(span, _)| (span, depth)))
        .with_colors(shown.iter().map(|(_, call)| palette::color(call.color(scene))));
    store.put_ragged_rows(path.as_str(), running.times(), &bars, &lengths)?;
    put_names(store, depth, running)
}

/// The running program's name, left of its row.
fn put_names(store: &mut Store, depth: u8, running: &Running<'_>) -> Result<(), VisualizeError> {
    let path = format!("specification/name/depth_{depth}");
    let style = Points2D::update_fields().with_radii([0.0]).with_show_labels(true);
    store.put_static(path.as_str(), &style)?;
    let shown: Vec<Option<&ProgramCall>> = running.drawn().collect();
    let lengths: Vec<usize> = shown.iter().map(|call| usize::from(call.is_some())).collect();
    let scene = &running.episode.scene;
    let calls: Vec<&ProgramCall> = shown.into_iter().flatten().collect();
    let points = Points2D::new(calls.iter().map(|_| [-MARGIN / 2.0, Strip::y(depth) - NAME_RISE]))
        .with_labels(calls.iter().map(|call| call.label(scene)))
        .with_colors(calls.iter().map(|call| palette::color(call.color(scene))));
    store.put_ragged_rows(path.as_str(), running.times(), &points, &lengths)
}

/// Start and end curves over the caller's window; nothing where no call of this depth has them.
fn put_probabilities(store: &mut Store, strip: Strip, depth: u8, running: &Running<'_>) -> Result<(), VisualizeError> {
    let curves = |call: Option<&ProgramCall>| -> Vec<LineStrip2D> {
        let Some((call, prediction)) = call.and_then(|call| Some((call, call.prediction.as_ref()?))) else {
            return Vec::new();
        };
        let both = [&prediction.start_probabilities, &prediction.stop_probabilities];
        if both.iter().any(|probabilities| probabilities.is_empty()) {
            return Vec::new();
        }
        both.map(|probabilities| strip.curve(call.input, probabilities, depth)).into()
    };
    let rows: Vec<Vec<LineStrip2D>> = running.drawn().map(curves).collect();
    if rows.iter().all(Vec::is_empty) {
        return Ok(());
    }
    let path = format!("specification/probability/depth_{depth}");
    let style = LineStrips2D::update_fields()
        .with_colors([palette::color(palette::START), palette::color(palette::STOP)])
        .with_radii([0.12])
        .with_draw_order(3.0);
    store.put_static(path.as_str(), &style)?;
    let lengths: Vec<usize> = rows.iter().map(Vec::len).collect();
    let strips = LineStrips2D::new(rows.into_iter().flatten());
    store.put_ragged_rows(path.as_str(), running.times(), &strips, &lengths)
}
