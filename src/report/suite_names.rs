//! How suites are called in tables and charts.
//!
//! Experiments of a study may have suites of one name. Where their rows would read alike, the experiment is told too.

use std::collections::{BTreeMap, BTreeSet};

use crate::report::summary::Aggregate;

/// The suites whose name alone does not tell rows apart.
#[derive(Debug, Default)]
pub(super) struct SuiteNames {
    shared: BTreeSet<String>,
}

impl SuiteNames {
    /// Of all rows that are shown together.
    pub(super) fn of(aggregates: &[Aggregate]) -> Self {
        let mut experiments: BTreeMap<_, BTreeSet<&str>> = BTreeMap::new();
        for row in aggregates {
            let read = (&row.suite, row.actor.words());
            experiments.entry(read).or_default().insert(&row.actor.experiment);
        }
        let is_shared = experiments.into_iter().filter(|(_, experiments)| experiments.len() > 1);
        Self { shared: is_shared.map(|((suite, _), _)| suite.clone()).collect() }
    }

    /// The suite, and its experiment where it needs to be told.
    pub(super) fn tell(&self, suite: &str, experiment: &str) -> String {
        match self.shared.contains(suite) {
            true => format!("{suite} of {experiment}"),
            false => suite.to_owned(),
        }
    }

    /// The same of a row.
    pub(super) fn of_row(&self, row: &Aggregate) -> String {
        self.tell(&row.suite, &row.actor.experiment)
    }

    /// Whether rows stand under one name, in tasks of the same kind.
    pub(super) fn are_one(&self, a: &Aggregate, b: &Aggregate) -> bool {
        (self.of_row(a), &a.facts) == (self.of_row(b), &b.facts)
    }
}
