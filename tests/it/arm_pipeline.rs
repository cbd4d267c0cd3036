//! The arm through every stage: a pipeline whose robot is Sawyer, and suites whose robots differ.

use std::path::Path;

use ntp::dataset::validate;
use ntp::recording::{ShardReader, inspect};
use serde_json::Value;

use crate::pipeline::{hashes, run};

const PIPELINE: &str = r#"
name = "arm"
seed = 5
[tasks]
family = "block_stacking"
train = 2
unseen = 4
[generate]
trials_per_task = 2
episodes_per_shard = 2
[generate.simulation]
robot = "sawyer"
[convert]
frames = "all"
action = "joints"
[rollout]
record = 2
oracle = true
[[rollout.suites]]
name = "with_arm"
split = "unseen"
episodes = 2
adversary = { probability = 0.5 }
[[rollout.suites]]
name = "with_gripper"
split = "unseen"
episodes = 2
robot = "gripper"
layout = "bench"
"#;

fn write(folder: &Path, pipeline: &str) -> String {
    let path = folder.join("arm.toml");
    std::fs::write(&path, pipeline).unwrap();
    path.to_string_lossy().into_owned()
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

#[test]
fn an_arm_acts_through_every_stage_and_is_simulated_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), PIPELINE);
    let out = folder.path().join("run");
    let (code, _, stderr) = run(&["run", &path, "--out", &text(&out), "--jobs", "2"]);
    assert_eq!(code, 0, "{stderr}");
    recordings_tell_joints(&out);
    dataset_has_joint_targets(&out);
    for recording in [
        out.join("recordings/shard-00000-of-00002.mcap"),
        out.join("rollouts/oracle/with_arm/recordings/shard-00000-of-00001.mcap"),
        out.join("rollouts/oracle/with_gripper/recordings/shard-00000-of-00001.mcap"),
    ] {
        let (code, stdout, stderr) = run(&["replay", &text(&recording), "--episode", "0", "--verify"]);
        assert_eq!(code, 0, "{}: {stdout} {stderr}", recording.display());
    }
    let (code, stdout, stderr) = run(&[
        "query",
        &text(&out),
        "SELECT suite, robot, COUNT(*) AS n FROM rollouts GROUP BY suite, robot ORDER BY suite",
        "--csv",
    ]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(stdout.lines().skip(1).collect::<Vec<_>>(), ["with_arm,sawyer,2", "with_gripper,gripper,2"]);
    // Any number of jobs gives the same bytes.
    let again = folder.path().join("again");
    let (code, _, stderr) = run(&["run", &path, "--out", &text(&again), "--jobs", "1", "--to", "rollout"]);
    assert_eq!(code, 0, "{stderr}");
    let folders = ["recordings", "dataset", "rollouts"];
    assert_eq!(hashes(&out, &folders), hashes(&again, &folders));
}

fn recordings_tell_joints(run: &Path) {
    let shard = run.join("recordings/shard-00000-of-00002.mcap");
    let topics: Vec<String> = inspect(&shard).unwrap().topics.into_iter().map(|topic| topic.topic).collect();
    assert!(topics.iter().any(|topic| topic == "/joint_states"), "{topics:?}");
    for episode in ShardReader::open(&shard).unwrap() {
        let episode = episode.unwrap();
        assert!(episode.outcome.is_success());
        let joints: Vec<_> = episode.frames.iter().map(|frame| frame.state.joints_rad.unwrap()).collect();
        assert!(joints.windows(2).any(|pair| pair[0] != pair[1]));
    }
}

fn dataset_has_joint_targets(run: &Path) {
    let dataset = run.join("dataset");
    let validation = validate(&dataset);
    assert!(validation.findings.is_empty(), "{:?}", validation.findings);
    let info: Value = serde_json::from_str(&std::fs::read_to_string(dataset.join("meta/info.json")).unwrap()).unwrap();
    assert_eq!(info["robot_type"], "sawyer");
    assert_eq!(info["features"]["ntp.joints_rad"]["shape"], serde_json::json!([7]));
    assert_eq!(info["features"]["action"]["shape"], serde_json::json!([8]));
    assert_eq!(info["features"]["action"]["names"][0], "right_j0.rad");
}

#[test]
fn targets_for_joints_are_refused_where_there_are_none() {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = PIPELINE.replace("robot = \"sawyer\"", "robot = \"gripper\"");
    let path = write(folder.path(), &pipeline);
    let out = folder.path().join("run");
    let (code, _, stderr) = run(&["run", &path, "--out", &text(&out), "--to", "convert"]);
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("has no joints; action = \"joints\" is allowed for recordings of an arm"), "{stderr}");
    assert!(!out.join("dataset").exists());
}

#[test]
fn an_unknown_robot_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), &PIPELINE.replace("robot = \"sawyer\"", "robot = \"baxter\""));
    let (code, _, stderr) = run(&["run", &path, "--out", &text(&folder.path().join("run"))]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("baxter") && stderr.contains("sawyer"), "{stderr}");
    let path = write(
        folder.path(),
        &PIPELINE
            .replace("layout = \"bench\"", "layout = \"table\"")
            .replace("robot = \"gripper\"", "robot = \"sawyer\""),
    );
    let (code, _, stderr) = run(&["run", &path, "--out", &text(&folder.path().join("run"))]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("bench, where the arm reaches everything"), "{stderr}");
}
