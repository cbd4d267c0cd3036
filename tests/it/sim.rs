//! The world in physics: motions, grasps, falls, piles, and that all of it repeats to the bit.

mod adversary;
mod arm;
mod cleanup;
mod contract;
mod rates;
mod table;

use ntp::geometry::horizontal_distance;
use ntp::robot::{Action, GRASP_M, HOVER_M, RobotApi as _};
use ntp::scene::{BodyIndex, Scene, SlotIndex};
use ntp::sim::{SimError, Simulation, SimulationConfig};
use ntp::trace::Cause;

use table::{BLOCK, Table, pick_and_place};

const PICK_FIRST: [Action; 2] = [Action::MoveTo(SlotIndex(0)), Action::Grip];

#[track_caller]
fn act_all(world: &mut Simulation, actions: &[Action]) {
    for &action in actions {
        assert_eq!(world.act(action), Ok(()), "{action:?}");
    }
}

#[test]
fn a_tower_of_eight_is_as_high_as_its_blocks() {
    let mut table = Table::default();
    for column in 0..8_u16 {
        table.add(&format!("block_{column}"), BLOCK, [-0.28 + 0.08 * f32::from(column), 0.0]);
    }
    let mut world = table.world();
    let base = world.state().bodies_in_world[0].translation.vector;
    for upper in 1..8 {
        act_all(&mut world, &pick_and_place(upper, upper - 1));
    }
    let state = world.settle().unwrap();
    for (level, pose) in state.bodies_in_world.iter().enumerate() {
        let error_m = pose.translation.vector.z - (0.025 + 0.05 * level as f32);
        assert!(error_m.abs() < 0.001, "block {level} is {error_m} m off its height");
        assert!(horizontal_distance(&pose.translation.vector, &base) < 0.002, "block {level} leans");
    }
}

#[test]
fn move_to_ends_above_the_body_and_grip_two_centimetres_above_its_centre() {
    let mut world = Table::default().with("block", BLOCK, [0.1, -0.1]).world();
    let block = world.state().bodies_in_world[0].translation.vector;
    act_all(&mut world, &PICK_FIRST[..1]);
    let above = world.state().gripper_in_world.translation.vector - block;
    assert!(horizontal_distance(&above, &Default::default()) < 1e-4 && (above.z - HOVER_M).abs() < 1e-4);
    act_all(&mut world, &PICK_FIRST[1..]);
    let state = world.state();
    assert_eq!(state.held, Some(BodyIndex(0)));
    let held = state.gripper_in_world.translation.vector - state.bodies_in_world[0].translation.vector;
    assert!((held.z - GRASP_M).abs() < 1e-3);
    assert!((state.opening_m - 0.05).abs() < 0.001, "the fingers touch the block, {} m apart", state.opening_m);
}

#[test]
fn the_fingers_close_on_air_where_nothing_lies() {
    let mut world = Table::default().with("block", BLOCK, [0.2, 0.2]).gripper([-0.1, 0.0, 0.3]).world();
    assert_eq!(world.act(Action::Grip), Err(Cause::MissedGrasp));
    let state = world.state();
    assert_eq!(state.held, None);
    assert!((state.opening_m - 0.07).abs() < 1e-6, "the fingers are open again");
    assert!(state.gripper_in_world.translation.vector.z < 0.05, "it did go down");
    act_all(&mut world, &PICK_FIRST);
}

#[test]
fn only_what_is_between_the_fingers_is_grasped() {
    // Beside the middle along the fingers' closing: pulled there and grasped.
    let mut world = Table::default().with("block", BLOCK, [0.0, 0.0]).gripper([0.0, 0.006, 0.3]).world();
    assert_eq!(world.act(Action::Grip), Ok(()));
    let state = world.state();
    assert!((state.bodies_in_world[0].translation.vector.y - 0.006).abs() < 0.002);
    // So far beside it that a finger would come down on the block.
    let mut world = Table::default().with("block", BLOCK, [0.0, 0.0]).gripper([0.0, 0.02, 0.3]).world();
    let before = world.state().bodies_in_world[0];
    assert_eq!(world.act(Action::Grip), Err(Cause::MissedGrasp));
    let moved = world.settle().unwrap().bodies_in_world[0].translation.vector - before.translation.vector;
    assert!(moved.norm() < 1e-3, "the block is not pushed into the table");
    // At the block's end along the fingers' flat sides.
    let mut world = Table::default().with("block", BLOCK, [0.0, 0.0]).gripper([0.02, 0.0, 0.3]).world();
    assert_eq!(world.act(Action::Grip), Err(Cause::MissedGrasp));
    // Too wide for the fingers.
    let wide = ntp::scene::Shape::Cuboid { half_extents_m: [0.04; 3] };
    let mut world = Table::default().with("crate", wide, [0.0, 0.0]).world();
    assert_eq!(world.act(PICK_FIRST[0]), Ok(()));
    assert_eq!(world.act(PICK_FIRST[1]), Err(Cause::MissedGrasp));
}

#[test]
fn a_turned_block_is_gripped_at_its_sides_and_set_down_straight() {
    for yaw_rad in [0.4, -0.7, 1.2] {
        let mut world =
            Table::default().with("block", BLOCK, [0.0, 0.1]).turned(yaw_rad).with("base", BLOCK, [0.1, 0.0]).world();
        act_all(&mut world, &pick_and_place(0, 1));
        let yaw =
            ntp::geometry::yaw_rad(&world.settle().unwrap().bodies_in_world[0]).rem_euclid(std::f32::consts::FRAC_PI_2);
        let off = yaw.min(std::f32::consts::FRAC_PI_2 - yaw);
        assert!(off < 0.02, "a block turned by {yaw_rad} rad is set down {off} rad off");
    }
}

#[test]
fn a_carried_block_passes_above_a_tower_in_its_way() {
    let mut table = Table::default().with("carried", BLOCK, [-0.2, 0.0]).with("target", BLOCK, [0.2, 0.0]);
    for level in 0..4 {
        table.add_at(&format!("level_{level}"), BLOCK, [0.0, 0.0, 0.025 + 0.05 * level as f32]);
    }
    let (scene, initial) = table.parts();
    let config = SimulationConfig { frame_hz: 100, ..SimulationConfig::default() };
    let mut world = Simulation::new(scene, &initial, &config).unwrap();
    let tower = world.state().bodies_in_world[2..].to_vec();
    act_all(&mut world, &pick_and_place(0, 1));
    let over = |frame: &&ntp::trace::Frame| frame.state.bodies_in_world[0].translation.vector.x.abs() < 0.05;
    let over: Vec<_> = world.frames().iter().filter(over).collect();
    assert!(!over.is_empty(), "the way leads over the tower");
    assert!(over.iter().all(|frame| frame.state.bodies_in_world[0].translation.vector.z - 0.025 > 0.2));
    for (before, after) in tower.iter().zip(&world.settle().unwrap().bodies_in_world[2..]) {
        assert!((before.translation.vector - after.translation.vector).norm() < 1e-4);
    }
}

#[test]
fn a_tower_that_an_action_topples_is_named() {
    // The upper two are nearly out of balance; one more on the outer one is too much.
    let mut world = Table::default()
        .with("carried", BLOCK, [0.2, 0.2])
        .at("lower", BLOCK, [0.0, 0.0, 0.025])
        .at("upper", BLOCK, [0.013, 0.0, 0.075])
        .at("outer", BLOCK, [0.0355, 0.0, 0.125])
        .world();
    assert_eq!(world.act(PICK_FIRST[0]), Ok(()));
    assert_eq!(world.act(PICK_FIRST[1]), Ok(()));
    assert_eq!(world.act(Action::MoveTo(SlotIndex(3))), Ok(()));
    assert_eq!(world.act(Action::Release), Err(Cause::KnockedTower));
    assert_eq!(world.act(Action::MoveTo(SlotIndex(1))), Ok(()), "it is told once, and the world goes on");
}

#[test]
fn what_falls_off_the_table_is_named() {
    // Gripped off its centre, the block is set down on a post near the edge with its weight on the outer side.
    let post = ntp::scene::Shape::Cuboid { half_extents_m: [0.006, 0.02, 0.02] };
    let mut world = Table::default()
        .with("block", BLOCK, [0.0, 0.0])
        .with("post", post, [0.393, 0.0])
        .gripper([-0.013, 0.0, 0.3])
        .world();
    assert_eq!(world.act(Action::Grip), Ok(()));
    assert_eq!(world.act(Action::MoveTo(SlotIndex(1))), Ok(()));
    assert_eq!(world.act(Action::Release), Err(Cause::ObjectOffTable));
    let state = world.settle().unwrap();
    assert!(state.bodies_in_world[0].translation.vector.z < -0.2, "it lies on the ground");
    assert_eq!(world.act(Action::MoveTo(SlotIndex(1))), Ok(()));
}

#[test]
fn a_beam_that_stands_out_on_both_sides_is_carried_unless_it_is_too_heavy() {
    let beam = |length_m: f32| ntp::scene::Shape::Cuboid { half_extents_m: [length_m / 2.0, 0.03, 0.03] };
    let mut light = Table::default().with("beam", beam(0.2), [0.0, 0.0]).with("block", BLOCK, [0.0, 0.2]).world();
    act_all(&mut light, &PICK_FIRST);
    assert_eq!(light.act(Action::MoveTo(SlotIndex(1))), Ok(()));
    assert_eq!(light.state().held, Some(BodyIndex(0)));
    // Of 1.4 kg: it is gripped, but slips as it is lifted.
    let mut heavy = Table::default().with("beam", beam(0.75), [0.0, 0.0]).with("block", BLOCK, [0.0, 0.2]).world();
    act_all(&mut heavy, &PICK_FIRST);
    assert_eq!(heavy.act(Action::MoveTo(SlotIndex(1))), Err(Cause::DroppedObject));
    assert_eq!(heavy.state().held, None);
}

#[track_caller]
fn check_refused(table: Table, expected: &str) {
    let (scene, initial) = table.parts();
    let error = Simulation::new(scene, &initial, &SimulationConfig::default()).err().unwrap();
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn starts_that_make_no_sense_are_refused_by_name() {
    let two = || Table::default().with("red", BLOCK, [0.0, 0.0]);
    check_refused(two().with("blue", BLOCK, [0.04, 0.0]), "red and blue overlap");
    check_refused(two().with("blue", BLOCK, [0.45, 0.0]), "blue starts at [0.45");
    check_refused(two().at("blue", BLOCK, [0.2, 0.0, 0.01]), "table and blue overlap");
    check_refused(two().gripper([0.0, 0.03, 0.06]), "gripper and red overlap");
    check_refused(two().at("blue", BLOCK, [f32::NAN, 0.0, 0.1]), "blue: its pose is not finite");
    check_refused(two().with("blue", ntp::scene::Shape::Ball { radius_m: 0.0 }, [0.2, 0.0]), "blue: every size");
    let (mut scene, mut initial) = two().parts();
    initial.held = Some(BodyIndex(0));
    let held = Simulation::new(scene.clone(), &initial, &SimulationConfig::default()).err();
    assert_eq!(held, Some(SimError::HeldAtStart { name: "red".to_owned() }));
    initial.held = None;
    scene.slots[0].bodies.clear();
    let slot = Simulation::new(scene, &initial, &SimulationConfig::default()).err();
    assert_eq!(slot, Some(SimError::Slot { name: "red".to_owned(), bodies: Vec::new() }));
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let (scene, initial) = Table::default().with("red", BLOCK, [0.0, 0.0]).parts();
    let fine = SimulationConfig::default;
    let wrong = [
        (SimulationConfig { step_hz: 0, ..fine() }, "simulation.step_hz is 0"),
        (SimulationConfig { frame_hz: 300, ..fine() }, "simulation.frame_hz is 300"),
        (SimulationConfig { speed_m_per_s: f32::NAN, ..fine() }, "simulation.speed_m_per_s is NaN"),
        (SimulationConfig { acceleration_m_per_s2: -1.0, ..fine() }, "simulation.acceleration_m_per_s2 is -1"),
        (SimulationConfig { settle_limit_secs: 0.0, ..fine() }, "simulation.settle_limit_secs is 0"),
    ];
    for (config, expected) in wrong {
        let error = Simulation::new(Scene::clone(&scene), &initial, &config).err().unwrap();
        assert!(error.to_string().contains(expected), "{error}");
    }
}
