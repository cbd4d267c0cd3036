//! Files that are whole or not there.

use std::collections::BTreeMap;
use std::io::Write as _;

use ntp::artifact::{AtomicFile, ContractError, FileEntry, LockError, Plan, Receipt, RunLock, StageDir, write};
use serde_json::json;

fn plan(shards: u32, setting: u32) -> Plan {
    Plan::new("generate", shards, BTreeMap::new(), json!({ "setting": setting }))
}

fn receipt(dir: &StageDir, plan: &Plan, shard: u32) -> Receipt {
    let name = format!("shard-{shard}");
    write(&dir.path().join(&name), &[shard as u8; 10]).unwrap();
    let files = vec![FileEntry::of(dir.path(), &name).unwrap()];
    Receipt { plan_id: plan.id(), shard, episodes: 2, failed: 1, files }
}

#[test]
fn a_file_that_is_not_committed_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a/file");
    let mut file = AtomicFile::create(&path).unwrap();
    file.write_all(b"half").unwrap();
    drop(file);
    assert_eq!(std::fs::read_dir(folder.path().join("a")).unwrap().count(), 0);
}

#[test]
fn a_stage_is_finished_only_when_every_shard_has_its_receipt() {
    let folder = tempfile::tempdir().unwrap();
    let dir = StageDir::new("generate", folder.path().join("stage"));
    let plan = plan(3, 1);
    dir.begin(&plan).unwrap();
    for shard in [2, 0] {
        dir.commit_shard(&receipt(&dir, &plan, shard)).unwrap();
    }
    let error = dir.commit(&plan, &[]).unwrap_err();
    assert!(matches!(&error, ContractError::MissingShards { missing, total: 3, .. } if *missing == [1]));
    assert!(matches!(dir.finished().unwrap_err(), ContractError::Unfinished { .. }));
    dir.commit_shard(&receipt(&dir, &plan, 1)).unwrap();
    let manifest = dir.commit(&plan, &[]).unwrap();
    assert_eq!((manifest.episodes, manifest.failed, manifest.files.len()), (6, 3, 3));
}

#[test]
fn another_plan_takes_nothing_of_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let dir = StageDir::new("generate", folder.path().join("stage"));
    let (first, second) = (plan(1, 1), plan(1, 2));
    dir.begin(&first).unwrap();
    dir.commit_shard(&receipt(&dir, &first, 0)).unwrap();
    assert!(dir.receipt(&second, 0).unwrap().is_none());
    dir.begin(&second).unwrap();
    assert!(!dir.path().join("shard-0").exists());
}

#[test]
fn a_changed_file_is_named_with_what_its_manifest_says() {
    let folder = tempfile::tempdir().unwrap();
    let dir = StageDir::new("generate", folder.path().join("stage"));
    let plan = plan(1, 1);
    dir.begin(&plan).unwrap();
    dir.commit_shard(&receipt(&dir, &plan, 0)).unwrap();
    let manifest = dir.commit(&plan, &[]).unwrap();
    dir.check_files(&manifest, true).unwrap();
    write(&dir.path().join("shard-0"), &[9; 10]).unwrap();
    dir.check_files(&manifest, false).unwrap();
    let error = dir.check_files(&manifest, true).unwrap_err().to_string();
    assert!(error.contains("shard-0") && error.contains("sha256"), "{error}");
}

#[test]
fn a_lock_is_held_once_and_given_back() {
    let folder = tempfile::tempdir().unwrap();
    let lock = RunLock::take(folder.path()).unwrap();
    assert!(matches!(RunLock::take(folder.path()), Err(LockError::Held { .. })));
    drop(lock);
    RunLock::take(folder.path()).unwrap();
}
