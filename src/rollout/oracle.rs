//! A policy that does what the expert would do: it tests the interpreter, before any learning.

use crate::model::ScopingKind;
use crate::rollout::{Decision, Expectation, Policy, PolicyError, Query, Start};

/// Knows for each episode what the expert would call next. What is knocked over it builds again.
#[derive(Clone, Debug, Default)]
pub struct Oracle {
    beginnings: Vec<Expectation>,
    expectations: Vec<Expectation>,
}

impl Oracle {
    /// For episodes `0..expectations.len()`.
    pub fn new(expectations: Vec<Expectation>) -> Self {
        Self { beginnings: expectations.clone(), expectations }
    }

    /// For the episodes of [`super::run`] with the same starts.
    pub fn for_starts(starts: &[Start<'_>]) -> Self {
        let expectation = |start: &Start<'_>| {
            Expectation::new(ScopingKind::Scoped, &start.demonstration.clone().boundaries_only(), start.world.scene())
        };
        Self::new(starts.iter().map(expectation).collect())
    }

    fn decide_one(&mut self, query: &Query) -> Decision {
        let Self { beginnings, expectations } = self;
        let mut expectation = expectations.get_mut(query.episode);
        if let (Some(expectation), Some(beginning), 0) =
            (&mut expectation, beginnings.get(query.episode), query.decision)
        {
            expectation.clone_from(beginning);
        }
        match expectation.and_then(|expectation| expectation.next(&query.observation)) {
            Some(call) => Decision {
                program: call.program,
                scope: call.output.filter(|_| call.program.is_composite()).unwrap_or(query.window),
                argument: call.argument,
                argument_probability: 1.0,
                end_of_program: call.end_of_program,
                prediction: None,
            },
            None => Decision::end(query),
        }
    }
}

impl Policy for Oracle {
    fn name(&self) -> &str {
        "oracle"
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        Ok(queries.iter().map(|query| self.decide_one(query)).collect())
    }
}
