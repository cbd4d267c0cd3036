//! The sections of the page: each is a file that makes words and places of the report, and a template beside it that
//! says how they look. A section that has nothing to show is empty.

pub(in crate::report) mod annotations;
mod claims;
mod detectors;
mod failures;
mod figures;
mod filmstrips;
mod headline;
mod learning;
pub(in crate::report) mod models;
mod results;
mod robot_table;
mod run;
mod success;

use minijinja::Value;

use crate::report::metrics::Curve;
use crate::report::suite_names::SuiteNames;
use crate::report::summary::{Aggregate, Report};

/// One section.
pub(super) struct Section {
    /// Its template's name.
    pub(super) name: &'static str,
    /// Its template.
    pub(super) template: &'static str,
    /// What the template is filled in with.
    pub(super) fill: fn(&Contents<'_>) -> Value,
}

/// What sections are made of.
pub(super) struct Contents<'a> {
    pub(super) report: &'a Report,
    pub(super) curves: &'a [Curve],
    /// Of each model and suite the row that stands for it.
    pub(super) leading: Vec<Aggregate>,
    /// How their suites are called.
    pub(super) names: SuiteNames,
    /// Whether there is more than one experiment.
    pub(super) is_study: bool,
}

/// In their order on the page.
pub(super) const SECTIONS: [Section; 13] = [
    headline::SECTION,
    claims::SECTION,
    robot_table::SECTION,
    figures::SECTION,
    success::SECTION,
    filmstrips::SECTION,
    results::SECTION,
    failures::SECTION,
    learning::SECTION,
    detectors::SECTION,
    annotations::SECTION,
    models::SECTION,
    run::SECTION,
];
