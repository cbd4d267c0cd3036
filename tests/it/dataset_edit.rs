//! Datasets of datasets: merged and filtered ones are as if converted so, open elsewhere, and what does not fit is
//! refused by name.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, BinaryArray, RecordBatch, StringArray, StructArray};
use arrow::datatypes::{DataType, Field, Int64Type};
use ntp::dataset::edit::{Carry, Condition, EditError, Ending, SplitBy, Unit, diff, filter, merge, split};
use ntp::dataset::{
    ConvertConfig, FailedEpisodes, FrameChoice, RecordingEpisodes, convert, read_trials, schema, validate,
};
use ntp::program::Program;
use ntp::table::{self, Column};
use ntp::task::Split;
use ntp::trace::{Cause, Episode};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use re_lerobot::EpisodeIndex;
use re_lerobot::datasetv3::LeRobotDatasetV3;

use crate::dataset::{densify, episodes, failed, rewrite, sorting_episodes};
use crate::kinematic::{demonstration, tower, trial};

const TABLES: [(&str, table::TableSchema); 7] = [
    ("data/chunk-000/file-000.parquet", schema::FRAMES),
    ("ntp/calls/chunk-000/file-000.parquet", schema::CALLS),
    ("ntp/scopes/chunk-000/file-000.parquet", schema::SCOPES),
    ("meta/episodes/chunk-000/file-000.parquet", schema::META_EPISODES),
    ("ntp/episodes.parquet", schema::EPISODES),
    ("meta/tasks.parquet", schema::TASKS),
    ("meta/subtasks.parquet", schema::SUBTASKS),
];

/// A dataset of recordings, each a number and its episodes.
fn dataset(root: &Path, recordings: &[(u32, &[Episode])], config: &ConvertConfig) {
    let recordings = recordings.iter().map(|(number, episodes)| {
        Ok::<_, Infallible>(RecordingEpisodes {
            file: format!("shard-{number:05}.mcap"),
            sha256: format!("{number:064x}"),
            episodes: episodes.iter().cloned().map(Ok),
        })
    });
    convert(recordings, config, root).unwrap();
}

/// A folder with the datasets `a` of four episodes and `b` of two others.
fn two_datasets() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    dataset(&folder.path().join("a"), &[(0, &episodes[..4])], &ConvertConfig::default());
    dataset(&folder.path().join("b"), &[(1, &episodes[4..])], &ConvertConfig::default());
    folder
}

fn sources(folder: &Path) -> [PathBuf; 2] {
    ["a", "b"].map(|name| folder.join(name))
}

#[track_caller]
fn assert_same_content(found: &Path, expected: &Path) {
    for (file, schema) in TABLES {
        let read = |root: &Path| table::read(&root.join(file), &schema).unwrap().into_inner();
        assert_eq!(read(found), read(expected), "{file}");
    }
    for file in ["meta/info.json", "meta/stats.json", "ntp/info.json"] {
        let read = |root: &Path| std::fs::read_to_string(root.join(file)).unwrap();
        assert_eq!(read(found), read(expected), "{file}");
    }
}

/// What Rerun's own reader of the format sees must be what is counted.
#[track_caller]
fn assert_opens_in_rerun(root: &Path, lengths: &[usize]) {
    let opened = LeRobotDatasetV3::load_from_directory(root).unwrap();
    assert_eq!(opened.metadata.episode_count(), lengths.len());
    let tasks = table::read(&root.join("meta/tasks.parquet"), &schema::TASKS).unwrap();
    let Some(Column::Text(tasks)) = tasks.get("__index_level_0__") else { panic!("no texts") };
    for (task, text) in tasks.iter().enumerate() {
        assert_eq!(opened.task_by_index(re_lerobot::TaskIndex(task)).unwrap().task, *text);
    }
    for (episode, &length) in lengths.iter().enumerate() {
        let rows = opened.read_episode_data(EpisodeIndex(episode)).unwrap();
        assert_eq!(rows.num_rows(), length, "episode {episode}");
    }
}

fn lengths(root: &Path) -> Vec<usize> {
    let mut rows = table::read(&root.join("ntp/episodes.parquet"), &schema::EPISODES).unwrap();
    rows.int64("n_frames").unwrap().into_iter().map(|n| n as usize).collect()
}

#[track_caller]
fn refused<T: std::fmt::Debug>(result: Result<T, EditError>, code: &str, words: &str) {
    let error = result.unwrap_err().to_string();
    assert!(error.starts_with(code) && error.contains(words), "{error:?} is no {code} with {words:?}");
}

#[test]
fn merging_gives_what_converting_all_at_once_would() {
    let folder = two_datasets();
    let whole = folder.path().join("whole");
    let episodes = episodes();
    dataset(&whole, &[(0, &episodes[..4]), (1, &episodes[4..])], &ConvertConfig::default());
    let merged = folder.path().join("merged");
    let summary = merge(&sources(folder.path()), &merged, Carry::Packets).unwrap();
    assert_eq!((summary.episodes, summary.left_out, summary.tasks), (6, 0, 3));
    assert_same_content(&merged, &whole);
    assert_eq!(validate(&merged).findings, []);
    assert_eq!(read_trials(&merged).unwrap(), read_trials(&whole).unwrap());
    assert_opens_in_rerun(&merged, &lengths(&whole));
}

#[test]
fn merging_keeps_frames_between_boundaries_and_both_kinds_of_slot_names() {
    let folder = tempfile::tempdir().unwrap();
    let config = ConvertConfig { frames: FrameChoice::All, ..ConvertConfig::default() };
    let dense = |episodes: Vec<Episode>| episodes.iter().map(|episode| densify(episode, 3)).collect::<Vec<_>>();
    let (towers, sorted) = (dense(episodes()), dense(sorting_episodes()));
    dataset(&folder.path().join("a"), &[(0, &towers)], &config);
    dataset(&folder.path().join("b"), &[(1, &sorted)], &config);
    dataset(&folder.path().join("whole"), &[(0, &towers), (1, &sorted)], &config);
    let merged = folder.path().join("merged");
    merge(&sources(folder.path()), &merged, Carry::Packets).unwrap();
    assert_same_content(&merged, &folder.path().join("whole"));
    assert_eq!(validate(&merged).findings, []);
    assert_opens_in_rerun(&merged, &lengths(&merged));
}

#[test]
fn merging_is_the_same_bytes_each_time_and_says_where_episodes_come_from() {
    let folder = two_datasets();
    let [first, second] = ["first", "second"].map(|name| folder.path().join(name));
    let summary = merge(&sources(folder.path()), &first, Carry::Packets).unwrap();
    assert_eq!(merge(&sources(folder.path()), &second, Carry::Packets).unwrap(), summary);
    for file in summary.files.iter().map(String::as_str).chain(["plan.json", "manifest.json"]) {
        let [a, b] = [&first, &second].map(|root| std::fs::read(root.join(file)).unwrap());
        assert!(a == b, "{file} differs");
    }
    let plan: serde_json::Value = ntp::artifact::read_json(&first.join("plan.json")).unwrap();
    assert_eq!(plan["stage"], "merge");
    let sources = plan["config"]["sources"].as_array().unwrap();
    assert_eq!((&sources[1]["name"], &sources[1]["episodes"]), (&"b".into(), &serde_json::json!([4, 6])));
    let mut rows = table::read(&first.join("ntp/episodes.parquet"), &schema::EPISODES).unwrap();
    assert_eq!(rows.text("recording").unwrap()[3..5], ["shard-00000.mcap", "shard-00001.mcap"]);
    assert_eq!(rows.text("recording_sha256").unwrap()[4], format!("{:064x}", 1));
}

#[test]
fn filtering_gives_what_converting_the_wanted_episodes_would() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("a");
    let mut all = episodes();
    all[2] = failed(&all[2]);
    let config = ConvertConfig { failed: FailedEpisodes::Include, ..ConvertConfig::default() };
    dataset(&root, &[(0, &all)], &config);
    let cases: [(&str, Condition, &[usize]); 8] = [
        ("task", Condition { tasks: vec!["stack_1".into()], ..Condition::default() }, &[2, 3]),
        ("split", Condition { split: Some(Split::Seen.name().to_owned()), ..Condition::default() }, &[0, 1]),
        ("success", Condition { outcomes: vec![Ending::Success], ..Condition::default() }, &[0, 1, 3, 4, 5]),
        ("cause", Condition { outcomes: vec![Ending::Cause(Cause::MissedGrasp)], ..Condition::default() }, &[2]),
        ("short", Condition { max_frames: Some(5), ..Condition::default() }, &[2, 3]),
        ("long", Condition { min_frames: Some(6), max_frames: Some(9), ..Condition::default() }, &[0, 1]),
        (
            "program",
            Condition { programs: vec![Program::BlockStacking.name().to_owned()], ..Condition::default() },
            &[0, 1, 2, 3, 4, 5],
        ),
        (
            "both",
            Condition {
                outcomes: vec![Ending::Failure],
                split: Some(Split::Unseen.name().to_owned()),
                ..Condition::default()
            },
            &[2],
        ),
    ];
    for (name, condition, wanted) in cases {
        let found = folder.path().join(name);
        let summary = filter(&root, &condition, &found, Carry::Packets).unwrap();
        assert_eq!(summary.left_out as usize, 6 - wanted.len(), "{name}");
        assert_eq!(validate(&found).findings, [], "{name}");
        let expected = tempfile::tempdir().unwrap();
        let episodes: Vec<Episode> = wanted.iter().map(|&at| all[at].clone()).collect();
        dataset(expected.path(), &[(0, &episodes)], &config);
        assert!(diff(&found, expected.path()).unwrap().is_none(), "{name}");
        assert_opens_in_rerun(&found, &lengths(expected.path()));
        let stats =
            |root: &Path| -> serde_json::Value { ntp::artifact::read_json(&root.join("meta/stats.json")).unwrap() };
        assert_eq!(stats(&found)["observation.state"], stats(expected.path())["observation.state"], "{name}");
        assert_eq!(stats(&found)["index"], stats(expected.path())["index"], "{name}");
    }
    let none = Condition { programs: vec![Program::ObjectSorting.name().to_owned()], ..Condition::default() };
    refused(filter(&root, &none, &folder.path().join("none"), Carry::Packets), "edit.empty", "no episode is left");
    assert!(!folder.path().join("none").exists() && !folder.path().join(".partial-none").exists());
}

#[test]
fn what_does_not_fit_together_is_refused_by_name() {
    let folder = two_datasets();
    let (a, other) = (folder.path().join("a"), folder.path().join("other"));
    let to = folder.path().join("merged");
    let all = episodes();
    let check = |make: &dyn Fn(&Path), code: &str, words: &str| {
        let _none = std::fs::remove_dir_all(&other);
        make(&other);
        refused(merge(&[a.clone(), other.clone()], &to, Carry::Packets), code, words);
        assert!(!to.exists());
    };
    let with = |config: ConvertConfig| move |root: &Path| dataset(root, &[(1, &episodes()[4..])], &config);
    let fps = ConvertConfig { fps: NonZeroU32::new(20).unwrap(), ..ConvertConfig::default() };
    check(&with(fps), "edit.fps", "fps is 20, but in");
    let frames = ConvertConfig { frames: FrameChoice::All, ..ConvertConfig::default() };
    check(&with(frames), "edit.frames", "frames is \"all\"");
    check(
        &|root| dataset(root, &[(0, &all[3..5])], &ConvertConfig::default()),
        "edit.episode",
        "episode 3 of the recording",
    );
    let leak = tower("stack_0", &[2, 5, 0], Split::Unseen);
    let leak = [demonstration(&leak, &trial(&leak, 7, 1), 0)];
    check(&|root| dataset(root, &[(2, &leak)], &ConvertConfig::default()), "edit.task", "\"stack_0\" is unseen");
    let json = |file: &'static str, from: &'static str, to: &'static str| {
        move |root: &Path| {
            dataset(root, &[(1, &episodes()[4..])], &ConvertConfig::default());
            let text = std::fs::read_to_string(root.join(file)).unwrap();
            assert!(text.contains(from));
            std::fs::write(root.join(file), text.replacen(from, to, 1)).unwrap();
        }
    };
    check(&json("ntp/info.json", "\"schema_version\": 1", "\"schema_version\": 9"), "edit.version", "9, but 1");
    check(&json("meta/info.json", "v3.0", "v2.1"), "edit.version", "\"v2.1\"");
    check(&json("ntp/info.json", "\"vocabulary_hash\": \"", "\"vocabulary_hash\": \"0"), "edit.vocabulary", "programs");
    check(&json("ntp/info.json", "\"n_slots\": 8", "\"n_slots\": 9"), "edit.slots", "n_slots is 9");
    check(&json("meta/info.json", "\"ntp.time_secs\"", "\"ntp.time\""), "edit.features", "\"ntp.time\"");
    check(
        &|root| {
            dataset(root, &[(1, &episodes()[4..])], &ConvertConfig::default());
            add_pictures(root);
        },
        "edit.columns",
        "observation.picture",
    );
    refused(merge(&[a.clone(), a], &to, Carry::Packets), "edit.episode", "is there twice");
    refused(merge(&[], &to, Carry::Packets), "edit.empty", "no dataset");
}

#[test]
fn only_a_new_folder_is_written_and_what_a_killed_process_left_is_removed() {
    let folder = two_datasets();
    let to = folder.path().join("to");
    std::fs::create_dir_all(to.join("mine")).unwrap();
    let error = merge(&sources(folder.path()), &to, Carry::Packets).unwrap_err();
    assert!(matches!(error, EditError::Staging(_)) && error.to_string().contains("new or empty folder"), "{error}");
    std::fs::remove_dir(to.join("mine")).unwrap();
    let partial = folder.path().join(".partial-to");
    std::fs::create_dir_all(partial.join("data")).unwrap();
    std::fs::write(partial.join("data/file"), "half").unwrap();
    merge(&sources(folder.path()), &to, Carry::Packets).unwrap();
    assert!(!partial.exists() && !to.join("data/file").exists() && !to.join(".lock").exists());
    assert_eq!(validate(&to).findings, []);
}

/// Gives the frames a column of pictures, as LeRobot has them: a frame's picture is its `index` as text.
fn add_pictures(root: &Path) {
    let path = root.join(TABLES[0].0);
    let file = std::fs::File::open(&path).unwrap();
    let reader = ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap();
    let batches: Vec<RecordBatch> = reader.map(Result::unwrap).map(|rows| with_pictures(&rows)).collect();
    let mut writer = ArrowWriter::try_new(std::fs::File::create(&path).unwrap(), batches[0].schema(), None).unwrap();
    batches.iter().for_each(|rows| writer.write(rows).unwrap());
    writer.close().unwrap();
}

fn with_pictures(rows: &RecordBatch) -> RecordBatch {
    let index = rows.column_by_name("index").unwrap().as_primitive::<Int64Type>();
    let bytes: BinaryArray = index.values().iter().map(|index| Some(format!("picture {index}"))).collect();
    let paths: StringArray = index.values().iter().map(|_| None::<&str>).collect();
    let fields = [("bytes", DataType::Binary), ("path", DataType::Utf8)];
    let fields = fields.map(|(name, kind)| Field::new(name, kind, true));
    let pictures = StructArray::new(fields.to_vec().into(), vec![Arc::new(bytes) as ArrayRef, Arc::new(paths)], None);
    let schema = rows.schema();
    let named = schema.fields().iter().map(|field| field.name().clone()).zip(rows.columns().iter().cloned());
    let named: Vec<_> = named.chain([("observation.picture".to_owned(), Arc::new(pictures) as ArrayRef)]).collect();
    let nullable = named.iter().map(|(name, column)| (name.as_str(), Arc::clone(column), name.ends_with("picture")));
    RecordBatch::try_from_iter_with_nullable(nullable).unwrap()
}

#[test]
fn columns_that_only_others_know_are_carried_over() {
    let folder = two_datasets();
    for root in sources(folder.path()) {
        add_pictures(&root);
    }
    let (merged, filtered) = (folder.path().join("merged"), folder.path().join("filtered"));
    merge(&sources(folder.path()), &merged, Carry::Packets).unwrap();
    filter(&merged, &Condition { tasks: vec!["stack_2".into()], ..Condition::default() }, &filtered, Carry::Packets)
        .unwrap();
    let file = std::fs::File::open(filtered.join(TABLES[0].0)).unwrap();
    let rows = ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap().next().unwrap().unwrap();
    let pictures = rows.column_by_name("observation.picture").unwrap().as_struct().column(0).as_binary::<i32>().clone();
    let found: Vec<String> =
        pictures.iter().map(|picture| String::from_utf8(picture.unwrap().to_vec()).unwrap()).collect();
    let expected: Vec<String> = (0..rows.num_rows()).map(|index| format!("picture {index}")).collect();
    // Both of the task's episodes are all of `b`, whose frames were counted from 0.
    assert_eq!(found, expected);
    assert_eq!(rows.column_by_name("index").unwrap().as_primitive::<Int64Type>().value(3), 3);
    assert_eq!(rows.column_by_name("observation.state").unwrap().as_fixed_size_list().value_length(), 26);
}

#[test]
fn parts_hold_every_episode_once_and_tasks_stay_together() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("a");
    dataset(&root, &[(0, &episodes())], &ConvertConfig::default());
    let tasks = |part: &Path| -> BTreeSet<String> {
        let mut rows = table::read(&part.join("ntp/episodes.parquet"), &schema::EPISODES).unwrap();
        rows.text("task_id").unwrap().into_iter().collect()
    };
    let by_split = folder.path().join("by_split");
    let parts = split(&root, &SplitBy::Split, &by_split, Carry::Packets).unwrap();
    let counts: Vec<_> = parts.iter().map(|(name, summary)| (name.as_str(), summary.episodes)).collect();
    assert_eq!(counts, [("seen", 2), ("unseen", 4)]);
    assert_eq!(tasks(&by_split.join("seen")), BTreeSet::from(["stack_0".to_owned()]));
    let shares = |unit, seed| SplitBy::Shares { parts: vec![("train".into(), 0.67), ("val".into(), 0.33)], unit, seed };
    let drawn = folder.path().join("drawn");
    let parts = split(&root, &shares(Unit::Task, 3), &drawn, Carry::Packets).unwrap();
    assert_eq!(parts.iter().map(|(_, summary)| summary.episodes).collect::<Vec<_>>(), [4, 2]);
    assert!(tasks(&drawn.join("train")).is_disjoint(&tasks(&drawn.join("val"))));
    let together = folder.path().join("together");
    merge(&[drawn.join("train"), drawn.join("val")], &together, Carry::Packets).unwrap();
    let difference = diff(&root, &together).unwrap();
    assert!(difference.is_none(), "{difference:?}");
    let of_seed = |name: &str, seed| {
        let to = folder.path().join(name);
        split(&root, &shares(Unit::Episode, seed), &to, Carry::Packets).unwrap();
        lengths(&to.join("val"))
    };
    assert_eq!(of_seed("x", 1), of_seed("y", 1));
    assert_eq!(of_seed("z", 2).len(), 2);
    for part in ["drawn/train", "x/val"] {
        let part = folder.path().join(part);
        assert_eq!(validate(&part).findings, []);
        assert_opens_in_rerun(&part, &lengths(&part));
    }
    let unfit = |parts: &[(&str, f64)]| {
        let parts = parts.iter().map(|&(name, share)| (name.to_owned(), share)).collect();
        split(
            &root,
            &SplitBy::Shares { parts, unit: Unit::Task, seed: 0 },
            &folder.path().join("unfit"),
            Carry::Packets,
        )
    };
    refused(unfit(&[("a", 0.5), ("b", 0.4)]), "edit.parts", "the shares sum to 0.9");
    refused(unfit(&[("a", 0.99), ("b", 0.01)]), "edit.parts", "part \"b\"");
    refused(unfit(&[("../a", 1.0)]), "edit.parts", "a name has letters");
}

#[test]
fn a_difference_names_episodes_calls_and_labels() {
    let folder = two_datasets();
    let [a, b] = sources(folder.path());
    let same = diff(&a, &a).unwrap();
    assert!(same.is_none() && (same.same, same.moved) == (4, 0));
    let disjoint = diff(&a, &b).unwrap();
    assert_eq!((disjoint.same, disjoint.removed, disjoint.added), (0, 4, 2));
    assert_eq!(disjoint.added_episodes[1].task_id, "stack_2");
    let moved = folder.path().join("moved");
    merge(&[b, a.clone()], &moved, Carry::Packets).unwrap();
    let found = diff(&a, &moved).unwrap();
    assert_eq!((found.same, found.moved, found.added, found.changed), (4, 4, 2, 0));
    let spoilt = folder.path().join("spoilt");
    dataset(&spoilt, &[(0, &episodes()[..4])], &ConvertConfig::default());
    rewrite(&spoilt, TABLES[1].0, &schema::CALLS, |columns| {
        let at = columns.iter().position(|(name, _)| name == "instruction").unwrap();
        let Column::OptionalText(rows) = &mut columns[at].1 else { panic!() };
        rows[2] = Some("pick block_A".to_owned());
    });
    rewrite(&spoilt, TABLES[0].0, &schema::FRAMES, |columns| {
        let at = columns.iter().position(|(name, _)| name == "subtask_index").unwrap();
        let Column::Int64(rows) = &mut columns[at].1 else { panic!() };
        rows[0] = 0;
    });
    let found = diff(&a, &spoilt).unwrap();
    assert_eq!((found.same, found.changed), (3, 1));
    let [changed] = &found.changed_episodes[..] else { panic!("{found:?}") };
    assert_eq!((changed.before.episode_index, changed.after_index, &changed.calls[..]), (0, 0, &[2][..]));
    assert_eq!(changed.frames.iter().map(|(name, n)| (name.as_str(), *n)).collect::<Vec<_>>(), [("subtask", 1)]);
    assert_eq!((changed.scopes, changed.episode_columns.len()), (0, 0));
}

#[test]
fn every_refusal_is_documented_and_no_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let in_folder = |folder: &str| {
        let entries = std::fs::read_dir(root.join("src/dataset").join(folder)).unwrap();
        entries.map(|entry| entry.unwrap().path()).filter(|path| path.is_file()).collect::<Vec<_>>()
    };
    let files = ["edit.rs", "export.rs", "import.rs"].map(|file| root.join("src/dataset").join(file));
    let files = files.into_iter().chain(["edit", "edit/plain", "import"].into_iter().flat_map(in_folder));
    let text: String = files.map(|path| std::fs::read_to_string(path).unwrap()).collect();
    let is_code = |word: &&str| {
        let name = word.strip_prefix("edit.").or_else(|| word.strip_prefix("import."));
        name.is_some_and(|name| !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase()))
    };
    let used: BTreeSet<&str> = text.split('"').filter(is_code).collect();
    let page = std::fs::read_to_string(root.join("schemas/findings.md")).unwrap();
    let documented: BTreeSet<&str> = page.split('`').filter(is_code).collect();
    assert!(used.len() > 5);
    assert_eq!(used, documented);
}

/// Changes a byte of a file, and what `ntp validate` then says of the dataset.
#[track_caller]
fn validate_finds_a_changed_byte(root: &Path, file: &str, [byte, other]: [&str; 2], named: &str) {
    let path = root.join(file);
    let whole = std::fs::read_to_string(&path).unwrap();
    assert!(whole.contains(byte), "{file} has no {byte:?}");
    std::fs::write(&path, whole.replacen(byte, other, 1)).unwrap();
    let (code, stdout, stderr) = crate::pipeline::run(&["validate", &root.to_string_lossy()]);
    assert_eq!(code, 1, "{file}: {stdout}{stderr}");
    assert!(stdout.contains("MANIFEST") && stdout.contains(named), "{stdout}");
    std::fs::write(&path, whole).unwrap();
}

#[test]
fn validate_finds_a_changed_byte_in_plan_and_receipts() {
    let folder = two_datasets();
    let merged = folder.path().join("merged");
    merge(&sources(folder.path()), &merged, Carry::Packets).unwrap();
    let (code, stdout, stderr) = crate::pipeline::run(&["validate", &merged.to_string_lossy()]);
    assert_eq!(code, 0, "{stdout}{stderr}");
    validate_finds_a_changed_byte(&merged, "plan.json", ["\"shards\": 1", "\"shards\": 2"], "plan.json: its id");
    validate_finds_a_changed_byte(&merged, "plan.json", ["\"episodes\": [", "\"episodez\": ["], "plan.json: its id");
    validate_finds_a_changed_byte(&merged, "receipts/shard-00000.json", ["\"failed\": 0", "\"failed\": 1"], "failures");
    validate_finds_a_changed_byte(
        &merged,
        "receipts/shard-00000.json",
        ["\"shard\": 0", "\"shard\": 1"],
        "plan_id and shard",
    );
}

/// The same table with its columns in the order from the last to the first.
fn turn_columns(path: &Path) {
    let builder = ParquetRecordBatchReaderBuilder::try_new(std::fs::File::open(path).unwrap()).unwrap();
    let batches: Vec<RecordBatch> = builder.build().unwrap().map(Result::unwrap).collect();
    let n_columns = batches[0].num_columns();
    let turned: Vec<usize> = (0..n_columns).rev().collect();
    let batches: Vec<RecordBatch> = batches.iter().map(|rows| rows.project(&turned).unwrap()).collect();
    let file = std::fs::File::create(path).unwrap();
    let mut writer = ArrowWriter::try_new(file, batches[0].schema(), None).unwrap();
    batches.iter().for_each(|rows| writer.write(rows).unwrap());
    writer.close().unwrap();
}

#[test]
fn the_order_of_columns_is_no_difference() {
    let folder = two_datasets();
    let [a, _] = sources(folder.path());
    let turned = folder.path().join("turned");
    crate::smoke::copy_folder(&a, &turned);
    for table in ["data/chunk-000/file-000.parquet", "ntp/calls/chunk-000/file-000.parquet", "ntp/episodes.parquet"] {
        turn_columns(&turned.join(table));
    }
    let found = diff(&a, &turned).unwrap();
    assert!(found.is_none() && found.same == 4, "{found:?}");
    rewrite(&turned, "data/chunk-000/file-000.parquet", &schema::FRAMES, |columns| {
        let (_, column) = columns.iter_mut().find(|(name, _)| name == "ntp.call_id").unwrap();
        let Column::Int64(calls) = column else { panic!("{column:?}") };
        calls[0] += 1;
    });
    let found = diff(&a, &turned).unwrap();
    assert_eq!((found.changed, found.changed_episodes[0].frames["ntp.call_id"]), (1, 1), "{found:?}");
}
