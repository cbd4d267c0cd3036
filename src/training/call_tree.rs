//! A trial's calls, indexed by caller and by the program that decided on them.
//!
//! # Errors
//!
//! What was read from a table that was tampered with may break a rule that indexing relies on: it is refused by name.

use std::collections::BTreeMap;

use crate::dataset::TrialData;
use crate::model::ScopingKind;
use crate::program::Program;
use crate::scene::SlotIndex;
use crate::trace::{Observation, ProgramCall, Span};
use crate::training::TrainError;

/// A trial's calls by caller.
#[derive(Debug)]
pub(super) struct CallTree {
    /// Positions of the calls that each call made.
    pub(super) callees: Vec<Vec<usize>>,
    /// Arguments of the moves below each callee of the root.
    pub(super) signatures: BTreeMap<usize, Vec<SlotIndex>>,
    /// Calls by the program that decided on them, those of one running call together.
    pub(super) decisions: BTreeMap<Program, Vec<Vec<usize>>>,
}

impl CallTree {
    /// Indexes a trial.
    ///
    /// # Errors
    ///
    /// [`TrainError::Trial`] when its calls and frames do not fit together.
    pub(super) fn new(trial: &TrialData, scoping: ScopingKind) -> Result<Self, TrainError> {
        check(trial)?;
        let calls = &trial.calls;
        let mut callees = vec![Vec::new(); calls.len()];
        for (position, call) in calls.iter().enumerate() {
            if let Some(caller) = call.caller {
                callees[caller.0 as usize].push(position);
            }
        }
        let signatures = callees[0].iter().map(|&position| (position, moves_below(calls, position))).collect();
        let decisions = match scoping {
            ScopingKind::Primitives => BTreeMap::from([(calls[0].program, vec![without_hierarchy(calls)])]),
            ScopingKind::Scoped | ScopingKind::Unscoped | ScopingKind::Arguments => by_program(calls, &callees),
        };
        Ok(Self { callees, signatures, decisions })
    }
}

/// The calls of each running call, by its program.
fn by_program(calls: &[ProgramCall], callees: &[Vec<usize>]) -> BTreeMap<Program, Vec<Vec<usize>>> {
    let mut decisions: BTreeMap<Program, Vec<Vec<usize>>> = BTreeMap::new();
    for (call, callees) in calls.iter().zip(callees).filter(|(_, callees)| !callees.is_empty()) {
        decisions.entry(call.program).or_default().push(callees.clone());
    }
    decisions
}

/// What moves the robot, in order, and the step that ends the root.
fn without_hierarchy(calls: &[ProgramCall]) -> Vec<usize> {
    let is_decided =
        |call: &ProgramCall| call.program.is_primitive() || (call.program == Program::None && call.depth == 1);
    (0..calls.len()).filter(|&position| is_decided(&calls[position])).collect()
}

/// Arguments of the moves below a call. What is below it follows it in the order of calling.
pub(super) fn moves_below(calls: &[ProgramCall], position: usize) -> Vec<SlotIndex> {
    let below = calls[position + 1..].iter().take_while(|call| call.depth > calls[position].depth);
    below.filter_map(|call| call.argument).collect()
}

/// What indexing relies on. An [`crate::trace::Episode`] holds it; a table that was tampered with may not.
fn check(trial: &TrialData) -> Result<(), TrainError> {
    let n_slots = trial.family.n_slots();
    let refuse = |problem: &str| {
        Err(TrainError::Trial { task: trial.task_id.clone(), trial: trial.trial, problem: problem.to_owned() })
    };
    if trial.n_frames == 0 || trial.observations.len() != trial.n_frames * Observation::width(n_slots) {
        return refuse("observations are not as many as frames and slots ask for");
    }
    if trial.grippers.len() != trial.n_frames {
        return refuse("states of the gripper are not as many as frames");
    }
    if trial.calls.first().is_none_or(|root| root.caller.is_some() || root.output.is_none()) {
        return refuse("the first call is not a root");
    }
    for (position, call) in trial.calls.iter().enumerate() {
        let caller = call.caller.map(|caller| caller.0 as usize);
        if caller.is_none() != (position == 0) || caller.is_some_and(|caller| caller >= position) {
            return refuse("a call's caller does not come before it");
        }
        if caller.is_some_and(|caller| call.output.is_some_and(|part| !contains(&trial.calls[caller], part))) {
            return refuse("a call's part lies outside its caller's");
        }
        let frames = [Some(call.frames), call.output].into_iter().flatten();
        if frames.into_iter().any(|span| span.is_empty() || span.end as usize > trial.n_frames) {
            return refuse("a call's frames lie beyond the episode");
        }
        if call.argument.is_some_and(|slot| usize::from(slot.0) >= n_slots) {
            return refuse("a call's argument is not a slot");
        }
    }
    Ok(())
}

fn contains(caller: &ProgramCall, part: Span) -> bool {
    caller.output.is_some_and(|window| window.contains(part))
}
