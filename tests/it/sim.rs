//! The world in physics.

use ntp::expert::demonstrate;
use ntp::geometry::{Vec3, upright};
use ntp::robot::{Action, GRASP_M, HOVER_M, RobotApi};
use ntp::scene::{Body, BodyIndex, Mobility, Scene, SceneState, Shape, Slot, SlotIndex, lies_in_any_container};
use ntp::seed::Seed;
use ntp::sim::{SimError, Simulation, SimulationConfig};
use ntp::task::{Condition, Family, Goal, Split, Task, Trial, initial_state, scene};
use ntp::trace::{Actor, Cause, Outcome, Provenance};
use rand::Rng as _;
use rand::seq::SliceRandom as _;

/// Towers of 2 to 4 blocks, each built bottom-up.
fn random_stacking_task(seed: Seed) -> Task {
    let mut rng = seed.rng();
    let mut blocks: Vec<u16> = (0..8).collect();
    blocks.shuffle(&mut rng);
    let mut goals = Vec::new();
    let n_goals = rng.random_range(3..=6);
    let mut rest = blocks.as_slice();
    while goals.len() < n_goals && rest.len() >= 2 {
        let height = rng.random_range(2..=4).min(rest.len());
        let (tower, others) = rest.split_at(height);
        goals.extend(tower.windows(2).map(|pair| Goal { source: SlotIndex(pair[1]), target: SlotIndex(pair[0]) }));
        rest = others;
    }
    let conditions = goals.iter().map(|goal| Condition::OnTop { upper: goal.source, lower: goal.target }).collect();
    Task { id: format!("random_{}", seed.0), family: Family::BlockStacking, goals, conditions, split: Split::Seen }
}

fn world(family: Family, counts: &[u16], seed: Seed) -> Simulation {
    let scene = scene(family, counts);
    let initial = initial_state(family, &scene, seed);
    Simulation::new(scene, &initial, &SimulationConfig::default()).unwrap()
}

#[test]
fn probe_stacking() {
    let n: u64 = std::env::var("PROBE_N").ok().and_then(|n| n.parse().ok()).unwrap_or(20);
    let start = cpu_time::ProcessTime::now();
    let mut failures = Vec::new();
    let mut n_goals = 0;
    let mut n_frames = 0;
    let mut secs = 0.0;
    for index in 0..n {
        let task = random_stacking_task(Seed(index));
        n_goals += task.goals.len();
        let trial = Trial { index: 0, counts: Vec::new(), seed: Seed(index).derive("trial", &[]) };
        let mut world = world(task.family, &[], trial.seed);
        let episode = demonstrate(&task, &mut world, Provenance::new(&task, &trial, Actor::Expert, index)).unwrap();
        n_frames += episode.frames.len();
        secs += episode.frames.last().unwrap().time_nanos as f64 * 1e-9;
        if episode.outcome != Outcome::Success {
            failures.push((index, episode.outcome, episode.frames.iter().filter(|f| f.boundary).count()));
        }
    }
    let cpu = start.elapsed().as_secs_f64();
    eprintln!(
        "stacking: {n} demos, {} failures {failures:?}, {:.2} ms/demo, {:.2} goals, {:.1} frames, {:.2} s",
        failures.len(),
        1e3 * cpu / n as f64,
        n_goals as f64 / n as f64,
        n_frames as f64 / n as f64,
        secs / n as f64
    );
}

#[test]
fn probe_sorting() {
    let n: u64 = std::env::var("PROBE_N").ok().and_then(|n| n.parse().ok()).unwrap_or(4) / 4;
    let start = cpu_time::ProcessTime::now();
    let mut failures = Vec::new();
    for index in 0..n {
        let mut rng = Seed(index).derive("map", &[]).rng();
        let one: bool = index % 2 == 0;
        let first = rng.random_range(0..4);
        let mapping = std::array::from_fn(|_| if one { first } else { rng.random_range(0..4) });
        let task = crate::kinematic::sorting("map", mapping, Split::Seen);
        let trial = Trial { index: 0, counts: vec![10; 4], seed: Seed(index).derive("trial", &[]) };
        let mut world = world(task.family, &trial.counts, trial.seed);
        let episode = demonstrate(&task, &mut world, Provenance::new(&task, &trial, Actor::Expert, index)).unwrap();
        if episode.outcome != Outcome::Success {
            failures.push((index, episode.outcome, episode.frames.iter().filter(|f| f.boundary).count()));
        }
    }
    let cpu = start.elapsed().as_secs_f64();
    eprintln!("sorting: {n} demos, {} failures {failures:?}, {:.2} ms/demo", failures.len(), 1e3 * cpu / n as f64);
}

#[test]
fn probe_tower() {
    let shape = Shape::Cuboid { half_extents_m: [0.025; 3] };
    let body = |name: String| Body { name, shape, mobility: Mobility::Movable, color: [0; 3] };
    let bodies: Vec<Body> = (0..8).map(|i| body(format!("b{i}"))).collect();
    let slots =
        bodies.iter().enumerate().map(|(i, b)| Slot { name: b.name.clone(), bodies: vec![BodyIndex(i as u16)] });
    let scene = Scene { slots: slots.collect(), bodies, table_half_m: [0.4; 2] };
    let position = |i: usize| Vec3::new(-0.28 + 0.08 * i as f32, 0.0, 0.025);
    let initial = SceneState {
        gripper_in_world: upright(Vec3::new(0.0, 0.2, 0.3), 0.0),
        opening_m: 0.07,
        held: None,
        bodies_in_world: (0..8).map(|i| upright(position(i), 0.0)).collect(),
    };
    let mut world = Simulation::new(scene, &initial, &SimulationConfig::default()).unwrap();
    for upper in 1..8 {
        for action in
            [Action::MoveTo(SlotIndex(upper)), Action::Grip, Action::MoveTo(SlotIndex(upper - 1)), Action::Release]
        {
            let acted = world.act(action);
            eprintln!(
                "{upper} {action:?} {acted:?} {:?}",
                world.state().body_in_world(BodyIndex(upper)).translation.vector
            );
        }
    }
    for f in world.frames() {
        eprintln!(
            "{} {} {:?} {}",
            f.time_nanos as f64 * 1e-9,
            f.boundary,
            f.state.gripper_in_world.translation.vector,
            f.state.opening_m
        );
    }
    let state = world.settle();
    for i in 0..8 {
        let p = state.bodies_in_world[i].translation.vector;
        eprintln!("{i}: dx {:.5} dy {:.5} dz {:.5}", p.x - position(0).x, p.y, p.z - 0.025 - 0.05 * i as f32);
    }
}
