//! The geometry of the page's plots: numbers and words only. How they look is in the templates.
//!
//! Rows of dots and bars are placed in percent of their width, so that they fit a telephone and a desk alike. Panels of
//! curves and histograms are drawn in units of [`PANEL`], which the browser scales.

pub(super) mod bars;
pub(super) mod curves;
pub(super) mod dots;
pub(super) mod histogram;
pub(super) mod lines;
pub(super) mod scale;

use serde::Serialize;

use crate::report::actor::{Actor, ModelParts};

/// How many colours the style sheet has for causes and kinds, beside those for models.
pub(super) const N_COLORS: usize = 8;

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(in crate::report) struct Tick {
    /// Percent of the width, or units of the panel.
    pub(in crate::report) at: String,
    pub(in crate::report) label: String,
}

/// A line of a legend.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(in crate::report) struct Key {
    pub(in crate::report) label: String,
    pub(in crate::report) color: usize,
    /// Whether it is a variant with the paper's encoder.
    pub(in crate::report) hollow: bool,
}

impl Key {
    /// The line of a model that was trained.
    pub(in crate::report) fn of_model(variant: &str, parts: &ModelParts) -> Self {
        Self { label: variant.to_owned(), color: parts.color(false), hollow: parts.has_papers_encoder() }
    }
}

/// A panel's size and the rectangle in it that data is drawn in.
#[derive(Clone, Copy, Debug, Serialize)]
pub(in crate::report) struct Panel {
    width: f64,
    height: f64,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

/// The one size of all panels.
pub(in crate::report) const PANEL: Panel =
    Panel { width: 440.0, height: 230.0, left: 52.0, right: 430.0, top: 10.0, bottom: 196.0 };

impl Panel {
    /// Where a share of the width is.
    fn x(&self, share: f64) -> f64 {
        self.left + share * (self.right - self.left)
    }

    /// Where a share of the height is, counted from below.
    fn y(&self, share: f64) -> f64 {
        self.bottom - share * (self.bottom - self.top)
    }
}

/// The colour of an actor's kind.
pub(in crate::report) fn color_of(actor: &Actor) -> usize {
    actor.parts.color(actor.is_oracle())
}

/// Lines in order of appearance, of those that are alike the first.
pub(in crate::report) fn once_each(keys: impl Iterator<Item = Key>, are_alike: fn(&Key, &Key) -> bool) -> Vec<Key> {
    keys.fold(Vec::new(), |mut kept, key| {
        if !kept.iter().any(|other| are_alike(other, &key)) {
            kept.push(key);
        }
        kept
    })
}

/// Names as they are in order of appearance, each once.
pub(in crate::report) fn distinct<'a>(names: impl Iterator<Item = &'a String>) -> Vec<String> {
    names.fold(Vec::new(), |mut distinct, name| {
        if !distinct.contains(name) {
            distinct.push(name.clone());
        }
        distinct
    })
}
