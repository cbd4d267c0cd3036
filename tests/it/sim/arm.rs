//! Acting with the arm: that it does what the gripper does, within its limits, and refuses what it cannot.

use ntp::arm::{self, Posture, forward, self_clearance};
use ntp::expert::demonstrate;
use ntp::geometry::{Vec3, upright};
use ntp::robot::{Action, RobotApi as _, RobotKind};
use ntp::scene::{BodyIndex, SlotIndex};
use ntp::seed::Seed;
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Family, Layout, Split, Task, Trial, initial_state_on, sample, scene_on};
use ntp::trace::{Actor, Cause, Episode, Frame, Provenance};

use super::table::pick_and_place;

fn sawyer() -> SimulationConfig {
    SimulationConfig { robot: RobotKind::Sawyer, ..SimulationConfig::default() }
}

fn world(family: Family, counts: &[u16], seed: Seed, config: &SimulationConfig) -> Simulation {
    let scene = scene_on(Layout::Bench, family, counts);
    let initial = initial_state_on(Layout::Bench, family, &scene, seed);
    Simulation::new(scene, &initial, config).unwrap()
}

fn demonstration(task: &Task, index: u64, config: &SimulationConfig) -> Episode {
    let trial = Trial { index: 0, counts: task.counts(|| 2), seed: Seed(index).derive(&task.id, &[]) };
    let mut world = world(task.family, &trial.counts, trial.seed, config);
    demonstrate(task, &mut world, Provenance::new(task, &trial, Actor::Expert, index)).unwrap()
}

fn posture(frame: &Frame) -> Posture {
    Posture(frame.state.joints_rad.expect("an arm tells its joints").map(f64::from))
}

/// How many of some tasks of a family the expert brings to their end with the arm.
fn successes(family: Family, n_train: u32, n_tasks: usize) -> (usize, usize) {
    let tasks = sample(family, n_train, 0, Seed(5)).unwrap();
    let tasks: Vec<&Task> = tasks.of_split(Split::Seen).take(n_tasks).collect();
    let succeeded =
        |(number, task): (usize, &&Task)| demonstration(task, number as u64, &sawyer()).outcome.is_success();
    (tasks.iter().enumerate().filter(|found| succeeded(*found)).count(), tasks.len())
}

#[test]
fn the_expert_brings_tasks_of_every_family_to_their_end_with_the_arm() {
    for (family, n_train) in
        [(Family::BlockStacking, 12), (Family::ObjectSorting, 4), (Family::TableCleanup, 6), (Family::Kitting, 6)]
    {
        let (n_succeeded, n_tasks) = successes(family, n_train, 12);
        assert!(n_succeeded == n_tasks, "{}: {n_succeeded} of {n_tasks}", family.name());
    }
}

/// How far a second difference of recorded angles may be off, in radians: they are of four bytes, so each below 4 is off
/// by at most 2⁻²³, and the middle one counts twice.
const ROUNDED_RAD: f64 = 4.0 / 8_388_608.0;

/// The greatest of a joint's angle, speed and acceleration over what it allows, over all frames at every step.
fn strain(frames: &[Frame]) -> [f64; 3] {
    let mut strain = [0.0_f64; 3];
    let step_secs = 1.0 / 240.0;
    for window in frames.windows(3) {
        let [before, now, after] = [0, 1, 2].map(|at| posture(&window[at]).0);
        strain[0] = strain[0].max(f64::from(u8::from(!Posture(now).is_within_limits())));
        for joint in 0..7 {
            let (speed, acceleration) = arm::limits(joint);
            strain[1] = strain[1].max((after[joint] - now[joint]).abs() / step_secs / speed);
            let bent = (after[joint] - 2.0 * now[joint] + before[joint]).abs();
            strain[2] = strain[2].max((bent - ROUNDED_RAD) / step_secs / step_secs / acceleration);
        }
    }
    strain
}

#[test]
fn no_frame_of_an_episode_is_beyond_the_arms_limits() {
    let config = SimulationConfig { frame_hz: 240, ..sawyer() };
    for (family, n_train) in [(Family::BlockStacking, 2), (Family::ObjectSorting, 4), (Family::TableCleanup, 2)] {
        let tasks = sample(family, n_train, 0, Seed(7)).unwrap();
        for (number, task) in tasks.of_split(Split::Seen).take(2).enumerate() {
            let episode = demonstration(task, number as u64, &config);
            let [beyond, fastest, hardest] = strain(&episode.frames);
            assert!(beyond == 0.0 && fastest <= 1.001, "{}: {beyond} {fastest}", task.id);
            assert!(hardest <= 1.001, "{}: {hardest}", task.id);
            for frame in episode.frames.iter().step_by(8) {
                assert!(self_clearance(&posture(frame)) > 0.0);
                let tool = forward(&posture(frame)).position + arm::Vector::from(arm::BASE_IN_WORLD_M);
                let gripper = frame.state.gripper_in_world.translation.vector.cast::<f64>();
                assert!((tool - gripper).norm() < 1e-5, "{tool:?} {gripper:?}");
            }
        }
    }
}

#[test]
fn the_same_actions_give_the_same_bits() {
    let run = || {
        let mut world = world(Family::BlockStacking, &[], Seed(4), &sawyer());
        for action in [pick_and_place(2, 5), pick_and_place(7, 2)].concat() {
            assert_eq!(world.act(action), Ok(()));
        }
        world.frames().to_vec()
    };
    assert_eq!(run(), run());
}

#[test]
fn frames_between_do_not_change_what_the_arm_does() {
    let run = |frame_hz: u32| {
        let mut world = world(Family::BlockStacking, &[], Seed(9), &SimulationConfig { frame_hz, ..sawyer() });
        for action in [pick_and_place(1, 3), pick_and_place(0, 1)].concat() {
            assert_eq!(world.act(action), Ok(()));
        }
        world.frames().iter().filter(|frame| frame.boundary).cloned().collect::<Vec<_>>()
    };
    assert_eq!(run(0), run(30));
}

#[test]
fn what_is_out_of_reach_is_refused_and_nothing_moves() {
    let scene = scene_on(Layout::Bench, Family::BlockStacking, &[]);
    let mut initial = initial_state_on(Layout::Bench, Family::BlockStacking, &scene, Seed(3));
    // 1.3 m from the base.
    initial.bodies_in_world[0] = upright(Vec3::new(0.7, 0.0, 0.025), 0.0);
    let mut world = Simulation::new(scene, &initial, &sawyer()).unwrap();
    let before = world.state();
    assert_eq!(world.planned_stretches(SlotIndex(0)), Err(Cause::NoPath));
    assert_eq!(world.act(Action::MoveTo(SlotIndex(0))), Err(Cause::NoPath));
    assert_eq!(world.state(), before);
    assert_eq!(world.frames().iter().filter(|frame| frame.boundary).count(), 2);
    assert_eq!(world.act(Action::MoveTo(SlotIndex(1))), Ok(()), "the world goes on");
}

#[test]
fn the_arm_begins_at_home_wherever_the_gripper_is_said_to_be() {
    let [one, other] = [1, 2].map(|seed| world(Family::BlockStacking, &[], Seed(seed), &sawyer()).state());
    assert_eq!(one.gripper_in_world, other.gripper_in_world);
    assert_eq!(one.joints_rad, Some(arm::HOME.0.map(|angle| angle as f32)));
    assert!(world(Family::BlockStacking, &[], Seed(1), &SimulationConfig::default()).state().joints_rad.is_none());
}

#[test]
fn an_arm_without_its_bench_is_refused() {
    let config = SimulationConfig { layout: Some(Layout::Table), ..sawyer() };
    let refused = config.check().unwrap_err().to_string();
    assert_eq!(refused, "simulation.layout is table; allowed: bench, where the arm reaches everything");
}

#[test]
fn everything_of_every_bench_is_within_reach() {
    for family in Family::ALL {
        for seed in 0..20 {
            let counts = [10; 8];
            let scene = scene_on(Layout::Bench, family, &counts);
            let state = initial_state_on(Layout::Bench, family, &scene, Seed(seed));
            let named = scene.slots.iter().flat_map(|slot| slot.bodies.clone());
            for body in named {
                let place = state.body_in_world(body).translation.vector.cast::<f64>()
                    - arm::Vector::from(arm::BASE_IN_WORLD_M);
                for height_m in [0.03, 0.145] {
                    let at =
                        arm::Upright { position: arm::Vector::new(place.x, place.y, place.z + height_m), yaw_rad: 0.0 };
                    assert!(arm::solutions(&at).next().is_some(), "{} of {}", scene.body(body).name, family.name());
                }
            }
        }
    }
}

#[test]
fn a_block_in_the_grasp_stays_there_on_the_way() {
    let mut world = world(Family::BlockStacking, &[], Seed(11), &sawyer());
    for action in pick_and_place(4, 6).into_iter().take(3) {
        assert_eq!(world.act(action), Ok(()));
    }
    assert_eq!(world.state().held, Some(BodyIndex(4)));
    let state = world.state();
    let block = state.body_in_world(BodyIndex(4)).translation.vector;
    assert!((block - state.gripper_in_world.translation.vector + Vec3::new(0.0, 0.0, 0.02)).norm() < 0.003);
}
