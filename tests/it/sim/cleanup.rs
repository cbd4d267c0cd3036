//! Bowls, forks and the tray.

use ntp::geometry::horizontal_distance;
use ntp::robot::{Action, RobotApi as _};
use ntp::scene::{BodyIndex, Scene, SceneState, Shape, SlotIndex, lies_inside};
use ntp::seed::Seed;
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Family, initial_state, scene};
use ntp::trace::Cause;

use super::table::{Table, pick_and_place};

const FORK: SlotIndex = SlotIndex(4);
const TRAY: u16 = 5;

fn world(bowls: [u16; 4], forks: u16, seed: u64) -> Simulation {
    let scene = scene(Family::TableCleanup, &[bowls.as_slice(), &[forks]].concat());
    let initial = initial_state(Family::TableCleanup, &scene, Seed(seed));
    Simulation::new(scene, &initial, &SimulationConfig::default()).unwrap()
}

#[track_caller]
fn act_all(world: &mut Simulation, actions: &[Action]) {
    for &action in actions {
        assert_eq!(world.act(action), Ok(()), "{action:?}");
    }
}

fn position(state: &SceneState, body: u16) -> ntp::geometry::Vec3 {
    state.body_in_world(BodyIndex(body)).translation.vector
}

fn tray_of(scene: &Scene) -> BodyIndex {
    scene.slot(SlotIndex(TRAY)).bodies[0]
}

#[test]
fn four_bowls_nest_with_the_foot_of_each_on_the_floor_of_the_one_below() {
    for seed in 0..3 {
        let mut world = world([1; 4], 1, seed);
        act_all(&mut world, &[pick_and_place(2, TRAY), pick_and_place(0, 2)].concat());
        act_all(&mut world, &[pick_and_place(3, 0), pick_and_place(1, 3)].concat());
        let state = world.settle().unwrap();
        let tray = state.body_in_world(tray_of(world.scene())).translation.vector;
        for (level, bowl) in [2, 0, 3, 1].into_iter().enumerate() {
            let at = position(&state, bowl);
            assert!((at.z - tray.z - 0.02 * (level + 1) as f32).abs() < 0.001, "bowl {bowl} at {at}, tray at {tray}");
            assert!(horizontal_distance(&at, &tray) < 0.004, "bowl {bowl} is off the middle");
        }
    }
}

#[test]
fn a_bowl_is_gripped_at_its_rim_and_hangs_above_the_middle_of_what_move_to_names() {
    let mut world = world([1; 4], 1, 5);
    act_all(&mut world, &[Action::MoveTo(SlotIndex(0)), Action::Grip]);
    let state = world.state();
    assert_eq!(state.held, Some(BodyIndex(0)));
    let beside = horizontal_distance(&state.gripper_in_world.translation.vector, &position(&state, 0));
    assert!((beside - 0.061).abs() < 0.003, "the gripper is {beside} m beside the bowl's middle");
    assert!(state.opening_m < 0.02, "the fingers close on the wall, {} m apart", state.opening_m);
    act_all(&mut world, &[Action::MoveTo(SlotIndex(1))]);
    let state = world.state();
    assert!(horizontal_distance(&position(&state, 0), &position(&state, 1)) < 1e-3);
}

#[test]
fn a_bowl_that_stands_aside_is_not_gripped() {
    let mut world = world([1, 0, 1, 0], 1, 2);
    let before = world.state();
    act_all(&mut world, &[Action::MoveTo(SlotIndex(1))]);
    assert_eq!(world.act(Action::Grip), Err(Cause::MissedGrasp));
    assert_eq!(position(&world.settle().unwrap(), 1), position(&before, 1));
}

#[test]
fn a_fork_that_lies_in_a_bowl_gives_the_slot_to_another() {
    let mut world = world([1; 4], 2, 7);
    let first = world.now().slots[usize::from(FORK.0)];
    act_all(&mut world, &[Action::MoveTo(FORK), Action::Grip, Action::MoveTo(SlotIndex(3)), Action::Release]);
    assert!(lies_inside(world.scene(), &world.state(), first, BodyIndex(3)));
    assert_ne!(world.now().slots[usize::from(FORK.0)], first);
}

#[test]
fn what_stands_firmly_is_carried_with_the_tray_and_what_does_not_falls() {
    let tray = Shape::OpenBox { inner_m: [0.09, 0.09, 0.02], wall_m: 0.005 };
    let block = Shape::Cuboid { half_extents_m: [0.02; 3] };
    let post = Shape::Cuboid { half_extents_m: [0.003, 0.003, 0.04] };
    let mut world = Table::default()
        .with("tray", tray, [0.0, 0.2])
        .at("block", block, [0.04, 0.2, 0.0251])
        .at("post", post, [-0.04, 0.2, 0.0451])
        .world();
    let before = world.settle().unwrap();
    let after = world.carry(BodyIndex(0)).unwrap();
    let on_tray = |state: &SceneState, body: u16| {
        state.body_in_world(BodyIndex(0)).inv_mul(state.body_in_world(BodyIndex(body))).translation.vector
    };
    let way = position(&after, 0) - position(&before, 0);
    assert!(way.z > 0.1 && way.xy().norm() > 0.2, "the tray was carried by {way}");
    assert!((on_tray(&after, 1) - on_tray(&before, 1)).norm() < 0.002, "the block stays where it was on the tray");
    assert!(on_tray(&after, 2).z < 0.02, "the post has fallen over");
}
