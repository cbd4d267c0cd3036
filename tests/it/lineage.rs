//! Where a frame or a model comes from: every hash upstream is found, and what is missing is told as missing.

use std::path::{Path, PathBuf};

use ntp::artifact::{read_json, sha256_file};
use ntp::dataset::edit::{Carry, Condition, filter};
use ntp::lineage::{LineageError, explain_episode, explain_model, stage_of};
use ntp::task::Split;
use serde_json::Value;

use crate::pipeline::run;
use crate::smoke::copy_to;

fn manifest_hash(folder: &Path) -> Option<String> {
    Some(sha256_file(&folder.join("manifest.json")).unwrap())
}

#[test]
fn a_frame_leads_to_its_calls_its_recording_and_every_stage_before() {
    let folder = copy_to("convert");
    let dataset = folder.path().join("dataset");
    let found = explain_episode(&dataset, 1, Some(2), &[]).unwrap();
    let frame = found.frame.unwrap();
    assert_eq!((frame.frame_index, frame.index - found.episode.first_index), (2, 2));
    let path: Vec<&str> = frame.stack.iter().map(|call| call.program.as_str()).collect();
    assert_eq!(path.join("/"), frame.program);
    assert!(frame.stack.iter().all(|call| (call.frames[0]..call.frames[1]).contains(&2)));
    let recording = folder.path().join("recordings").join(&found.episode.recording);
    assert_eq!(found.episode.recording_sha256, sha256_file(&recording).unwrap());
    assert_eq!(found.recording.path.unwrap().canonicalize().unwrap(), recording.canonicalize().unwrap());
    assert_eq!(found.recording.stage.unwrap().stage, "generate");
    let convert = found.dataset.unwrap();
    assert_eq!((convert.stage.as_str(), convert.version), ("convert", manifest_hash(&dataset)));
    let plan: Value = read_json(&dataset.join("plan.json")).unwrap();
    assert_eq!(convert.config, plan["config"]);
    let generate = convert.inputs["generate"].stage.as_ref().unwrap();
    assert_eq!(generate.version, manifest_hash(&folder.path().join("recordings")));
    assert!(generate.config["generate"]["simulation"].is_object() && generate.config["seed"].is_number());
    assert_eq!(generate.inputs["tasks"].stage.as_ref().unwrap().stage, "tasks");
    let costs: Value = read_json(&folder.path().join("costs.json")).unwrap();
    assert_eq!(convert.commit.as_deref(), costs["units"]["convert"]["commit"].as_str());
}

#[test]
fn an_edited_dataset_leads_to_what_it_was_made_of() {
    let folder = copy_to("convert");
    let (dataset, edited) = (folder.path().join("dataset"), folder.path().join("deep/er/edited"));
    filter(
        &dataset,
        &Condition { split: Some(Split::Seen.name().to_owned()), ..Condition::default() },
        &edited,
        Carry::Packets,
    )
    .unwrap();
    let recordings = [folder.path().join("recordings")];
    let found = explain_episode(&edited, 0, None, &recordings).unwrap();
    assert!(found.frame.is_none() && found.recording.path.is_some());
    let stage = found.dataset.unwrap();
    assert_eq!(stage.stage, "filter");
    assert_eq!(stage.config["settings"]["condition"]["split"], "seen");
    let source = stage.inputs.values().next().unwrap().stage.as_ref().unwrap();
    assert_eq!((source.stage.as_str(), &source.path), ("convert", &None));
    assert_eq!(source.plan_id, stage_of(&dataset).unwrap().unwrap().plan_id);
}

#[test]
fn what_is_missing_or_other_upstream_is_told() {
    let folder = copy_to("convert");
    let dataset = folder.path().join("dataset");
    let other = folder.path().join("other");
    let name = explain_episode(&dataset, 0, None, &[]).unwrap().episode.recording;
    std::fs::create_dir(&other).unwrap();
    std::fs::write(other.join(&name), "another").unwrap();
    std::fs::remove_dir_all(folder.path().join("recordings")).unwrap();
    let found = explain_episode(&dataset, 0, None, std::slice::from_ref(&other)).unwrap();
    assert_eq!((found.recording.path, found.recording.other_files), (None, vec![other.join(name)]));
    assert!(found.dataset.unwrap().inputs["generate"].stage.is_none());
    let error = explain_episode(&dataset, 900, None, &[]).unwrap_err().to_string();
    assert!(error.contains("there is no episode 900; there are"), "{error}");
    let error = explain_episode(&dataset, 0, Some(900), &[]).unwrap_err().to_string();
    assert!(error.contains("there is no frame 900"), "{error}");
    assert!(matches!(explain_model(&other), Err(LineageError::NoPlan { .. })));
}

#[test]
fn the_commands_print_lineage_and_differences_and_exit_as_documented() {
    let folder = copy_to("train");
    let at = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let models: Vec<PathBuf> = std::fs::read_dir(at("models")).unwrap().map(|entry| entry.unwrap().path()).collect();
    let model = models[0].to_string_lossy().into_owned();
    let (code, stdout, _) = run(&["explain", &model]);
    assert_eq!(code, 0);
    for words in ["train by ntp", "from convert", "convert by ntp", "from generate", "tasks by ntp", "settings {"] {
        assert!(stdout.contains(words), "{words:?} is missing in {stdout}");
    }
    let (code, stdout, _) = run(&["explain", &at("dataset"), "--episode", "0", "--frame", "1"]);
    assert_eq!(code, 0);
    assert!(stdout.contains("running") && stdout.contains("found, with this hash"), "{stdout}");
    assert_eq!(run(&["explain", &at("dataset")]).0, 2);
    let (code, stdout, stderr) =
        run(&["dataset", "split", &at("dataset"), "--shares", "a=0.5,b=0.5", "--to", &at("parts"), "--json"]);
    assert_eq!(code, 0, "{stderr}");
    let written: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(written["written"].as_array().unwrap().len(), 2);
    let (code, _, stderr) = run(&["dataset", "merge", &at("parts/a"), &at("parts/b"), "--to", &at("whole")]);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(run(&["dataset", "diff", &at("dataset"), &at("whole")]).0, 0);
    let (code, stdout, _) = run(&["dataset", "diff", &at("dataset"), &at("parts/a"), "--json"]);
    assert_eq!(code, 1);
    assert!(serde_json::from_str::<Value>(&stdout).unwrap()["removed"].as_u64() > Some(0));
    assert_eq!(run(&["validate", &at("whole")]).0, 0);
    assert_eq!(run(&["dataset", "filter", &at("dataset"), "--to", &at("all")]).0, 2);
    let (code, _, stderr) = run(&["dataset", "merge", &at("dataset"), &at("whole"), "--to", &at("twice")]);
    assert!(code == 1 && stderr.contains("edit.episode"), "{stderr}");
}
