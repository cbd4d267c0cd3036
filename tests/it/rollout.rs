//! The interpreter, driven by the oracle.

use ntp::model::ScopingKind;
use ntp::program::Program;
use ntp::robot::{Action, RobotApi};
use ntp::rollout::{Decision, Limits, Noisy, Oracle, Policy, PolicyError, Query, RolloutEpisode, Start, run};
use ntp::scene::{BodyIndex, Scene, SceneState, SlotIndex};
use ntp::seed::Seed;
use ntp::task::{Split, Task};
use ntp::trace::{Actor, Cause, Frame, ObservationNoise, Outcome, Provenance};

use crate::kinematic::{KinematicWorld, cleanup, demonstration, sorting, tower, trial};

fn start(task: &Task, demonstrated: u16, on_table: u16) -> Start<'_> {
    let own_trial = trial(task, 1, on_table);
    Start {
        task,
        demonstration: demonstration(task, &trial(task, 0, demonstrated), 0),
        world: Box::new(KinematicWorld::new(task.family, &own_trial)),
        sight: None,
        provenance: Provenance::new(task, &own_trial, Actor::Policy(String::new()), 0),
    }
}

fn check_oracle(starts: Vec<Start<'_>>) -> Vec<RolloutEpisode> {
    let mut oracle = Oracle::for_starts(&starts);
    let rollouts = run(&mut oracle, starts, Limits::default()).unwrap();
    for rollout in &rollouts {
        assert_eq!(rollout.episode.outcome, Outcome::Success);
        assert_eq!(rollout.first_divergence, None);
    }
    rollouts
}

#[test]
fn an_oracle_succeeds_at_stacking_and_sorting_side_by_side() {
    let (stacking, map) = (tower("t", &[4, 1, 6, 2], Split::Unseen), sorting("m", [0, 2, 2, 1], Split::Unseen));
    let rollouts = check_oracle(vec![start(&stacking, 1, 1), start(&map, 2, 2), start(&stacking, 1, 1)]);
    assert_eq!(rollouts[0].decisions, 7 * 3 + 1);
}

#[test]
fn an_oracle_sorts_more_objects_than_were_demonstrated() {
    let map = sorting("m", [3, 0, 2, 2], Split::Unseen);
    let rollouts = check_oracle(vec![start(&map, 1, 4)]);
    assert_eq!(rollouts[0].decisions, 7 * 16 + 1);
}

#[test]
fn an_oracle_cleans_up_more_forks_than_were_demonstrated() {
    let task = cleanup("c", &[1, 3], Split::Unseen);
    let rollouts = check_oracle(vec![start(&task, 1, 20)]);
    assert_eq!(rollouts[0].decisions, 7 * (2 + 20) + 1);
}

#[test]
fn a_policy_behind_noise_is_told_positions_that_are_off_and_the_same_each_time() {
    let task = tower("t", &[4, 1, 6, 2], Split::Unseen);
    let acted = |frame_m, offset_m| {
        let starts = vec![start(&task, 1, 1)];
        let oracle = Box::new(Oracle::for_starts(&starts));
        let mut policy = Noisy::new(oracle, ObservationNoise { frame_m, offset_m }, vec![Seed(7)]);
        run(&mut policy, starts, Limits::default()).unwrap().remove(0)
    };
    let exact = acted(0.0, 0.0);
    assert_eq!((exact.episode.outcome, exact.decisions), (Outcome::Success, 7 * 3 + 1));
    for (frame_m, offset_m) in [(0.1, 0.0), (0.0, 0.1)] {
        let off = acted(frame_m, offset_m);
        assert_eq!(off, acted(frame_m, offset_m));
        // It takes what stands for fallen, and builds it again and again.
        assert_eq!(off.episode.outcome, Outcome::Failure(Cause::NeverEnded));
    }
}

/// The world of a trial, but the last body falls off the tray when it is carried.
struct Shaky(KinematicWorld);

impl RobotApi for Shaky {
    fn scene(&self) -> &Scene {
        self.0.scene()
    }
    fn state(&self) -> SceneState {
        self.0.state()
    }
    fn frames(&self) -> &[Frame] {
        self.0.frames()
    }
    fn act(&mut self, action: Action) -> Result<(), Cause> {
        self.0.act(action)
    }
    fn settle(&mut self) -> Result<SceneState, Cause> {
        self.0.settle()
    }
    fn carry(&mut self, tray: BodyIndex) -> Result<SceneState, Cause> {
        let mut carried = self.0.carry(tray)?;
        let fork = self.scene().slot(SlotIndex(4)).bodies[0];
        carried.bodies_in_world[usize::from(fork.0)].translation.vector.x += 0.3;
        Ok(carried)
    }
}

#[test]
fn what_falls_when_carried_is_the_cause_of_failure() {
    let task = cleanup("c", &[1, 3], Split::Unseen);
    let own_trial = trial(&task, 1, 2);
    let world = Box::new(Shaky(KinematicWorld::new(task.family, &own_trial)));
    let starts = vec![Start { world, ..start(&task, 2, 2) }];
    let mut oracle = Oracle::for_starts(&starts);
    let rollouts = run(&mut oracle, starts, Limits::default()).unwrap();
    assert_eq!(rollouts[0].episode.outcome, Outcome::Failure(Cause::FellWhenCarried));
    assert_eq!(rollouts[0].first_divergence, None);
}

/// Calls the wrong thing at one decision.
struct Spoiled<P> {
    inner: P,
    at: u32,
    spoil: fn(&Query, &mut Decision),
}

impl<P: Policy> Policy for Spoiled<P> {
    fn name(&self) -> &str {
        "spoiled"
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        let mut decisions = self.inner.decide(queries)?;
        for (query, decision) in queries.iter().zip(&mut decisions) {
            if query.decision == self.at {
                (self.spoil)(query, decision);
            }
        }
        Ok(decisions)
    }
}

fn check_spoiled(at: u32, spoil: fn(&Query, &mut Decision)) -> RolloutEpisode {
    let task = tower("t", &[4, 1, 6], Split::Unseen);
    let starts = vec![start(&task, 1, 1)];
    let mut policy = Spoiled { inner: Oracle::for_starts(&starts), at, spoil };
    run(&mut policy, starts, Limits::default()).unwrap().remove(0)
}

#[test]
fn a_wrong_argument_is_the_first_divergence_and_the_wrong_block_stays_in_the_way() {
    let rollout = check_spoiled(2, |_, decision| decision.argument = Some(SlotIndex(7)));
    let divergence = rollout.first_divergence.unwrap();
    assert_eq!((divergence.decision, divergence.kind.name()), (2, "argument"));
    assert_eq!(rollout.episode.outcome, Outcome::Failure(Cause::NeverEnded));
}

#[test]
fn an_early_end_of_the_root_is_a_failure_although_nothing_went_wrong_before() {
    let rollout = check_spoiled(7, |query, decision| *decision = Decision::end(query));
    assert_eq!(rollout.first_divergence.unwrap().kind.name(), "early_end");
    assert_eq!(rollout.fault_decision, None);
    assert_eq!(rollout.episode.outcome, Outcome::Failure(Cause::EndedEarly));
}

#[test]
fn a_policy_that_leaves_a_query_unanswered_ends_the_rollout_with_an_error() {
    struct Silent;
    impl Policy for Silent {
        fn name(&self) -> &str {
            "silent"
        }
        fn decide(&mut self, _queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
            Ok(Vec::new())
        }
    }
    let task = tower("t", &[4, 1], Split::Unseen);
    let error = run(&mut Silent, vec![start(&task, 1, 1)], Limits::default()).unwrap_err().to_string();
    assert_eq!(error, "policy silent made 0 decisions; asked for were 1");
}

#[test]
fn a_policy_that_never_ends_is_stopped() {
    struct Endless;
    impl Policy for Endless {
        fn name(&self) -> &str {
            "endless"
        }
        fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
            let go_on = |query: &Query| Decision {
                program: ntp::program::Program::MoveTo,
                argument: Some(SlotIndex(0)),
                end_of_program: false,
                ..Decision::end(query)
            };
            Ok(queries.iter().map(go_on).collect())
        }
    }
    let task = tower("t", &[4, 1], Split::Unseen);
    let rollouts = run(&mut Endless, vec![start(&task, 1, 1)], Limits::default()).unwrap();
    assert_eq!(rollouts[0].episode.outcome, Outcome::Failure(Cause::NeverEnded));
}

/// Repeats the expert's primitives from the root, as a flat model decides.
struct FlatOracle(Vec<Decision>);

impl Policy for FlatOracle {
    fn name(&self) -> &str {
        "flat"
    }

    fn scoping(&self) -> ScopingKind {
        ScopingKind::Primitives
    }

    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        let decision = |query: &Query| {
            let planned = self.0.get(query.decision as usize).cloned();
            planned.map_or_else(|| Decision::end(query), |decision| Decision { scope: query.window, ..decision })
        };
        Ok(queries.iter().map(decision).collect())
    }
}

#[test]
fn primitives_called_by_the_root_do_what_the_hierarchy_does() {
    let task = tower("t", &[4, 1, 6], Split::Unseen);
    let starts = vec![start(&task, 1, 1)];
    let calls = starts[0].demonstration.calls.clone();
    let primitives = calls.iter().filter(|call| call.program.is_primitive());
    let decision = |call: &ntp::trace::ProgramCall| Decision {
        program: call.program,
        scope: call.input,
        argument: call.argument,
        argument_probability: 1.0,
        end_of_program: false,
        prediction: None,
    };
    let rollout =
        run(&mut FlatOracle(primitives.map(decision).collect()), starts, Limits::default()).unwrap().remove(0);
    assert_eq!(rollout.episode.outcome, Outcome::Success);
    assert_eq!((rollout.decisions, rollout.first_divergence), (2 * 4 + 1, None));
    assert!(rollout.episode.calls.iter().skip(1).all(|call| call.depth == 1));
}

/// Answers every question with one program and argument.
struct Stubborn(Program, Option<SlotIndex>);

impl Policy for Stubborn {
    fn name(&self) -> &str {
        "stubborn"
    }
    fn decide(&mut self, queries: &[Query]) -> Result<Vec<Decision>, PolicyError> {
        let Self(program, argument) = *self;
        let decision = |query: &Query| Decision { program, argument, end_of_program: false, ..Decision::end(query) };
        Ok(queries.iter().map(decision).collect())
    }
}

#[test]
fn a_decision_that_is_no_call_is_an_error_that_names_it() {
    let task = tower("t", &[0, 1], Split::Unseen);
    let error = |program, argument| {
        let rollouts = run(&mut Stubborn(program, argument), vec![start(&task, 1, 1)], Limits::default());
        rollouts.unwrap_err().to_string()
    };
    let unknown = error(Program::MoveTo, Some(SlotIndex(8)));
    assert_eq!(unknown, "call 1: its argument is slot 8, but the scene has 8, counted from 0");
    assert_eq!(error(Program::MoveTo, None), "call 1: move_to and no argument do not go together");
    let superfluous = error(Program::Grip, Some(SlotIndex(0)));
    assert_eq!(superfluous, "call 1: grip and slot 0 as argument do not go together");
}
