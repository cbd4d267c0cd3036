//! Runs as a whole: the shortest pipeline through every stage, and what happens when a run is broken off.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use ntp::artifact::{Plan, sha256_file};
use ntp::pipeline::{Pipeline, PipelineError, PipelineFile, RunDir};

use crate::killing::killed_after;
use crate::smoke;

pub(crate) fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub(crate) fn ntp(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ntp"));
    command.args(arguments).current_dir(repository()).stdin(Stdio::null());
    command
}

/// Runs to the end and gives exit code, stdout and stderr.
pub(crate) fn run(arguments: &[&str]) -> (i32, String, String) {
    let output = ntp(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

fn run_smoke(out: &Path, more: &[&str]) -> (i32, String, String) {
    let out = out.to_string_lossy();
    run(&[&["run", smoke::PIPELINE, "--out", out.as_ref()], more].concat())
}

/// Every file below the folders of a run, with its hash, in order.
pub(crate) fn hashes(run: &Path, folders: &[&str]) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut waiting: Vec<PathBuf> = folders.iter().map(|folder| run.join(folder)).collect();
    while let Some(folder) = waiting.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                let name = path.strip_prefix(run).unwrap().to_string_lossy().into_owned();
                found.push((name, sha256_file(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

/// Every folder whose bytes are a function of the pipeline file; the report also tells what the run took.
pub(crate) const ALL: [&str; 5] = ["tasks", "recordings", "dataset", "models", "rollouts"];

#[test]
fn a_second_run_finds_every_stage_up_to_date_and_changes_no_byte() {
    let folder = smoke::copy_to("report");
    let (code, stdout, _) = run_smoke(folder.path(), &[]);
    assert_eq!(code, 0);
    assert_eq!(stdout.lines().count(), 7, "{stdout}");
    assert!(stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
    assert_eq!(hashes(folder.path(), &ALL), hashes(smoke::whole(), &ALL));
}

#[test]
fn one_job_and_two_give_the_same_bytes_in_every_stage() {
    let one = tempfile::tempdir().unwrap();
    assert_eq!(run_smoke(one.path(), &["--jobs", "1"]).0, 0);
    assert_eq!(hashes(one.path(), &ALL), hashes(smoke::whole(), &ALL));
}

#[test]
fn a_run_killed_at_any_moment_carries_on_to_the_same_bytes() {
    let wanted = hashes(smoke::whole(), &ALL);
    let mut n_killed = 0;
    for share in [0.05, 0.15, 0.3, 0.45, 0.6, 0.8] {
        let broken = tempfile::tempdir().unwrap();
        let out = broken.path().to_string_lossy();
        let child = ntp(&["run", smoke::PIPELINE, "--out", out.as_ref()])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        n_killed += usize::from(killed_after(child, smoke::lasted().mul_f64(share)));
        let (code, _, stderr) = run_smoke(broken.path(), &[]);
        assert_eq!(code, 0, "killed after {share} of its time: {stderr}");
        let found = hashes(broken.path(), &ALL);
        let differing: Vec<_> = found.iter().filter(|file| !wanted.contains(file)).collect();
        assert!(differing.is_empty(), "killed after {share} of its time: {differing:?}");
        assert_eq!(found.len(), wanted.len(), "killed after {share} of its time");
    }
    assert!(n_killed >= 2, "{n_killed} of 6 were running when they were killed");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_says_so_exits_with_130_and_carries_on_to_the_same_bytes() {
    for signal in ["-INT", "-TERM"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().to_string_lossy();
        let mut command = ntp(&["run", smoke::PIPELINE, "--out", out.as_ref()]);
        let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        while !folder.path().join("recordings/plan.json").exists() {
            std::thread::sleep(Duration::from_millis(2));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(130), "{stderr}");
        assert!(stderr.contains("interrupted; the same command carries on"), "{stderr}");
        assert_eq!(run_smoke(folder.path(), &[]).0, 0);
        assert_eq!(hashes(folder.path(), &ALL), hashes(smoke::whole(), &ALL));
    }
}

#[test]
fn force_does_again_what_is_up_to_date_and_nothing_else() {
    let folder = smoke::copy_to("report");
    std::fs::write(folder.path().join("rollouts/oracle/stacking_unseen/left-behind"), "").unwrap();
    let (code, stdout, stderr) = run_smoke(folder.path(), &["--from", "rollout", "--to", "rollout", "--force"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.lines().count() == 2 && stdout.lines().all(|line| line.contains("--force")), "{stdout}");
    assert_eq!(hashes(folder.path(), &ALL), hashes(smoke::whole(), &ALL));
}

#[test]
fn stages_in_the_wrong_order_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (code, _, stderr) = run_smoke(&folder.path().join("run"), &["--from", "report", "--to", "tasks"]);
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.contains("--from") && stderr.contains("report, which comes after --to tasks"), "{stderr}");
    assert!(!folder.path().join("run").exists(), "something was written");
}

#[test]
fn a_shard_of_what_has_none_is_refused_with_the_stages_that_have_shards() {
    let folder = smoke::copy_to("report");
    let before = hashes(folder.path(), &ALL);
    let out = folder.path().to_string_lossy();
    for command in ["run", "convert", "train", "report"] {
        let (code, _, stderr) = run(&[command, smoke::PIPELINE, "--out", out.as_ref(), "--shard", "0"]);
        assert_eq!(code, 2, "{command}: {stderr}");
        assert!(stderr.contains("stages with shards are generate, rollout"), "{command}: {stderr}");
    }
    assert_eq!(run(&["tasks", smoke::PIPELINE, "--out", out.as_ref(), "--shard", "0"]).0, 2);
    assert_eq!(hashes(folder.path(), &ALL), before);
}

#[test]
fn what_an_earlier_release_made_is_up_to_date_and_what_another_stage_version_made_is_not() {
    let folder = smoke::copy_to("report");
    let edit = |stage: &str, from: &str, to: &str| {
        let path = folder.path().join(stage).join("plan.json");
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{text}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    };
    let own = format!("\"ntp_version\": \"{}\"", env!("CARGO_PKG_VERSION"));
    for stage in ["tasks", "recordings", "dataset", "models/ntp-seed0", "rollouts/oracle/stacking_unseen"] {
        edit(stage, &own, "\"ntp_version\": \"0.0.9\"");
    }
    let (code, stdout, stderr) = run_smoke(folder.path(), &["--dry-run"]);
    assert!(code == 0 && stderr.contains("nothing is left to do"), "{stdout} {stderr}");
    edit("models/ntp-seed0", "\"ntp_version\"", "\"stage_version\": 9,\n  \"ntp_version\"");
    let (_, stdout, stderr) = run_smoke(folder.path(), &["--dry-run"]);
    assert!(stderr.contains("left: train 1 of 1"), "{stderr}");
    assert!(stdout.contains("made by version 9 of train, this is 1"), "{stdout}");
}

#[test]
fn settings_that_json_moves_by_their_last_bit_are_up_to_date_in_a_second_run() {
    let folder = tempfile::tempdir().unwrap();
    let pipeline = folder.path().join("adversary.toml");
    let smoke = std::fs::read_to_string(repository().join(smoke::PIPELINE)).unwrap();
    let adversary = "episodes = 4\nadversary = { probability = 0.25, impulse_ns = 0.03 }";
    std::fs::write(&pipeline, smoke.replace("episodes = 4", adversary)).unwrap();
    let (path, out) = (pipeline.to_string_lossy(), folder.path().join("run"));
    let arguments = ["run", path.as_ref(), "--out", &out.to_string_lossy()];
    assert_eq!(run(&arguments).0, 0);
    let (code, stdout, _) = run(&arguments);
    assert!(code == 0 && stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
}

#[test]
fn the_plans_of_every_shipped_pipeline_survive_their_own_json() {
    let mut n_plans = 0;
    for path in shipped() {
        let file = PipelineFile::load(&path).unwrap();
        for (pipeline, _) in file.experiments(&RunDir::new("")) {
            for plan in ntp::pipeline::plans(pipeline) {
                let read: Plan = serde_json::from_str(&serde_json::to_string_pretty(&plan).unwrap()).unwrap();
                assert_eq!(read, plan, "{}", path.display());
                assert_eq!(read.id(), plan.id(), "{}", path.display());
                n_plans += 1;
            }
        }
    }
    assert!(n_plans > 100, "{n_plans}");
}

#[test]
fn a_second_run_on_the_same_directory_says_so_and_stops() {
    let folder = tempfile::tempdir().unwrap();
    let _lock = ntp::artifact::RunLock::take(folder.path()).unwrap();
    let (code, _, stderr) = run_smoke(folder.path(), &[]);
    assert_eq!(code, 1);
    assert!(stderr.contains("another ntp command is writing"), "{stderr}");
}

#[test]
fn shards_done_one_by_one_are_committed_by_the_stage() {
    let by_shard = smoke::copy_to("tasks");
    let out = by_shard.path().to_string_lossy();
    for shard in ["2", "0", "1"] {
        let arguments = ["generate", "pipelines/smoke.toml", "--out", out.as_ref(), "--shard", shard];
        assert_eq!(run(&arguments).0, 0);
    }
    assert_eq!(run(&["generate", "pipelines/smoke.toml", "--out", out.as_ref()]).0, 0);
    assert_eq!(hashes(smoke::whole(), &["recordings"]), hashes(by_shard.path(), &["recordings"]));
}

#[test]
fn a_shard_that_does_not_exist_is_refused_with_those_that_do() {
    let folder = smoke::copy_to("tasks");
    let out = folder.path().to_string_lossy();
    let (code, _, stderr) = run(&["generate", "pipelines/smoke.toml", "--out", out.as_ref(), "--shard", "3"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("generate has shards 0 to 2"), "{stderr}");
}

#[test]
fn a_model_of_another_family_or_variant_is_refused_with_its_path_and_what_is_asked_for() {
    let folder = smoke::copy_to("train");
    let config = folder.path().join("models/ntp-seed0/config.json");
    let text = std::fs::read_to_string(&config).unwrap();
    let manifest = folder.path().join("models/ntp-seed0/manifest.json");
    let told = std::fs::read_to_string(&manifest).unwrap();
    let hash_before = sha256_file(&config).unwrap();
    for (own, other, expected) in [
        ("\"block_stacking\"", "\"object_sorting\"", "model is for family object_sorting, but block_stacking is"),
        ("\"variant\": \"ntp\"", "\"variant\":\"flat\"", "model is for variant flat, but ntp is asked for"),
    ] {
        let changed = text.replacen(own, other, 1);
        assert!(changed.len() == text.len() && changed != text, "{own} in {text}");
        std::fs::write(&config, changed).unwrap();
        // As if it had been made so: what is not as its manifest says is not even looked at.
        std::fs::write(&manifest, told.replace(&hash_before, &sha256_file(&config).unwrap())).unwrap();
        let (code, _, stderr) = run_smoke(folder.path(), &[]);
        assert_eq!(code, 1);
        assert!(stderr.contains("models/ntp-seed0/config.json") && stderr.contains(expected), "{stderr}");
    }
}

#[test]
fn a_changed_setting_redoes_its_stage_and_says_which_setting() {
    let folder = smoke::copy_to("report");
    let changed =
        std::fs::read_to_string(repository().join("pipelines/smoke.toml")).unwrap().replace("steps = 6", "steps = 7");
    let pipeline = folder.path().join("changed.toml");
    std::fs::write(&pipeline, changed).unwrap();
    let (path, out) = (pipeline.to_string_lossy(), folder.path().to_string_lossy());
    let (code, stdout, stderr) = run(&["run", path.as_ref(), "--out", out.as_ref(), "--dry-run"]);
    assert_eq!(code, 0);
    assert!(stderr.contains("left: train 1 of 1"), "{stderr}");
    let line = |start: &str| stdout.lines().find(|line| line.starts_with(start)).unwrap_or_default().to_owned();
    assert!(line("convert").contains("up to date"), "{stdout}");
    assert!(line("train").contains("its setting training changed"), "{stdout}");
    // What is made of it is to do as well, though its own plan still fits what lies there.
    assert!(line("rollout ntp").contains("train comes first"), "{stdout}");
    assert!(line("rollout oracle").contains("up to date"), "{stdout}");
    assert!(line("report").contains("rollout comes first"), "{stdout}");
}

#[test]
fn a_model_that_begins_with_another_is_made_after_it_and_again_when_that_one_changes() {
    let folder = smoke::copy_to("convert");
    let smoke = std::fs::read_to_string(repository().join("pipelines/smoke.toml")).unwrap();
    let further = |first: u32, start: &str| {
        let model = format!(
            "[[models]]\nvariant = \"ntp\"\ntag = \"further\"\n[models.training]\nsteps = 2\nstart_from = \"{start}\"\n\n\
             [rollout]"
        );
        smoke.replace("steps = 6", &format!("steps = {first}")).replace("[rollout]", &model)
    };
    let pipeline = folder.path().join("further.toml");
    let (path, out) = (pipeline.to_string_lossy(), folder.path().to_string_lossy());
    let train = |text: String, more: &[&str]| {
        std::fs::write(&pipeline, text).unwrap();
        run(&[&["run", path.as_ref(), "--out", out.as_ref(), "--to", "train"], more].concat())
    };
    let (code, _, stderr) = train(further(6, "models/ntp-seed0"), &[]);
    assert_eq!(code, 0, "{stderr}");
    let (_, stdout, _) = train(further(6, "models/../models/./ntp-seed0"), &["--dry-run"]);
    assert!(stdout.contains("its setting training changed"), "{stdout}");
    let (_, stdout, _) = train(further(6, "models/ntp-seed0"), &["--dry-run"]);
    assert!(stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
    let (_, stdout, _) = train(further(7, "models/ntp-seed0"), &["--dry-run"]);
    let line = |start: &str| stdout.lines().find(|line| line.starts_with(start)).unwrap_or_default();
    assert!(line("train ntp-further").contains("train comes first"), "{stdout}");
    let (code, _, stderr) = train(further(6, "models/ntp-seed9"), &[]);
    assert_eq!(code, 1);
    assert!(stderr.contains("models/ntp-seed9") && stderr.contains("not finished"), "{stderr}");
}

#[test]
fn nothing_is_made_of_a_file_with_a_flipped_bit() {
    let folder = smoke::copy_to("report");
    let out = folder.path().to_string_lossy();
    let before = hashes(folder.path(), &ALL);
    for (stage, file) in [
        ("generate", "tasks/tasks.json"),
        ("convert", "recordings/shard-00001-of-00003.mcap"),
        ("train", "dataset/data/chunk-000/file-000.parquet"),
        ("rollout", "models/ntp-seed0/model.safetensors"),
        ("report", "rollouts/ntp-seed0-mss/stacking_unseen/rollouts.parquet"),
    ] {
        let path = folder.path().join(file);
        let bytes = std::fs::read(&path).unwrap();
        let mut damaged = bytes.clone();
        damaged[bytes.len() / 2] ^= 0x10;
        std::fs::write(&path, damaged).unwrap();
        let (code, _, stderr) = run(&[stage, smoke::PIPELINE, "--out", out.as_ref(), "--force"]);
        assert_eq!(code, 1, "{stage}: {stderr}");
        assert!(stderr.contains(file) && stderr.contains("its manifest says"), "{stage}: {stderr}");
        std::fs::write(&path, bytes).unwrap();
        assert_eq!(hashes(folder.path(), &ALL), before, "{stage}");
    }
}

#[test]
fn a_recording_that_was_cut_off_is_made_again() {
    let folder = smoke::copy_to("convert");
    let before = hashes(folder.path(), &["recordings", "dataset"]);
    let recording = folder.path().join("recordings/shard-00001-of-00003.mcap");
    let bytes = std::fs::read(&recording).unwrap();
    std::fs::write(&recording, &bytes[..bytes.len() / 2]).unwrap();
    let (code, stdout, stderr) = run_smoke(folder.path(), &["--to", "convert"]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("its manifest says"), "{stdout}");
    assert_eq!(hashes(folder.path(), &["recordings", "dataset"]), before);
}

#[test]
fn validate_names_a_flipped_byte() {
    let folder = smoke::copy_to("convert");
    let out = folder.path().to_string_lossy();
    let (code, stdout, _) = run(&["validate", out.as_ref()]);
    assert_eq!(code, 0, "{stdout}");
    let recording = folder.path().join("recordings/shard-00001-of-00003.mcap");
    let mut bytes = std::fs::read(&recording).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    std::fs::write(&recording, bytes).unwrap();
    let (code, stdout, _) = run(&["validate", out.as_ref()]);
    assert_eq!(code, 1);
    assert!(stdout.contains("MANIFEST") && stdout.contains("shard-00001-of-00003.mcap"), "{stdout}");
}

#[test]
fn an_episode_simulated_again_is_the_same_in_every_frame() {
    for part in ["recordings", "rollouts/oracle/stacking_unseen", "rollouts/ntp-seed0-mss/stacking_unseen"] {
        let path = smoke::whole().join(part);
        let (code, stdout, stderr) = run(&["replay", path.to_string_lossy().as_ref(), "--episode", "1", "--verify"]);
        assert_eq!(code, 0, "{part}: {stdout} {stderr}");
        assert!(stdout.contains("episode 1 simulated again: the same in"), "{stdout}");
    }
    let recorded = smoke::whole().join("recordings");
    let (code, stdout, _) = run(&["replay", &recorded.to_string_lossy(), "--episode", "0,2", "--verify", "--json"]);
    let verified: serde_json::Value = serde_json::from_str(&stdout).expect("one document, however many episodes");
    let told = |episode: &serde_json::Value| {
        (episode["episode"].as_u64().unwrap(), episode["result"].as_str().unwrap().to_owned())
    };
    let told: Vec<_> = verified["episodes"].as_array().unwrap().iter().map(told).collect();
    assert_eq!((code, told), (0, vec![(0, "same".to_owned()), (2, "same".to_owned())]));
}

/// Every pipeline file of the repository.
fn shipped() -> Vec<PathBuf> {
    let (mut files, mut folders) = (Vec::new(), vec![repository().join("pipelines")]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "toml") {
                files.push(path);
            }
        }
    }
    files
}

#[test]
fn every_shipped_pipeline_can_be_loaded() {
    for path in shipped() {
        PipelineFile::load(&path).unwrap();
    }
}

pub(crate) fn check_refused(change: impl Fn(&str) -> String, key: &str, allowed: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.toml");
    let text = std::fs::read_to_string(repository().join("pipelines/smoke.toml")).unwrap();
    let changed = change(&text);
    assert_ne!(changed, text);
    std::fs::write(&path, changed).unwrap();
    let error = Pipeline::load(&path).unwrap_err();
    assert!(error.is_usage());
    let message = error.to_string();
    for part in ["wrong.toml", key, allowed] {
        assert!(message.contains(part), "{message} does not say {part}");
    }
    let out = folder.path().join("out");
    let arguments = ["run", &path.to_string_lossy(), "--out", &out.to_string_lossy()];
    assert_eq!(run(&arguments).0, 2);
    assert!(!out.exists(), "something was written");
}

#[test]
fn a_wrong_pipeline_file_names_file_key_and_what_is_allowed_and_writes_nothing() {
    check_refused(|text| text.replace("[generate]", "[generate]\ncolour = 1"), "colour", "trials_per_task");
    check_refused(|text| text.replace("train = 3", "train = \"three\""), "train", "u32");
    check_refused(|text| text.replace("train = 3", "train = 0"), "tasks.train", "at least 1");
    check_refused(|text| text.replace("block_stacking", "block_stackin"), "block_stackin", "object_sorting");
    check_refused(|text| text.replace("variant = \"ntp\"", "variant = \"npt\""), "npt", "ntp_paper");
    check_refused(|text| text.replace("unseen = 4", "unseen = 4\nimport = \"no.json\""), "tasks.import", "no.json");
    check_refused(|text| text.replace("steps = 6", "steps = 0"), "training", "at least 1");
    check_refused(|text| text.replace("split = \"unseen\"", "split = \"unknown\""), "unknown", "seen");
    check_refused(|text| text.replace("name = \"smoke\"", "name = \"a/b\""), "name", "letters");
    let model = |more: &'static str| move |text: &str| text.replace("\"ntp\"\n", &format!("\"ntp\"\n{more}\n"));
    check_refused(model("decoders = []"), "models[0].decoders", "argmax, mss, am");
    check_refused(model("decoders = [\"mss\", \"mss\"]"), "models[0].decoders", "mss is there twice");
    check_refused(model("tag = \"a b\""), "models[0].tag", "letters");
    check_refused(model("suites = [\"stacking\"]"), "models[0].suites", "there are stacking_unseen");
    let tasks = |more: &'static str| move |text: &str| text.replace("unseen = 4", &format!("unseen = 4\n{more}"));
    check_refused(tasks("blocks = 9"), "tasks.blocks", "2 to 8");
    check_refused(tasks("blocks = 2"), "tasks.train", "block_stacking with 2 blocks has at most 2 training tasks");
    let counts = "episodes = 4\non_table = { min = 1, max = 2 }";
    check_refused(|text| text.replace("episodes = 4\n", &format!("{counts}\n")), "on_table", "no categories");
}

#[test]
fn a_suite_that_asks_for_more_than_the_table_holds_is_refused_with_what_is_allowed() {
    let cleanup = |text: &str, suite: &str| {
        let text = text.replace("block_stacking", "table_cleanup");
        text.replace("episodes = 4\n", &format!("episodes = 4\n{suite}\n"))
    };
    check_refused(|text| cleanup(text, "bowls = 5"), "rollout.suites[0].bowls", "allowed is 1 to 4");
    let forks = "on_table = { min = 1, max = 21 }";
    check_refused(|text| cleanup(text, forks), "rollout.suites[0].on_table", "<= 20");
    check_refused(|text| cleanup(text, "").replace("train = 3", "train = 41"), "tasks.train", "at most 40");
    check_refused(|text| cleanup(text, "").replace("unseen = 4", "unseen = 25"), "tasks.unseen", "at most 24");
    let bowls = |text: &str| text.replace("episodes = 4\n", "episodes = 4\nbowls = 1\n");
    check_refused(bowls, "rollout.suites[0].bowls", "block_stacking has no bowls");
}

#[test]
fn settings_of_networks_and_noise_that_cannot_be_are_refused_with_what_is_allowed() {
    let training = |more: &'static str| move |text: &str| text.replace("steps = 6", &format!("steps = 6\n{more}"));
    check_refused(training("scope_kernel = 4"), "models[0].training", "scope_kernel is 4; allowed: odd numbers");
    check_refused(training("relations = true"), "models[0].training", "relations is on for variant ntp");
    check_refused(
        training("merge_aside_m = 0.2"),
        "models[0].training",
        "merge_aside_m is 0.2; allowed: from 0 to 0.1",
    );
    let model = |more: &'static str| {
        move |text: &str| text.replace("variant = \"ntp\"", "variant = \"ntp_vid_detector\"").replace("steps = 6", more)
    };
    let start = model("start_from = \"models/ntp-seed0\"");
    check_refused(start, "models[0].training", "start_from is set for variant ntp_vid_detector; allowed: variants");
    let maps = |text: &str| {
        let detector = "[models.training.detector]\nheat_maps = true\n\n[rollout]";
        text.replace("variant = \"ntp\"", "variant = \"ntp_vid_detector\"").replace("[rollout]", detector)
    };
    check_refused(
        maps,
        "models[0].training",
        "detector.heat_maps is on for variant ntp_vid_detector; allowed: on with ntp_vid",
    );
    let allowed = "noise.frame_m is -0.01; allowed: from 0 to 0.1";
    check_refused(training("noise = { frame_m = -0.01 }"), "models[0].training", allowed);
    let suite = |more: &'static str| move |text: &str| text.replace("episodes = 4", &format!("episodes = 4\n{more}"));
    let key = "rollout.suites[0].noise";
    check_refused(suite("noise = { offset_m = nan }"), key, "offset_m is NaN; allowed: from 0 to 0.1");
    check_refused(suite("noise = { frame_m = inf }"), key, "frame_m is inf; allowed: from 0 to 0.1");
    check_refused(suite("noise = { sigma = 0.1 }"), "sigma", "frame_m");
    let building = |blocks: &'static str| {
        move |text: &str| {
            text.replace("block_stacking", "tower_building").replace("unseen = 4", &format!("unseen = 4\n{blocks}"))
        }
    };
    check_refused(building("blocks = 17"), "tasks.blocks", "is 17; allowed is 2 to 16");
    let sorted = |text: &str| {
        let text = text.replace("block_stacking", "object_sorting").replace("train = 3", "train = 4");
        text.replace("episodes = 4", "episodes = 4\ntallest = 3")
    };
    check_refused(sorted, "rollout.suites[0].tallest", "builds no towers");
}

#[test]
fn a_pipeline_that_is_not_there_is_a_usage_error_with_its_path() {
    let error = Pipeline::load(Path::new("no/such.toml")).unwrap_err();
    assert!(matches!(error, PipelineError::Syntax { .. }));
    assert!(error.to_string().contains("no/such.toml"));
    assert_eq!(run(&["run", "no/such.toml"]).0, 2);
}

#[test]
fn the_committed_pipeline_schema_is_the_generated_one() {
    let path = repository().join("schemas/pipeline.schema.json");
    let schema = schemars::schema_for!(ntp::pipeline::PipelineSpec);
    let generated = format!("{}\n", serde_json::to_string_pretty(&schema).unwrap());
    if std::fs::read_to_string(&path).ok().as_ref() != Some(&generated) {
        std::fs::write(&path, &generated).unwrap();
        panic!("{} was stale and has been written anew: look at the change and commit it", path.display());
    }
}
