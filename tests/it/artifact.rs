//! Files that are whole or not there.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::Path;

use ntp::artifact::{
    AtomicFile, Committed, ContractError, FileEntry, LockError, Plan, Receipt, RunLock, StageDir, write,
};
use proptest::prelude::*;
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
    assert!(dir.receipt(&second.id(), 0).unwrap().is_none());
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

/// A plan as a stage writes it and reads it back.
fn through_json(plan: &Plan) -> Plan {
    serde_json::from_str(&serde_json::to_string_pretty(plan).unwrap()).unwrap()
}

#[test]
fn a_plan_with_any_f32_setting_survives_its_own_json() {
    // Every 4099th of all f32, and all around those that are written with the most digits.
    let all = (0..=u32::MAX).step_by(4099).chain(0x3cf5_c28f - 20_000..0x3cf5_c28f + 20_000);
    let settings: Vec<f32> = all.map(f32::from_bits).filter(|setting| setting.is_finite()).collect();
    assert!(settings.len() > 1_000_000);
    let plan = Plan::new("generate", 1, BTreeMap::new(), json!({ "settings": settings }));
    let read = through_json(&plan);
    assert!(read == plan, "a setting moved");
    assert_eq!(read.id(), plan.id());
    assert_eq!(read.setting::<Vec<f32>>(&["settings"]), Some(settings));
}

proptest! {
    #[test]
    fn a_plan_survives_its_own_json(
        settings in proptest::collection::vec(proptest::num::f32::ANY.prop_filter("JSON has none", |x| x.is_finite()), 1..20),
        whole in any::<i64>(),
        text in ".*",
        stage_version in 1..5_u32,
    ) {
        let config = json!({ "text": text, "nested": { "settings": settings, "whole": whole } });
        let plan = Plan::new("rollout", 3, BTreeMap::from([("tasks".to_owned(), text)]), config);
        let plan = plan.of_stage_version(stage_version);
        let read = through_json(&plan);
        prop_assert_eq!(&read, &plan);
        prop_assert_eq!(read.id(), plan.id());
        prop_assert_eq!(plan.difference(&read), None);
    }
}

#[test]
fn plans_differ_by_stage_version_inputs_and_settings_but_not_by_release() {
    let old = plan(1, 1);
    let release = Plan { ntp_version: "0.0.9".to_owned(), ..old.clone() };
    assert_eq!(release.difference(&old), None);
    assert_ne!(release.id(), old.id());
    let difference = |new: Plan| old.difference(&new).unwrap();
    assert_eq!(difference(old.clone().of_stage_version(2)), "made by version 1 of generate, this is 2");
    assert_eq!(difference(plan(1, 2)), "its setting setting changed");
    assert_eq!(difference(plan(2, 1)), "it had 1 shard, now it has 2");
    let inputs = BTreeMap::from([("tasks".to_owned(), "abc".to_owned())]);
    assert_eq!(difference(Plan { inputs, ..old.clone() }), "its input tasks changed");
}

#[test]
fn the_first_version_of_a_stage_is_not_written_so_that_earlier_plans_keep_their_ids() {
    let text = serde_json::to_string(&plan(1, 1)).unwrap();
    assert!(!text.contains("stage_version"), "{text}");
    assert!(serde_json::to_string(&plan(1, 1).of_stage_version(2)).unwrap().contains("\"stage_version\":2"));
}

#[test]
fn who_joins_another_plan_is_refused_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let dir = StageDir::new("generate", folder.path().join("stage"));
    let (first, second) = (plan(2, 1), plan(2, 2));
    dir.join(&first).unwrap();
    dir.join(&first).unwrap();
    dir.commit_shard(&receipt(&dir, &first, 0)).unwrap();
    let error = dir.join(&second).unwrap_err();
    assert!(matches!(&error, ContractError::OtherPlan { .. }), "{error}");
    assert!(error.to_string().contains("its setting setting changed; nothing was changed"), "{error}");
    assert!(dir.receipt(&first.id(), 0).unwrap().is_some());
    assert_eq!(dir.plan().unwrap(), Some(first));
}

#[test]
fn the_first_receipt_wins_unless_it_is_of_no_use() {
    let folder = tempfile::tempdir().unwrap();
    let dir = StageDir::new("generate", folder.path().join("stage"));
    let plan = plan(1, 1);
    dir.join(&plan).unwrap();
    let first = receipt(&dir, &plan, 0);
    assert_eq!(dir.commit_shard(&first).unwrap(), Committed::Here);
    assert_eq!(dir.commit_shard(&Receipt { failed: 2, ..first.clone() }).unwrap(), Committed::Before);
    assert_eq!(dir.receipt(&plan.id(), 0).unwrap(), Some(first));
    write(&dir.path().join("shard-0"), b"cut").unwrap();
    let again = receipt(&dir, &plan, 0);
    write(&dir.path().join("shard-0"), b"cut").unwrap();
    assert!(dir.receipt(&plan.id(), 0).unwrap().is_none());
    assert_eq!(dir.commit_shard(&again).unwrap(), Committed::Here);
}

#[test]
fn of_processes_that_commit_one_shard_at_once_one_is_first() {
    let folder = tempfile::tempdir().unwrap();
    let dir = StageDir::new("generate", folder.path().join("stage"));
    let plan = plan(1, 1);
    let own = receipt(&dir, &plan, 0);
    for _ in 0..50 {
        let outcomes: Vec<Committed> = std::thread::scope(|scope| {
            let twins: Vec<_> = (0..8).map(|_| scope.spawn(|| dir.commit_shard(&own).unwrap())).collect();
            twins.into_iter().map(|twin| twin.join().unwrap()).collect()
        });
        assert_eq!(outcomes.iter().filter(|outcome| **outcome == Committed::Here).count(), 1);
        std::fs::remove_file(dir.path().join("receipts/shard-00000.json")).unwrap();
    }
}

#[cfg(unix)]
#[test]
fn a_file_that_came_after_its_receipt_must_have_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let dir = StageDir::new("generate", folder.path().join("stage"));
    let plan = plan(2, 1);
    dir.join(&plan).unwrap();
    for shard in 0..2 {
        dir.commit_shard(&receipt(&dir, &plan, shard)).unwrap();
    }
    std::thread::sleep(std::time::Duration::from_millis(20));
    write(&dir.path().join("shard-0"), &[0; 10]).unwrap();
    assert_eq!(dir.missing(&plan).unwrap(), [] as [u32; 0], "a twin with the same bytes");
    write(&dir.path().join("shard-1"), &[7; 10]).unwrap();
    assert_eq!(dir.missing(&plan).unwrap(), [1], "a twin with other bytes of the same size");
}
