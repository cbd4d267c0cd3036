//! Episodes in pictures.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use minijinja::Value;
use serde::Serialize;

use crate::report::filmstrip::{Filmstrip, Shows, StripPicture};
use crate::report::section::{Contents, Section};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "filmstrips.html.j2",
    template: include_str!("filmstrips.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Filmstrips<'a> {
    strips: Vec<Strip<'a>>,
    is_study: bool,
}

/// One episode.
#[derive(Serialize)]
struct Strip<'a> {
    #[serde(flatten)]
    of: &'a Filmstrip,
    /// What it shows, for people.
    title: &'static str,
    cause: Option<String>,
    frames: Vec<Frame<'a>>,
}

/// One picture.
#[derive(Serialize)]
struct Frame<'a> {
    secs: String,
    call: &'a str,
    is_departure: bool,
    size_px: [u32; 2],
    /// JPEG as text.
    base64: String,
}

fn fill<'a>(of: &Contents<'a>) -> Filmstrips<'a> {
    Filmstrips { strips: of.report.filmstrips.iter().map(strip).collect(), is_study: of.is_study }
}

fn strip(of: &Filmstrip) -> Strip<'_> {
    let title = match of.shows {
        Shows::Demonstration => "Demonstration",
        Shows::Success => "Success",
        Shows::Failure => "Failure",
    };
    let cause = of.cause.as_ref().map(|cause| cause.replace('_', " "));
    Strip { of, title, cause, frames: of.pictures.iter().map(frame).collect() }
}

fn frame(picture: &StripPicture) -> Frame<'_> {
    let StripPicture { time_ms, call, is_departure, size_px, jpeg } = picture;
    let secs = format!("{:.1}", *time_ms as f64 / 1000.0);
    Frame { secs, call, is_departure: *is_departure, size_px: *size_px, base64: STANDARD.encode(jpeg) }
}
