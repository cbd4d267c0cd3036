//! Pushes that topple towers.

use ntp::robot::RobotApi as _;
use ntp::seed::Seed;
use ntp::sim::{AdversaryConfig, SimError, Simulation, SimulationConfig};
use ntp::task::{Family, initial_state, scene};
use ntp::trace::Push;

use super::table::{BLOCK, Table, pick_and_place};

const ALWAYS: AdversaryConfig = AdversaryConfig { probability: 1.0, impulse_ns: 0.08 };

fn boundaries() -> SimulationConfig {
    SimulationConfig { frame_hz: 0, ..SimulationConfig::default() }
}

/// A stacking scene in which a tower was built in peace, and then met an adversary at its last placement.
fn pushed_tower(height: u16, seed: Seed, config: AdversaryConfig) -> Simulation {
    let scene = scene(Family::BlockStacking, &[]);
    let initial = initial_state(Family::BlockStacking, &scene, seed);
    let mut world = Simulation::new(scene, &initial, &boundaries()).unwrap();
    for upper in 1..height {
        if upper + 1 == height {
            world = world.with_adversary(config, seed).unwrap();
        }
        pick_and_place(upper, upper - 1).into_iter().for_each(|action| {
            let _acted = world.act(action);
        });
    }
    world
}

fn pushes(world: &Simulation) -> &[Push] {
    world.pushes().unwrap()
}

#[test]
fn pushes_of_the_default_impulse_topple_towers_of_every_height_and_leave_them_on_the_table() {
    let default = AdversaryConfig { probability: 1.0, ..AdversaryConfig::default() };
    let (mut n_toppled, mut n_off) = (0, 0);
    for height in 2..=4 {
        for seed in 0..12 {
            let world = pushed_tower(height, Seed(seed), default);
            assert_eq!(pushes(&world).len(), 1, "one placement, one push");
            n_toppled += usize::from(!pushes(&world)[0].toppled.is_empty());
            let state = world.state();
            n_off += usize::from(state.bodies_in_world.iter().any(|pose| pose.translation.vector.z < 0.0));
        }
    }
    assert!(n_toppled >= 34, "{n_toppled} of 36 pushes toppled something");
    assert!(n_off <= 1, "{n_off} of 36 pushes pushed something off the table");
}

#[test]
fn what_was_pushed_lies_and_the_robot_goes_on_without_blame() {
    let mut world = Table::default().with("red", BLOCK, [0.0, 0.0]).with("blue", BLOCK, [0.2, 0.0]).world();
    world = world.with_adversary(ALWAYS, Seed(1)).unwrap();
    for action in pick_and_place(0, 1) {
        assert_eq!(world.act(action), Ok(()), "{action:?}");
    }
    let state = world.state();
    assert_eq!(pushes(&world)[0].toppled, [ntp::scene::BodyIndex(0)]);
    assert!(state.bodies_in_world[0].translation.vector.z < 0.03, "it lies on the table");
    let frames = pushes(&world)[0].frames;
    assert_eq!(frames.last() as usize, world.frames().len() - 1);
    let before = &world.frames()[frames.begin as usize].state;
    assert!(before.bodies_in_world[0].translation.vector.z > 0.07, "the frame before shows the tower");
    assert_eq!(world.frames().last().map(|frame| &frame.state), Some(&state), "the frame shows what came of it");
    assert_eq!(world.act(ntp::robot::Action::MoveTo(ntp::scene::SlotIndex(1))), Ok(()));
}

#[test]
fn only_placements_on_other_bodies_are_pushed() {
    let mut world = Table::default().with("red", BLOCK, [0.0, 0.0]).with("blue", BLOCK, [0.2, 0.0]).world();
    world = world.with_adversary(ALWAYS, Seed(1)).unwrap();
    // Gripped and put down again where it was.
    for action in [pick_and_place(0, 1)[0], pick_and_place(0, 1)[1], pick_and_place(0, 1)[3]] {
        assert_eq!(world.act(action), Ok(()));
    }
    assert_eq!(pushes(&world), []);
}

#[test]
fn an_adversary_repeats_to_the_bit_and_another_seed_pushes_otherwise() {
    let first = pushed_tower(3, Seed(5), ALWAYS);
    let again = pushed_tower(3, Seed(5), ALWAYS);
    assert_eq!((first.frames(), first.pushes()), (again.frames(), again.pushes()));
    let impulses: Vec<[f32; 3]> =
        (0..4).map(|seed| pushes(&pushed_tower(2, Seed(seed), ALWAYS))[0].impulse_ns).collect();
    assert!(impulses.iter().all(|impulse| impulse != &pushes(&first)[0].impulse_ns));
    for [x, y, z] in impulses {
        assert!((x.hypot(y) - ALWAYS.impulse_ns).abs() < 1e-6 && z.abs() < 1e-9, "{x} {y} {z}");
    }
}

#[test]
fn an_adversary_that_never_pushes_changes_nothing() {
    let never = AdversaryConfig { probability: 0.0, ..ALWAYS };
    let world = pushed_tower(3, Seed(2), never);
    assert_eq!(pushes(&world), []);
    let scene = scene(Family::BlockStacking, &[]);
    let initial = initial_state(Family::BlockStacking, &scene, Seed(2));
    let mut alone = Simulation::new(scene, &initial, &boundaries()).unwrap();
    for upper in 1..3 {
        pick_and_place(upper, upper - 1).into_iter().for_each(|action| assert_eq!(alone.act(action), Ok(())));
    }
    assert_eq!(alone.frames(), world.frames());
    assert_eq!(alone.pushes(), None);
}

#[test]
fn settings_of_an_adversary_out_of_range_are_refused_by_name() {
    let check = |config: AdversaryConfig, expected: &str| {
        let error: SimError = config.check().unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    };
    check(AdversaryConfig { probability: 1.5, ..ALWAYS }, "adversary.probability is 1.5; allowed: 0 to 1");
    check(AdversaryConfig { probability: f32::NAN, ..ALWAYS }, "adversary.probability is NaN");
    check(AdversaryConfig { impulse_ns: 0.0, ..ALWAYS }, "adversary.impulse_ns is 0; allowed: above 0, at most 1");
    check(AdversaryConfig { impulse_ns: 2.0, ..ALWAYS }, "adversary.impulse_ns is 2");
}
