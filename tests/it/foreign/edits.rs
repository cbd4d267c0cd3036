//! Datasets made of datasets of others: rows, packets, splits and statistics are carried over, and nothing is decoded.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{FixedSizeListArray, Float32Array};
use arrow::datatypes::{DataType, Field};
use ntp::dataset::edit::{Carry, Condition, EditError, SplitBy, Unit, diff, filter, merge, repair, split};
use ntp::dataset::{Severity, play_back, summarize, validate};
use ntp::publish::{Publication, publish};
use ntp::query::{Tables, query};
use ntp::store::Folder;
use ntp::video::{Mp4Reader, VideoTrackFile};
use serde_json::{Value, json};

use crate::foreign::Mini;
use crate::foreign::mini::CAMERA;

fn made(folder: &Path, name: &str, change: impl FnOnce(&mut Mini)) -> PathBuf {
    let root = folder.join(name);
    let mut mini = Mini::new();
    change(&mut mini);
    mini.write(&root);
    root
}

fn info(root: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(root.join("meta/info.json")).unwrap()).unwrap()
}

fn stats(root: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(root.join("meta/stats.json")).unwrap()).unwrap()
}

#[track_caller]
fn is_whole(root: &Path) {
    let errors: Vec<_> = validate(root).findings.into_iter().filter(|of| of.severity == Severity::Error).collect();
    assert_eq!(errors, []);
}

fn ask(root: &Path, sql: &str) -> String {
    let mut tables = Tables::default();
    tables.add_dataset(root).unwrap();
    query(&tables, sql).unwrap().to_csv().unwrap()
}

#[test]
fn episodes_are_chosen_by_number_and_keep_what_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let root = made(folder.path(), "theirs", |_| {});
    let to = folder.path().join("chosen");
    let condition = Condition { episodes: vec!["0".parse().unwrap(), "2-2".parse().unwrap()], ..Condition::default() };
    let summary = filter(&root, &condition, &to, Carry::Packets).unwrap();
    assert_eq!((summary.episodes, summary.frames, summary.left_out, summary.tasks), (2, 10, 1, 1));
    is_whole(&to);
    // Episode 2 began at row 11; its actions say so still.
    assert_eq!(play_back(&to, 1).unwrap().numbers[0].values[..4], [0.5, 11.0, 0.5, 12.0]);
    assert_eq!(
        ask(&to, "SELECT MIN(index) AS a, MAX(index) AS b, MAX(episode_index) AS c FROM frames"),
        "a,b,c\n0,9,1\n"
    );
    let of = &stats(&to)["action"];
    // Rows 0 to 5 and 11 to 14: their mean is (15 + 50) / 10.
    assert_eq!((&of["min"], &of["max"], &of["mean"]), (&json!([0.5, 0.0]), &json!([0.5, 14.0]), &json!([0.5, 6.5])));
    assert_eq!(of["count"], json!([10]));
    let error = filter(
        &root,
        &Condition { episodes: vec!["1-3".parse().unwrap()], ..Condition::default() },
        &to,
        Carry::Packets,
    );
    assert!(error.unwrap_err().to_string().contains("there is no episode 3; there are 3"));
}

#[test]
fn splits_are_kept_by_filter_and_merge() {
    let folder = tempfile::tempdir().unwrap();
    let halves = |mini: &mut Mini| mini.info["splits"] = json!({ "train": "0:2", "test": "2:3" });
    let [a, b] = ["a", "b"].map(|name| made(folder.path(), name, halves));
    let short = folder.path().join("short");
    filter(&a, &Condition { max_frames: Some(5), ..Condition::default() }, &short, Carry::Packets).unwrap();
    assert_eq!(info(&short)["splits"], json!({ "train": "0:1", "test": "1:2" }));
    let test = folder.path().join("test");
    filter(&a, &Condition { split: Some("test".to_owned()), ..Condition::default() }, &test, Carry::Packets).unwrap();
    assert_eq!(
        (info(&test)["splits"].clone(), info(&test)["total_frames"].clone()),
        (json!({ "test": "0:1" }), json!(4))
    );
    let unknown = Condition { split: Some("seen".to_owned()), ..Condition::default() };
    let error = filter(&a, &unknown, &folder.path().join("none"), Carry::Packets).unwrap_err().to_string();
    assert!(error.contains("edit.split") && error.contains("allowed: train, test"), "{error}");
    let both = folder.path().join("both");
    merge(&[a.clone(), b], &both, Carry::Packets).unwrap();
    is_whole(&both);
    // Each split stays one range: the trainings of both come first.
    assert_eq!(info(&both)["splits"], json!({ "train": "0:4", "test": "4:6" }));
    assert_eq!(ask(&both, "SELECT length FROM episodes ORDER BY episode_index"), "length\n6\n5\n6\n5\n4\n4\n");
    let parts = split(&a, &SplitBy::Split, &folder.path().join("parts"), Carry::Packets).unwrap();
    let parts: Vec<(&str, u64)> = parts.iter().map(|(name, of)| (name.as_str(), of.episodes)).collect();
    assert_eq!(parts, [("test", 1), ("train", 2)]);
    let shares =
        SplitBy::Shares { parts: vec![("x".to_owned(), 0.5), ("y".to_owned(), 0.5)], unit: Unit::Task, seed: 1 };
    let parts = split(&a, &shares, &folder.path().join("shares"), Carry::Packets).unwrap();
    // Two tasks, of two episodes and of one.
    assert_eq!(parts.iter().map(|(_, of)| of.episodes).sum::<u64>(), 3);
    let itself = merge(&[a.clone(), a], &folder.path().join("twice"), Carry::Packets).unwrap_err().to_string();
    assert!(itself.contains("edit.episode"), "{itself}");
}

#[test]
fn the_format_before_is_read_alike_and_becomes_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let (old, new) = (folder.path().join("old"), folder.path().join("new"));
    Mini::new().write_v21(&old);
    let mut mini = Mini::new();
    mini.subtasks = None;
    mini.write(&new);
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    merge(std::slice::from_ref(&old), &a, Carry::Packets).unwrap();
    merge(&[new], &b, Carry::Packets).unwrap();
    is_whole(&a);
    assert_eq!(info(&a)["codebase_version"], "v3.0");
    assert!(diff(&a, &b).unwrap().is_none());
    assert_eq!(stats(&a), stats(&b));
    assert!(diff(&old, &a).unwrap().is_none());
}

#[test]
fn packets_are_carried_over_by_time_and_not_encoded_again() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("theirs");
    let mut mini = Mini::new();
    mini.camera();
    mini.write(&root);
    mini.write_video(&root, true);
    let to = folder.path().join("chosen");
    let condition = Condition { episodes: vec!["0".parse().unwrap(), "2".parse().unwrap()], ..Condition::default() };
    filter(&root, &condition, &to, Carry::Packets).unwrap();
    is_whole(&to);
    let file = format!("videos/{CAMERA}/chunk-000/file-000.mp4");
    let packets = |root: &Path, samples: &[usize]| -> Vec<Vec<u8>> {
        let mut track = VideoTrackFile::open(&root.join(&file)).unwrap();
        let read = |&at: &usize| {
            let (sample, mut bytes) = (track.samples[at], Vec::new());
            track.read(sample, &mut bytes).unwrap();
            bytes
        };
        samples.iter().map(read).collect()
    };
    // Episodes 0 and 2 were pictures 0 to 5 and 11 to 14.
    let expected = packets(&root, &[0, 1, 2, 3, 4, 5, 11, 12, 13, 14]);
    assert_eq!(packets(&to, &(0..10).collect::<Vec<_>>()), expected);
    let secs: Vec<f64> = Mp4Reader::open(&to.join(&file)).unwrap().samples().iter().map(|of| of.seconds).collect();
    assert!(secs.iter().enumerate().all(|(at, secs)| (secs - at as f64 / 10.0).abs() < 1e-6), "{secs:?}");
    let place = format!(
        "SELECT \"videos/{CAMERA}/from_timestamp\" AS a, \"videos/{CAMERA}/to_timestamp\" AS b FROM episodes ORDER BY a"
    );
    assert_eq!(ask(&to, &place), "a,b\n0.0,0.6\n0.6,1.0\n");
    let same = folder.path().join("same");
    merge(std::slice::from_ref(&root), &same, Carry::Packets).unwrap();
    assert!(diff(&root, &same).unwrap().is_none());
    let found = diff(&root, &to).unwrap();
    assert_eq!((found.same, found.moved, found.removed, found.added), (2, 1, 1, 0));
}

#[test]
fn an_episode_within_a_group_of_pictures_is_refused_or_encoded_again() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("theirs");
    let mut mini = Mini::new();
    mini.camera();
    mini.write(&root);
    mini.write_video(&root, false);
    is_whole(&root);
    let to = folder.path().join("second");
    let condition = Condition { episodes: vec!["1".parse().unwrap()], ..Condition::default() };
    let refused = filter(&root, &condition, &to, Carry::Packets).unwrap_err();
    let EditError::Refused { code, problem, .. } = &refused else { panic!("{refused}") };
    assert_eq!(*code, "edit.keyframe");
    assert!(
        problem.contains("no key frame begins the episode at 0.600 s") && problem.contains("--reencode"),
        "{problem}"
    );
    assert!(!to.exists());
    filter(&root, &condition, &to, Carry::Reencode).unwrap();
    is_whole(&to);
    assert_eq!(play_back(&to, 0).unwrap().cameras.len(), 1);
    let leftovers = std::fs::read_dir(&to)
        .unwrap()
        .filter(|of| of.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
    assert_eq!(leftovers.count(), 0);
}

#[test]
fn what_does_not_fit_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let a = made(folder.path(), "a", |_| {});
    type Case = (&'static str, &'static str, fn(&mut Mini));
    let cases: [Case; 4] = [
        ("edit.fps", "fps is 20, but in", |mini| mini.info["fps"] = json!(20)),
        ("edit.features", "feature \"action\" is float32 [3], but in", |mini| {
            mini.info["features"]["action"]["shape"] = json!([3]);
        }),
        ("edit.features", "feature \"subtask_index\" is not there", |mini| {
            mini.info["features"].as_object_mut().unwrap().remove("subtask_index");
        }),
        ("edit.columns", "a column \"operator\"", |mini| {
            mini.episodes.push(("operator".into(), crate::foreign::whole([1, 2, 3])));
        }),
    ];
    for (at, (code, words, change)) in cases.into_iter().enumerate() {
        let other = made(folder.path(), &format!("other{at}"), change);
        let error = merge(&[a.clone(), other], &folder.path().join("to"), Carry::Packets).unwrap_err().to_string();
        assert!(error.contains(code) && error.contains(words), "{error}");
        assert!(!folder.path().join("to").exists());
    }
    let programs = Condition { programs: vec!["pick".to_owned()], ..Condition::default() };
    let error = filter(&a, &programs, &folder.path().join("to"), Carry::Packets).unwrap_err().to_string();
    assert!(error.contains("edit.vocabulary") && error.contains("no program tables"), "{error}");
}

#[test]
fn repair_keeps_the_episodes_before_the_first_that_breaks_a_rule() {
    let folder = tempfile::tempdir().unwrap();
    let whole_one = made(folder.path(), "whole", |_| {});
    assert_eq!(repair(&whole_one, &folder.path().join("not")).unwrap().written, None);
    let broken = made(folder.path(), "broken", |mini| {
        let mut frames: Vec<i64> = (0..6).chain(0..5).chain(0..4).collect();
        frames[8] = 7;
        mini.replace("frame_index", crate::foreign::whole(frames));
    });
    let to = folder.path().join("mended");
    let repaired = repair(&broken, &to).unwrap();
    let written = repaired.written.unwrap();
    assert_eq!((written.episodes, written.frames, written.left_out), (1, 6, 2));
    assert!(repaired.reasons[0].contains("frames.row"), "{:?}", repaired.reasons);
    is_whole(&to);
}

#[test]
fn a_dataset_of_others_is_published_with_nothing_claimed_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let root = made(folder.path(), "theirs", |_| {});
    let to = folder.path().join("published");
    let publication = Publication {
        license: "mit".parse().unwrap(),
        date: "2026-11-30".parse().unwrap(),
        name: "Drawers".to_owned(),
        creators: Vec::new(),
        url: None,
        release: "1.0.0".parse().unwrap(),
    };
    publish(&root, &Folder::new(&to), &publication, || true).unwrap();
    let card = std::fs::read_to_string(to.join("README.md")).unwrap();
    assert!(card.contains("3 robot episodes of 2 tasks: 15 frames at 10 a second, robot type \"so101\"."), "{card}");
    for claim in ["simulat", "synthetic", "guessed", "scripted", "machine-generated"] {
        let told: Vec<&str> = card.lines().filter(|line| line.contains(claim)).collect();
        // That nothing tells whether it was a simulation is no claim.
        assert!(told.iter().all(|line| line.contains("do not tell")), "{claim}: {told:?}");
    }
    assert_eq!(summarize(&to).unwrap().total_frames, 15);
    is_whole(&to);
}

/// Rows of the action's second value that are no numbers: 3 and 4 of the first episode.
fn with_no_numbers(mini: &mut Mini) {
    let actions = (0..15).flat_map(|row| {
        let second = match row {
            3 => f32::NAN,
            4 => f32::NEG_INFINITY,
            row => row as f32,
        };
        [0.5, second]
    });
    let values = Float32Array::from_iter_values(actions);
    let item = Arc::new(Field::new("element", DataType::Float32, false));
    mini.replace("action", Arc::new(FixedSizeListArray::new(item, 2, Arc::new(values), None)));
    let nothing = || Arc::new(Float32Array::from(vec![f32::NAN; 15]));
    mini.column("touch", crate::foreign::one("float32"), nothing());
}

#[test]
fn numbers_that_are_none_are_left_out_of_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let root = made(folder.path(), "theirs", with_no_numbers);
    // As Python writes them.
    let text = stats(&root).to_string().replacen("\"max\":[0.5,14.0]", "\"max\":[0.5,NaN]", 1);
    assert!(text.contains("NaN"), "{text}");
    std::fs::write(root.join("meta/stats.json"), text).unwrap();
    let to = folder.path().join("chosen");
    let condition = Condition { episodes: vec!["0".parse().unwrap()], ..Condition::default() };
    let summary = filter(&root, &condition, &to, Carry::Packets).unwrap();
    let of = &stats(&to)["action"];
    // 0, 1, 2 and 5: their mean is 2, their deviation the root of (4 + 1 + 0 + 9) / 4, half is at 1.5.
    assert_eq!((&of["min"], &of["max"], &of["mean"]), (&json!([0.5, 0.0]), &json!([0.5, 5.0]), &json!([0.5, 2.0])));
    assert_eq!((&of["q50"], &of["count"]), (&json!([0.5, 1.5]), &json!([6])));
    assert!((of["std"][1].as_f64().unwrap() - 3.5_f64.sqrt()).abs() < 1e-12, "{of}");
    assert_eq!((summary.without_statistics, stats(&to).get("touch")), (vec!["touch".to_owned()], None));
    assert!(!std::fs::read_to_string(to.join("meta/stats.json")).unwrap().contains("null"));
    let both = folder.path().join("both");
    merge(&[root.clone(), to], &both, Carry::Packets).unwrap();
    assert_eq!(stats(&both)["action"]["max"], json!([0.5, 14.0]));
    let parts = split(&root, &SplitBy::Task, &folder.path().join("parts"), Carry::Packets).unwrap();
    for (name, part) in parts {
        assert_eq!(part.without_statistics, ["touch"], "{name}");
    }
}

#[test]
fn values_with_other_names_are_a_difference() {
    let folder = tempfile::tempdir().unwrap();
    let a = made(folder.path(), "a", |_| {});
    let b = made(folder.path(), "b", |mini| mini.info["features"]["action"]["names"] = json!(["y", "x"]));
    let found = diff(&a, &b).unwrap();
    assert_eq!((found.same, found.settings), (3, vec!["names of action: [\"x\",\"y\"] → [\"y\",\"x\"]".to_owned()]));
}
