//! Object Sorting with up to eighty objects.

use ntp::expert::demonstrate;
use ntp::scene::{Mobility, Shape};
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Family, Layout, Split, initial_state, scene};
use ntp::trace::{Actor, Outcome, Provenance};

use crate::kinematic::{sorting, trial};
use crate::pipeline::check_refused;

#[test]
fn eighty_objects_lie_apart_and_away_from_the_containers() {
    let task = sorting("map", [0, 1, 2, 3], Split::Seen);
    for index in 0..20 {
        let trial = trial(&task, index, 20);
        let scene = scene(Family::ObjectSorting, &trial.counts);
        let state = initial_state(Family::ObjectSorting, &scene, trial.seed);
        let at: Vec<_> = state.bodies_in_world.iter().map(|pose| pose.translation.vector.xy()).collect();
        let movable = |body: &usize| scene.bodies[*body].mobility == Mobility::Movable;
        let (objects, containers): (Vec<usize>, Vec<usize>) = (0..at.len()).partition(movable);
        assert_eq!((objects.len(), containers.len()), (80, 4));
        for (position, &object) in objects.iter().enumerate() {
            assert!(objects[..position].iter().all(|&other| (at[object] - at[other]).norm() >= 0.07));
            assert!(at[object].x.abs() < 0.5 && at[object].y > -0.5);
            for &container in &containers {
                let Shape::OpenBox { inner_m: [x, y, _], wall_m } = scene.bodies[container].shape else { panic!() };
                let beside = at[object] - at[container];
                assert!(beside.x.abs() > x + wall_m + 0.03 || beside.y.abs() > y + wall_m + 0.03, "{beside}");
            }
        }
    }
}

#[test]
fn the_expert_sorts_eighty_objects_that_all_share_a_container() {
    let task = sorting("map", [2, 2, 2, 2], Split::Unseen);
    let trial = trial(&task, 0, 20);
    let scene = scene(task.family, &trial.counts);
    let initial = initial_state(task.family, &scene, trial.seed);
    let mut world = Simulation::new(scene, &initial, &SimulationConfig::default()).unwrap();
    let episode = demonstrate(&task, &mut world, Provenance::new(&task, &trial, Actor::Expert, 0)).unwrap();
    assert_eq!(episode.outcome, Outcome::Success);
    assert_eq!(episode.boundary_frames().count(), 4 * 80 + 1);
}

#[test]
fn an_arm_s_bench_holds_ten_of_a_category_and_more_are_refused() {
    assert_eq!(Family::ObjectSorting.max_instances(Layout::Table), Some(20));
    assert_eq!(Family::ObjectSorting.max_instances(Layout::Bench), Some(10));
    let sorting = |text: &str, counts: &str, suite: &str| {
        let text = text.replace("block_stacking", "object_sorting").replace("train = 3", "train = 4");
        let text = text.replace("[generate]", &format!("[generate]\n{counts}"));
        text.replace("episodes = 4\n", &format!("episodes = 4\n{suite}\n"))
    };
    let arm = "robot = \"sawyer\"\ndemonstrated = { min = 1, max = 11 }";
    let said = "is 1 to 11; allowed is 1 <= min <= max <= 10, as many as an arm's bench holds of one category";
    check_refused(|text| sorting(text, "", arm), "rollout.suites[0].demonstrated", said);
    let counts = "counts = { min = 1, max = 11 }";
    let left_out =
        "is left out, so that up to 11 of one category are there, as in generate.counts; an arm's bench holds 10";
    check_refused(|text| sorting(text, counts, "robot = \"sawyer\""), "rollout.suites[0].on_table", left_out);
    let table = "demonstrated = { min = 1, max = 21 }";
    let said = "as many as the table holds of one category";
    check_refused(|text| sorting(text, "", table), "rollout.suites[0].demonstrated", said);
}
