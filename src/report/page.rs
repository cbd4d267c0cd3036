//! `index.html`: the report as one page that needs no other file.
//!
//! Its parts are in [`section`](super::section), its plots in [`chart`](super::chart); the look is in the templates and
//! the style sheet beside them.

use minijinja::{Environment, UndefinedBehavior, Value};
use serde::Serialize;

use crate::report::chart::distinct;
use crate::report::chart::scale::many;
use crate::report::markdown;
use crate::report::metrics::Curve;
use crate::report::order;
use crate::report::section::{Contents, SECTIONS};
use crate::report::suite_names::SuiteNames;
use crate::report::summary::Report;
use crate::words::counted;

/// What the page's own template is filled in with.
#[derive(Serialize)]
struct Page<'a> {
    report: &'a Report,
    style: &'static str,
    lede: Vec<String>,
    /// Program, commits, training seeds, cost.
    made_by: String,
    /// Each section as HTML.
    sections: Vec<Value>,
}

/// The page of a report.
pub(super) fn render(report: &Report, curves: &[Curve]) -> Result<String, minijinja::Error> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_trim_blocks(true);
    environment.set_lstrip_blocks(true);
    environment.add_filter("counted", |n: u64, thing: String| counted(n, &thing));
    environment.add_template("charts.html.j2", include_str!("charts.html.j2"))?;
    environment.add_template("page.html.j2", include_str!("page.html.j2"))?;
    let experiments = distinct(report.aggregates.iter().map(|row| &row.actor.experiment));
    let (leading, names) = (order::leading(&report.aggregates), SuiteNames::of(&report.aggregates));
    let contents = Contents { report, curves, leading, names, is_study: experiments.len() > 1 };
    let mut sections = Vec::with_capacity(SECTIONS.len());
    for section in SECTIONS {
        environment.add_template(section.name, section.template)?;
        let html = environment.get_template(section.name)?.render((section.fill)(&contents))?;
        sections.push(Value::from_safe_string(html));
    }
    let (lede, made_by) = (lede(report), markdown::made_by(report));
    let page = Page { report, style: include_str!("style.css"), lede, made_by, sections };
    environment.get_template("page.html.j2")?.render(page)
}

fn lede(report: &Report) -> Vec<String> {
    let episodes: u64 = report.aggregates.iter().map(|row| row.episodes).sum();
    if episodes == 0 {
        return Vec::new();
    }
    let mut seeds: Vec<i64> = report.results.iter().map(|row| row.seed).collect();
    seeds.sort_unstable();
    seeds.dedup();
    let variants = distinct(report.aggregates.iter().map(|row| &row.actor.variant)).len() as u64;
    let suites = distinct(report.aggregates.iter().map(|row| &row.suite)).len() as u64;
    vec![
        many(episodes, "rollout"),
        many(suites, "suite"),
        many(variants, "variant"),
        many(seeds.len() as u64, "training seed"),
    ]
}
