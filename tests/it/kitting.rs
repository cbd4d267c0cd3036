//! Kitting: which kits there are, where parts and trays begin, what a filled place is, and that the expert fills them.

use std::collections::BTreeSet;

use ntp::expert::demonstrate;
use ntp::geometry::{Vec3, horizontal_distance, upright};
use ntp::program::{KnownPrograms, Program};
use ntp::recording::{ShardWriter, inspect};
use ntp::rollout::{Limits, Oracle, Start, run};
use ntp::scene::{BodyIndex, Scene, SceneState, SlotIndex};
use ntp::seed::Seed;
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Condition, Family, Goal, Split, Task, TaskSet, Trial, condition_holds, initial_state, sample, scene};
use ntp::trace::{Actor, Outcome, Provenance};
use proptest::prelude::*;

use crate::kinematic::{KinematicWorld, demonstration, tower, trial};

const PARTS: std::ops::Range<u16> = 0..6;
const PLACES: std::ops::Range<u16> = 6..12;

fn kit(goals: &[(u16, u16)]) -> Task {
    let goals: Vec<Goal> =
        goals.iter().map(|&(part, place)| Goal { source: SlotIndex(part), target: SlotIndex(place) }).collect();
    let conditions = goals.iter().map(|goal| goal.brings_about(Family::Kitting)).collect();
    Task { id: "kit".to_owned(), family: Family::Kitting, goals, conditions, split: Split::Unseen, blocks: None }
}

fn start(seed: u64) -> (Scene, SceneState) {
    let scene = scene(Family::Kitting, &[]);
    let state = initial_state(Family::Kitting, &scene, Seed(seed));
    (scene, state)
}

/// Puts a part's foot on a place, so far from its middle.
fn put(scene: &Scene, state: &mut SceneState, part: u16, place: u16, offset_m: [f32; 2]) {
    let body = BodyIndex(part);
    let below = state.body_in_world(scene.slot(SlotIndex(place)).bodies[0]);
    let height_m = scene.body(BodyIndex(place)).shape.seat_m() + scene.body(body).shape.foot_m();
    let position = below * ntp::geometry::Point::new(offset_m[0], offset_m[1], height_m);
    state.bodies_in_world[usize::from(part)] = upright(position.coords, 0.4);
}

/// So many ways to fill so many of six places from two, two, one and one alike: 15·14 + 20·42 + 15·102 + 6·180 + 180.
#[test]
fn there_are_3840_kits() {
    let set = sample(Family::Kitting, 3840, 0, Seed(5)).unwrap();
    set.validate().unwrap();
    let distinct: BTreeSet<_> = set.tasks.iter().map(Task::canonical_goal).collect();
    assert_eq!(distinct.len(), 3840);
    let of_size = |size| set.tasks.iter().filter(|task| task.goals.len() == size).count();
    assert_eq!([2, 3, 4, 5, 6].map(of_size), [15 * 14, 20 * 42, 15 * 102, 6 * 180, 180]);
    let error = sample(Family::Kitting, 3000, 841, Seed(5)).unwrap_err().to_string();
    assert_eq!(error, "kitting has at most 840 unseen tasks to draw, 841 were asked for");
}

#[test]
fn a_kit_is_told_by_its_id_and_in_words() {
    let set = sample(Family::Kitting, 100, 0, Seed(2)).unwrap();
    for task in &set.tasks {
        let digits = task.id.strip_prefix("kit_").unwrap().chars().map(|digit| digit.to_digit(10).unwrap());
        let by_id: BTreeSet<(u32, u16)> = digits.zip(PLACES).filter(|&(kind, _)| kind > 0).collect();
        let kind = |part: u16| [1, 1, 2, 2, 3, 4][usize::from(part)];
        let by_goals = task.goals.iter().map(|goal| (kind(goal.source.0), goal.target.0)).collect();
        assert_eq!(by_id, by_goals, "{}", task.id);
    }
    assert_eq!(kit(&[(1, 8), (4, 6)]).text(), "put peg_2 on place_C, then put gear on place_A");
}

#[test]
fn which_of_two_like_parts_is_used_makes_no_other_kit() {
    assert_eq!(kit(&[(0, 6), (1, 7)]).canonical_goal(), kit(&[(0, 7), (1, 6)]).canonical_goal());
    assert_ne!(kit(&[(0, 6), (2, 7)]).canonical_goal(), kit(&[(0, 7), (2, 6)]).canonical_goal());
    let [mut seen, unseen] = [kit(&[(0, 6), (4, 7)]), kit(&[(4, 7), (1, 6)])];
    seen.split = Split::Seen;
    seen.id = "seen".to_owned();
    let leak = TaskSet { family: Family::Kitting, tasks: vec![seen, unseen] }.validate().unwrap_err().to_string();
    assert!(leak.contains("asks for the same as training task seen"), "{leak}");
}

#[test]
fn parts_look_the_same_exactly_when_they_make_the_same_kit() {
    let scene = scene(Family::Kitting, &[]);
    for (part, other) in PARTS.flat_map(|part| PARTS.map(move |other| (part, other))) {
        let [a, b] = [part, other].map(|part| scene.body(BodyIndex(part)));
        let same_kit = kit(&[(part, 6)]).canonical_goal() == kit(&[(other, 6)]).canonical_goal();
        assert_eq!((a.shape, a.color) == (b.shape, b.color), same_kit, "{} and {}", a.name, b.name);
    }
}

#[test]
fn the_rules_of_a_task_set_hold_for_kits() {
    let problem = |goals: &[(u16, u16)]| {
        TaskSet { family: Family::Kitting, tasks: vec![kit(goals)] }.validate().unwrap_err().to_string()
    };
    assert_eq!(problem(&[(6, 7)]), "tasks[0].goals[0].source: place_A is not a part");
    assert_eq!(problem(&[(0, 1)]), "tasks[0].goals[0].target: peg_2 is not a place");
    assert_eq!(problem(&[(0, 12)]), "tasks[0].goals[0].target: slot 12 does not exist, the scene has 12");
    assert_eq!(problem(&[(0, 6), (1, 6)]), "tasks[0].goals[1]: goals[0] already puts something on place_A");
    assert_eq!(problem(&[(0, 6), (0, 7)]), "tasks[0].goals[1]: peg_1 is already moved by goals[0]");
}

#[test]
fn a_place_is_filled_by_the_part_or_one_like_it_alone() {
    let (scene, begin) = start(3);
    let filled = Condition::Filled { part: SlotIndex(0), place: SlotIndex(6) };
    let holds = |put_there: &[(u16, [f32; 2])], held: Option<u16>| {
        let mut state = begin.clone();
        put_there.iter().for_each(|&(part, offset_m)| put(&scene, &mut state, part, 6, offset_m));
        state.held = held.map(BodyIndex);
        condition_holds(&scene, &state, &filled)
    };
    assert!(!holds(&[], None), "nothing lies there");
    assert!(holds(&[(0, [0.0, 0.0])], None));
    assert!(holds(&[(1, [0.03, -0.03])], None), "the other peg, at a corner");
    assert!(!holds(&[(2, [0.0, 0.0])], None), "a nut");
    assert!(!holds(&[(0, [0.04, 0.0])], None), "beside the place, on the board");
    assert!(!holds(&[(0, [0.02, 0.0]), (4, [-0.02, 0.0])], None), "a gear lies there too");
    assert!(!holds(&[(0, [0.0, 0.0])], Some(0)), "it is still held");
    let mut above = begin.clone();
    put(&scene, &mut above, 0, 6, [0.0, 0.0]);
    above.bodies_in_world[0].translation.vector.z += 0.02;
    assert!(!condition_holds(&scene, &above, &filled), "it hangs above");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_kit_depends_on_seed_and_place_in_its_split_alone(seed: u64, train in 1_u32..400, unseen in 1_u32..400) {
        let set = sample(Family::Kitting, train, unseen, Seed(seed)).unwrap();
        set.validate().unwrap();
        let more = sample(Family::Kitting, train + 50, unseen + 20, Seed(seed)).unwrap();
        for split in Split::ALL {
            let n = set.of_split(split).count();
            prop_assert!(set.of_split(split).eq(more.of_split(split).take(n)));
        }
    }

    #[test]
    fn every_start_has_room_for_fingers_and_places_on_their_trays(seed: u64) {
        let (scene, state) = start(seed);
        let position = |body: u16| state.bodies_in_world[usize::from(body)].translation.vector;
        for part in PARTS {
            let others = (0..part).chain(PLACES);
            let nearest = others.map(|other| horizontal_distance(&position(part), &position(other)));
            prop_assert!(nearest.fold(f32::MAX, f32::min) > 0.09, "seed {seed}");
        }
        for place in PLACES {
            let tray = &state.bodies_in_world[usize::from(12 + (place - 6) / 3)];
            let on_tray: Vec3 = tray.inverse_transform_point(&position(place).into()).coords;
            prop_assert!(on_tray.x.abs() < 0.101 && on_tray.y.abs() < 0.001, "seed {seed}");
        }
        prop_assert!(Simulation::new(scene, &state, &SimulationConfig::default()).is_ok(), "seed {seed}");
    }

    #[test]
    fn the_expert_and_an_oracle_fill_every_kit(seed: u64) {
        let set = sample(Family::Kitting, 0, 1, Seed(seed)).unwrap();
        let task = &set.tasks[0];
        let own = trial(task, 1, 1);
        let shown = demonstration(task, &trial(task, 0, 1), 0);
        prop_assert_eq!(shown.outcome, Outcome::Success);
        prop_assert_eq!(shown.boundary_frames().count(), 4 * task.goals.len() + 1);
        let world = Box::new(KinematicWorld::new(task.family, &own));
        let provenance = Provenance::new(task, &own, Actor::Policy(String::new()), 0);
        let starts = vec![Start { task, demonstration: shown, world, sight: None, provenance }];
        let mut oracle = Oracle::for_starts(&starts);
        let rollouts = run(&mut oracle, starts, Limits::default()).unwrap();
        prop_assert_eq!(rollouts[0].episode.outcome, Outcome::Success);
        prop_assert_eq!(rollouts[0].first_divergence, None);
    }
}

#[test]
fn the_expert_fills_kits_in_physics() {
    let set = sample(Family::Kitting, 0, 12, Seed(8)).unwrap();
    let config = SimulationConfig { frame_hz: 0, ..SimulationConfig::default() };
    for (index, task) in set.tasks.iter().enumerate() {
        let trial = Trial { index: 0, counts: task.counts(|| 1), seed: Seed(index as u64) };
        let scene = scene(task.family, &trial.counts);
        let state = initial_state(task.family, &scene, trial.seed);
        let mut world = Simulation::new(scene, &state, &config).unwrap();
        let provenance = Provenance::new(task, &trial, Actor::Expert, index as u64);
        let episode = demonstrate(task, &mut world, provenance).unwrap();
        assert_eq!(episode.outcome, Outcome::Success, "{}", task.id);
    }
}

/// Twelve programs were known before there were kits; recordings of other families still tell of these alone.
#[test]
fn recordings_declare_the_programs_that_their_family_needs() {
    let folder = tempfile::tempdir().unwrap();
    for (task, n_programs) in [(tower("t", &[0, 1], Split::Seen), 12), (kit(&[(0, 6)]), 13)] {
        let path = folder.path().join(format!("{n_programs}.mcap"));
        let mut writer = ShardWriter::create(&path, "{}").unwrap();
        writer.write(&demonstration(&task, &trial(&task, 0, 1), 0)).unwrap();
        writer.finish().unwrap();
        let known = KnownPrograms::of_hash(&inspect(&path).unwrap().vocabulary_hash).unwrap();
        assert_eq!(known.programs(), &Program::ALL[..n_programs]);
        let bytes = std::fs::read(&path).unwrap();
        let declares = |word: &[u8]| bytes.windows(word.len()).any(|found| found == word);
        assert_eq!([&b"TABLE_CLEANUP"[..], b"KITTING"].map(declares), [true, n_programs == 13]);
    }
}
