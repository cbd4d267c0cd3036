//! Suites under an adversary and of another order, from a task file of the authors' form, through every stage.

use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

/// Stacks of two and three of eight cubes: a task for each pair of towers.
fn authors_file(n_tasks: usize) -> Value {
    let names: Vec<String> = ('A'..='H').map(|letter| format!("block_{letter}")).collect();
    let task = |idx: usize| {
        let block = |place: usize| &names[(place * (1 + 2 * (idx % 4)) + idx) % 8];
        let pairs: Vec<Value> =
            [(1, 0), (2, 1), (4, 3)].map(|(src, target)| json!({"src": block(src), "target": block(target)})).into();
        let with = |key: &str, word: &str| -> Vec<Value> {
            let add = |mut pair: Value| {
                pair[key] = json!(word);
                pair
            };
            pairs.iter().cloned().map(add).collect()
        };
        json!({"id": format!("authors_{idx}"), "goals": with("name", "pick_place"), "end_constraints": with("type", "on_top")})
    };
    json!({"scene": {"task_objects": names}, "tasks": (0..n_tasks).map(task).collect::<Vec<_>>()})
}

const PIPELINE: &str = r#"
name = "imported"
seed = 2
[tasks]
family = "block_stacking"
train = 4
import = "authors.json"
[generate]
trials_per_task = 2
[[models]]
variant = "ntp"
train_tasks = 2
[models.training]
steps = 4
[rollout]
record = 2
oracle = true
[[rollout.suites]]
name = "stacking_unseen"
split = "unseen"
episodes = 4
[[rollout.suites]]
name = "stacking_topology"
split = "seen"
order = "shuffled"
episodes = 4
[[rollout.suites]]
name = "stacking_adversary"
split = "unseen"
adversary = { probability = 0.5 }
episodes = 4
"#;

/// Writes pipeline and task file into a folder.
fn write(folder: &Path, pipeline: &str, n_tasks: usize) -> String {
    std::fs::write(folder.join("authors.json"), authors_file(n_tasks).to_string()).unwrap();
    let path = folder.join("imported.toml");
    std::fs::write(&path, pipeline).unwrap();
    path.to_string_lossy().into_owned()
}

fn ntp(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ntp"));
    let output = command.args(arguments).stdin(Stdio::null()).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

#[test]
fn imported_tasks_run_through_every_stage_and_suite() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), PIPELINE, 8);
    let out = folder.path().join("run");
    let (code, _, stderr) = ntp(&["run", &path, "--out", &out.to_string_lossy()]);
    assert_eq!(code, 0, "{stderr}");
    let report: Value = serde_json::from_slice(&std::fs::read(out.join("report/report.json")).unwrap()).unwrap();
    let of_oracle = |suite: &str| {
        let results = report["results"].as_array().unwrap();
        let row = results.iter().find(|row| row["variant"] == "oracle" && row["suite"] == suite);
        row.unwrap_or_else(|| panic!("{suite} is missing: {report:#}")).clone()
    };
    for suite in ["stacking_unseen", "stacking_topology"] {
        assert_eq!(of_oracle(suite)["successes"], 4, "{suite}");
        assert_eq!(of_oracle(suite)["pushes"], Value::Null, "{suite} has no adversary");
    }
    let tasks_of = |variant: &str, suite: &str| {
        let sql =
            format!("SELECT task_id FROM rollouts WHERE variant = '{variant}' AND suite = '{suite}' ORDER BY episode");
        let (_, rows, _) = ntp(&["query", &out.to_string_lossy(), &sql, "--json"]);
        let rows: Value = serde_json::from_str(&rows).unwrap();
        let ids = rows
            .as_array()
            .unwrap()
            .iter()
            .map(|row| row["task_id"].as_str().unwrap().trim_start_matches("authors_").to_owned());
        ids.collect::<Vec<_>>().join(" ")
    };
    assert_eq!(tasks_of("ntp", "stacking_topology"), "0 1 0 1", "seen are those that the model was trained on");
    assert_eq!(tasks_of("oracle", "stacking_topology"), "0 1 2 3");
    assert_eq!(tasks_of("ntp", "stacking_unseen"), "4 5 6 7");
    let pushes = of_oracle("stacking_adversary")["pushes"].as_u64().unwrap();
    let toppled = of_oracle("stacking_adversary")["toppled"].as_u64().unwrap();
    assert!(pushes > 0 && toppled > 0, "{pushes} pushes toppled {toppled} blocks");
    let recorded = out.join("rollouts/oracle/stacking_adversary").to_string_lossy().into_owned();
    let (code, stdout, stderr) = ntp(&["replay", &recorded, "--episode", "1", "--verify"]);
    assert_eq!(code, 0, "pushes repeat when an episode is simulated again: {stdout} {stderr}");
    let rrd = folder.path().join("pushed.rrd").to_string_lossy().into_owned();
    let (code, stdout, stderr) = ntp(&["replay", &recorded, "--episode", "0,1", "--save", &rrd, "--json"]);
    assert_eq!(code, 0, "{stderr}");
    let replayed: Value = serde_json::from_str(&stdout).unwrap();
    let sql = "SELECT pushes FROM rollouts WHERE variant = 'oracle' AND suite = 'stacking_adversary' ORDER BY episode";
    let (_, rows, _) = ntp(&["query", &out.to_string_lossy(), sql, "--json"]);
    let rows: Value = serde_json::from_str(&rows).unwrap();
    for (episode, row) in replayed["episodes"].as_array().unwrap().iter().zip(rows.as_array().unwrap()) {
        let pushes = episode["pushes"].as_array().unwrap();
        assert_eq!(row["pushes"], pushes.len(), "a recording has every push");
        assert!(pushes.iter().all(|push| push["secs"].as_f64().unwrap() > 0.0), "{pushes:?}");
    }
}

/// Rows of a statement over a run.
#[track_caller]
fn ask(run: &Path, sql: &str) -> Vec<Value> {
    let (code, rows, stderr) = ntp(&["query", &run.to_string_lossy(), sql, "--json"]);
    assert_eq!(code, 0, "{stderr}");
    serde_json::from_str(&rows).unwrap()
}

#[test]
fn rows_say_what_their_suite_and_model_are_and_how_far_they_came() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), PIPELINE, 8);
    let out = folder.path().join("run");
    assert_eq!(ntp(&["run", &path, "--out", &out.to_string_lossy(), "--to", "rollout"]).0, 0);
    let sql = "SELECT DISTINCT suite, family, blocks, \"order\", adversary_probability AS p, adversary_impulse_ns AS impulse, \
               on_table_min, bowls, objects, goals FROM rollouts ORDER BY suite";
    let row = |suite: &str, order: &str, push: [f64; 2]| {
        json!({"suite": suite, "family": "block_stacking", "blocks": 8, "order": order, "p": push[0],
               "impulse": push[1], "on_table_min": null, "bowls": null, "objects": 8, "goals": 3})
    };
    let expected = [
        row("stacking_adversary", "own", [0.5, 0.06]),
        row("stacking_topology", "shuffled", [0.0, 0.0]),
        row("stacking_unseen", "own", [0.0, 0.0]),
    ];
    assert_eq!(ask(&out, sql), expected);
    let parts = ask(&out, "SELECT DISTINCT variant, core, scoping, encoder FROM rollouts ORDER BY variant");
    let of = |variant: &str, parts: [Value; 3]| {
        let [core, scoping, encoder] = parts;
        json!({"variant": variant, "core": core, "scoping": scoping, "encoder": encoder})
    };
    let ntp_parts = ["reactive", "scoped", "object_centric"].map(Value::from);
    assert_eq!(parts, [of("ntp", ntp_parts), of("oracle", [Value::Null, Value::Null, Value::Null])]);
    // Whoever succeeds meets all goals, and who ended by itself and does not, does not.
    let sql = "SELECT COUNT(*) AS n FROM rollouts WHERE success AND goals_met < goals \
               OR outcome = 'ended_early' AND goals_met = goals";
    assert_eq!(ask(&out, sql), [json!({"n": 0})]);
    let met =
        ask(&out, "SELECT SUM(goals_met) AS met FROM rollouts WHERE variant = 'oracle' AND adversary_probability = 0");
    assert_eq!(met, [json!({"met": 24})], "the oracle meets all three goals of eight undisturbed rollouts");
}

#[test]
fn suites_by_other_names_are_told_in_the_same_report() {
    let names =
        [("stacking_unseen", "zeta"), ("stacking_topology", "stacking_unseen_2"), ("stacking_adversary", "alpha")];
    let renamed = names.iter().fold(PIPELINE.to_owned(), |text, (from, to)| text.replace(from, to));
    let told = |pipeline: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = write(folder.path(), pipeline, 8);
        let out = folder.path().join("run");
        assert_eq!(ntp(&["run", &path, "--out", &out.to_string_lossy()]).0, 0);
        let report: Value = serde_json::from_slice(&std::fs::read(out.join("report/report.json")).unwrap()).unwrap();
        let aggregates = report["aggregates"].as_array().unwrap().iter();
        let facts: Vec<Value> = aggregates.map(|row| json!([row["variant"], row["facts"]])).collect();
        let figures: Vec<Value> =
            report["figures"].as_array().unwrap().iter().map(|figure| json!([figure["id"], figure["title"]])).collect();
        (facts, figures)
    };
    // Trials are drawn by the suite's name, so that shares may differ; what is told of them does not.
    let (facts, figures) = told(PIPELINE);
    assert_eq!(facts.len(), 6);
    assert_eq!((facts, figures), told(&renamed));
}

#[test]
fn the_report_shows_episodes_and_how_to_replay_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), PIPELINE, 8);
    let out = folder.path().join("run");
    assert_eq!(ntp(&["run", &path, "--out", &out.to_string_lossy()]).0, 0);
    let page = std::fs::read(out.join("report/index.html")).unwrap();
    let report: Value = serde_json::from_slice(&std::fs::read(out.join("report/report.json")).unwrap()).unwrap();
    let strips = report["filmstrips"].as_array().unwrap();
    let failures: Vec<&Value> = strips.iter().filter(|strip| strip["shows"] == "failure").collect();
    assert_eq!(strips[0]["shows"], "demonstration");
    assert!(!failures.is_empty(), "four steps teach nothing: {strips:?}");
    for strip in &failures {
        let suite = failures.iter().filter(|other| other["suite"] == strip["suite"]).count();
        assert!(suite <= 3, "the first failures of a suite are few");
        let pictures = strip["pictures"].as_array().unwrap();
        assert!((1..=6).contains(&pictures.len()) && pictures[0]["call"] == "start", "{strip:#}");
        let departures = pictures.iter().filter(|picture| picture["is_departure"] == true).count();
        assert_eq!(departures, usize::from(!strip["left"].is_null()), "{strip:#}");
        let command: Vec<&str> = strip["replay"].as_str().unwrap().split(' ').collect();
        let ["ntp", "replay", place, "--episode", number, "--spawn"] = command[..] else { panic!("{command:?}") };
        let rrd = folder.path().join("strip.rrd").to_string_lossy().into_owned();
        let place = out.join(place).to_string_lossy().into_owned();
        let (code, replayed, stderr) = ntp(&["replay", &place, "--episode", number, "--save", &rrd, "--json"]);
        assert_eq!(code, 0, "{stderr}");
        let replayed: Value = serde_json::from_str(&replayed).unwrap();
        let leaves = &replayed["episodes"][0]["first_divergence"]["secs"];
        match strip["left"].as_str() {
            Some(left) => assert!(left.contains(&format!("at {:.1} s", leaves.as_f64().unwrap())), "{left}: {leaves}"),
            None => assert!(leaves.is_null()),
        }
    }
    let n_pictures: usize = strips.iter().map(|strip| strip["pictures"].as_array().unwrap().len()).sum();
    let page_text = String::from_utf8(page.clone()).unwrap();
    assert_eq!(page_text.matches("src=\"data:image/jpeg;base64,").count(), n_pictures);
    assert_eq!(ntp(&["report", &path, "--out", &out.to_string_lossy(), "--force"]).0, 0);
    assert_eq!(std::fs::read(out.join("report/index.html")).unwrap(), page, "the same run has the same page");
}

#[track_caller]
fn check_refused(pipeline: &str, n_tasks: usize, code: i32, expected: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let path = write(folder.path(), pipeline, n_tasks);
    let (found, _, stderr) = ntp(&["run", &path, "--out", &folder.path().join("run").to_string_lossy()]);
    assert_eq!(found, code, "{stderr}");
    for part in expected {
        assert!(stderr.contains(part), "{stderr} does not say {part}");
    }
}

#[test]
fn fewer_tasks_in_the_file_than_the_split_asks_for_are_refused_with_both_numbers() {
    check_refused(PIPELINE, 3, 1, &["authors.json", "4 training tasks", "3 tasks"]);
    let unseen = PIPELINE.replace("train = 4", "train = 4\nunseen = 9");
    check_refused(&unseen, 8, 2, &["imported.toml", "tasks.unseen", "13 tasks in all", "holds 8"]);
    check_refused(PIPELINE, 4, 2, &["rollout.suites.stacking_unseen.split", "no such task"]);
}

#[test]
fn settings_of_suites_out_of_range_are_refused_by_key() {
    let with = |adversary: &str| PIPELINE.replace("probability = 0.5", adversary);
    let key = "rollout.suites[2].adversary";
    check_refused(&with("probability = 1.5"), 8, 2, &["imported.toml", key, "probability is 1.5", "0 to 1"]);
    check_refused(&with("impulse_ns = -1.0"), 8, 2, &["imported.toml", key, "impulse_ns is -1", "above 0"]);
    check_refused(&with("force = 1.0"), 8, 2, &["imported.toml", "force", "probability", "impulse_ns"]);
    let order = PIPELINE.replace("\"shuffled\"", "\"backwards\"");
    check_refused(&order, 8, 2, &["imported.toml", "backwards", "own", "shuffled"]);
    let sorting = PIPELINE.replace("block_stacking", "object_sorting").replace("import = ", "# import = ");
    check_refused(&sorting, 8, 2, &["rollout.suites[1].order", "object_sorting builds no towers", "block_stacking"]);
}

#[test]
fn rollouts_are_replayed_beside_the_demonstrations_that_they_were_given() {
    let folder = tempfile::tempdir().unwrap();
    let rrd = folder.path().join("rollouts.rrd");
    let (out, rrd) = (crate::smoke::whole().to_string_lossy(), rrd.to_string_lossy());
    let replay = |actor: &str| {
        let path = format!("{out}/rollouts/{actor}/stacking_unseen");
        let (code, stdout, stderr) = ntp(&["replay", &path, "--episode", "1,0", "--save", &rrd, "--json"]);
        assert_eq!(code, 0, "{stderr}");
        serde_json::from_str::<serde_json::Value>(&stdout).unwrap()["episodes"].as_array().unwrap().clone()
    };
    for episode in replay("oracle") {
        assert_eq!(episode["demonstration"], true);
        assert_eq!(episode["first_divergence"], serde_json::Value::Null);
    }
    let sql =
        "SELECT episode, first_divergence, divergence_kind FROM rollouts WHERE variant = 'ntp' ORDER BY episode DESC";
    let (_, rows, _) = ntp(&["query", &out, sql, "--json"]);
    let rows: serde_json::Value = serde_json::from_str(&rows).unwrap();
    let told = replay("ntp-seed0-mss");
    assert_eq!(told.len(), 2);
    for (row, episode) in rows.as_array().unwrap()[2..].iter().zip(told) {
        assert_eq!(episode["demonstration"], true);
        assert_eq!(episode["episode"], row["episode"]);
        assert_eq!(episode["first_divergence"]["decision"], row["first_divergence"]);
        assert_eq!(episode["first_divergence"]["kind"], row["divergence_kind"]);
    }
}
