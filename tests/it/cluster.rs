//! Work that processes share: addresses, plans that are joined, receipts that win, commits, and submitted runs.

use std::path::Path;
use std::process::{Child, Stdio};

use ntp::pipeline::{ItemRanges, Pipeline, RunDir, Stage, items};
use serde_json::Value;

use crate::killing::killed_after;
use crate::length::{from_environment, tell};
use crate::pipeline::{ALL, hashes, ntp, repository, run};
use crate::smoke::{self, PIPELINE};

fn stage(command: &str, out: &Path, more: &[&str]) -> (i32, String, String) {
    run(&[&[command, PIPELINE, "--out", &out.to_string_lossy()], more].concat())
}

fn json(command: &str, out: &Path, more: &[&str]) -> Value {
    let (_, stdout, stderr) = stage(command, out, &[more, &["--json"]].concat());
    serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error}: {stdout} {stderr}"))
}

fn start(command: &str, out: &Path, more: &[&str]) -> Child {
    let out = out.to_string_lossy();
    let arguments = [&[command, PIPELINE, "--jobs", "1", "--out", out.as_ref()], more].concat();
    ntp(&arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap()
}

fn check_all_succeed(children: Vec<Child>) {
    for child in children {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}

/// A pipeline file like smoke.toml with something changed.
fn changed(folder: &Path, from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(repository().join(PIPELINE)).unwrap();
    assert!(text.contains(from));
    let path = folder.join("changed.toml");
    std::fs::write(&path, text.replace(from, to)).unwrap();
    path.to_string_lossy().into_owned()
}

#[test]
fn every_piece_of_work_has_an_address_before_anything_has_run() {
    let folder = tempfile::tempdir().unwrap();
    let listed = json("items", folder.path(), &[]);
    let told: Vec<String> = listed
        .as_array()
        .unwrap()
        .iter()
        .map(|item| {
            let number = |key: &str| item[key].as_u64().unwrap();
            let text = |key: &str| item[key].as_str().unwrap().to_owned();
            let (stage, unit, counted) = (text("stage"), text("unit"), text("counted"));
            assert_eq!(item["state"], "left");
            format!(
                "{stage} {}: {unit} {}/{}, {} {counted}",
                number("item"),
                number("shard"),
                number("shards"),
                number("amount")
            )
        })
        .collect();
    assert_eq!(
        told,
        [
            "tasks 0: tasks 0/1, 7 tasks",
            "generate 0: generate 0/3, 4 episodes",
            "generate 1: generate 1/3, 4 episodes",
            "generate 2: generate 2/3, 1 episodes",
            "convert 0: convert 0/1, 9 episodes",
            "train 0: train ntp-seed0 0/1, 6 steps",
            "rollout 0: rollout oracle stacking_unseen 0/1, 4 episodes",
            "rollout 1: rollout ntp-seed0-mss stacking_unseen 0/1, 4 episodes",
            "report 0: report 0/1, 1 experiments",
        ]
    );
    assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none(), "something was written");
    let needed = json("run", folder.path(), &["--dry-run"]);
    let needed: Vec<(&str, u64, &str)> = needed
        .as_array()
        .unwrap()
        .iter()
        .map(|report| {
            (report["unit"].as_str().unwrap(), report["shards"].as_u64().unwrap(), report["reason"].as_str().unwrap())
        })
        .collect();
    assert_eq!(
        needed,
        [
            ("tasks", 1, "not done yet"),
            ("generate", 3, "tasks comes first"),
            ("convert", 1, "generate comes first"),
            ("train ntp-seed0", 1, "convert comes first"),
            ("rollout oracle stacking_unseen", 1, "tasks comes first"),
            ("rollout ntp-seed0-mss stacking_unseen", 1, "tasks comes first"),
            ("report", 1, "rollout comes first"),
        ]
    );
}

#[test]
fn items_that_are_left_are_told_as_sbatch_takes_them() {
    let folder = smoke::copy_to("tasks");
    assert_eq!(stage("items", folder.path(), &["--stage", "generate", "--left", "--array"]).1, "0-2\n");
    assert_eq!(stage("generate", folder.path(), &["--items", "1"]).0, 0);
    assert_eq!(stage("items", folder.path(), &["--stage", "generate", "--left", "--array"]).1, "0,2\n");
    assert_eq!(stage("generate", folder.path(), &["--items", "0,2"]).0, 0);
    let (code, stdout, _) = stage("items", folder.path(), &["--stage", "generate", "--left", "--array"]);
    assert_eq!((code, stdout.trim()), (0, ""));
    assert_eq!(ItemRanges::from_iter([0, 1, 2, 5, 7, 8]).to_string(), "0-2,5,7-8");
    assert!("3-1".parse::<ItemRanges>().is_err() && "".parse::<ItemRanges>().is_err());
}

#[test]
fn parts_of_every_number_of_processes_do_each_item_once() {
    for n_parts in [1, 2, 3, 5] {
        let folder = smoke::copy_to("tasks");
        let mut done = 0;
        for part in 0..n_parts {
            let reports = json("generate", folder.path(), &["--part", &format!("{part}/{n_parts}")]);
            done += reports.as_array().unwrap().iter().filter(|report| report["status"] == "shard_done").count();
        }
        assert_eq!(done, 3, "in {n_parts} parts");
        let (code, _, stderr) = stage("generate", folder.path(), &["--part", &format!("{n_parts}/{n_parts}")]);
        assert!(code == 2 && stderr.contains("T from 0 and below N"), "{stderr}");
        assert_eq!(stage("generate", folder.path(), &["--commit"]).0, 0);
        assert_eq!(hashes(folder.path(), &["recordings"]), hashes(smoke::whole(), &["recordings"]));
    }
}

/// `NTP_ROUNDS=200` starts 200 rounds.
#[test]
fn processes_that_start_at_once_on_a_fresh_folder_lose_and_double_nothing() {
    let n_rounds = from_environment("NTP_ROUNDS", 2);
    let wanted = hashes(smoke::whole(), &["recordings"]);
    for round in 0..n_rounds {
        let folder = smoke::copy_to("tasks");
        if round % 2 == 0 {
            assert_eq!(stage("generate", folder.path(), &["--begin"]).0, 0);
        }
        // Each item has four twins.
        check_all_succeed(
            (0..12).map(|at| start("generate", folder.path(), &["--items", &(at % 3).to_string()])).collect(),
        );
        let (code, _, stderr) = stage("generate", folder.path(), &["--commit"]);
        assert_eq!(code, 0, "round {round}: {stderr}");
        assert_eq!(hashes(folder.path(), &["recordings"]), wanted, "round {round}");
    }
    tell(&format!("{n_rounds} rounds of 12 processes: 0 lost, 0 doubled"));
}

#[test]
fn items_of_another_plan_are_refused_by_name_and_change_nothing() {
    let folder = smoke::copy_to("report");
    let before = hashes(folder.path(), &ALL);
    let pipeline = changed(folder.path(), "trials_per_task = 3", "trials_per_task = 2");
    let out = folder.path().to_string_lossy();
    for more in [
        &["--items", "0"][..],
        &["--part", "0/2"],
        &["--shard", "0"],
        &["--commit"],
        &["--begin"],
        &["--items", "0", "--force"],
    ] {
        let (code, _, stderr) = run(&[&["generate", &pipeline, "--out", out.as_ref()], more].concat());
        assert_eq!(code, 2, "{more:?}: {stderr}");
        assert!(stderr.contains("recordings is of another plan: its setting"), "{more:?}: {stderr}");
        assert_eq!(hashes(folder.path(), &ALL), before, "{more:?}");
    }
    // So are those of later stages, which would read what is of another plan, and the whole when it is submitted.
    for stage in ["convert", "train", "rollout", "report"] {
        let (code, _, stderr) = run(&[stage, &pipeline, "--out", out.as_ref(), "--items", "0"]);
        assert_eq!(code, 2, "{stage}: {stderr}");
        let told =
            format!("{stage} would read what is of another plan: generate: its setting episodes changed; ntp run ");
        assert!(stderr.contains(&told), "{stage}: {stderr}");
    }
    for force in [&[][..], &["--force"]] {
        let submit = ["submit", &pipeline, "--out", out.as_ref(), "--engine", "local"];
        let (code, _, stderr) = run(&[&submit[..], force].concat());
        assert_eq!(code, 2, "{stderr}");
        assert!(stderr.contains("was begun by another plan: generate: its setting episodes changed; "), "{stderr}");
    }
    assert_eq!(hashes(folder.path(), &ALL), before);
    assert!(!folder.path().join("submit").exists());
    let (code, stdout, stderr) = run(&["generate", &pipeline, "--out", out.as_ref(), "--begin", "--force"]);
    assert!(code == 0 && stdout.contains("removed: 3 finished shards"), "{stdout} {stderr}");
    assert_eq!(run(&["generate", &pipeline, "--out", out.as_ref(), "--items", "0-1"]).0, 0);
    assert_eq!(run(&["generate", &pipeline, "--out", out.as_ref(), "--commit"]).0, 0);
}

#[test]
fn force_on_one_item_leaves_the_receipts_of_others_alone() {
    let folder = smoke::copy_to("generate");
    let receipt = |shard: u32| folder.path().join(format!("recordings/receipts/shard-0000{shard}.json"));
    let written = |shard: u32| std::fs::metadata(receipt(shard)).unwrap().modified().unwrap();
    let before = [written(0), written(2)];
    std::fs::write(receipt(1), std::fs::read_to_string(receipt(1)).unwrap().replace("\"failed\": 0", "\"failed\": 1"))
        .unwrap();
    let (code, stdout, stderr) = stage("generate", folder.path(), &["--items", "1", "--force"]);
    assert!(code == 0 && stdout.contains("generate shard 1 of 3  done"), "{stdout} {stderr}");
    assert_eq!([written(0), written(2)], before);
    assert_eq!(stage("generate", folder.path(), &["--commit"]).0, 0);
    assert_eq!(hashes(folder.path(), &["recordings"]), hashes(smoke::whole(), &["recordings"]));
}

#[test]
fn a_commit_does_no_work_names_what_is_missing_and_waits_for_it() {
    let folder = smoke::copy_to("tasks");
    assert_eq!(stage("generate", folder.path(), &["--items", "1"]).0, 0);
    let (code, stdout, stderr) = stage("generate", folder.path(), &["--commit"]);
    assert_eq!(code, 1);
    assert!(stdout.contains("2 of 3 items missing: 0,2"), "{stdout}");
    assert!(stderr.contains("generate: 2 items are missing: 0,2"), "{stderr}");
    assert_eq!(json("generate", folder.path(), &["--commit"])[0]["missing"], serde_json::json!([0, 2]));
    let waiting = start("generate", folder.path(), &["--commit", "--wait", "60"]);
    assert_eq!(stage("generate", folder.path(), &["--items", "0,2"]).0, 0);
    check_all_succeed(vec![waiting]);
    assert_eq!(hashes(folder.path(), &["recordings"]), hashes(smoke::whole(), &["recordings"]));
}

#[test]
fn a_model_and_a_suite_are_items_that_need_their_own_inputs_alone() {
    let folder = smoke::copy_to("convert");
    let two = changed(folder.path(), "variant = \"ntp\"", "variant = \"ntp\"\nseeds = [0, 1]");
    let out = folder.path().to_string_lossy();
    let run = |command: &str, items: &str| run(&[command, &two, "--out", out.as_ref(), "--items", items]);
    assert_eq!(run("rollout", "0").0, 0, "the oracle needs no model");
    let (code, stdout, _) = run("rollout", "2");
    assert!(code == 1, "{stdout}");
    assert_eq!(run("train", "0").0, 0);
    assert!(folder.path().join("models/ntp-seed0/manifest.json").is_file());
    assert!(!folder.path().join("models/ntp-seed1").exists(), "another model was begun");
    assert_eq!(run("rollout", "1").0, 0, "its own model is there");
    let parts = ["models/ntp-seed0", "rollouts/oracle", "rollouts/ntp-seed0-mss"];
    assert_eq!(hashes(folder.path(), &parts), hashes(smoke::whole(), &parts));
}

#[test]
fn every_stage_done_by_items_has_the_bytes_of_a_run() {
    let folder = smoke::copy_to("tasks");
    for command in ["generate", "convert", "train", "rollout", "report"] {
        let (code, _, stderr) = stage(command, folder.path(), &["--part", "0/1"]);
        assert_eq!(code, 0, "{command}: {stderr}");
        let (code, _, stderr) = stage(command, folder.path(), &["--commit"]);
        assert_eq!(code, 0, "{command}: {stderr}");
    }
    assert_eq!(hashes(folder.path(), &ALL), hashes(smoke::whole(), &ALL));
    let (_, stdout, _) = stage("run", folder.path(), &["--dry-run"]);
    assert!(stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
}

#[test]
fn items_that_are_not_there_are_refused_with_those_that_are() {
    let folder = smoke::copy_to("tasks");
    for (more, expected) in [
        (["--items", "0-3"], "--items: is 0-3; generate has items 0 to 2"),
        (["--items", "9-1"], "is no list of items"),
        (["--part", "1"], "written as T/N"),
        (["--part", "0/0"], "written as T/N"),
        (["--shard", "3"], "--shard: is 3; generate has shards 0 to 2"),
    ] {
        let (code, _, stderr) = stage("generate", folder.path(), &more);
        assert_eq!(code, 2, "{more:?}: {stderr}");
        assert!(stderr.contains(expected), "{more:?}: {stderr}");
    }
    let (code, _, stderr) = stage("run", folder.path(), &["--items", "0"]);
    assert!(code == 2 && stderr.contains("--items: is of one stage"), "{stderr}");
    assert!(!folder.path().join("recordings").exists(), "something was written");
}

#[test]
fn a_shard_beyond_the_end_of_a_suite_is_nothing_to_do_there() {
    let folder = smoke::copy_to("train");
    let more = "episodes = 4\n[[rollout.suites]]\nname = \"longer\"\nsplit = \"unseen\"\nepisodes = 26";
    let pipeline = changed(folder.path(), "episodes = 4\n", &format!("{more}\n"));
    let out = folder.path().to_string_lossy();
    let (code, stdout, stderr) = run(&["rollout", &pipeline, "--out", out.as_ref(), "--shard", "1", "--json"]);
    assert_eq!(code, 0, "{stderr}");
    let reports: Value = serde_json::from_str(&stdout).unwrap();
    let units: Vec<&str> = reports.as_array().unwrap().iter().map(|report| report["unit"].as_str().unwrap()).collect();
    assert_eq!(units, ["rollout oracle longer", "rollout ntp-seed0-mss longer"]);
}

#[test]
fn a_failing_item_is_named_and_keeps_no_other_from_being_done() {
    let folder = smoke::copy_to("tasks");
    let poison = folder.path().join("recordings/shard-00001-of-00003.mcap/taken");
    std::fs::create_dir_all(&poison).unwrap();
    let (code, stdout, stderr) = stage("generate", folder.path(), &["--items", "0-2"]);
    assert_eq!(code, 1);
    assert!(stderr.contains("generate: 1 item failed: 1"), "{stderr}");
    assert!(stdout.contains("shard 1 of 3  failed") && stdout.contains("shard-00001-of-00003.mcap"), "{stdout}");
    let failed = json("items", folder.path(), &["--stage", "generate", "--left"]);
    assert_eq!((failed.as_array().unwrap().len(), &failed[0]["state"]), (1, &"failed".into()));
    assert_eq!((&failed[0]["item"], &failed[0]["failure"]["attempts"]), (&1.into(), &1.into()));
    std::fs::remove_dir_all(poison.parent().unwrap()).unwrap();
    assert_eq!(stage("generate", folder.path(), &["--items", "0-2"]).0, 0);
    assert_eq!(stage("generate", folder.path(), &["--commit"]).0, 0);
    assert_eq!(hashes(folder.path(), &["recordings"]), hashes(smoke::whole(), &["recordings"]));
    assert!(json("items", folder.path(), &["--stage", "generate", "--left"]).as_array().unwrap().is_empty());
}

#[test]
fn what_items_took_is_in_the_report_and_what_was_not_measured_is_not_zero() {
    let folder = smoke::copy_to("tasks");
    let costs = folder.path().join("costs.json");
    let mut noted: Value = serde_json::from_slice(&std::fs::read(&costs).unwrap()).unwrap();
    noted["units"].as_object_mut().unwrap().retain(|unit, _| unit == "tasks");
    std::fs::write(&costs, noted.to_string()).unwrap();
    for command in ["generate", "convert", "train", "rollout"] {
        assert_eq!(stage(command, folder.path(), &["--part", "0/1"]).0, 0);
        assert_eq!(stage(command, folder.path(), &["--commit"]).0, 0);
    }
    let costs = || {
        let report = json("report", folder.path(), &["--force"]);
        let costs = report["costs"].as_array().unwrap().clone();
        costs
            .iter()
            .map(|cost| (cost["stage"].as_str().unwrap().to_owned(), cost["cpu_secs"].as_f64()))
            .collect::<Vec<_>>()
    };
    assert!(costs().iter().all(|(_, secs)| secs.is_some_and(|secs| secs > 0.0)), "{:?}", costs());
    assert_eq!(costs().len(), 5);
    std::fs::remove_dir_all(folder.path().join("costs/generate")).unwrap();
    let of = |stage: &str| costs().into_iter().find(|(name, _)| name == stage).unwrap().1;
    assert_eq!(of("generate"), None);
    assert!(of("train") > Some(0.0));
    let page = std::fs::read_to_string(folder.path().join("report/report.md")).unwrap();
    assert!(page.contains("- CPU-minutes"), "{page}");
}

#[test]
fn a_run_that_was_killed_in_its_items_is_carried_on_by_others() {
    let folder = smoke::copy_to("convert");
    let mut n_killed = 0;
    for (command, n_items) in [("train", 1), ("rollout", 2)] {
        for kill in 0..3 {
            let child = start(command, folder.path(), &["--part", "0/1"]);
            let wait = smoke::lasted().mul_f64(0.03 * f64::from(kill + 1));
            n_killed += usize::from(killed_after(child, wait));
        }
        check_all_succeed(
            (0..n_items).map(|item| start(command, folder.path(), &["--items", &item.to_string()])).collect(),
        );
        assert_eq!(stage(command, folder.path(), &["--commit"]).0, 0);
    }
    assert!(n_killed > 0, "none was running when it was killed");
    assert_eq!(hashes(folder.path(), &ALL), hashes(smoke::whole(), &ALL));
}

#[test]
fn a_submitted_run_ends_as_a_run_and_submitting_again_does_what_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a run");
    std::fs::create_dir_all(out.join("recordings/shard-00001-of-00003.mcap/taken")).unwrap();
    let submit = |more: &[&str]| stage("submit", &out, &[&["--engine", "local", "--per-task", "1"], more].concat());
    let path = out.to_string_lossy().into_owned();
    let (code, stdout, stderr) = submit(&["--dry-run"]);
    assert!(code == 0 && stdout.contains("generate: 3 items left, in 3 tasks"), "{stdout} {stderr}");
    assert!(!out.join("tasks").exists(), "something was done");
    let (code, _, stderr) = submit(&[]);
    assert_eq!(code, 1, "{stderr}");
    let (code, stdout, stderr) = run(&["status", &path]);
    assert_eq!(code, 3, "{stderr}");
    assert!(stdout.contains("generate: 2 of 3 items done, 1 failed"), "{stdout}");
    assert!(stdout.contains("item 1 of generate failed 1 time") && stdout.contains("logs/generate-1.log"), "{stdout}");
    assert!(stdout.contains("train: 0 of 1 item done, 1 left: 0"), "{stdout}");
    std::fs::remove_dir_all(out.join("recordings/shard-00001-of-00003.mcap")).unwrap();
    let (code, stdout, stderr) = submit(&[]);
    assert!(code == 0 && stdout.contains("generate: 1 item left, in 1 task"), "{stdout} {stderr}");
    assert_eq!(hashes(&out, &ALL), hashes(smoke::whole(), &ALL));
    let (code, stdout, _) = run(&["status", &path]);
    assert!(code == 0 && stdout.contains("report: 1 of 1 item done"), "{stdout}");
    let (code, stdout, _) = submit(&[]);
    assert!(code == 0 && stdout.contains("nothing is left to do"), "{stdout}");
    let other = changed(folder.path(), "steps = 6", "steps = 7");
    let again = ["submit", &other, "--out", &path, "--engine", "local"];
    let (code, _, stderr) = run(&again);
    assert!(code == 2 && stderr.contains("was made with another pipeline; once none"), "{stderr}");
    assert_eq!(run(&["status", &folder.path().to_string_lossy()]).0, 1);
}

#[test]
fn a_submitted_run_that_is_told_to_stop_tells_its_tasks_and_is_carried_on() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let pipeline = changed(folder.path(), "steps = 6", "steps = 100000");
    let words = ["submit", &pipeline, "--out", &out.to_string_lossy(), "--engine", "local"];
    let mut child = ntp(&words).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let training = out.join("models/ntp-seed0/plan.json");
    while !training.exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was stopped");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let told = std::process::Command::new("kill").arg(child.id().to_string()).status().unwrap();
    assert!(told.success());
    let ended = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.code() == Some(130) && stderr.contains("tasks were told to end"), "{stderr}");
    let copy = out.join("submit/ntp");
    let is_running = |process: std::path::PathBuf| std::fs::read_link(process.join("exe")).is_ok_and(|exe| exe == copy);
    let processes = std::fs::read_dir("/proc").unwrap().flatten().map(|process| process.path());
    assert_eq!(processes.filter(|process| is_running(process.clone())).count(), 0, "a task goes on");
    let (code, stdout, _) = run(&["status", &out.to_string_lossy()]);
    assert!(code == 3 && stdout.contains("train: 0 of 1 item done, 1 left: 0"), "{stdout}");
}

#[test]
fn twins_of_a_training_leave_a_model_and_nothing_else() {
    let folder = smoke::copy_to("convert");
    check_all_succeed((0..3).map(|_| start("train", folder.path(), &["--items", "0"])).collect());
    assert!(!folder.path().join("models/ntp-seed0/checkpoint").exists());
    assert_eq!(hashes(folder.path(), &["models"]), hashes(smoke::whole(), &["models"]));
}

#[test]
fn a_study_is_submitted_as_a_chain_for_each_experiment_and_a_report_of_all() {
    let folder = tempfile::tempdir().unwrap();
    let smoke = std::fs::read_to_string(repository().join(PIPELINE)).unwrap();
    std::fs::create_dir(folder.path().join("below")).unwrap();
    for (name, place) in [("one", "one.toml"), ("two", "below/two.toml")] {
        std::fs::write(folder.path().join(place), smoke.replace("\"smoke\"", &format!("\"{name}\""))).unwrap();
    }
    let study = folder.path().join("pair.toml");
    std::fs::write(&study, "name = \"pair\"\nexperiments = [\"one.toml\", \"below/two.toml\"]\n").unwrap();
    let (study, out) = (study.to_string_lossy(), folder.path().join("run"));
    let path = out.to_string_lossy();
    let (code, _, stderr) = run(&["submit", &study, "--out", &path, "--engine", "local"]);
    assert_eq!(code, 0, "{stderr}");
    for name in ["one", "two"] {
        assert_eq!(hashes(&out.join(name), &["dataset"]).len(), hashes(smoke::whole(), &["dataset"]).len());
    }
    assert!(out.join("report/index.html").is_file());
    let (code, stdout, _) = run(&["status", &path]);
    assert!(code == 0 && stdout.contains("two: rollout: 2 of 2 items done"), "{stdout}");
}

#[test]
fn arrays_for_slurm_are_written_with_what_waits_for_what() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    let more = ["--engine", "slurm", "--dry-run", "--max-running", "8", "--sbatch-arg=--partition=long queue"];
    let (code, _, stderr) = stage("submit", &out, &more);
    assert_eq!(code, 0, "{stderr}");
    let script = std::fs::read_to_string(out.join("submit/submit.sh")).unwrap();
    for words in [
        "running=8",
        "arguments=('--partition=long queue')",
        "--kill-on-invalid-dep=yes",
        "items \"$folder\" \"$pipeline\" train",
    ] {
        assert!(script.contains(words), "{words} is missing in {script}");
    }
    let checked = std::process::Command::new("bash").arg("-n").arg(out.join("submit/submit.sh")).status().unwrap();
    assert!(checked.success());
    assert_eq!(std::fs::read_to_string(out.join("submit/items/generate")).unwrap(), "0-2\n");
}

/// A hundred thousand shards are listed from the pipeline file alone.
#[test]
fn a_hundred_thousand_items_are_listed() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(repository().join(PIPELINE)).unwrap();
    let path = folder.path().join("large.toml");
    std::fs::write(
        &path,
        text.replace("trials_per_task = 3", "trials_per_task = 100000").replace("per_shard = 4", "per_shard = 3"),
    )
    .unwrap();
    let listed =
        items(&Pipeline::load(&path).unwrap(), &RunDir::new(folder.path().join("run")), Stage::Generate).unwrap();
    assert_eq!(listed.len(), 100_000);
    assert_eq!((listed[99_999].item, listed[99_999].shard, listed[99_999].amount), (99_999, 99_999, 3));
}
