//! The arm through every stage: a pipeline whose robot is Sawyer, suites whose robots differ, and robots that see.

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

const ROBOT_TABLE: &str = r#"
name = "robot_table"
seed = 5
[tasks]
family = "block_stacking"
train = 2
unseen = 4
[generate]
trials_per_task = 1
frames = "boundaries"
[rollout]
record = 3
oracle = true
[[rollout.suites]]
name = "seen_well"
split = "unseen"
episodes = 3
robot = "sawyer"
perception = {}
[[rollout.suites]]
name = "seen_badly"
split = "unseen"
episodes = 3
robot = "sawyer"
jaw_m = 0.057
perception = { camera = "right", sensor = "exact", calibration_deg = 0.0, calibration_mm = 60.0, depth_mm = 0.0 }
[[rollout.suites]]
name = "known"
split = "unseen"
episodes = 2
"#;

#[test]
fn a_robot_that_sees_acts_the_same_any_number_of_jobs_and_its_rows_tell_with_what_it_saw() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), ROBOT_TABLE);
    let out = folder.path().join("run");
    let (code, _, stderr) = run(&["run", &path, "--out", &text(&out), "--jobs", "2"]);
    assert_eq!(code, 0, "{stderr}");
    let (code, stdout, stderr) = run(&[
        "query",
        &text(&out),
        "SELECT suite, jaw_m, camera, sensor, calibration_deg, calibration_mm, depth_mm, COUNT(localisation_mm) AS n FROM \
         rollouts GROUP BY suite, jaw_m, camera, sensor, calibration_deg, calibration_mm, depth_mm ORDER BY suite",
        "--csv",
    ]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(
        stdout.lines().skip(1).collect::<Vec<_>>(),
        [
            "known,0.07,,,,,,0",
            "seen_badly,0.057,right,exact,0.0,60.0,0.0,3",
            "seen_well,0.07,front,kinect,0.1,1.5,2.0,3"
        ]
    );
    let (_, stdout, _) =
        run(&["query", &text(&out), "SELECT suite, failure, localisation_mm FROM rollouts WHERE NOT success", "--csv"]);
    let badly: Vec<&str> = stdout.lines().filter(|line| line.starts_with("seen_badly")).collect();
    assert!(!badly.is_empty(), "blocks are gripped 6 cm beside where they stand");
    assert!(badly.iter().all(|line| line.split(',').nth(1).is_some_and(|failure| !failure.is_empty())), "{badly:?}");
    let recording = out.join("rollouts/oracle/seen_badly/recordings/shard-00000-of-00001.mcap");
    for episode in ["0", "1", "2"] {
        let (code, stdout, stderr) = run(&["replay", &text(&recording), "--episode", episode, "--verify"]);
        assert_eq!(code, 0, "{stdout} {stderr}");
    }
    let page = std::fs::read_to_string(out.join("report/index.html")).unwrap();
    assert!(page.contains("Robot table") && page.contains("Block Stacking, real robot"));
    let again = folder.path().join("again");
    let (code, _, stderr) = run(&["run", &path, "--out", &text(&again), "--jobs", "1", "--to", "rollout"]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(hashes(&out, &["rollouts"]), hashes(&again, &["rollouts"]));
}

#[test]
fn a_camera_or_a_gripper_that_cannot_be_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to, said) in [
        ("perception = {}", "perception = { depth_mm = -1.0 }", "depth_mm is -1; allowed: from 0 to 100"),
        ("perception = {}", "perception = { camera = \"below\" }", "below"),
        ("jaw_m = 0.057", "jaw_m = 0.2", "jaw_m is 0.2; allowed: 0.01 to 0.07"),
    ] {
        let path = write(folder.path(), &ROBOT_TABLE.replace(from, to));
        let (code, _, stderr) = run(&["run", &path, "--out", &text(&folder.path().join("run"))]);
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains(said), "{stderr}");
    }
}
