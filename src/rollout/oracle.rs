//! A policy that repeats the expert's calls: it tests the interpreter, before any learning.

use crate::rollout::{Decision, Policy, Query, Start, expected_calls};
use crate::trace::ProgramCall;

/// Knows for each episode what the expert would call.
#[derive(Clone, Debug, Default)]
pub struct Oracle {
    expected: Vec<Vec<ProgramCall>>,
}

impl Oracle {
    /// For episodes `0..expected.len()`; see [`super::expected_calls`].
    pub fn new(expected: Vec<Vec<ProgramCall>>) -> Self {
        Self { expected }
    }

    /// For the episodes of [`super::run`] with the same starts.
    pub fn for_starts(starts: &[Start<'_>]) -> Self {
        let expected = |start: &Start<'_>| {
            let demonstration = start.demonstration.clone().boundaries_only();
            expected_calls(&demonstration, start.world.scene()).into_iter().cloned().collect()
        };
        Self::new(starts.iter().map(expected).collect())
    }

    fn decide_one(&self, query: &Query) -> Decision {
        let calls = self.expected.get(query.episode);
        match calls.and_then(|calls| calls.get(query.decision as usize)) {
            Some(call) => Decision {
                program: call.program,
                scope: call.output.filter(|_| call.program.is_composite()).unwrap_or(query.window),
                argument: call.argument,
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

    fn decide(&mut self, queries: &[Query]) -> Vec<Decision> {
        queries.iter().map(|query| self.decide_one(query)).collect()
    }
}
