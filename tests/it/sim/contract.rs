//! What every world of the robot API promises, whatever is asked of it.

use ntp::robot::{Action, RobotApi as _};
use ntp::scene::{BodyIndex, SlotIndex, locked_bodies};
use ntp::seed::Seed;
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Family, initial_state, scene};
use ntp::trace::{Cause, Frame};
use rand::Rng as _;

use super::table::pick_and_place;

fn world(family: Family, counts: &[u16], seed: Seed, config: &SimulationConfig) -> Simulation {
    let scene = scene(family, counts);
    let initial = initial_state(family, &scene, seed);
    Simulation::new(scene, &initial, config).unwrap()
}

fn random_actions(seed: Seed, n_actions: usize) -> Vec<Action> {
    let mut rng = seed.rng();
    let draw = |_| match rng.random_range(0..6) {
        0..3 => Action::MoveTo(SlotIndex(rng.random_range(0..8))),
        3..5 => Action::Grip,
        _ => Action::Release,
    };
    (0..n_actions).map(draw).collect()
}

/// All numbers of the frames as bits.
fn bits(frames: &[Frame]) -> Vec<u32> {
    let poses =
        frames.iter().flat_map(|frame| frame.state.bodies_in_world.iter().chain([&frame.state.gripper_in_world]));
    poses
        .flat_map(|pose| {
            pose.translation.vector.iter().chain(pose.rotation.coords.iter()).map(|x| x.to_bits()).collect::<Vec<_>>()
        })
        .collect()
}

#[test]
fn each_action_ends_with_one_boundary_frame_whatever_it_is() {
    for seed in 0..12 {
        let family = Family::ALL[seed as usize % Family::ALL.len()];
        let mut world = world(family, &[3; 4], Seed(seed), &SimulationConfig::default());
        assert_eq!(world.frames().len(), 1);
        assert!(world.now().boundary && world.now().time_nanos == 0);
        for action in random_actions(Seed(seed), 40) {
            let n_before = world.frames().len();
            let _outcome = world.act(action);
            let new = &world.frames()[n_before..];
            let (last, inside) = new.split_last().unwrap();
            assert!(last.boundary && inside.iter().all(|frame| !frame.boundary), "{action:?}");
            assert_eq!(last.state, world.state());
        }
        check_frames(&world);
    }
}

/// Times increase, inside frames lie on the 10 Hz grid, poses are finite, slots follow the rule of locking.
fn check_frames(world: &Simulation) {
    let scene = world.scene();
    for pair in world.frames().windows(2) {
        let [before, frame] = pair else { unreachable!("windows of two") };
        assert!(frame.time_nanos > before.time_nanos);
        assert!(frame.boundary || frame.time_nanos % 100_000_000 == 0);
        let poses = frame.state.bodies_in_world.iter().chain([&frame.state.gripper_in_world]);
        assert!(poses.flat_map(|pose| pose.translation.vector.iter().copied()).all(f32::is_finite));
        assert_eq!(frame.slots, locked_bodies(scene, &frame.state, Some(&before.slots)));
    }
}

#[test]
fn with_no_frames_between_only_boundaries_are_recorded() {
    let config = SimulationConfig { frame_hz: 0, ..SimulationConfig::default() };
    let mut world = world(Family::BlockStacking, &[], Seed(3), &config);
    for action in pick_and_place(2, 5) {
        assert_eq!(world.act(action), Ok(()));
    }
    assert_eq!(world.frames().len(), 5);
}

#[test]
fn frames_between_do_not_change_what_happens() {
    let run = |frame_hz: u32| {
        let config = SimulationConfig { frame_hz, ..SimulationConfig::default() };
        let mut world = world(Family::BlockStacking, &[], Seed(4), &config);
        for action in [pick_and_place(2, 5), pick_and_place(7, 2)].concat() {
            assert_eq!(world.act(action), Ok(()));
        }
        let boundaries: Vec<Frame> = world.frames().iter().filter(|frame| frame.boundary).cloned().collect();
        boundaries
    };
    assert_eq!(run(0), run(30));
}

#[test]
fn to_grip_twice_and_to_release_nothing_change_nothing() {
    let mut world = world(Family::BlockStacking, &[], Seed(5), &SimulationConfig::default());
    assert_eq!(world.act(Action::Release), Ok(()));
    assert_eq!(world.act(Action::MoveTo(SlotIndex(1))), Ok(()));
    assert_eq!(world.act(Action::Grip), Ok(()));
    let before = world.state();
    assert_eq!(world.act(Action::Grip), Ok(()));
    assert_eq!(world.state(), before);
    assert_eq!(before.held, Some(BodyIndex(1)));
}

#[test]
fn a_slot_that_is_not_there_is_told_as_that() {
    let mut world = world(Family::BlockStacking, &[], Seed(6), &SimulationConfig::default());
    let before = world.state();
    assert_eq!(world.act(Action::MoveTo(SlotIndex(99))), Err(Cause::UnknownSlot));
    assert_eq!(world.state(), before);
    assert_eq!(world.frames().len(), 2);
}

#[test]
fn the_same_actions_give_the_same_bits_in_every_thread() {
    let run = || {
        let mut world = world(Family::ObjectSorting, &[4; 4], Seed(8), &SimulationConfig::default());
        let outcomes: Vec<_> = random_actions(Seed(8), 60).into_iter().map(|action| world.act(action)).collect();
        (bits(world.frames()), outcomes)
    };
    let here = run();
    let threads: Vec<_> = (0..3).map(|_| std::thread::spawn(run)).collect();
    for thread in threads {
        assert!(thread.join().unwrap() == here);
    }
}

#[test]
fn a_simulation_can_move_to_another_thread() {
    fn check<T: Send>(_: &T) {}
    check(&world(Family::BlockStacking, &[], Seed(9), &SimulationConfig::default()));
}
