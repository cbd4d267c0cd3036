//! What a failed rollout is due to: the model, what it was told, or physics.
//!
//! # Source
//!
//! Xu et al., section V-D, table "Real robot": successes, "NTP failures" and "manipulation failures". There a person
//! told them apart; here the expert's decisions do. A failure in which no decision left the expert's is physics', also
//! where nothing was noticed to go wrong. Failures of the model that follow from where things were seen are told apart
//! from the others; the paper counts them as the model's.

use crate::rollout::{Decision, Policy, PolicyError, Query};
use crate::trace::{Observation, ProgramCall};

/// What a failure is due to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Failure {
    /// The model decided otherwise than the expert before anything went wrong in physics.
    Ntp,
    /// So it did, and decides as the expert when it is told true places.
    Localisation,
    /// Nothing was decided otherwise before physics went wrong, or at all.
    Manipulation,
}

impl Failure {
    /// Every kind, in the order of the paper's table.
    pub const ALL: [Self; 3] = [Self::Ntp, Self::Localisation, Self::Manipulation];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ntp => "ntp",
            Self::Localisation => "localisation",
            Self::Manipulation => "manipulation",
        }
    }

    /// What a failure is due to whose first decision that is not the expert's, and whose decision whose primitive first
    /// went wrong, are these; `is_right_when_told` says whether that decision is right with true places.
    pub fn of(first_divergence: Option<u32>, fault_decision: Option<u32>, is_right_when_told: bool) -> Self {
        match (first_divergence, fault_decision) {
            (None, _) => Self::Manipulation,
            (Some(divergence), Some(fault)) if fault < divergence => Self::Manipulation,
            (Some(_), _) if is_right_when_told => Self::Localisation,
            (Some(_), _) => Self::Ntp,
        }
    }
}

/// What an episode's policy was asked up to its first decision that is not the expert's.
#[derive(Clone, Debug, Default)]
pub(super) struct Asked {
    /// Every query up to that decision, or so far.
    queries: Vec<Query>,
    /// What the expert would do there; nothing where it would do no more.
    wanted: Option<ProgramCall>,
}

impl Asked {
    /// Notes a query.
    pub(super) fn note(&mut self, query: Query) {
        self.queries.push(query);
    }

    /// The last query was answered otherwise than the expert does; true places were these.
    pub(super) fn diverged(&mut self, wanted: Option<&ProgramCall>, observation: Observation) {
        if let Some(last) = self.queries.last_mut() {
            last.observation = observation;
        }
        self.wanted = wanted.cloned();
    }

    /// Asks a policy all of it again, of the last query with true places; whether it does as the expert then.
    ///
    /// # Errors
    ///
    /// When it cannot decide.
    pub(super) fn is_right_when_told(&self, policy: &mut dyn Policy) -> Result<bool, PolicyError> {
        let mut last = None;
        for query in &self.queries {
            last = policy.decide(std::slice::from_ref(query))?.pop();
        }
        Ok(last.zip(self.wanted.as_ref()).is_some_and(|(decision, wanted)| is_as(&decision, wanted)))
    }
}

fn is_as(decision: &Decision, wanted: &ProgramCall) -> bool {
    decision.program == wanted.program
        && decision.argument == wanted.argument
        && (!decision.program.is_composite() || Some(decision.scope) == wanted.output)
        && decision.end_of_program == wanted.end_of_program
}

/// What a failure is due to; the policy is asked again only where that tells.
pub(super) fn due_to(
    divergence: Option<u32>,
    fault: Option<u32>,
    is_right_when_told: impl FnOnce() -> Result<bool, PolicyError>,
) -> Result<Failure, PolicyError> {
    Ok(match Failure::of(divergence, fault, false) {
        Failure::Ntp => Failure::of(divergence, fault, is_right_when_told()?),
        other => other,
    })
}

/// How far off the places are that a policy is told.
#[derive(Default)]
pub(super) struct Localisation {
    sum_mm: f64,
    n_places: u32,
}

impl Localisation {
    pub(super) fn add(&mut self, told: &Observation, at: &Observation) {
        for (told, at) in told.slots_m.iter().zip(&at.slots_m) {
            self.sum_mm += 1000.0 * f64::from(told[0] - at[0]).hypot(f64::from(told[1] - at[1]));
            self.n_places += 1;
        }
    }

    pub(super) fn mean_mm(&self) -> Option<f64> {
        (self.n_places > 0).then(|| self.sum_mm / f64::from(self.n_places))
    }
}

#[cfg(test)]
mod tests {
    use super::Failure::{self, Localisation, Manipulation, Ntp};

    #[test]
    fn failures_are_told_apart_by_what_was_first() {
        // First divergence, first fault, whether it is right with true places.
        let rows = [
            (Some(5), None, false, Ntp),
            (Some(5), None, true, Localisation),
            (Some(5), Some(7), false, Ntp),
            (Some(5), Some(7), true, Localisation),
            // The decision itself is wrong, and goes wrong.
            (Some(5), Some(5), false, Ntp),
            (Some(5), Some(4), false, Manipulation),
            // What follows a fault is not asked again.
            (Some(5), Some(4), true, Manipulation),
            (None, Some(4), false, Manipulation),
            // Everything was decided as the expert does, and it does not stand.
            (None, None, false, Manipulation),
        ];
        for (divergence, fault, is_right_when_told, expected) in rows {
            let found = Failure::of(divergence, fault, is_right_when_told);
            assert_eq!(found, expected, "{divergence:?} {fault:?} {is_right_when_told}");
        }
    }
}
