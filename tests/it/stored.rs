//! Runs in a store: machines that see no folder of each other. The store is a folder here; `tests/cluster/bucket.sh` does
//! the same with a server that speaks S3.

use std::path::PathBuf;
use std::process::{Child, Stdio};

use serde_json::Value;
use tempfile::TempDir;

use crate::killing::killed_after;
use crate::pipeline::{ALL, hashes, ntp, run};
use crate::smoke::{self, PIPELINE};

/// A store, and folders of machines that have nothing in common but that.
struct Machines {
    folder: TempDir,
}

impl Machines {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap() }
    }

    /// A store that holds the stages of the smoke run up to one.
    fn with(last: &str) -> Self {
        let machines = Self::new();
        for stage in ["tasks", "generate", "convert", "train", "rollout", "report"] {
            assert_eq!(machines.on("first", stage, &[]).0, 0, "{stage}");
            if stage == last {
                break;
            }
        }
        machines
    }

    fn store(&self) -> PathBuf {
        self.folder.path().join("store")
    }

    fn scratch(&self, machine: &str) -> PathBuf {
        self.folder.path().join(machine)
    }

    fn words(&self, machine: &str, command: &str, more: &[&str]) -> Vec<String> {
        let (store, scratch) = (self.store(), self.scratch(machine));
        let place = [command, PIPELINE, "--store", &store.to_string_lossy(), "--out", &scratch.to_string_lossy()]
            .map(str::to_owned);
        place.into_iter().chain(more.iter().map(|word| (*word).to_owned())).collect()
    }

    fn on(&self, machine: &str, command: &str, more: &[&str]) -> (i32, String, String) {
        let words = self.words(machine, command, more);
        run(&words.iter().map(String::as_str).collect::<Vec<_>>())
    }

    fn start(&self, machine: &str, command: &str, more: &[&str]) -> Child {
        let words = self.words(machine, command, more);
        let words: Vec<&str> = words.iter().map(String::as_str).chain(["--jobs", "1"]).collect();
        ntp(&words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }

    fn items(&self, stage: &str) -> Vec<Value> {
        let store = self.store();
        let (code, stdout, stderr) =
            run(&["items", PIPELINE, "--store", &store.to_string_lossy(), "--stage", stage, "--json"]);
        assert_eq!(code, 0, "{stderr}");
        serde_json::from_str(&stdout).unwrap()
    }

    /// What a machine that did nothing is brought of the store.
    fn fetched(&self) -> PathBuf {
        let (code, _, stderr) = self.on("reader", "run", &["--fetch"]);
        assert_eq!(code, 0, "{stderr}");
        self.scratch("reader")
    }
}

/// What ended well, by what it said.
fn ended(child: Child) -> String {
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn machines_that_share_a_store_alone_make_the_files_of_one_process() {
    let machines = Machines::new();
    let on = |machine: &str, command: &str, more: &[&str]| {
        let (code, stdout, stderr) = machines.on(machine, command, more);
        assert_eq!(code, 0, "{command} on {machine}: {stdout} {stderr}");
        stdout
    };
    on("a", "tasks", &[]);
    assert!(on("a", "generate", &["--begin"]).contains("begun"));
    for (machine, item) in [("a", "0"), ("b", "1"), ("c", "2"), ("b", "0")] {
        on(machine, "generate", &["--items", item]);
    }
    on("d", "generate", &["--commit"]);
    assert!(!machines.scratch("d").join("recordings/shard-00000-of-00003.mcap").exists(), "a commit moves no data");
    on("c", "convert", &["--items", "0"]);
    on("a", "train", &["--items", "0"]);
    on("b", "rollout", &["--items", "0"]);
    on("c", "rollout", &["--items", "1"]);
    on("d", "rollout", &["--commit"]);
    assert!(on("b", "report", &[]).contains("stacking_unseen"));
    let fetched = machines.fetched();
    assert_eq!(hashes(&fetched, &ALL[..5]), hashes(smoke::whole(), &ALL[..5]));
    let (code, _, stderr) = run(&["validate", &fetched.to_string_lossy()]);
    assert_eq!(code, 0, "{stderr}");
}

#[test]
fn a_whole_run_in_a_store_is_one_command_and_does_only_what_is_left() {
    let machines = Machines::new();
    let (code, stdout, stderr) = machines.on("a", "run", &[]);
    assert!(code == 0 && stdout.contains("train ntp-seed0  done"), "{stdout} {stderr}");
    let (code, stdout, _) = machines.on("b", "run", &[]);
    assert!(code == 0 && stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
    assert!(!machines.scratch("b").join("dataset/data").exists(), "what is up to date was brought");
    let (code, stdout, _) = machines.on("c", "run", &["--dry-run"]);
    assert!(code == 0 && !machines.scratch("c").exists(), "{stdout}");
    assert_eq!(hashes(&machines.fetched(), &ALL[..5]), hashes(smoke::whole(), &ALL[..5]));
}

#[test]
fn of_twins_one_is_first_and_the_other_succeeds() {
    let machines = Machines::with("tasks");
    let twins = ["a", "b", "c", "d"].map(|machine| machines.start(machine, "generate", &["--items", "1"]));
    let said = twins.map(ended);
    let firsts = said.iter().filter(|said| said.contains("shard 1 of 3  done")).count();
    let others = said.iter().filter(|said| said.contains("another process was first") || said.contains("up to date"));
    assert_eq!((firsts, others.count()), (1, 3), "{said:?}");
    let states: Vec<Value> = machines.items("generate").into_iter().map(|item| item["state"].clone()).collect();
    assert_eq!(states, ["left", "done", "left"]);
}

#[test]
fn an_item_that_is_killed_is_done_elsewhere_or_kept_when_it_is_carried_on() {
    let machines = Machines::with("tasks");
    let mut n_killed = 0;
    for kill in 0..4 {
        let child = machines.start("a", "generate", &["--part", "0/1"]);
        let wait = smoke::lasted().mul_f64(0.01 * f64::from(kill + 1));
        n_killed += usize::from(killed_after(child, wait));
    }
    assert!(n_killed > 0, "none was running when it was killed");
    for item in ["0", "1", "2"] {
        assert_eq!(machines.on(if item == "1" { "b" } else { "a" }, "generate", &["--items", item]).0, 0);
    }
    assert_eq!(machines.on("c", "generate", &["--commit"]).0, 0);
    let (code, _, stderr) = machines.on("reader", "generate", &["--fetch"]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(hashes(&machines.scratch("reader"), &["recordings"]), hashes(smoke::whole(), &["recordings"]));
}

#[test]
fn what_was_done_here_and_not_kept_is_kept_without_being_done_again() {
    let machines = Machines::with("tasks");
    assert_eq!(machines.on("a", "generate", &["--items", "0"]).0, 0);
    // As if the machine had stopped before the store had the receipt.
    std::fs::remove_file(machines.store().join("recordings/receipts/shard-00000.json")).unwrap();
    let recording = machines.scratch("a").join("recordings/shard-00000-of-00003.mcap");
    let written = || std::fs::metadata(&recording).unwrap().modified().unwrap();
    let before = written();
    let (code, stdout, stderr) = machines.on("a", "generate", &["--items", "0"]);
    assert!(code == 0 && stdout.contains("shard 0 of 3  done"), "{stdout} {stderr}");
    assert_eq!(written(), before);
    // What is not whole here is done again.
    std::fs::remove_file(machines.store().join("recordings/receipts/shard-00000.json")).unwrap();
    std::fs::write(&recording, "spoiled").unwrap();
    assert_eq!(machines.on("a", "generate", &["--items", "0"]).0, 0);
    assert_eq!(
        std::fs::read(&recording).unwrap(),
        std::fs::read(smoke::whole().join("recordings/shard-00000-of-00003.mcap")).unwrap()
    );
}

#[test]
fn a_commit_in_a_store_names_what_is_missing_and_a_stage_whose_inputs_are_missing_says_so() {
    let machines = Machines::with("tasks");
    assert_eq!(machines.on("a", "generate", &["--items", "1"]).0, 0);
    let (code, stdout, _) = machines.on("b", "generate", &["--commit"]);
    assert!(code == 1 && stdout.contains("2 of 3 items missing: 0,2"), "{stdout}");
    let (code, stdout, _) = machines.on("b", "convert", &["--items", "0"]);
    assert!(code == 1 && stdout.contains("generate is not finished"), "{stdout}");
    assert!(stdout.contains(&*machines.store().join("recordings/manifest.json").to_string_lossy()), "{stdout}");
    let (code, stdout, _) = machines.on("b", "generate", &["--fetch"]);
    assert!(code == 1 && stdout.contains("not finished in the store"), "{stdout}");
}

#[test]
fn another_plan_is_refused_by_a_store_and_changes_nothing() {
    let machines = Machines::with("generate");
    let text = std::fs::read_to_string(crate::pipeline::repository().join(PIPELINE)).unwrap();
    let changed = machines.folder.path().join("changed.toml");
    std::fs::write(&changed, text.replace("trials_per_task = 3", "trials_per_task = 2")).unwrap();
    let (store, changed) = (machines.store(), changed.to_string_lossy().into_owned());
    let before = hashes(&store, &["recordings", "sha256"]);
    for more in [&["--items", "0"][..], &["--begin"], &["--commit"], &[]] {
        for scratch in ["first", "fresh"] {
            let scratch = machines.scratch(scratch);
            let place = ["--store", &store.to_string_lossy(), "--out", &scratch.to_string_lossy()];
            let (code, _, stderr) = run(&[&["generate", &changed][..], &place, more].concat());
            assert_eq!(code, 2, "{more:?}: {stderr}");
            assert!(stderr.contains("is of another plan: its setting"), "{more:?}: {stderr}");
        }
        assert_eq!(hashes(&store, &["recordings", "sha256"]), before, "{more:?}");
    }
    let (code, _, stderr) = machines.on("first", "generate", &["--items", "0", "--force"]);
    assert!(code == 2 && stderr.contains("--force: is of no use with --store"), "{stderr}");
}

#[test]
fn what_a_store_spoils_is_named_and_never_used() {
    let machines = Machines::with("generate");
    let content = std::fs::read(smoke::whole().join("recordings/shard-00001-of-00003.mcap")).unwrap();
    let hash = ntp::artifact::sha256_bytes(&content);
    std::fs::write(machines.store().join("sha256").join(&hash), "something else").unwrap();
    let (code, stdout, _) = machines.on("b", "convert", &["--items", "0"]);
    assert!(code == 1 && stdout.contains(&hash) && stdout.contains("but should be"), "{stdout}");
    assert_eq!(machines.items("convert")[0]["failure"]["attempts"], 1);
    assert_eq!(machines.on("c", "convert", &["--items", "0"]).0, 1);
    let failed = machines.items("convert");
    assert_eq!((&failed[0]["state"], &failed[0]["failure"]["attempts"]), (&"failed".into(), &2.into()));
}

#[test]
fn a_manifest_that_names_a_place_outside_of_the_run_is_refused() {
    let machines = Machines::with("generate");
    let manifest = machines.store().join("recordings/manifest.json");
    let text = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, text.replace("shard-00000-of", "../../shard-00000-of")).unwrap();
    let (code, stdout, stderr) = machines.on("d", "convert", &["--items", "0"]);
    assert!(code == 1 && stdout.contains("leads out of the run"), "{stdout} {stderr}");
}

#[test]
fn a_run_in_a_store_is_submitted_and_its_directory_holds_scripts_alone() {
    let machines = Machines::new();
    let (store, out) = (machines.store(), machines.folder.path().join("submitted"));
    let (store, path) = (store.to_string_lossy(), out.to_string_lossy());
    let submit = ["submit", PIPELINE, "--out", path.as_ref(), "--engine", "local", "--store", store.as_ref()];
    let scratch = machines.scratch("tmp");
    std::fs::create_dir(&scratch).unwrap();
    let output = ntp(&submit).env("TMPDIR", &scratch).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (code, stdout, stderr) = run(&["status", &path]);
    assert!(code == 0 && stdout.contains("rollout: 2 of 2 items done"), "{stdout} {stderr}");
    let names = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name());
    assert_eq!(names.collect::<Vec<_>>(), ["submit"]);
    assert_eq!(hashes(&machines.fetched(), &ALL[..5]), hashes(smoke::whole(), &ALL[..5]));
    let (code, _, stderr) = run(&["submit", PIPELINE, "--out", &path, "--engine", "local"]);
    assert!(code == 2 && stderr.contains("was made with another store; once none"), "{stderr}");
}

#[test]
fn a_store_is_of_one_experiment_and_a_bucket_needs_its_feature() {
    let machines = Machines::new();
    let scratch = machines.scratch("a");
    let study = ["run", "pipelines/paper_small.toml", "--store", "elsewhere", "--out", &scratch.to_string_lossy()];
    let (code, _, stderr) = run(&study);
    assert!(code == 2 && stderr.contains("--store: is of one experiment"), "{stderr}");
    let (code, _, stderr) = run(&["generate", PIPELINE, "--fetch"]);
    assert!(code == 2 && stderr.contains("--store"), "{stderr}");
    let (code, _, stderr) = run(&["generate", PIPELINE, "--store", "gs://bucket/run"]);
    assert!(code == 2 && stderr.contains("s3://BUCKET"), "{stderr}");
    if !cfg!(feature = "cloud") {
        let bucket = ["generate", PIPELINE, "--store", "s3://bucket/run", "--out", &scratch.to_string_lossy()];
        let (code, _, stderr) = run(&bucket);
        assert!(code == 2 && stderr.contains("cargo build --release --features cloud"), "{stderr}");
    }
    assert!(!scratch.exists(), "something was written");
}

#[test]
fn a_store_holds_each_content_once_and_nothing_of_clocks_but_costs() {
    let machines = Machines::with("convert");
    let listed: Vec<String> = ntp::store::files_below(&machines.store()).unwrap();
    let folders: std::collections::BTreeSet<&str> = listed.iter().filter_map(|name| name.split('/').next()).collect();
    assert_eq!(folders.into_iter().collect::<Vec<_>>(), ["costs", "dataset", "recordings", "sha256", "tasks"]);
    for name in listed.iter().filter_map(|name| name.strip_prefix("sha256/")) {
        let content = std::fs::read(machines.store().join("sha256").join(name)).unwrap();
        assert_eq!(ntp::artifact::sha256_bytes(&content), name);
    }
    let records: Vec<&String> = listed.iter().filter(|name| name.starts_with("recordings/")).collect();
    assert_eq!(records.len(), 5, "plan, three receipts and manifest: {records:?}");
}
