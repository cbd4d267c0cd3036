//! How often a scripted expert succeeds in physics.

use ntp::expert::demonstrate;
use ntp::scene::{BodyIndex, SlotIndex, lies_inside};
use ntp::seed::Seed;
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Condition, Family, Goal, Split, Task, Trial, initial_state, scene};
use ntp::trace::{Actor, Episode, Outcome, Provenance};
use rand::Rng as _;
use rand::seq::SliceRandom as _;

/// Towers of 2 to 4 blocks, each built bottom-up.
fn random_stacking_task(seed: Seed) -> Task {
    let mut rng = seed.derive("task", &[]).rng();
    let mut blocks: Vec<u16> = (0..8).collect();
    blocks.shuffle(&mut rng);
    let mut goals = Vec::new();
    let n_goals = rng.random_range(1..=6);
    let mut rest = blocks.as_slice();
    while goals.len() < n_goals && rest.len() >= 2 {
        let height = rng.random_range(2..=4).min(rest.len());
        let (tower, others) = rest.split_at(height);
        goals.extend(tower.windows(2).map(|pair| Goal { source: SlotIndex(pair[1]), target: SlotIndex(pair[0]) }));
        rest = others;
    }
    let conditions = goals.iter().map(|goal| Condition::OnTop { upper: goal.source, lower: goal.target }).collect();
    Task {
        id: format!("stack_{}", seed.0),
        family: Family::BlockStacking,
        goals,
        conditions,
        split: Split::Seen,
        blocks: None,
    }
}

fn demonstration(task: &Task, counts: Vec<u16>, seed: Seed) -> Episode {
    let trial = Trial { index: 0, counts, seed: seed.derive("trial", &[]) };
    let scene = scene(task.family, &trial.counts);
    let initial = initial_state(task.family, &scene, trial.seed);
    let mut world = Simulation::new(scene, &initial, &SimulationConfig::default()).unwrap();
    demonstrate(task, &mut world, Provenance::new(task, &trial, Actor::Expert, seed.0)).unwrap()
}

/// Fails when more than one in `one_in` of the episodes failed.
#[track_caller]
fn check_rate(n_episodes: u64, one_in: u64, episode: impl Fn(Seed) -> Episode) {
    let outcomes = (0..n_episodes).map(|index| (index, episode(Seed(index)).outcome));
    let failures: Vec<_> = outcomes.filter(|(_, outcome)| *outcome != Outcome::Success).collect();
    assert!(failures.len() as u64 <= n_episodes / one_in, "of {n_episodes} these failed: {failures:?}");
}

#[test]
fn an_expert_stacks_nearly_always() {
    check_rate(400, 200, |seed| demonstration(&random_stacking_task(seed), Vec::new(), seed));
}

#[test]
fn an_expert_sorts_forty_objects_nearly_always() {
    check_rate(10, 100, |seed| {
        let mut rng = seed.derive("mapping", &[]).rng();
        let mapping = std::array::from_fn(|_| rng.random_range(0..4));
        demonstration(&crate::kinematic::sorting("map", mapping, Split::Seen), vec![10; 4], seed)
    });
}

#[test]
fn an_expert_cleans_up_any_number_of_bowls_and_forks_and_nothing_falls_when_carried() {
    for n_bowls in 1..=4 {
        for n_forks in [1, 5, 10, 20] {
            check_rate(3, 100, |seed| {
                let mut bowls: Vec<u16> = (0..4).collect();
                bowls.shuffle(&mut seed.derive("bowls", &[n_bowls, n_forks]).rng());
                let id = format!("{n_bowls} bowls, {n_forks} forks");
                let task = crate::kinematic::cleanup(&id, &bowls[..n_bowls as usize], Split::Seen);
                demonstration(&task, task.counts(|| n_forks as u16), seed.derive(&id, &[]))
            });
        }
    }
}

#[test]
fn one_container_holds_forty_objects() {
    for seed in 0..3 {
        let container = (seed % 4) as u16;
        let task = crate::kinematic::sorting("all", [container; 4], Split::Seen);
        let episode = demonstration(&task, vec![10; 4], Seed(seed));
        let last = &episode.frames[episode.frames.len() - 1].state;
        let box_index = BodyIndex(40 + container);
        let n_inside = (0..40).filter(|&body| lies_inside(&episode.scene, last, BodyIndex(body), box_index)).count();
        assert_eq!((n_inside, episode.outcome), (40, Outcome::Success), "seed {seed}");
    }
}
