//! Tasks: sampling, splits, the task file and the import of the authors' file.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use ntp::scene::{Mobility, SlotIndex};
use ntp::seed::Seed;
use ntp::task::{Condition, Family, Goal, Split, Task, TaskPool, TaskSet, import, sample};
use serde_json::{Value, json};

fn goals_of(set: &TaskSet, split: Split) -> Vec<&[Goal]> {
    set.of_split(split).map(|task| task.goals.as_slice()).collect()
}

/// Heights of a task's towers in the order they are built.
fn heights(goals: &[Goal]) -> Vec<usize> {
    let mut heights: Vec<usize> = Vec::new();
    for (at, goal) in goals.iter().enumerate() {
        match heights.last_mut() {
            Some(height) if goals[at - 1].source == goal.target => *height += 1,
            _ => heights.push(2),
        }
    }
    heights
}

fn count<T: Ord>(values: impl Iterator<Item = T>) -> BTreeMap<T, usize> {
    values.fold(BTreeMap::new(), |mut counts, value| {
        *counts.entry(value).or_default() += 1;
        counts
    })
}

#[test]
fn two_thousand_stacking_tasks_have_the_authors_counts() {
    let set = sample(Family::BlockStacking, 1000, 1000, Seed(7)).unwrap();
    set.validate().unwrap();
    assert_eq!((set.of_split(Split::Seen).count(), set.of_split(Split::Unseen).count()), (1000, 1000));
    let goals = count(set.tasks.iter().map(|task| task.goals.len()));
    assert_eq!(goals, BTreeMap::from([(1, 4), (2, 43), (3, 239), (4, 689), (5, 904), (6, 121)]));
    let towers = count(set.tasks.iter().map(|task| heights(&task.goals).len()));
    assert_eq!(towers, BTreeMap::from([(1, 47), (2, 1148), (3, 785), (4, 20)]));
    let heights_of_all = count(set.tasks.iter().flat_map(|task| heights(&task.goals)));
    assert_eq!(heights_of_all, BTreeMap::from([(2, 1976), (3, 1573), (4, 1229)]));
    let distinct: BTreeSet<_> = set.tasks.iter().map(Task::canonical_goal).collect();
    assert_eq!(distinct.len(), 2000);
}

#[test]
fn both_splits_of_stacking_look_alike() {
    let set = sample(Family::BlockStacking, 1000, 1000, Seed(3)).unwrap();
    for split in Split::ALL {
        let goals: usize = goals_of(&set, split).iter().map(|goals| goals.len()).sum();
        assert!((4300..=4500).contains(&goals), "{split}: {goals} goals in 1000 tasks, the authors' mean is 4.40");
    }
}

#[test]
fn towers_stand_in_no_order_of_height() {
    let set = sample(Family::BlockStacking, 500, 0, Seed(1)).unwrap();
    let orders: BTreeSet<Vec<usize>> = set.tasks.iter().map(|task| heights(&task.goals)).collect();
    assert!(orders.contains(&vec![3, 4]) && orders.contains(&vec![4, 3]), "{orders:?}");
}

fn with_blocks(blocks: u16) -> TaskPool {
    TaskPool { family: Family::BlockStacking, blocks: Some(blocks) }
}

#[test]
fn fewer_blocks_have_as_many_end_configurations_as_there_are_towers_of_them() {
    // Ordered towers without order among themselves: 4!/2! of two, 4! of three, 4! of four, 4!/2! of two and two.
    for (blocks, all) in [(2, 2), (3, 6 + 6), (4, 12 + 24 + 24 + 12), (5, 20 + 60 + 120 + 60 + 120)] {
        assert_eq!(with_blocks(blocks).limits(0), (all, all));
        assert_eq!(with_blocks(blocks).limits(1), (all, all - 1));
        let set = sample(with_blocks(blocks), all - 1, 1, Seed(3)).unwrap();
        set.validate().unwrap();
        let distinct: BTreeSet<_> = set.tasks.iter().map(Task::canonical_goal).collect();
        assert_eq!(distinct.len(), all as usize);
        let named = set.tasks.iter().flat_map(|task| task.goals.iter().flat_map(|goal| [goal.source, goal.target]));
        assert_eq!(named.max(), Some(SlotIndex(blocks - 1)));
    }
}

#[test]
fn a_split_of_few_blocks_depends_on_no_other() {
    let set = |train, unseen| sample(with_blocks(4), train, unseen, Seed(5)).unwrap();
    let [few, many, most] = [set(12, 10), set(48, 24), set(10, 62)];
    assert!(many.of_split(Split::Seen).take(12).eq(few.of_split(Split::Seen)));
    assert!(many.of_split(Split::Unseen).take(10).eq(few.of_split(Split::Unseen)));
    assert!(most.of_split(Split::Unseen).take(24).eq(many.of_split(Split::Unseen)));
    for set in [few, many, most] {
        set.validate().unwrap();
    }
}

#[test]
fn blocks_that_a_task_leaves_out_stand_aside_and_fixed() {
    let task = &sample(with_blocks(3), 1, 0, Seed(1)).unwrap().tasks[0];
    let scene = ntp::task::scene(Family::BlockStacking, &task.counts(|| 7));
    assert_eq!(scene.slots.len(), Family::BlockStacking.n_slots());
    for seed in 0..200 {
        let state = ntp::task::initial_state(Family::BlockStacking, &scene, Seed(seed));
        for body in scene.body_indices() {
            let at = state.body_in_world(body).translation.vector;
            let aside = body.0 >= 3;
            assert_eq!(scene.body(body).mobility == Mobility::Fixed, aside);
            assert_eq!(at.x < -0.47 && at.y < -0.42, aside, "seed {seed}: {} at {at}", scene.body(body).name);
        }
    }
}

#[test]
fn every_block_is_used_about_equally() {
    let set = sample(Family::BlockStacking, 1000, 0, Seed(5)).unwrap();
    let moved = count(set.tasks.iter().flat_map(|task| task.goals.iter().map(|goal| goal.source)));
    assert_eq!(moved.len(), 8);
    assert!(moved.values().all(|&n| (450..=650).contains(&n)), "{moved:?}");
}

#[test]
fn smaller_experiments_are_the_beginning_of_larger_ones() {
    for (family, sizes) in [(Family::BlockStacking, [20, 100, 1000]), (Family::ObjectSorting, [1, 2, 4])] {
        let [small, middle, large] = sizes.map(|train| sample(family, train, 100, Seed(11)).unwrap());
        for set in [&small, &middle] {
            let seen = goals_of(set, Split::Seen);
            assert_eq!(seen, goals_of(&large, Split::Seen)[..seen.len()], "{}", family.name());
            assert!(set.of_split(Split::Unseen).eq(large.of_split(Split::Unseen)), "{}", family.name());
        }
        let fewer_unseen = sample(family, sizes[2], 10, Seed(11)).unwrap();
        assert!(fewer_unseen.of_split(Split::Seen).eq(large.of_split(Split::Seen)));
        assert_eq!(goals_of(&fewer_unseen, Split::Unseen), goals_of(&large, Split::Unseen)[..10]);
    }
}

#[test]
fn tasks_depend_on_the_seed_alone() {
    for (family, train) in [(Family::BlockStacking, 50), (Family::ObjectSorting, 4)] {
        let [a, again, other] = [1, 1, 2].map(|seed| sample(family, train, 50, Seed(seed)).unwrap());
        assert_eq!(a, again);
        assert_ne!(a.tasks, other.tasks);
    }
}

#[test]
fn sorting_trains_on_four_mappings_that_cover_every_pair() {
    let set = sample(Family::ObjectSorting, 4, 252, Seed(9)).unwrap();
    set.validate().unwrap();
    let pairs: BTreeSet<Goal> = set.of_split(Split::Seen).flat_map(|task| task.goals.clone()).collect();
    assert_eq!(pairs.len(), 16);
    let distinct: BTreeSet<_> = set.tasks.iter().map(Task::canonical_goal).collect();
    assert_eq!(distinct.len(), 256);
    let orders: BTreeSet<Vec<SlotIndex>> =
        set.tasks.iter().map(|task| task.goals.iter().map(|goal| goal.source).collect()).collect();
    assert!(orders.len() > 20, "categories come in {} of 24 orders", orders.len());
}

#[test]
fn cleaning_up_has_unseen_orders_of_every_length() {
    let set = sample(Family::TableCleanup, 40, 24, Seed(9)).unwrap();
    set.validate().unwrap();
    let lengths = |split| count(set.of_split(split).map(Task::n_bowls));
    assert_eq!(lengths(Split::Seen), BTreeMap::from([(1, 2), (2, 8), (3, 16), (4, 14)]));
    assert_eq!(lengths(Split::Unseen), BTreeMap::from([(1, 2), (2, 4), (3, 8), (4, 10)]));
    let distinct: BTreeSet<_> = set.tasks.iter().map(Task::canonical_goal).collect();
    assert_eq!(distinct.len(), 64);
    let fewer = sample(Family::TableCleanup, 20, 10, Seed(9)).unwrap();
    assert_eq!(goals_of(&fewer, Split::Seen), goals_of(&set, Split::Seen)[..20]);
    assert_eq!(goals_of(&fewer, Split::Unseen), goals_of(&set, Split::Unseen)[..10]);
    assert_ne!(sample(Family::TableCleanup, 40, 24, Seed(10)).unwrap().tasks, set.tasks);
}

#[test]
fn a_bowl_that_is_not_asked_for_stands_aside_and_the_others_have_room_for_fingers() {
    use ntp::geometry::horizontal_distance;
    use ntp::scene::Mobility;
    let scene = ntp::task::scene(Family::TableCleanup, &[1, 0, 1, 1, 20]);
    assert_eq!(scene.slots.len(), Family::TableCleanup.n_slots());
    assert_eq!(scene.slots[4].bodies.len(), 20);
    for seed in 0..2000 {
        let state = ntp::task::initial_state(Family::TableCleanup, &scene, Seed(seed));
        let at: Vec<_> = state.bodies_in_world.iter().map(|pose| pose.translation.vector).collect();
        for second in 0..at.len() {
            for first in 0..second {
                let least = match (first < 4, second < 4) {
                    (true, true) => 0.18,
                    (true, false) => 0.125,
                    _ => 0.085,
                };
                let apart = horizontal_distance(&at[first], &at[second]);
                assert!(apart >= least, "seed {seed}: bodies {first} and {second} are {apart} m apart");
            }
            let aside = second == 1;
            assert_eq!(at[second].x > 0.7, aside, "seed {seed}: body {second}");
            assert_eq!(scene.bodies[second].mobility == Mobility::Fixed, aside || second == at.len() - 1);
        }
    }
}

#[test]
fn more_tasks_than_there_are_is_an_error() {
    let check = |family, train, unseen, expected: &str| {
        let error = sample(family, train, unseen, Seed(1)).unwrap_err();
        assert_eq!(error.to_string(), expected);
    };
    check(Family::ObjectSorting, 5, 0, "object_sorting has at most 4 seen tasks to draw, 5 were asked for");
    check(Family::TableCleanup, 41, 0, "table_cleanup has at most 40 seen tasks to draw, 41 were asked for");
    check(Family::TableCleanup, 40, 25, "table_cleanup has at most 24 unseen tasks to draw, 25 were asked for");
    check(Family::ObjectSorting, 4, 253, "object_sorting has at most 252 unseen tasks to draw, 253 were asked for");
    check(
        Family::BlockStacking,
        82_937,
        82_936,
        "block_stacking has at most 82935 unseen tasks to draw, 82936 were asked for",
    );
    let error = sample(with_blocks(4), 73, 0, Seed(1)).unwrap_err();
    assert_eq!(error.to_string(), "block_stacking has at most 72 seen tasks to draw, 73 were asked for");
}

#[test]
fn a_task_file_reads_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    for (family, train) in [(Family::BlockStacking, 30), (Family::ObjectSorting, 4), (Family::TableCleanup, 40)] {
        let set = sample(family, train, 24, Seed(2)).unwrap();
        let path = folder.path().join(family.name()).join("tasks.json");
        set.write(&path).unwrap();
        assert_eq!(TaskSet::read(&path).unwrap(), set);
        assert!(serde_json::from_slice::<Value>(&std::fs::read(&path).unwrap()).is_ok());
    }
    let few = sample(with_blocks(4), 5, 5, Seed(2)).unwrap();
    let path = folder.path().join("few.json");
    few.write(&path).unwrap();
    assert_eq!(TaskSet::read(&path).unwrap(), few);
    let empty = TaskSet { family: Family::BlockStacking, tasks: Vec::new() };
    let path = folder.path().join("empty.json");
    empty.write(&path).unwrap();
    assert_eq!(TaskSet::read(&path).unwrap(), empty);
}

#[test]
fn the_committed_task_schema_is_the_generated_one() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("schemas/tasks.schema.json");
    let mut generated = serde_json::to_string_pretty(&TaskSet::json_schema()).unwrap();
    generated.push('\n');
    if std::fs::read_to_string(&path).ok().as_ref() != Some(&generated) {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, &generated).unwrap();
        panic!("{} was stale and has been written anew: look at the change and commit it", path.display());
    }
}

/// A file with one thing changed.
#[track_caller]
fn check_read(change: impl FnOnce(&mut Value), expected: &str) {
    let mut file = json!({
        "schema_version": 1,
        "family": "block_stacking",
        "tasks": [
            {"id": "a", "split": "seen",
             "goals": [{"source": "block_B", "target": "block_A"}, {"source": "block_C", "target": "block_B"}],
             "conditions": [{"type": "on_top", "upper": "block_C", "lower": "block_B"}]},
            {"id": "b", "split": "unseen",
             "goals": [{"source": "block_D", "target": "block_A"}],
             "conditions": [{"type": "on_top", "upper": "block_D", "lower": "block_A"}]},
        ],
    });
    change(&mut file);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tasks.json");
    std::fs::write(&path, file.to_string()).unwrap();
    let error = TaskSet::read(&path).unwrap_err().to_string();
    let error = error.replace(&path.display().to_string(), "FILE");
    assert!(error.contains(expected), "{error}\ndoes not contain\n{expected}");
}

#[test]
fn a_task_file_that_breaks_a_rule_is_refused_by_name_and_place() {
    let goals = |goals: Value| move |file: &mut Value| file["tasks"][0]["goals"] = goals;
    check_read(|file| file["schema_version"] = json!(2), "schema_version is 2, this program reads 1: FILE");
    check_read(|file| file["tasks"][0]["extra"] = json!(1), "unknown field `extra`");
    check_read(|file| file["tasks"][1]["id"] = json!("a"), "tasks[1].id: \"a\" is already the id of tasks[0]: FILE");
    check_read(
        |file| file["tasks"][0]["goals"][1]["target"] = json!("block_Z"),
        "tasks[0].goals[1].target: unknown slot \"block_Z\"; allowed: block_A, block_B,",
    );
    check_read(goals(json!([])), "tasks[0]: has no goals: FILE");
    check_read(|file| file["tasks"][1]["conditions"] = json!([]), "tasks[1]: has no conditions");
    check_read(
        goals(json!([{"source": "block_A", "target": "block_A"}])),
        "tasks[0].goals[0]: block_A is its own target: FILE",
    );
    check_read(
        goals(json!([{"source": "block_B", "target": "block_A"}, {"source": "block_B", "target": "block_C"}])),
        "tasks[0].goals[1]: block_B is already moved by goals[0]",
    );
    check_read(
        goals(json!([{"source": "block_B", "target": "block_A"}, {"source": "block_C", "target": "block_A"}])),
        "tasks[0].goals[1]: goals[0] already puts something on block_A",
    );
    check_read(
        goals(json!([{"source": "block_C", "target": "block_B"}, {"source": "block_B", "target": "block_A"}])),
        "tasks[0].goals[0]: block_B is built on, but goals[1] moves it afterwards; towers grow from below",
    );
    check_read(
        goals(json!([
            {"source": "block_A", "target": "block_B"},
            {"source": "block_B", "target": "block_C"},
            {"source": "block_C", "target": "block_A"},
        ])),
        "tasks[0]: block_A, block_B, block_C stand on each other in a ring",
    );
    check_read(
        |file| file["tasks"][0]["conditions"][0]["lower"] = json!("block_A"),
        "tasks[0].conditions[0]: no goal brings this about",
    );
    check_read(|file| file["tasks"].as_array_mut().unwrap().reverse(), "tasks[1]: is a training task behind an unseen");
    check_read(
        |file| {
            let mut twin = file["tasks"][0].clone();
            twin["id"] = json!("twin");
            twin["split"] = json!("unseen");
            file["tasks"][1] = twin;
        },
        "tasks[1]: twin is unseen but asks for the same as training task a, tasks[0]: FILE",
    );
}

#[test]
fn a_set_made_in_memory_keeps_the_same_rules() {
    let on = |source, target| Goal { source: SlotIndex(source), target: SlotIndex(target) };
    let check = |family, goals: Vec<Goal>, expected: &str| {
        let conditions = vec![Condition::OnTop { upper: SlotIndex(0), lower: SlotIndex(1) }];
        let task = Task { id: "a".to_owned(), family, goals, conditions, split: Split::Seen, blocks: None };
        let error = TaskSet { family, tasks: vec![task] }.validate().unwrap_err();
        assert_eq!(error.to_string(), expected);
    };
    check(Family::BlockStacking, vec![on(0, 8)], "tasks[0].goals[0].target: slot 8 does not exist, the scene has 8");
    check(Family::ObjectSorting, vec![on(0, 1)], "tasks[0].goals[0].target: can is not a container");
    check(Family::ObjectSorting, vec![on(5, 6)], "tasks[0].goals[0].source: bin_2 is not a category");
    check(Family::ObjectSorting, vec![on(0, 4), on(0, 5)], "tasks[0].goals[1]: cube is already moved by goals[0]");
    check(Family::ObjectSorting, vec![on(0, 4)], "tasks[0].conditions[0]: no goal brings this about");
    check(Family::TableCleanup, vec![on(0, 6)], "tasks[0].goals[0].target: slot 6 does not exist, the scene has 6");
    check(Family::TableCleanup, vec![on(5, 0)], "tasks[0].goals[0].source: tray is not a bowl or fork");
    check(Family::TableCleanup, vec![on(0, 4)], "tasks[0].goals[0].target: fork is not a bowl or tray");
    check(
        Family::TableCleanup,
        vec![on(0, 5), on(1, 0), on(4, 0)],
        "tasks[0].goals[2]: goals[1] already puts something on bowl_1",
    );
    let blocks = |blocks: u16, family, expected: &str| {
        let goals = vec![if family == Family::BlockStacking { on(0, 3) } else { on(0, 4) }];
        let conditions = vec![goals[0].brings_about(family)];
        let task = Task { id: "a".to_owned(), family, goals, conditions, split: Split::Seen, blocks: Some(blocks) };
        let error = TaskSet { family, tasks: vec![task] }.validate().unwrap_err();
        assert_eq!(error.to_string(), expected);
    };
    let allowed = "allowed in block_stacking is 2 to 7, or none for all 8";
    blocks(8, Family::BlockStacking, &format!("tasks[0].blocks: is 8; {allowed}"));
    blocks(1, Family::BlockStacking, &format!("tasks[0].blocks: is 1; {allowed}"));
    blocks(4, Family::ObjectSorting, "tasks[0].blocks: is 4; allowed in object_sorting is none");
    let aside = "tasks[0].goals[0]: block_D stands aside, only the first 3 blocks are within reach";
    blocks(3, Family::BlockStacking, aside);
    let mut set = sample(Family::BlockStacking, 1, 0, Seed(1)).unwrap();
    set.family = Family::ObjectSorting;
    let error = set.validate().unwrap_err().to_string();
    assert_eq!(error, "tasks[0]: is of family block_stacking, the set is of object_sorting");
}

/// A file in the authors' form, with three tasks of 8 cubes.
pub(crate) fn authors_file() -> Value {
    let task = |id: &str, pairs: &[(u8, u8)]| {
        let cubes = |(source, target): &(u8, u8)| (format!("cube_{source}"), format!("cube_{target}"));
        let goal = |(src, target): (String, String)| json!({"name": "pick_place", "src": src, "target": target});
        let constraint = |(src, target): (String, String)| json!({"type": "on_top", "src": src, "target": target});
        json!({
            "id": id, "name": "stack",
            "goals": pairs.iter().map(cubes).map(goal).collect::<Vec<_>>(),
            "end_constraints": pairs.iter().map(cubes).map(constraint).collect::<Vec<_>>(),
        })
    };
    json!({
        "name": "stacking",
        "scene": {
            "objects": [{"name": "cube_0", "filename": "cubes/cube_0.urdf", "fixed": false}],
            "task_objects": (0..8).map(|cube| format!("cube_{cube}")).collect::<Vec<_>>(),
            "workspace": {"pos_eps": 0.03, "size": 0.1, "xlim": [-0.2, 0.2], "ylim": [-0.2, 0.2]},
        },
        "tasks": [
            task("stack_0", &[(2, 6), (7, 1), (3, 7), (4, 5)]),
            task("stack_1", &[(5, 3), (1, 5)]),
            task("stack_2", &[(7, 3)]),
        ],
    })
}

fn write_and_import(file: &Value, train: u32) -> Result<TaskSet, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("stack.json");
    std::fs::write(&path, file.to_string()).unwrap();
    import(&path, train).map_err(|error| error.to_string().replace(&path.display().to_string(), "FILE"))
}

#[test]
fn the_authors_file_becomes_a_task_set() {
    let set = write_and_import(&authors_file(), 2).unwrap();
    assert_eq!(set.family, Family::BlockStacking);
    assert_eq!(set.tasks.iter().map(|task| task.split).collect::<Vec<_>>(), [Split::Seen, Split::Seen, Split::Unseen]);
    let first = &set.tasks[0];
    assert_eq!(first.id, "stack_0");
    assert_eq!(
        first.text(),
        "put block_C on block_G, then put block_H on block_B, then put block_D on block_H, then put block_E on block_F"
    );
    assert_eq!(first.conditions.len(), 4);
    assert_eq!(first.conditions[0], Condition::OnTop { upper: SlotIndex(2), lower: SlotIndex(6) });
}

/// As large as the authors' own.
#[test]
fn two_thousand_tasks_in_the_authors_form_come_back_as_they_were_split_at_a_thousand() {
    let ours = sample(Family::BlockStacking, 1000, 1000, Seed(3)).unwrap();
    let cube = |slot: SlotIndex| format!("cube_{}", slot.0);
    let entry = |task: &Task| {
        let goals = task
            .goals
            .iter()
            .map(|goal| json!({"name": "pick_place", "src": cube(goal.source), "target": cube(goal.target)}));
        let ends = task.conditions.iter().map(|condition| match *condition {
            Condition::OnTop { upper, lower } => json!({"type": "on_top", "src": cube(upper), "target": cube(lower)}),
            Condition::Inside { .. } | Condition::Filled { .. } => panic!("blocks lie in nothing"),
        });
        json!({"id": task.id, "goals": goals.collect::<Vec<_>>(), "end_constraints": ends.collect::<Vec<_>>()})
    };
    let mut file = authors_file();
    file["tasks"] = ours.tasks.iter().map(entry).collect();
    assert_eq!(write_and_import(&file, 1000).unwrap(), ours);
    let other = write_and_import(&file, 400).unwrap();
    assert_eq!((other.of_split(Split::Seen).count(), other.of_split(Split::Unseen).count()), (400, 1600));
}

#[test]
fn an_imported_sorting_file_puts_categories_into_containers() {
    let mut file = authors_file();
    file["scene"]["task_objects"] = json!(["duck", "frog", "lego", "pen", "traybox_0", "t1", "t2", "t3"]);
    file["tasks"] = json!([{
        "id": "sort_0", "name": "sorting",
        "goals": [{"name": "pick_release", "src": "frog", "target": "traybox_0", "count": 3}],
        "end_constraints": [{"type": "on_top", "src": "frog", "target": "traybox_0", "count": 3}],
    }]);
    let set = write_and_import(&file, 1).unwrap();
    assert_eq!(set.family, Family::ObjectSorting);
    let expected = Condition::Inside { category: SlotIndex(1), container: SlotIndex(4) };
    assert_eq!(set.tasks[0].conditions, [expected]);
}

/// The authors' file with one thing changed.
#[track_caller]
fn check_import(change: impl FnOnce(&mut Value), expected: &str) {
    let mut file = authors_file();
    change(&mut file);
    let error = write_and_import(&file, 2).unwrap_err();
    assert_eq!(error, expected);
}

#[test]
fn a_wrong_authors_file_is_refused_by_place() {
    check_import(
        |file| file["tasks"][0]["goals"][3]["src"] = json!("cube_9"),
        "tasks[0].goals[3].src: unknown object \"cube_9\"; allowed: \
         cube_0, cube_1, cube_2, cube_3, cube_4, cube_5, cube_6, cube_7: FILE",
    );
    check_import(
        |file| file["tasks"][0]["goals"][1]["target"] = json!("cube_7"),
        "tasks[0].goals[1]: block_H is its own target: FILE",
    );
    check_import(
        |file| file["tasks"][1]["goals"][0]["name"] = json!("throw"),
        "tasks[1].goals[0].name: unknown goal name \"throw\"; allowed: pick_place, pick_release: FILE",
    );
    check_import(
        |file| file["tasks"][1]["goals"][0]["name"] = json!("pick_release"),
        "tasks[1].goals[0]: is a goal of object_sorting, the first goal is of block_stacking: FILE",
    );
    check_import(
        |file| file["tasks"][2]["end_constraints"][0]["type"] = json!("beside"),
        "tasks[2].end_constraints[0].type: unknown constraint type \"beside\"; allowed: on_top: FILE",
    );
    check_import(
        |file| file["tasks"][2].as_object_mut().unwrap().retain(|key, _| key != "end_constraints"),
        "tasks[2]: missing field \"end_constraints\": FILE",
    );
    check_import(
        |file| file.as_object_mut().unwrap().retain(|key, _| key != "scene"),
        "the top level: missing field \"scene\": FILE",
    );
    check_import(|file| file["tasks"][1]["goals"] = json!({}), "tasks[1].goals: is not a list: FILE");
    check_import(|file| file["tasks"][1]["id"] = json!(7), "tasks[1].id: is not a string: FILE");
    check_import(|file| file["tasks"] = json!([]), "tasks: is not a list with goals in it: FILE");
    check_import(
        |file| file["tasks"][0]["goals"][0]["count"] = json!(0),
        "tasks[0].goals[0].count: is not a positive whole number: FILE",
    );
    check_import(
        |file| file["scene"]["task_objects"][7] = json!("cube_0"),
        "scene.task_objects[7]: \"cube_0\" is named twice: FILE",
    );
    check_import(
        |file| file["scene"]["task_objects"].as_array_mut().unwrap().push(json!("cube_8")),
        "scene.task_objects: has 9 objects, block_stacking has 8: FILE",
    );
    check_import(
        |file| file["tasks"][2] = json!({"id": "twin", "goals": file["tasks"][1]["goals"], "end_constraints": file["tasks"][1]["end_constraints"]}),
        "tasks[2]: twin is unseen but asks for the same as training task stack_1, tasks[1]: FILE",
    );
    let too_few = write_and_import(&authors_file(), 4).unwrap_err();
    assert_eq!(too_few, "the split asks for 4 training tasks, the file has 3 tasks: FILE");
}

#[test]
fn a_file_that_is_no_json_is_refused_with_line_and_column() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.json");
    std::fs::write(&path, "{\n  \"scene\": ").unwrap();
    let error = import(&path, 1).unwrap_err().to_string();
    assert!(error.contains("broken.json:2:"), "{error}");
    let missing = import(&folder.path().join("absent.json"), 1).unwrap_err().to_string();
    assert!(missing.contains("absent.json"), "{missing}");
}

#[test]
fn every_seed_has_a_start_with_room_for_fingers() {
    use ntp::geometry::horizontal_distance;
    let scene = ntp::task::scene(Family::BlockStacking, &[]);
    for seed in 0..20_000 {
        let state = ntp::task::initial_state(Family::BlockStacking, &scene, Seed(seed));
        let positions: Vec<_> = state.bodies_in_world.iter().map(|pose| pose.translation.vector).collect();
        for (idx, position) in positions.iter().enumerate() {
            assert!(positions[..idx].iter().all(|other| horizontal_distance(other, position) >= 0.08), "seed {seed}");
        }
    }
}

#[test]
fn shuffled_towers_end_in_the_same_configuration_by_another_lawful_order() {
    let set = sample(Family::BlockStacking, 200, 0, Seed(4)).unwrap();
    let mut n_single = 0;
    for task in &set.tasks {
        let Some(shuffled) = task.with_towers_shuffled(Seed(9)) else {
            n_single += 1;
            assert_eq!(heights(&task.goals).len(), 1, "{}", task.id);
            continue;
        };
        assert_ne!(shuffled.goals, task.goals, "{}", task.id);
        assert_eq!(shuffled.canonical_goal(), task.canonical_goal());
        assert_eq!(shuffled.with_towers_shuffled(Seed(1)).map(|again| again.goals.len()), Some(task.goals.len()));
        TaskSet { family: set.family, tasks: vec![shuffled] }.validate().unwrap();
    }
    assert!(n_single < 20, "{n_single} of 200 tasks are of one tower");
}
