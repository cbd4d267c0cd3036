//! Files that are whole or not there.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

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

/// A finished stage of two shards, whose settings have texts with quotes and a number that not every reader keeps.
fn finished_stage(folder: &Path) -> StageDir {
    let dir = StageDir::new("generate", folder.join("stage"));
    let settings = json!({ "words": "a \"b\" \\", "impulse_ns": f64::from(0.03_f32) });
    let plan = Plan::new("generate", 2, BTreeMap::new(), settings);
    dir.begin(&plan).unwrap();
    for shard in [0, 1] {
        dir.commit_shard(&receipt(&dir, &plan, shard)).unwrap();
    }
    dir.commit(&plan, &[]).unwrap();
    dir
}

#[test]
fn no_bit_of_plan_or_receipts_can_change_unseen() {
    let folder = tempfile::tempdir().unwrap();
    let dir = finished_stage(folder.path());
    let manifest = dir.finished().unwrap();
    dir.check_record(&manifest).unwrap();
    for file in ["plan.json", "receipts/shard-00000.json", "receipts/shard-00001.json"] {
        let path = dir.path().join(file);
        let whole = std::fs::read(&path).unwrap();
        for at in 0..whole.len() {
            for bit in 0..8 {
                let mut bytes = whole.clone();
                bytes[at] ^= 1 << bit;
                std::fs::write(&path, &bytes).unwrap();
                assert!(dir.check_record(&manifest).is_err(), "{file}: byte {at}, bit {bit}");
            }
        }
        std::fs::write(&path, &whole).unwrap();
    }
    dir.check_record(&manifest).unwrap();
}

#[test]
fn a_missing_plan_or_receipt_is_named_and_a_published_folder_has_no_receipts() {
    let folder = tempfile::tempdir().unwrap();
    let dir = finished_stage(folder.path());
    let manifest = dir.finished().unwrap();
    std::fs::remove_file(dir.path().join("receipts/shard-00001.json")).unwrap();
    let error = dir.check_record(&manifest).unwrap_err().to_string();
    assert!(error.ends_with("receipts/shard-00001.json: missing"), "{error}");
    std::fs::remove_dir_all(dir.path().join("receipts")).unwrap();
    dir.check_record(&manifest).unwrap();
    std::fs::remove_file(dir.path().join("plan.json")).unwrap();
    let error = dir.check_record(&manifest).unwrap_err().to_string();
    assert!(error.ends_with("plan.json: missing"), "{error}");
}

#[test]
fn a_lock_is_held_once_and_given_back() {
    let folder = tempfile::tempdir().unwrap();
    let lock = RunLock::take(folder.path()).unwrap();
    assert!(matches!(RunLock::take(folder.path()), Err(LockError::Held { .. })));
    drop(lock);
    RunLock::take(folder.path()).unwrap();
}
