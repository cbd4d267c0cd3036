//! Damaged files of every kind: each is refused with an error or a finding, none stops the program, none is taken for
//! whole.
//!
//! The suite does some thousand cases from a fixed seed. `NTP_FUZZ=1000000 cargo test --release fuzz` does a million
//! in all, `NTP_SEED=n` others. What once failed stays in `fuzz.regressions` and comes first.

pub(crate) mod change;
mod values;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{Sender, channel};
use std::time::Duration;

use ntp::artifact::{FileEntry, Plan, Receipt, StageDir};
use ntp::dataset::{ConvertConfig, read_trials, schema, validate};
use ntp::pipeline::PipelineFile;
use ntp::publish;
use ntp::recording::{ShardReader, ShardWriter};
use ntp::table;
use ntp::task::{Family, Split, TaskSet, import, sample};
use ntp::trace::Episode;
use proptest::prelude::Strategy;
use proptest::test_runner::{Config, FileFailurePersistence, RngAlgorithm, TestError, TestRng, TestRunner};

use crate::dataset::convert_all;
use crate::kinematic::{demonstration, sorting, tower, trial};
use crate::length::{from_environment, tell};
use change::{changed, changes, changes_of_text};

/// Cases of all targets together in the suite.
const IN_SUITE: u64 = 4000;
/// A case that takes longer is taken for one that never ends.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs a target's share of the cases, in thousandths of all.
#[track_caller]
pub(crate) fn run<S: Strategy>(share: u64, strategy: &S, case: impl Fn(S::Value)) {
    let cases = (from_environment("NTP_FUZZ", IN_SUITE) * share).div_ceil(1000) as u32;
    let regressions = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/it/fuzz.regressions");
    let config = Config {
        cases,
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(regressions))),
        max_shrink_iters: 512,
        ..Config::default()
    };
    let mut seed = [0_u8; 32];
    seed[..8].copy_from_slice(&from_environment("NTP_SEED", 1).to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &seed);
    let watched = watch();
    let outcome = TestRunner::new_with_rng(config, rng).run(strategy, |value| {
        let _watcher_is_gone = watched.send(());
        case(value);
        Ok(())
    });
    match outcome {
        Ok(()) => {}
        Err(TestError::Fail(reason, value)) => panic!("{reason}: {value:?}"),
        Err(TestError::Abort(reason)) => panic!("{reason}"),
    }
}

/// A thread that ends the process when a case does not end.
fn watch() -> Sender<()> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        while let Ok(()) = receiver.recv() {
            // Cases that came meanwhile are over too.
            while receiver.try_recv().is_ok() {}
            match receiver.recv_timeout(PATIENCE) {
                Ok(()) => {}
                Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => return,
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {
                    tell(&format!("a case has not ended after {PATIENCE:?}"));
                    std::process::abort();
                }
            }
        }
    });
    sender
}

/// A file that is damaged again and again.
struct Target {
    _folder: tempfile::TempDir,
    path: PathBuf,
    whole: Vec<u8>,
}

impl Target {
    fn new(name: &str, write: impl FnOnce(&Path)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        write(&path);
        Self { whole: std::fs::read(&path).unwrap(), _folder: folder, path }
    }

    fn put(&self, bytes: &[u8]) {
        std::fs::write(&self.path, bytes).unwrap();
    }
}

/// A dataset of two short episodes with a manifest.
pub(crate) fn small_dataset() -> tempfile::TempDir {
    let tasks = [tower("stack_0", &[2, 5], Split::Seen), tower("stack_1", &[1, 3], Split::Unseen)];
    let episodes: Vec<Episode> =
        tasks.iter().enumerate().map(|(at, task)| demonstration(task, &trial(task, 0, 1), at as u64)).collect();
    let folder = tempfile::tempdir().unwrap();
    let written = convert_all(&episodes, &ConvertConfig::default(), folder.path()).unwrap();
    let dir = StageDir::new("convert", folder.path());
    let plan = Plan::new("convert", 1, Default::default(), serde_json::json!({}));
    dir.write_plan(&plan).unwrap();
    let files = written.files.iter().map(|file| FileEntry::of(folder.path(), file).unwrap()).collect();
    dir.commit_shard(&Receipt { plan_id: plan.id(), shard: 0, episodes: 2, failed: 0, files }).unwrap();
    dir.commit(&plan, &[]).unwrap();
    folder
}

/// Files of a dataset, with the schemas of those that are tables.
pub(crate) const FILES: [(&str, Option<table::TableSchema>); 10] = [
    ("data/chunk-000/file-000.parquet", Some(schema::FRAMES)),
    ("ntp/calls/chunk-000/file-000.parquet", Some(schema::CALLS)),
    ("ntp/scopes/chunk-000/file-000.parquet", Some(schema::SCOPES)),
    ("ntp/episodes.parquet", Some(schema::EPISODES)),
    ("meta/episodes/chunk-000/file-000.parquet", Some(schema::META_EPISODES)),
    ("meta/tasks.parquet", Some(schema::TASKS)),
    ("meta/subtasks.parquet", Some(schema::SUBTASKS)),
    ("meta/info.json", None),
    ("meta/stats.json", None),
    ("ntp/info.json", None),
];

#[test]
fn fuzz_recordings() {
    let task = sorting("sort_0", [1, 0, 2, 3], Split::Seen);
    let episodes = [0, 1].map(|index| demonstration(&task, &trial(&task, index, 1), u64::from(index)));
    let target = Target::new("shard.mcap", |path| {
        let mut writer = ShardWriter::create(path, "{}").unwrap();
        episodes.iter().for_each(|episode| writer.write(episode).unwrap());
        writer.finish().unwrap();
    });
    run(150, &changes(), |changes| {
        let bytes = changed(&target.whole, &changes);
        target.put(&bytes);
        let read: Result<Vec<Episode>, _> = ShardReader::open(&target.path).and_then(Iterator::collect);
        let _described = ntp::recording::inspect(&target.path);
        if let Ok(read) = read {
            assert_eq!(bytes, target.whole, "a damaged recording was taken for whole");
            assert_eq!(read, episodes);
        }
    });
}

#[test]
fn fuzz_tables_alone() {
    let dataset = small_dataset();
    let tables: Vec<(PathBuf, table::TableSchema, Vec<u8>)> = FILES
        .into_iter()
        .filter_map(|(file, schema)| Some((dataset.path().join(file), schema?)))
        .map(|(path, schema)| (path.clone(), schema, std::fs::read(path).unwrap()))
        .collect();
    run(300, &(0..tables.len(), changes()), |(table, changes)| {
        let (path, schema, whole) = &tables[table];
        std::fs::write(path, changed(whole, &changes)).unwrap();
        let _refused_or_read = table::read(path, schema);
        let _listed = table::file_columns(path);
    });
}

#[test]
fn fuzz_files_of_datasets() {
    let dataset = small_dataset();
    let root = dataset.path();
    let files: Vec<(PathBuf, Option<table::TableSchema>, Vec<u8>)> = FILES
        .into_iter()
        .map(|(file, schema)| (root.join(file), schema, std::fs::read(root.join(file)).unwrap()))
        .collect();
    let dir = StageDir::new("convert", root);
    let manifest = dir.manifest().unwrap().unwrap();
    run(50, &(0..files.len(), changes_of_text()), |(file, changes)| {
        let (path, schema, whole) = &files[file];
        let bytes = changed(whole, &changes);
        std::fs::write(path, &bytes).unwrap();
        let found = validate(root);
        let _learned_or_refused = read_trials(root);
        let is_whole = bytes == *whole;
        assert_eq!(dir.check_files(&manifest, true).is_ok(), is_whole, "the manifest tells every change");
        assert!(found.is_valid() || !is_whole, "{:?}", found.findings.first());
        if let (true, Some(schema)) = (found.is_valid(), schema) {
            let after = table::read(path, schema).map(table::Columns::into_inner);
            std::fs::write(path, whole).unwrap();
            let before = table::read(path, schema).unwrap().into_inner();
            values::assert_same_where_checked(schema, &before, &after.unwrap());
        }
        std::fs::write(path, whole).unwrap();
    });
}

#[test]
fn fuzz_task_files() {
    let target = Target::new("tasks.json", |path| {
        sample(Family::BlockStacking, 4, 3, ntp::seed::Seed(1)).unwrap().write(path).unwrap();
    });
    run(200, &changes_of_text(), |changes| {
        target.put(&changed(&target.whole, &changes));
        if let Ok(tasks) = TaskSet::read(&target.path) {
            let _refused_or_not = tasks.validate();
        }
    });
}

#[test]
fn fuzz_task_files_of_the_authors() {
    let target =
        Target::new("stack.json", |path| std::fs::write(path, crate::task::authors_file().to_string()).unwrap());
    assert!(import(&target.path, 1).is_ok());
    run(100, &changes_of_text(), |changes| {
        target.put(&changed(&target.whole, &changes));
        let _refused_or_imported = import(&target.path, 1);
    });
}

#[test]
fn fuzz_pipeline_files() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let names = ["adversary.toml", "table_cleanup.toml", "object_sorting.toml", "smoke.toml", "paper_small.toml"];
    let texts = names.map(|name| std::fs::read(folder.join(name)).unwrap());
    let target = Target::new("pipeline.toml", |path| std::fs::write(path, "").unwrap());
    run(150, &(0..texts.len(), changes_of_text()), |(text, changes)| {
        target.put(&changed(&texts[text], &changes));
        let _refused_or_loaded = PipelineFile::load(&target.path);
    });
}

#[test]
fn fuzz_models() {
    let folder = tempfile::tempdir().unwrap();
    crate::damaged_model::small_model(folder.path(), ntp::model::Variant::NTP);
    let files = [ntp::model::CONFIG_FILE, ntp::model::WEIGHTS_FILE].map(|file| {
        let path = folder.path().join(file);
        (path.clone(), std::fs::read(path).unwrap())
    });
    run(100, &(0..files.len(), changes_of_text()), |(file, changes)| {
        let (path, whole) = &files[file];
        std::fs::write(path, changed(whole, &changes)).unwrap();
        let described = ntp::model::inspect(folder.path());
        let acts = ntp::rollout::load_policy(folder.path(), ntp::model::Decoder::Mss);
        assert_eq!(described.is_ok(), acts.is_ok(), "what can be described can act");
        std::fs::write(path, whole).unwrap();
    });
}

#[test]
fn fuzz_checksum_files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.txt"), "a").unwrap();
    let sums = format!("{}  a.txt\n", ntp::artifact::sha256_bytes(b"a")).into_bytes();
    run(50, &changes_of_text(), |changes| {
        let bytes = changed(&sums, &changes);
        std::fs::write(folder.path().join("SHA256SUMS"), &bytes).unwrap();
        let found = publish::verify(&ntp::store::Folder::new(folder.path())).unwrap();
        let says_the_same =
            String::from_utf8_lossy(&bytes).trim_end().eq_ignore_ascii_case(String::from_utf8_lossy(&sums).trim_end());
        assert!(!found.differences.is_empty() || says_the_same, "{:?}", String::from_utf8_lossy(&bytes));
    });
}
