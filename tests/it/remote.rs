//! Robots behind the protocol: ours gives the bytes of a rollout in process, and one that misbehaves is lost by name.

mod fuzz;
mod wires;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::Duration;

use ntp::artifact::Plan;
use ntp::deploy::{Driver, Trials, rehearse, shown_task};
use ntp::recording::{ShardReader, ShardWriter};
use ntp::remote::{
    Address, InProcess, LinkProblem, RemoteProblem, RemoteRobot, Session, SimulatedRobot, Wire, connect,
};
use ntp::robot::{Action, RobotApi as _};
use ntp::rollout::{Limits, Oracle, RolloutEpisode, RolloutRows, Start, run};
use ntp::scene::SlotIndex;
use ntp::seed::Seed;
use ntp::sim::{Simulation, SimulationConfig};
use ntp::task::{Split, Task, initial_state, scene};
use ntp::trace::{Actor, Cause, Episode, Outcome, Provenance};
use serde_json::{Value, json};

use crate::kinematic::{cleanup, demonstration, sorting, tower, trial};
use crate::length::from_environment;
use wires::{Lines, Spoiled, Told, methods, scripted};

const PATIENCE: Duration = Duration::from_secs(60);

fn trials(demonstration: &Episode) -> Trials<'_> {
    trials_of_seed(demonstration, 3)
}

fn trials_of_seed(demonstration: &Episode, seed: u64) -> Trials<'_> {
    let counts = demonstration.provenance.counts.clone();
    Trials { task: shown_task(demonstration).unwrap(), demonstration, counts, seed }
}

fn greet(wire: impl Wire + 'static, trials: &Trials<'_>) -> Session {
    let family = trials.task.family;
    Session::begin(Box::new(wire), "test", family, scene(family, &trials.counts), PATIENCE).unwrap()
}

fn simulated(trials: &Trials<'_>) -> InProcess {
    InProcess::new(SimulatedRobot::new(trials.task.family, SimulationConfig::default(), Seed(0)))
}

/// The oracle's rollout of the same trial without any protocol.
fn in_process(trials: &Trials<'_>, index: u32) -> RolloutEpisode {
    let trial = trials.trial(index);
    let scene = scene(trials.task.family, &trial.counts);
    let initial = initial_state(trials.task.family, &scene, trial.seed);
    let starts = vec![Start {
        task: &trials.task,
        demonstration: trials.demonstration.clone(),
        world: Box::new(Simulation::new(scene, &initial, &SimulationConfig::default()).unwrap()),
        sight: None,
        provenance: Provenance::new(&trials.task, &trial, Actor::Policy(String::new()), u64::from(index)),
    }];
    run(&mut Oracle::for_starts(&starts), starts, Limits::default()).unwrap().remove(0)
}

fn recorded(episodes: &[&RolloutEpisode], path: &Path) -> Vec<u8> {
    let mut writer = ShardWriter::create(path, "{}").unwrap();
    episodes.iter().for_each(|rollout| writer.write(&rollout.episode).unwrap());
    writer.finish().unwrap();
    std::fs::read(path).unwrap()
}

fn binary() -> &'static str {
    env!("CARGO_BIN_EXE_ntp")
}

#[track_caller]
fn check_same_bytes(task: &Task, count: u16) {
    let shown = demonstration(task, &trial(task, 0, count), 0);
    let trials = trials(&shown);
    let command = format!("{} robot --family {}", binary(), task.family.name());
    let wire = connect(&Address::Command(command), Arc::default()).unwrap();
    let family = task.family;
    let session = Session::begin(wire, "test", family, scene(family, &trials.counts), PATIENCE).unwrap();
    let remote = [0, 1].map(|index| trials.act(&mut Driver::Oracle, &session, index, true).unwrap());
    let local = [0, 1].map(|index| in_process(&trials, index));
    assert_eq!(local[0].episode.outcome, Outcome::Success);
    let folder = tempfile::tempdir().unwrap();
    let [remote, local] = [("remote", remote), ("local", local)]
        .map(|(name, acted)| recorded(&acted.iter().collect::<Vec<_>>(), &folder.path().join(name)));
    assert!(remote == local, "other bytes");
}

#[test]
fn the_oracle_through_the_protocol_gives_the_bytes_of_a_recording_in_process() {
    check_same_bytes(&tower("t", &[4, 1, 6], Split::Unseen), 1);
    check_same_bytes(&sorting("m", [3, 0, 2, 2], Split::Unseen), 2);
    check_same_bytes(&cleanup("c", &[1, 3], Split::Unseen), 2);
}

#[test]
fn what_a_demonstration_shows_is_the_task_that_was_demonstrated() {
    for task in [
        tower("t", &[4, 1, 6, 2], Split::Unseen),
        sorting("m", [3, 0, 2, 2], Split::Seen),
        cleanup("c", &[1, 3], Split::Unseen),
    ] {
        assert_eq!(shown_task(&demonstration(&task, &trial(&task, 0, 2), 0)).unwrap(), task);
    }
}

#[test]
fn the_golden_dialogue_is_what_both_sides_say() {
    let task = Task { blocks: Some(2), ..tower("stack_0000", &[0, 1], Split::Unseen) };
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    let said = Told::default();
    let session = greet(said.around(simulated(&trials)), &trials);
    let rollout = trials.act(&mut Driver::Oracle, &session, 0, true).unwrap();
    assert_eq!(rollout.episode.outcome, Outcome::Success);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/robots/conformance.jsonl");
    let said: String = said.lines().iter().map(|line| format!("{line}\n")).collect();
    if from_environment("NTP_REWRITE", 0) == 1 {
        std::fs::write(&path, &said).unwrap();
    }
    assert!(std::fs::read_to_string(&path).unwrap() == said, "another dialogue; NTP_REWRITE=1 writes it");
}

/// What a robot does to its `at`-th line, and what that is called.
type Misdeed = (usize, fn(String) -> Result<String, LinkProblem>, fn(&RemoteProblem) -> bool);

/// The line with a part of it set to something else.
fn with(line: &str, pointer: &str, value: Value) -> String {
    let mut message: Value = serde_json::from_str(line).unwrap();
    *message.pointer_mut(pointer).unwrap_or_else(|| panic!("no {pointer} in {line}")) = value;
    message.to_string()
}

const MISDEEDS: [Misdeed; 14] = [
    (2, |_| Err(LinkProblem::Late(60)), |problem| *problem == LinkProblem::Late(60).into()),
    (3, |_| Err(LinkProblem::Gone), |problem| *problem == LinkProblem::Gone.into()),
    (3, |_| Ok("hello?".to_owned()), |problem| matches!(problem, RemoteProblem::Json { .. })),
    (
        2,
        |line| Ok(with(&line, "/id", json!(1))),
        |problem| *problem == RemoteProblem::Id { found: Some(1), expected: 2 },
    ),
    (
        2,
        |_| Ok(json!({"id": 2, "error": {"code": -1, "message": "no"}}).to_string()),
        |problem| *problem == RemoteProblem::Refused { message: "no".to_owned() },
    ),
    (
        2,
        |line| Ok(line.replacen("block_C", "block_X", 1)),
        |problem| matches!(problem, RemoteProblem::Missing { name } if name == "block_C"),
    ),
    (
        2,
        |line| Ok(line.replacen("block_C\":", "block_C\": {\"position_m\": [0, 0, 0]}, \"cup\":", 1)),
        |problem| matches!(problem, RemoteProblem::Name { found, .. } if found == "cup"),
    ),
    (
        2,
        |line| Ok(with(&line, "/result/observation/gripper/opening_m", json!(-1))),
        |problem| matches!(problem, RemoteProblem::Value { found, .. } if found == "-1"),
    ),
    (
        2,
        |line| Ok(with(&line, "/result/observation/bodies/block_A/position_m/0", json!(1e39))),
        |problem| matches!(problem, RemoteProblem::Value { what, .. } if what == "position of block_A"),
    ),
    (
        2,
        |line| Ok(line.replacen("\"opening_m\":0.07", "\"opening_m\":NaN", 1)),
        |problem| matches!(problem, RemoteProblem::Json { .. }),
    ),
    (
        2,
        |line| Ok(with(&line, "/result/observation/gripper", json!({}))),
        |problem| matches!(problem, RemoteProblem::Part { .. }),
    ),
    (
        3,
        |line| Ok(with(&line, "/params/time_ns", json!(0))),
        |problem| *problem == RemoteProblem::Time { before: 0, now: 0 },
    ),
    (
        3,
        |line| Ok(with(&line, "/params/gripper/holds", json!("block_Z"))),
        |problem| matches!(problem, RemoteProblem::Name { what: "held body", .. }),
    ),
    (
        2,
        |line| {
            Ok(with(
                &line,
                "/result/observation/bodies/block_A",
                json!({"position_m": [0, 0, 0], "orientation_xyzw": [0, 0, 1, 1]}),
            ))
        },
        |problem| matches!(problem, RemoteProblem::Value { what, .. } if what == "orientation of block_A"),
    ),
];

#[test]
fn a_robot_that_misbehaves_is_lost_by_name_and_told_to_stop_and_nothing_else() {
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    for (number, (at, spoil, is_named)) in MISDEEDS.into_iter().enumerate() {
        let sent = Lines::default();
        let session = greet(Spoiled::new(simulated(&trials), at, spoil, &sent), &trials);
        let acted = trials.act(&mut Driver::Oracle, &session, 0, true);
        let problem = session.lost().expect("it is lost").problem;
        assert!(is_named(&problem), "misdeed {number}: {problem}");
        let after_reset = at > 2;
        assert_eq!(acted.is_ok(), after_reset, "misdeed {number}");
        if let Ok(rollout) = acted {
            assert_eq!(rollout.episode.outcome, Outcome::Failure(Cause::RobotLost), "misdeed {number}");
        }
        let all: &[&str] = &["hello", "reset", "move_to", "stop"];
        let asked = if after_reset { all.to_vec() } else { [&all[..2], &all[3..]].concat() };
        assert_eq!(methods(&sent.lines()), asked, "misdeed {number}");
    }
}

#[test]
fn a_scene_that_is_not_the_one_asked_for_is_named() {
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    let asked = Lines::default();
    greet(Spoiled::new(simulated(&trials), usize::MAX, Ok, &asked), &trials);
    let hello: Value = serde_json::from_str(&asked.lines()[0]).unwrap();
    let scene_of = |pointer: &str, value: Value| {
        let own: Value = serde_json::from_str(&with(&hello.to_string(), pointer, value)).unwrap();
        json!({"id": 1, "result": {"protocol": 1, "robot": "r", "scene": own["params"]["scene"]}}).to_string()
    };
    let welcomed = |line: String| {
        let (family, sent) = (task.family, Lines::default());
        let wire = scripted(vec![line], &sent);
        Session::begin(Box::new(wire), "test", family, scene(family, &[]), PATIENCE).map_err(|lost| lost.to_string())
    };
    let larger = welcomed(scene_of("/params/scene/bodies/0/shape/cuboid/half_extents_m/0", json!(0.03))).unwrap();
    assert_eq!(larger.scene().bodies[0].shape.half_extents_m().x, 0.03);
    for (pointer, value, message) in [
        (
            "/params/scene/slots/3/bodies/0",
            json!("block_A"),
            "slot 3 of the scene is block_D (block_A), but block_D (block_D) was asked for",
        ),
        ("/params/scene/bodies/2/name", json!("block_A"), "body's name is \"block_A\"; allowed: each name once"),
        ("/params/scene/bodies/2/name", json!("cup"), "names body \"block_C\"; the scene has: block_A"),
        ("/params/scene/table_half_m/1", json!(-0.6), "table_half_m is -0.6; allowed: above 0"),
        ("/params/scene/bodies/1/shape", json!({"cone": {}}), "unknown variant `cone`"),
    ] {
        let lost = welcomed(scene_of(pointer, value)).err().unwrap();
        assert!(lost.contains(message), "{lost}");
    }
    let newer = json!({"id": 1, "result": {"protocol": 2, "robot": "r"}}).to_string();
    assert!(welcomed(newer).err().unwrap().contains("it speaks protocol 2; allowed: 1"));
}

#[test]
fn no_target_off_the_table_is_ever_sent() {
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    let sent = Lines::default();
    let off = |line: String| Ok(with(&line, "/result/observation/bodies/block_C/position_m/1", json!(0.61)));
    let session = greet(Spoiled::new(simulated(&trials), 2, off, &sent), &trials);
    let mut robot = RemoteRobot::observe(&session).unwrap();
    assert_eq!(robot.act(Action::MoveTo(SlotIndex(2))), Err(Cause::ObjectOffTable));
    assert_eq!(robot.act(Action::MoveTo(SlotIndex(99))), Err(Cause::UnknownSlot));
    assert_eq!(methods(&sent.lines()), ["hello", "observe"]);
    assert_eq!(robot.act(Action::MoveTo(SlotIndex(0))), Ok(()));
    assert_eq!(methods(&sent.lines()), ["hello", "observe", "move_to"]);
}

#[test]
fn a_body_that_is_not_seen_stays_where_it_was() {
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    let hide = |line: String| {
        let mut message: Value = serde_json::from_str(&line).unwrap();
        message["result"]["observation"]["bodies"].as_object_mut().unwrap().remove("block_E");
        Ok(message.to_string())
    };
    let session = greet(Spoiled::new(simulated(&trials), 3, hide, &Lines::default()), &trials);
    let mut robot = RemoteRobot::observe(&session).unwrap();
    let before = robot.state().bodies_in_world[4];
    // To release nothing takes one step: the third line is its answer.
    assert_eq!(robot.act(Action::Release), Ok(()));
    assert_eq!(robot.state().bodies_in_world[4], before);
    robot.act(Action::MoveTo(SlotIndex(0))).unwrap();
    robot.act(Action::Grip).unwrap();
    robot.act(Action::MoveTo(SlotIndex(1))).unwrap();
    robot.act(Action::Release).unwrap();
    assert_eq!(session.lost(), None);
}

#[test]
fn a_robot_that_dies_is_lost_and_recorded_up_to_there() {
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    let whole = in_process(&trials, 0).episode;
    let n_frames = whole.frames.len();
    for n_lines in [3, n_frames / 2, n_frames - 1] {
        let some = "while [ $n -gt 0 ] && read -r line; do echo \"$line\"; n=$((n - 1)); done";
        // All of it is killed at once, so that no end of a pipe stays open.
        let command = format!("{} robot --family block_stacking | {{ n={n_lines}; {some}; kill -9 0; }}", binary());
        let wire = connect(&Address::Command(command), Arc::default()).unwrap();
        let family = trials.task.family;
        let session = Session::begin(wire, "test", family, scene(family, &[]), PATIENCE).unwrap();
        let acted = trials.act(&mut Driver::Oracle, &session, 0, true).unwrap().episode;
        assert_eq!(acted.outcome, Outcome::Failure(Cause::RobotLost));
        // Hello is a line, and each other is a frame.
        assert_eq!(acted.frames.len(), n_lines - 1);
        let same = |(one, other): (&ntp::trace::Frame, &ntp::trace::Frame)| one.state == other.state;
        assert!(acted.frames.iter().zip(&whole.frames).all(same));
        assert_eq!(session.lost().unwrap().problem, LinkProblem::Gone.into());
    }
}

#[test]
fn a_dry_run_asks_the_robot_nothing_but_where_things_are() {
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let trials = trials(&shown);
    let (sent, told) = (Lines::default(), Lines::default());
    let session = greet(Spoiled::new(simulated(&trials), usize::MAX, Ok, &sent), &trials);
    let rehearsal = rehearse(&session, task.family, told.teller()).unwrap();
    let acted = trials.act(&mut Driver::Oracle, &rehearsal, 0, false).unwrap();
    assert_eq!(acted.episode.outcome, Outcome::Success);
    assert_eq!(methods(&sent.lines()), ["hello", "observe"]);
    let would_be = ["hello", "observe", "move_to", "grip", "move_to", "release", "settle"];
    assert_eq!(methods(&told.lines()), would_be);
}

#[test]
fn our_own_robot_refuses_what_it_cannot_do_and_goes_on() {
    let mut robot = SimulatedRobot::new(ntp::task::Family::BlockStacking, SimulationConfig::default(), Seed(0));
    let error = |robot: &mut SimulatedRobot, line: &str| {
        let answer: Value = serde_json::from_str(&robot.answer(line)[0]).unwrap();
        answer["error"]["message"].as_str().unwrap().to_owned()
    };
    for (line, message) in [
        ("{", "no message: "),
        (r#"{"id":1}"#, "a request without a method"),
        (r#"{"id":1,"method":"grip"}"#, "grip before hello"),
        (r#"{"id":1,"method":"hello","params":{"protocol":1}}"#, "params: missing field `family`"),
    ] {
        let told = error(&mut robot, line);
        assert!(told.starts_with(message), "{told}");
    }
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let sent = Lines::default();
    greet(Spoiled::new(simulated(&trials(&shown)), usize::MAX, Ok, &sent), &trials(&shown));
    let hello = &sent.lines()[0];
    assert!(
        error(&mut robot, &hello.replace("\"protocol\":1", "\"protocol\":7")).starts_with("protocol 7; allowed: 1")
    );
    let sorting = hello.replace("block_stacking", "object_sorting");
    assert_eq!(error(&mut robot, &sorting), "family object_sorting; allowed: block_stacking");
    assert!(robot.answer(hello)[0].contains("ntp-simulation"));
    assert!(error(&mut robot, r#"{"id":2,"method":"dance"}"#).starts_with("method dance; allowed: hello, reset"));
    let target = r#"{"id":3,"method":"move_to","params":{"slot":"cup","body":"cup","position_m":[0,0,0],"hover_m":0}}"#;
    assert!(error(&mut robot, target).starts_with("slot \"cup\"; allowed: block_A, block_B"));
    assert!(robot.answer(r#"{"method":"stop"}"#).is_empty());
    assert_eq!(error(&mut robot, r#"{"id":4,"method":"grip"}"#), "grip after stop; allowed: reset, observe");
    assert!(robot.answer(r#"{"id":5,"method":"observe"}"#)[0].contains("block_A"));
}

#[test]
fn addresses_are_commands_or_tcp() {
    let address = |word: &str| word.parse::<Address>();
    assert_eq!(address("python my_robot.py"), Ok(Address::Command("python my_robot.py".to_owned())));
    assert_eq!(address("tcp://127.0.0.1:7070"), Ok(Address::Tcp("127.0.0.1:7070".to_owned())));
    for word in ["", "tcp://", "tcp://host", "tcp://host:99999", "tcp://:1", "http://host:1"] {
        let told = address(word).unwrap_err().to_string();
        assert!(told.ends_with("is no robot; allowed: a command, or tcp://HOST:PORT"), "{told}");
    }
}

/// A folder with a recording of a demonstration.
fn recording() -> tempfile::TempDir {
    let task = tower("t", &[4, 1], Split::Unseen);
    let folder = tempfile::tempdir().unwrap();
    let plan = Plan::new("generate", 1, Default::default(), json!({}));
    let mut writer =
        ShardWriter::create(&folder.path().join("shown.mcap"), &serde_json::to_string(&plan).unwrap()).unwrap();
    writer.write(&demonstration(&task, &trial(&task, 0, 1), 0)).unwrap();
    writer.finish().unwrap();
    folder
}

#[test]
fn a_robot_that_listens_is_acted_on_over_tcp() {
    use std::io::{BufRead as _, BufReader};
    let folder = recording();
    let mut robot = Command::new(binary())
        .args(["robot", "--family", "block_stacking", "--listen", "0"])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(robot.stderr.take().unwrap()).read_line(&mut line).unwrap();
    let address = line.trim().strip_prefix("listening on ").unwrap();
    assert!(address.starts_with("tcp://127.0.0.1:"), "only this machine: {address}");
    let acted = Command::new(binary())
        .args(["act", "oracle", "--demonstration", "shown.mcap", "--robot", address])
        .args(["--reset", "--trials", "2", "--record", "acted"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    robot.kill().unwrap();
    robot.wait().unwrap();
    assert_eq!(acted.status.code(), Some(0), "{}", String::from_utf8_lossy(&acted.stderr));
    let said = String::from_utf8_lossy(&acted.stdout);
    assert_eq!(said.trim(), "ntp-simulation: 2 of 2 succeeded → acted");
    let valid = Command::new(binary()).args(["validate", "acted"]).current_dir(folder.path()).output().unwrap();
    assert_eq!(valid.status.code(), Some(0), "{}", String::from_utf8_lossy(&valid.stdout));
}

#[cfg(unix)]
#[test]
fn a_robot_does_not_move_for_what_cannot_be_recorded() {
    let folder = recording();
    std::fs::create_dir(folder.path().join("full")).unwrap();
    std::fs::write(folder.path().join("full/x"), "").unwrap();
    let acted = Command::new(binary())
        .args(["act", "oracle", "--demonstration", "shown.mcap", "--robot", "tee asked.jsonl", "--record", "full"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(acted.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&acted.stderr).contains("only a new or empty folder is written"));
    assert!(!folder.path().join("asked.jsonl").exists(), "the robot was asked something");
}

/// Episodes of the recordings of a folder, file by file.
fn recorded_in(folder: &Path) -> Vec<Vec<Episode>> {
    let open = |path: &PathBuf| ShardReader::open(path).unwrap().collect::<Result<_, _>>().unwrap();
    recordings_in(folder).iter().map(open).collect()
}

/// The whole recordings of `folder`, by name; a recording that is being written has another ending.
fn recordings_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    files.sort();
    files
}

#[cfg(unix)]
#[test]
fn trials_that_have_ended_outlive_a_kill() {
    let folder = recording();
    let robot = format!("{} robot --family block_stacking", binary());
    let (n_asked, acted) = ("1000", folder.path().join("acted"));
    let mut child = Command::new(binary())
        .args(["act", "oracle", "--demonstration", "shown.mcap", "--robot", &robot])
        .args(["--reset", "--trials", n_asked, "--record", "acted"])
        .current_dir(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    // A trial is in the folder as soon as it has ended.
    for _ in 0..1200 {
        if recordings_in(&acted.join("recordings")).len() >= 3 {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(child.try_wait().unwrap().is_none(), "it had ended by itself");
    // On Unix this is SIGKILL.
    child.kill().unwrap();
    let status = child.wait().unwrap();
    assert_eq!(std::os::unix::process::ExitStatusExt::signal(&status), Some(9));
    let recorded = recorded_in(&acted.join("recordings"));
    assert!(recorded.len() >= 3, "{}", recorded.len());
    let demonstration = recorded_in(folder.path()).remove(0).remove(0);
    let trials = trials_of_seed(&demonstration, 0);
    for (index, episodes) in (0..3).zip(&recorded) {
        assert_eq!(episodes[..], [in_process(&trials, index).episode], "trial {index}");
    }
    // The table follows each recording; the kill may have come between the two.
    let rows = RolloutRows::read(&acted.join("rollouts.parquet")).unwrap().successes();
    assert!(rows.0 >= 2 && (recorded.len() - 1..=recorded.len()).contains(&rows.0), "{rows:?}");
    let check =
        |arguments: &[&str]| Command::new(binary()).args(arguments).current_dir(folder.path()).output().unwrap();
    let valid = check(&["validate", "acted"]);
    assert_eq!(valid.status.code(), Some(0), "{}", String::from_utf8_lossy(&valid.stdout));
    // Nothing is written over it.
    let again = check(&["act", "oracle", "--demonstration", "shown.mcap", "--robot", &robot, "--record", "acted"]);
    assert_eq!(again.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&again.stderr).contains("only a new or empty folder is written"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_robot_that_hangs_does_not_outlive_the_command_nor_does_what_it_has_started() {
    let folder = recording();
    // Reads nothing, answers nothing, and has started something that goes on.
    let robot = "sleep 1000 & echo $! > started; trap '' INT TERM; while :; do sleep 1; done";
    let output = Command::new(binary())
        .args(["act", "oracle", "--demonstration", "shown.mcap", "--robot", robot, "--deadline", "1"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && stderr.contains("no answer"), "{stderr}");
    let started = std::fs::read_to_string(folder.path().join("started")).unwrap();
    // Gone, or dead and not yet buried.
    let state = std::fs::read_to_string(format!("/proc/{}/stat", started.trim())).unwrap_or_default();
    assert!(state.is_empty() || state.contains(") Z "), "{state}");
}

#[test]
fn our_own_robot_goes_to_bodies_of_the_slot_over_the_table_alone() {
    let mut ours = SimulatedRobot::new(tower("t", &[4, 1], Split::Unseen).family, SimulationConfig::default(), Seed(0));
    let task = tower("t", &[4, 1], Split::Unseen);
    let (shown, sent) = (demonstration(&task, &trial(&task, 0, 1), 0), Lines::default());
    let trials = trials(&shown);
    greet(Spoiled::new(simulated(&trials), usize::MAX, Ok, &sent), &trials);
    ours.answer(&sent.lines()[0]);
    let mut ask = |body: &str, position: &str, hover: &str| {
        let target = format!(r#"{{"slot":"block_A","body":"{body}","position_m":{position},"hover_m":{hover}}}"#);
        ours.answer(&format!(r#"{{"id":2,"method":"move_to","params":{target}}}"#)).concat()
    };
    assert!(ask("nobody", "[0,0,0.03]", "0.1").contains("body nobody of slot block_A; allowed: block_A"));
    assert!(ask("block_A", "[9,9,9]", "0.1").contains("target [9.0, 9.0, 9.0], 0.1 m above; allowed:"));
    assert!(ask("block_A", "[0,0,0.03]", "99").contains("99 m above; allowed:"));
    assert!(ask("block_A", "[0,0,0.03]", "0.1").contains(r#""result""#));
}

#[cfg(unix)]
#[test]
fn ctrl_c_stops_the_robot_and_keeps_what_was_seen() {
    let folder = recording();
    let task = tower("t", &[4, 1], Split::Unseen);
    let shown = demonstration(&task, &trial(&task, 0, 1), 0);
    let (trials, sent) = (trials(&shown), Lines::default());
    greet(Spoiled::new(simulated(&trials), usize::MAX, Ok, &sent), &trials);
    let mut ours = SimulatedRobot::new(task.family, SimulationConfig::default(), Seed(0));
    let hello = ours.answer(&sent.lines()[0]).concat();
    let observed = ours.answer(r#"{"id":2,"method":"observe"}"#).concat();
    std::fs::write(folder.path().join("answers.jsonl"), format!("{hello}\n{observed}\n")).unwrap();
    // Says hello, says where things are, and is silent from then on.
    let robot = "exec 4< answers.jsonl; while read -r line; do echo \"$line\" >> asked.jsonl; \
                 if read -r answer <&4; then echo \"$answer\"; fi; done";
    let child = Command::new(binary())
        .args(["act", "oracle", "--demonstration", "shown.mcap", "--robot", robot, "--record", "acted"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let asked = || std::fs::read_to_string(folder.path().join("asked.jsonl")).unwrap_or_default();
    for _ in 0..600 {
        if asked().contains("move_to") {
            break;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", String::from_utf8_lossy(&output.stderr));
    let lines: Vec<String> = asked().lines().map(str::to_owned).collect();
    assert_eq!(methods(&lines), ["hello", "observe", "move_to", "stop"]);
    assert!(folder.path().join("acted/rollouts.parquet").is_file());
}

#[test]
fn every_command_of_the_page_about_robots_does_what_it_says_in_an_empty_directory() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/robots.md")).unwrap();
    let made = crate::tutorial::follow(&page);
    for file in ["oracle.rrd", "oracle/rollouts.parquet", "acted/manifest.json"] {
        assert!(made.path().join(file).is_file(), "{file} is not there");
    }
}
