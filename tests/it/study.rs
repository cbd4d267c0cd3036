//! Studies: several experiments and one report.

use std::path::{Path, PathBuf};

use ntp::artifact::read_json;
use serde_json::Value;

use crate::pipeline::{ALL, hashes, repository, run};

/// Two experiments that differ in their seed, and a study of both.
struct Files {
    folder: tempfile::TempDir,
}

impl Files {
    fn new() -> Self {
        let files = Self { folder: tempfile::tempdir().unwrap() };
        let smoke = std::fs::read_to_string(repository().join("pipelines/smoke.toml")).unwrap();
        for (name, seed) in [("one", 3), ("two", 4)] {
            let own = smoke.replace("\"smoke\"", &format!("\"{name}\"")).replace("seed = 3", &format!("seed = {seed}"));
            files.write(&format!("{name}.toml"), &own);
        }
        files.write("pair.toml", "name = \"pair\"\nexperiments = [\"one.toml\", \"two.toml\"]\n");
        files
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.folder.path().join(name), text).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, command: &str, file: &str, out: &str, more: &[&str]) -> (i32, String, String) {
        let (file, out) = (self.path(file), self.path(out));
        run(&[&[command, &file.to_string_lossy(), "--out", &out.to_string_lossy()], more].concat())
    }
}

#[test]
fn a_study_runs_each_experiment_as_by_itself_and_reports_them_together() {
    let files = Files::new();
    let (code, stdout, stderr) = files.run("run", "pair.toml", "out", &[]);
    assert_eq!(code, 0, "{stderr}");
    assert!(stdout.contains("one: train ntp-seed0") && stdout.contains("two: train ntp-seed0"), "{stdout}");
    assert_eq!(files.run("run", "two.toml", "alone", &[]).0, 0);
    assert_eq!(hashes(&files.path("out/two"), &ALL), hashes(&files.path("alone"), &ALL));
    let report: Value = read_json(&files.path("out/report/report.json")).unwrap();
    let told = report["results"].as_array().unwrap().iter().map(|row| {
        let text = |key: &str| row[key].as_str().unwrap().to_owned();
        (text("experiment"), text("variant"), row["episodes"].as_u64().unwrap())
    });
    let mut told: Vec<_> = told.collect();
    told.sort();
    let row = |experiment: &str, variant: &str| (experiment.to_owned(), variant.to_owned(), 4);
    assert_eq!(told, [row("one", "ntp"), row("one", "oracle"), row("two", "ntp"), row("two", "oracle")]);
    let (code, json, _) = files.run("report", "pair.toml", "out", &["--json"]);
    assert_eq!((code, serde_json::from_str::<Value>(&json).unwrap()), (0, report));
    let (code, markdown, _) = files.run("report", "pair.toml", "out", &[]);
    assert!(code == 0 && markdown.contains("| stacking_unseen | ntp "), "{markdown}");
}

#[test]
fn a_study_says_what_is_left_and_carries_on() {
    let files = Files::new();
    assert_eq!(files.run("train", "pair.toml", "out", &[]).0, 1, "nothing was converted");
    let (code, _, stderr) = files.run("run", "pair.toml", "out", &["--to", "train"]);
    assert_eq!(code, 0, "{stderr}");
    let (_, stdout, _) = files.run("run", "pair.toml", "out", &["--dry-run"]);
    let line = |start: &str| stdout.lines().find(|line| line.starts_with(start)).unwrap_or_default().to_owned();
    assert!(line("two: train").contains("up to date"), "{stdout}");
    assert!(line("two: rollout ntp").contains("to do: not done yet"), "{stdout}");
    assert!(line("report").contains("to do: rollout comes first"), "{stdout}");
    assert_eq!(files.run("run", "pair.toml", "out", &[]).0, 0);
    let (_, stdout, _) = files.run("run", "pair.toml", "out", &[]);
    assert!(stdout.lines().count() > 14 && stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
}

#[test]
fn what_a_run_took_is_told_beside_the_stages() {
    let files = Files::new();
    assert_eq!(files.run("run", "one.toml", "out", &[]).0, 0);
    let report: Value = read_json(&files.path("out/report/report.json")).unwrap();
    let stages: Vec<&str> =
        report["costs"].as_array().unwrap().iter().map(|cost| cost["stage"].as_str().unwrap()).collect();
    assert_eq!(stages, ["tasks", "generate", "convert", "train", "rollout"]);
    assert!(report["models"][0]["cpu_secs"].as_f64().unwrap() > 0.0);
    std::fs::remove_file(files.path("out/costs.json")).unwrap();
    let (_, stdout, _) = files.run("run", "one.toml", "out", &[]);
    assert!(stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
}

#[track_caller]
fn check_refused(study: &str, more: &[&str], parts: &[&str]) {
    let files = Files::new();
    files.write("wrong.toml", study);
    files.write(
        "report.toml",
        &std::fs::read_to_string(files.path("one.toml")).unwrap().replace("\"one\"", "\"report\""),
    );
    let (code, _, stderr) = files.run("run", "wrong.toml", "out", more);
    assert_eq!(code, 2, "{stderr}");
    for part in parts {
        assert!(stderr.contains(part), "{stderr} does not say {part}");
    }
    assert!(!Path::new(&files.path("out")).exists(), "something was written");
}

#[test]
fn a_wrong_study_names_file_key_and_what_is_allowed_and_writes_nothing() {
    check_refused("name = \"x\"\nexperiments = []", &[], &["wrong.toml", "experiments", "at least one"]);
    check_refused("name = \"x\"\nexperiments = [\"no.toml\"]", &[], &["experiments[0]", "no such file", "no.toml"]);
    check_refused("name = \"x\"\nexperiments = [\"pair.toml\"]", &[], &["experiments[0]", "is a study"]);
    check_refused("name = \"x\"\nexperiments = [\"one.toml\", \"one.toml\"]", &[], &["experiments[1]", "must differ"]);
    check_refused("name = \"x\"\nexperiments = [\"report.toml\"]", &[], &["experiments[0]", "own report"]);
    check_refused("name = \"x\"\ntasks = 1\nexperiments = [\"one.toml\"]", &[], &["tasks", "expected one of"]);
    check_refused("name = \"a/b\"\nexperiments = [\"one.toml\"]", &[], &["name", "letters"]);
    let study = "name = \"x\"\nexperiments = [\"one.toml\"]";
    check_refused(study, &["--shard", "0"], &["--shard", "of one experiment"]);
}

#[test]
fn the_committed_study_schema_is_the_generated_one() {
    let path = repository().join("schemas/study.schema.json");
    let schema = schemars::schema_for!(ntp::pipeline::StudySpec);
    let generated = format!("{}\n", serde_json::to_string_pretty(&schema).unwrap());
    if std::fs::read_to_string(&path).ok().as_ref() != Some(&generated) {
        std::fs::write(&path, &generated).unwrap();
        panic!("{} was stale and has been written anew: look at the change and commit it", path.display());
    }
}
