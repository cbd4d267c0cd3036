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

use crate::report::order;

/// How many colours the style sheet has for variants.
const N_VARIANT_COLORS: usize = 11;
/// How many others it has for causes and kinds.
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
    /// A variant's line.
    pub(in crate::report) fn of_variant(variant: &str) -> Self {
        Self { label: variant.to_owned(), color: color_of(variant), hollow: has_paper_encoder(variant) }
    }
}

/// Whether a variant sees the paper's flattened input; the others compare objects.
pub(in crate::report) fn has_paper_encoder(variant: &str) -> bool {
    variant.ends_with("_paper")
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

/// The colour of a variant: the same in every report, and for both encoders.
pub(in crate::report) fn color_of(variant: &str) -> usize {
    order::variant_rank(variant) % N_VARIANT_COLORS
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
