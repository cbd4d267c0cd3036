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
    let out = files.path("out").to_string_lossy().into_owned();
    let (code, told, _) = run(&["inspect", &out, "--json"]);
    assert_eq!((code, &serde_json::from_str::<Value>(&told).unwrap()["kind"]), (0, &"study".into()));
    let (code, told, _) = run(&["validate", &out]);
    assert!(code == 0 && told.contains("out/two/dataset") && told.contains("out/report"), "{told}");
    let (code, markdown, _) = files.run("report", "pair.toml", "out", &[]);
    assert!(code == 0 && markdown.contains("| stacking_unseen of one | ntp "), "{markdown}");
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
    check_refused("name = \"x\"\nexperiments = [\"wrong.toml\"]", &[], &["experiments[0]", "is a study"]);
    check_refused("name = \"x\"\nexperiments = [\"one.toml\", \"one.toml\"]", &[], &["experiments[1]", "must differ"]);
    check_refused("name = \"x\"\nexperiments = [\"report.toml\"]", &[], &["experiments[0]", "own report"]);
    check_refused("name = \"x\"\ntasks = 1\nexperiments = [\"one.toml\"]", &[], &["tasks", "expected one of"]);
    check_refused("name = \"a/b\"\nexperiments = [\"one.toml\"]", &[], &["name", "letters"]);
    let study = "name = \"x\"\nexperiments = [\"one.toml\"]";
    check_refused(study, &["--shard", "0"], &["--shard", "of one experiment"]);
}

/// Kits beside the towers of `one.toml`, each with a model of its own, and models that learn from more than one experiment.
fn joint() -> Files {
    let files = Files::new();
    files.write(
        "kits.toml",
        "name = \"kits\"\nseed = 5\n[tasks]\nfamily = \"kitting\"\ntrain = 2\nunseen = 2\n[generate]\ntrials_per_task = 2\n\
         frames = \"boundaries\"\n[[rollout.suites]]\nname = \"kitting_unseen\"\nsplit = \"unseen\"\nepisodes = 2\n\
         [[rollout.suites]]\nname = \"kitting_seen\"\nsplit = \"seen\"\nepisodes = 2\n",
    );
    let model = |variant: &str, tag: &str, experiments: &str, more: &str| {
        format!(
            "[[models]]\nvariant = \"{variant}\"\ntag = \"{tag}\"\nexperiments = [{experiments}]\n[models.training]\n\
             steps = 2\nbatch = 4\n{more}"
        )
    };
    let both = "\"one\", \"kits\"";
    let models = [
        model("ntp", "joint", both, ""),
        model("ntp_paper", "joint", both, ""),
        model("ntp", "towers_alone", "\"one\"", "shared_root = true\n"),
        model("ntp", "apart", "\"one\"", ""),
    ];
    let study = format!("name = \"joint\"\nexperiments = [\"one.toml\", \"kits.toml\"]\n{}", models.concat());
    files.write("joint.toml", &study);
    files
}

#[test]
fn a_study_s_models_learn_from_several_families_and_act_what_they_know_the_root_of() {
    let files = joint();
    let (code, stdout, stderr) = files.run("run", "joint.toml", "out", &[]);
    assert_eq!(code, 0, "{stderr}");
    let kits = |model: &str, suite: &str| {
        stdout.lines().any(|line| line.starts_with(&format!("kits: rollout {model}-seed0-mss kitting_{suite}")))
    };
    assert!(kits("ntp-joint", "unseen") && kits("ntp-joint", "seen") && kits("ntp_paper-joint", "unseen"), "{stdout}");
    assert!(kits("ntp-towers_alone", "unseen") && !kits("ntp-towers_alone", "seen"), "it has seen no kit: {stdout}");
    assert!(!kits("ntp-apart", "unseen"), "it does not know the root of kits: {stdout}");
    assert!(stdout.contains("one: rollout ntp-apart-seed0-mss stacking_unseen"), "{stdout}");
    let config: Value = read_json(&files.path("out/models/ntp_paper-joint-seed0/config.json")).unwrap();
    assert_eq!((&config["family"], &config["other_families"][0]), (&"block_stacking".into(), &"kitting".into()));
    assert_eq!((&config["n_slots"], &config["shared_root"]), (&12.into(), &Value::Null));
    let report: Value = read_json(&files.path("out/report/report.json")).unwrap();
    let rows = report["results"].as_array().unwrap().iter().filter(|row| row["tag"] == "joint");
    let mut rows: Vec<_> = rows
        .map(|row| (row["experiment"].as_str().unwrap(), row["variant"].as_str().unwrap(), row["train_tasks"].as_u64()))
        .collect();
    rows.sort_unstable();
    rows.dedup();
    let row = |experiment, variant| (experiment, variant, Some(5));
    assert_eq!(rows, [row("kits", "ntp"), row("kits", "ntp_paper"), row("one", "ntp"), row("one", "ntp_paper")]);
    let models = report["models"].as_array().unwrap().iter().filter(|model| model["experiment"] == "joint").count();
    assert_eq!(models, 4);
    let (_, stdout, _) = files.run("run", "joint.toml", "out", &[]);
    assert!(stdout.lines().all(|line| line.contains("up to date")), "{stdout}");
    let out = files.path("out").to_string_lossy().into_owned();
    let (code, told, _) = run(&["validate", &out]);
    assert!(code == 0 && told.contains("out/models/ntp-joint-seed0"), "{told}");
}

#[test]
fn a_study_s_model_that_cannot_be_names_key_what_was_found_and_what_is_allowed() {
    let check = |from: &str, to: &str, parts: &[&str]| {
        let files = joint();
        let study = std::fs::read_to_string(files.path("joint.toml")).unwrap();
        assert!(study.contains(from), "{study}");
        files.write("joint.toml", &study.replacen(from, to, 1));
        let (code, _, stderr) = files.run("run", "joint.toml", "out", &[]);
        assert_eq!(code, 2, "{stderr}");
        for part in parts {
            assert!(stderr.contains(part), "{stderr} does not say {part}");
        }
        assert!(!files.path("out").exists(), "something was written");
    };
    let both = "experiments = [\"one\", \"kits\"]";
    check(both, "experiments = []", &["models[0].experiments", "is empty", "one, kits"]);
    check(both, "experiments = [\"two\"]", &["models[0].experiments", "\"two\" is no experiment", "one, kits"]);
    check(both, "experiments = [\"one\", \"one\"]", &["models[0].experiments", "\"one\" is there twice"]);
    check("variant = \"ntp\"", "variant = \"npi\"", &["models[0].variant", "is npi", "read positions"]);
    check("variant = \"ntp\"", "variant = \"ntp_vid_e2e\"", &["models[0].variant", "is ntp_vid_e2e"]);
    let instructed = "specification = \"instructions\"\nvariant = \"ntp\"";
    check("variant = \"ntp\"", instructed, &["models[0].specification", "other slots in each family", "trajectories"]);
    check("variant = \"ntp\"", "train_tasks = 4\nvariant = \"ntp\"", &["models[0].train_tasks", "is 4", "1 to 3"]);
    check("variant = \"ntp\"", "seeds = []\nvariant = \"ntp\"", &["models[0].seeds", "is empty"]);
    let suites = "suites = [\"kitting_all\"]\nvariant = \"ntp\"";
    check("variant = \"ntp\"", suites, &["models[0].suites", "kitting_all", "kitting_unseen, kitting_seen"]);
    check("tag = \"apart\"\n", "", &["models[3]", "ntp-seed0 is there twice", "a tag"]);
    check("batch = 4", "merge_containers = -0.5", &["models[0].training", "merge_containers is -0.5", "from 0 to 1"]);
}

#[test]
fn what_learns_from_several_experiments_is_not_submitted_and_stands_in_a_study_alone() {
    let files = joint();
    let out = files.path("out").to_string_lossy().into_owned();
    let study = files.path("joint.toml").to_string_lossy().into_owned();
    let (code, _, stderr) = run(&["submit", &study, "--out", &out, "--engine", "local"]);
    assert!(code == 2 && stderr.contains("models") && stderr.contains("ntp run alone"), "{code} {stderr}");
    let own = std::fs::read_to_string(files.path("one.toml")).unwrap();
    files.write("one.toml", &own.replace("variant = \"ntp\"", "variant = \"ntp\"\nexperiments = [\"kits\"]"));
    let (code, _, stderr) = files.run("run", "one.toml", "out", &[]);
    assert!(code == 2 && stderr.contains("models[0].experiments") && stderr.contains("a study's own"), "{stderr}");
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
