//! What the paper claims, judged, and what is to be said of models that see.

use minijinja::Value;
use serde::Serialize;

use crate::report::claims::{Claim, Note, Verdict};
use crate::report::section::{Contents, Section};

/// The section.
pub(super) const SECTION: Section = Section {
    name: "claims.html.j2",
    template: include_str!("claims.html.j2"),
    fill: |of| Value::from_serialize(fill(of)),
};

#[derive(Serialize)]
struct Claims<'a> {
    claims: Vec<ClaimRow<'a>>,
    notes: &'a [Note],
    is_study: bool,
}

/// A claim of the paper.
#[derive(Serialize)]
struct ClaimRow<'a> {
    claim: &'a str,
    experiment: &'a str,
    /// Whether it stands in the row before too.
    again: bool,
    encoder: &'a str,
    ours: &'a str,
    verdict: &'static str,
    /// Names its colour.
    class: Verdict,
}

fn fill<'a>(of: &Contents<'a>) -> Claims<'a> {
    Claims { claims: claim_rows(&of.report.claims), notes: &of.report.notes, is_study: of.is_study }
}

fn claim_rows(claims: &[Claim]) -> Vec<ClaimRow<'_>> {
    let mut rows: Vec<ClaimRow<'_>> = Vec::with_capacity(claims.len());
    for (at, claim) in claims.iter().enumerate() {
        rows.push(ClaimRow {
            claim: &claim.claim,
            experiment: &claim.experiment,
            again: at > 0 && (&claims[at - 1].id, &claims[at - 1].experiment) == (&claim.id, &claim.experiment),
            encoder: &claim.encoder,
            ours: &claim.ours,
            verdict: claim.verdict.words(),
            class: claim.verdict,
        });
    }
    rows
}
