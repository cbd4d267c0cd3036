//! Sawyer's kinematics, its limits, and the ways that it finds.

use std::f64::consts::{FRAC_PI_2, PI};

use ntp::arm::{
    self, Branch, HOME, Line, Load, Obstacles, PlannerConfig, Posture, Solid, Upright, Vector, closest, forward,
    inverse, jacobian, on_branch, plan, self_clearance, solutions,
};
use ntp::seed::Seed;
use rand::Rng as _;
use rand_chacha::ChaCha8Rng;
use sha2::{Digest as _, Sha256};

fn near(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance
}

#[track_caller]
fn check_place(posture: [f64; 7], expected: [f64; 3], tolerance: f64) {
    let found = forward(&Posture(posture)).position;
    let is_there = found.iter().zip(expected).all(|(found, expected)| near(*found, expected, tolerance));
    assert!(is_there, "{found:?} instead of {expected:?}");
}

/// A place over a table, near enough for most draws to be reached.
fn place(rng: &mut ChaCha8Rng) -> Upright {
    let radius = rng.random_range(0.25..0.85);
    let angle = rng.random_range(-2.0..2.0_f64);
    let position = Vector::new(radius * angle.cos(), radius * angle.sin(), rng.random_range(-0.05..0.4));
    Upright { position, yaw_rad: rng.random_range(-PI..PI) }
}

#[test]
fn the_stretched_arm_is_as_long_as_its_links() {
    // Shoulder at 0.081 before and 0.317 above the base; 0.4 to the elbow and 0.4 to the wrist; 0.11 + 0.0245 to the hand
    // and 0.1076 to the reference point. Beside: 0.05 + 0.1425 - 0.042 - 0.1265 + 0.031 + 0.1053.
    check_place([0.0; 7], [0.081 + 0.8 + 0.2421, 0.1603, 0.317], 1e-12);
    // A quarter turn of the first joint turns x to y and y to -x.
    check_place([FRAC_PI_2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [-0.1603, 1.1231, 0.317], 1e-12);
    // The elbow bent by a right angle: the forearm hangs down from 0.4 before the shoulder.
    check_place([0.0, 0.0, 0.0, FRAC_PI_2, 0.0, 0.0, 0.0], [0.481, 0.1603, 0.317 - 0.4 - 0.2421], 1e-12);
}

#[test]
fn the_neutral_posture_is_where_its_maker_says() {
    // The pose of the inverse kinematics example of Rethink's SDK: the hand at 0.4506, 0.1616, 0.2174, measured on a robot
    // at the neutral posture. The reference point is 0.1076 below the hand.
    check_place([0.0, -1.18, 0.0, 2.18, 0.0, 0.57, 3.3161], [0.4506, 0.1616, 0.2174 - 0.1076], 3e-3);
}

#[test]
fn the_jacobian_is_the_slope_of_the_forward_kinematics() {
    let mut rng = Seed(1).rng();
    for _ in 0..100 {
        let posture = Posture(std::array::from_fn(|_| rng.random_range(-2.0..2.0)));
        let slopes = jacobian(&posture);
        for joint in 0..7 {
            let turned = |angle: f64| {
                let mut turned = posture;
                turned.0[joint] += angle;
                forward(&turned)
            };
            let (before, after) = (turned(-1e-6), turned(1e-6));
            let moved = (after.position - before.position) / 2e-6;
            assert!((moved - slopes.fixed_view::<3, 1>(0, joint)).norm() < 1e-8);
            // Of a small turn the matrix is I + [w]: w from the part that changes sign when it is transposed.
            let turn = (after.rotation * before.rotation.transpose()) / 2e-6;
            let turned =
                Vector::new(turn[(2, 1)] - turn[(1, 2)], turn[(0, 2)] - turn[(2, 0)], turn[(1, 0)] - turn[(0, 1)]);
            assert!((turned / 2.0 - slopes.fixed_view::<3, 1>(3, joint)).norm() < 1e-8);
        }
    }
}

/// How far the gripper is from where it is asked to be: in metres, from pointing down, and from the turn or its half turn.
fn off(posture: &Posture, asked: &Upright) -> [f64; 3] {
    let found = forward(posture);
    let x_axis = found.rotation.column(0);
    let turn = (x_axis[1].atan2(x_axis[0]) - asked.yaw_rad).rem_euclid(PI);
    [(found.position - asked.position).norm(), (found.rotation[(2, 2)] + 1.0).abs(), turn.min(PI - turn)]
}

#[test]
fn every_posture_of_the_closed_form_holds_the_gripper_as_asked() {
    let mut rng = Seed(2).rng();
    let (mut n_reached, mut n_found) = (0, 0);
    for _ in 0..100_000 {
        let asked = place(&mut rng);
        let mut reached = false;
        for (_, posture) in solutions(&asked) {
            assert!(posture.is_within_limits(), "{posture:?}");
            let [away, tilted, turned] = off(&posture, &asked);
            assert!(away < 1e-9 && tilted < 1e-12 && turned < 1e-9, "{away} {tilted} {turned} at {asked:?}");
            reached = true;
            n_found += 1;
        }
        n_reached += u32::from(reached);
    }
    // Out of reach are places near the base's axis and some at the edge.
    assert!(n_reached > 90_000, "{n_reached}");
    assert!(n_found > 5 * n_reached, "{n_found} postures for {n_reached} places");
}

#[test]
fn places_out_of_reach_have_no_posture() {
    for [x, y, z] in [[1.2, 0.0, 0.1], [0.1, 0.05, 0.1], [0.6, 0.0, 1.5], [f64::NAN, 0.0, 0.1]] {
        let asked = Upright { position: Vector::new(x, y, z), yaw_rad: 0.0 };
        assert_eq!(solutions(&asked).count(), 0, "{asked:?}");
    }
}

#[test]
fn ten_thousand_inverses_have_the_bits_of_always() {
    let mut rng = Seed(3).rng();
    let mut hasher = Sha256::new();
    for _ in 0..10_000 {
        let asked = Upright {
            position: Vector::new(rng.random_range(0.2..0.9), rng.random_range(-0.6..0.6), 0.05),
            yaw_rad: rng.random(),
        };
        for (_, posture) in solutions(&asked) {
            posture.0.iter().for_each(|angle| hasher.update(angle.to_bits().to_le_bytes()));
        }
    }
    let hash: String = hasher.finalize()[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(hash, "becb78a671af1bb3");
}

#[test]
fn the_numeric_inverse_finds_what_the_closed_form_finds() {
    let mut rng = Seed(4).rng();
    for number in 0..300 {
        let asked = place(&mut rng);
        let Some((_, posture)) = solutions(&asked).next() else { continue };
        let target = forward(&posture);
        let found = inverse(&target, &HOME, Seed(number), |_| true).expect("it is within reach");
        assert!((forward(&found).position - target.position).norm() < 1e-6);
        assert!((forward(&found).rotation - target.rotation).norm() < 1e-6);
        assert!(found.is_within_limits());
    }
}

#[test]
fn the_numeric_inverse_reaches_any_pose_that_a_posture_has() {
    let mut rng = Seed(5).rng();
    for number in 0..200 {
        let posture = Posture(std::array::from_fn(|_| rng.random_range(-2.2..2.2)));
        let target = forward(&posture);
        let found = inverse(&target, &HOME, Seed(number), Posture::is_within_limits).expect("a posture has it");
        assert!((forward(&found).position - target.position).norm() < 1e-6);
        // From beside the posture the descent ends at that pose too.
        let beside = posture.between(&HOME, 0.02);
        assert!((forward(&closest(&target, &beside).unwrap()).position - target.position).norm() < 1e-6);
    }
}

#[test]
fn a_pose_out_of_reach_is_refused() {
    let mut target = forward(&HOME);
    target.position.x = 1.6;
    let refused = inverse(&target, &HOME, Seed(1), |_| true).unwrap_err();
    assert_eq!(refused.to_string(), "no posture within the joints' limits holds the gripper there");
}

#[test]
fn a_line_between_upright_postures_keeps_the_gripper_upright_and_turns_it_evenly() {
    let mut rng = Seed(6).rng();
    let mut n_lines = 0;
    while n_lines < 500 {
        let [from, to] = [place(&mut rng), place(&mut rng)];
        let (Some(from), Some(to)) = (on_branch(&from, Branch::ALL[0]), on_branch(&to, Branch::ALL[0])) else {
            continue;
        };
        n_lines += 1;
        let yaw = |posture: &Posture| posture.0[0] - posture.0[6];
        for part in 0..=20 {
            let share = f64::from(part) / 20.0;
            let posture = from.between(&to, share);
            let tool = forward(&posture);
            assert!(near(tool.rotation[(2, 2)], -1.0, 1e-9));
            assert!(near(yaw(&posture), yaw(&from) + (yaw(&to) - yaw(&from)) * share, 1e-9));
        }
    }
}

#[test]
fn no_frame_of_a_line_is_beyond_the_limits() {
    let mut rng = Seed(7).rng();
    let step_secs = 1.0 / 240.0;
    let (mut n_frames, mut fastest, mut hardest) = (0, 0.0_f64, 0.0_f64);
    while n_frames < 200_000 {
        let [from, to] = [place(&mut rng), place(&mut rng)];
        let (Some((_, from)), Some((_, to))) = (solutions(&from).next(), solutions(&to).last()) else { continue };
        // Short lines are bound by acceleration, long ones by speed.
        let line = Line { from, to: from.between(&to, rng.random_range(0.01..1.0)) };
        let n_steps = (line.duration_secs() / step_secs).ceil() as u32;
        let at = |step: u32| line.at(f64::from(step.min(n_steps)) / f64::from(n_steps));
        for step in 1..=n_steps {
            let [before, now, after] = [at(step - 1), at(step), at(step + 1)];
            assert!(now.is_within_limits());
            for joint in 0..7 {
                let (speed, acceleration) = arm::limits(joint);
                let [before, now, after] = [before, now, after].map(|posture| posture.0[joint]);
                fastest = fastest.max((now - before).abs() / step_secs / speed);
                hardest = hardest.max((after - 2.0 * now + before).abs() / step_secs / step_secs / acceleration);
            }
            n_frames += 1;
        }
    }
    assert!(fastest <= 1.001 && hardest <= 1.001, "{fastest} and {hardest} of the limits");
    // As fast as they allow: else the bound would say nothing.
    assert!(fastest > 0.95 && hardest > 0.9, "{fastest} and {hardest} of the limits");
}

#[test]
fn the_arm_at_home_is_clear_of_itself_and_folded_it_is_not() {
    assert!(self_clearance(&HOME) > 0.02, "{}", self_clearance(&HOME));
    assert!(self_clearance(&Posture([0.0, -1.18, 0.0, 2.18, 0.0, 0.57, 3.3161])) > 0.01);
    // The elbow bent all the way: the wrist lies on the upper arm.
    assert!(self_clearance(&Posture([0.0, -0.5, 0.0, 3.04, 0.0, 0.0, 0.0])) < 0.0);
}

const LOAD: Load = Load { radius_m: 0.052, below_m: 0.028, above_m: 0.1 };

/// A block of a tower of some height.
fn tower(x: f64, y: f64, height_m: f64) -> Solid {
    Solid { least: Vector::new(x - 0.025, y - 0.025, -0.1), most: Vector::new(x + 0.025, y + 0.025, height_m - 0.1) }
}

fn upright(x: f64, y: f64, z: f64) -> Posture {
    solutions(&Upright { position: Vector::new(x, y, z), yaw_rad: 0.0 }).next().expect("it is within reach").1
}

#[test]
fn ways_among_towers_are_found_and_free() {
    let mut rng = Seed(8).rng();
    let config = PlannerConfig::default();
    let (mut n_ways, mut n_planned) = (0, 0);
    for number in 0..60 {
        let mut solids = Vec::new();
        for _ in 0..6 {
            solids.push(tower(rng.random_range(0.45..0.8), rng.random_range(-0.18..0.18), 0.2));
        }
        let obstacles = Obstacles { solids, ..Obstacles::table(-0.1, 0.01) };
        let mut end = || loop {
            let posture =
                upright(rng.random_range(0.45..0.8), rng.random_range(-0.18..0.18), rng.random_range(-0.05..0.0));
            if obstacles.are_clear(&posture, &LOAD) {
                return posture;
            }
        };
        let (from, to) = (end(), end());
        let found = plan(&from, &to, &LOAD, &obstacles, &config, Seed(number)).expect("there is a way over the towers");
        assert_eq!(
            found,
            plan(&from, &to, &LOAD, &obstacles, &config, Seed(number)).unwrap(),
            "the same seed, the same way"
        );
        assert_eq!((found.postures.first(), found.postures.last()), (Some(&from), Some(&to)));
        for pair in found.postures.windows(2) {
            for part in 0..=50 {
                let posture = pair[0].between(&pair[1], f64::from(part) / 50.0);
                assert!(posture.is_within_limits());
                // Checked more densely than the planner does: a little of the margin may be gone between its checks.
                let halved = Obstacles { margin_m: 0.002, ..obstacles.clone() };
                assert!(halved.are_clear(&posture, &LOAD), "way {number}");
            }
        }
        n_ways += 1;
        n_planned += u32::from(found.n_nodes > 0);
    }
    assert_eq!(n_ways, 60);
    assert!(n_planned > 10, "{n_planned} of the ways needed more than a line");
}

#[test]
fn where_there_is_no_way_none_is_made_up() {
    // A wall across the whole table, higher than the arm reaches over it.
    let wall = Solid { least: Vector::new(-2.0, 0.05, -0.1), most: Vector::new(2.0, 0.1, 2.0) };
    let obstacles = Obstacles { solids: vec![wall], ..Obstacles::table(-0.1, 0.01) };
    let config = PlannerConfig { most_nodes: 300, ..PlannerConfig::default() };
    let (from, to) = (upright(0.5, -0.3, 0.2), upright(0.45, 0.4, 0.2));
    let refused = plan(&from, &to, &LOAD, &obstacles, &config, Seed(1)).unwrap_err();
    assert_eq!(refused.to_string(), "no free way there was found");
}
