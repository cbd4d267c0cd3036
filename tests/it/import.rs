//! Someone else's sub-tasks become a program tree that is valid, and what is not annotated is refused by name.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, AsArray as _, Int64Array, RecordBatch, StringArray};
use arrow::compute::concat_batches;
use arrow::datatypes::Int64Type;
use ntp::artifact::{read_json, sha256_file};
use ntp::dataset::edit::{Carry, Condition, EditError, SplitBy, diff, filter, merge, repair, split};
use ntp::dataset::export::{LabelForm, export};
use ntp::dataset::import::import;
use ntp::dataset::{ConvertConfig, schema, summarize, validate};
use ntp::lineage::explain_episode;
use ntp::table::{self, Column, TableSchema};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use re_lerobot::datasetv3::LeRobotDatasetV3;
use serde_json::{Value, json};

use crate::dataset::{convert_all, episodes};

const DATA: &str = "data/chunk-000/file-000.parquet";
const CALLS: &str = "ntp/calls/chunk-000/file-000.parquet";

/// A dataset as others have them: no columns of ours, no robot, tasks in a column of that name.
pub(crate) fn theirs(root: &Path) {
    let own = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), own.path()).unwrap();
    export(own.path(), LabelForm::SubtaskIndex, root).unwrap();
    let mut tasks = table::read(&root.join("meta/tasks.parquet"), &schema::TASKS).unwrap();
    let texts = tasks.text("__index_level_0__").unwrap();
    let numbers: Int64Array = (0..texts.len() as i64).collect();
    let columns =
        [("task_index", Arc::new(numbers) as ArrayRef), ("task", Arc::new(StringArray::from(texts)) as ArrayRef)];
    let rows = RecordBatch::try_from_iter(columns).unwrap();
    let file = std::fs::File::create(root.join("meta/tasks.parquet")).unwrap();
    let mut writer = ArrowWriter::try_new(file, rows.schema(), None).unwrap();
    writer.write(&rows).unwrap();
    writer.close().unwrap();
    change_info(root, |info| info["robot_type"] = Value::Null);
}

fn change_info(root: &Path, change: impl FnOnce(&mut Value)) {
    let path = root.join("meta/info.json");
    let mut info: Value = read_json(&path).unwrap();
    change(&mut info);
    std::fs::write(path, info.to_string()).unwrap();
}

fn rewrite(root: &Path, file: &str, schema: &TableSchema, change: impl FnOnce(&mut Vec<(String, Column)>)) {
    let mut columns = table::read(&root.join(file), schema).unwrap().into_inner();
    change(&mut columns);
    let named = columns.iter().map(|(name, column)| (name.as_str(), column.clone())).collect();
    table::write(&root.join(file), schema, named).unwrap();
}

#[test]
fn sub_tasks_become_calls_below_a_root() {
    let folder = tempfile::tempdir().unwrap();
    let (source, to) = (folder.path().join("theirs"), folder.path().join("ours"));
    theirs(&source);
    let summary = import(&source, None, &to).unwrap();
    let validation = validate(&to);
    assert_eq!(validation.findings, []);
    assert_eq!((validation.episodes, validation.frames), (6, summary.frames));
    assert_eq!((validation.calls, validation.scopes), (summary.calls, summary.scopes));
    let mut calls = table::read(&to.join(CALLS), &schema::CALLS).unwrap();
    let episode_index = calls.int64("episode_index").unwrap();
    let programs = calls.text("program").unwrap();
    let begin = calls.int64("frame_begin").unwrap();
    let end = calls.int64("frame_end").unwrap();
    let third: Vec<_> = (0..programs.len()).filter(|&row| episode_index[row] == 2).collect();
    let found: Vec<_> = third.iter().map(|&row| (programs[row].as_str(), begin[row], end[row])).collect();
    assert_eq!(found, [("task", 0, 5), ("pick_and_place block_D block_B", 0, 4), ("block_stacking", 4, 5)]);
    assert_eq!(summarize(&to).unwrap().total_calls, summary.calls);
    let opened = LeRobotDatasetV3::load_from_directory(&to).unwrap();
    assert_eq!(opened.metadata.episode_count(), 6);
}

#[test]
fn videos_and_features_of_types_of_others_stay_as_they_were() {
    let folder = tempfile::tempdir().unwrap();
    let (source, to) = (folder.path().join("theirs"), folder.path().join("ours"));
    theirs(&source);
    let camera = json!({ "dtype": "video", "shape": [4, 4, 3], "names": { "axes": ["height", "width", "channels"] } });
    change_info(&source, |info| info["features"]["observation.images.front"] = camera.clone());
    let video = "videos/observation.images.front/chunk-000/file-000.mp4";
    std::fs::create_dir_all(source.join(video).parent().unwrap()).unwrap();
    std::fs::write(source.join(video), "a film").unwrap();
    import(&source, None, &to).unwrap();
    assert_eq!(std::fs::read(to.join(video)).unwrap(), b"a film");
    let info: Value = read_json(&to.join("meta/info.json")).unwrap();
    assert_eq!(info["features"]["observation.images.front"], camera);
    // No episode says where its film is.
    let codes: Vec<_> = validate(&to).findings.iter().map(|finding| finding.code).collect();
    assert_eq!(codes, ["info.names", "file.unlisted", "pictures.place"]);
}

#[test]
fn frames_without_a_sub_task_are_the_root_s_own() {
    let folder = tempfile::tempdir().unwrap();
    let (own, source, to) = (folder.path().join("own"), folder.path().join("theirs"), folder.path().join("ours"));
    convert_all(&episodes(), &ConvertConfig::default(), &own).unwrap();
    rewrite(&own, DATA, &schema::FRAMES, |columns| {
        let at = columns.iter().position(|(name, _)| name == "subtask_index").unwrap();
        let Column::Int64(rows) = &mut columns[at].1 else { panic!() };
        rows[..3].fill(-1);
    });
    export(&own, LabelForm::SubtaskIndex, &source).unwrap();
    import(&source, None, &to).unwrap();
    assert_eq!(validate(&to).findings, []);
    let mut calls = table::read(&to.join(CALLS), &schema::CALLS).unwrap();
    assert_eq!(calls.int64("frame_begin").unwrap()[..2], [0, 3]);
}

#[test]
fn a_wrong_label_of_an_imported_dataset_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let (source, to) = (folder.path().join("theirs"), folder.path().join("ours"));
    theirs(&source);
    import(&source, None, &to).unwrap();
    rewrite(&to, CALLS, &schema::CALLS, |columns| {
        let at = columns.iter().position(|(name, _)| name == "program").unwrap();
        let Column::Text(rows) = &mut columns[at].1 else { panic!() };
        rows[1] = "nothing".to_owned();
    });
    let codes: Vec<_> = validate(&to).findings.iter().map(|finding| finding.code).collect();
    assert!(codes.contains(&"frames.label") && codes.contains(&"frames.task"), "{codes:?}");
    rewrite(&to, CALLS, &schema::CALLS, |columns| {
        let at = columns.iter().position(|(name, _)| name == "frame_end").unwrap();
        let Column::Int64(rows) = &mut columns[at].1 else { panic!() };
        rows[0] += 1;
    });
    assert!(validate(&to).findings.iter().any(|finding| finding.code == "calls.tree"));
}

#[test]
fn what_is_not_annotated_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let (source, to) = (folder.path().join("theirs"), folder.path().join("ours"));
    let refused = |code: &str, change: &dyn Fn(&Path)| {
        let _none = std::fs::remove_dir_all(&source);
        theirs(&source);
        change(&source);
        let error = import(&source, None, &to).unwrap_err().to_string();
        assert!(error.starts_with(code), "{error:?} is no {code}");
        assert!(!to.exists());
    };
    let info = |change: fn(&mut Value)| move |root: &Path| change_info(root, change);
    refused("import.version", &info(|info| info["codebase_version"] = json!("v2.1")));
    refused("import.annotation", &info(|info| info["features"]["subtask_index"] = Value::Null));
    refused("import.rows", &info(|info| info["total_episodes"] = json!(7)));
    refused("import.rows", &info(|info| info["fps"] = json!(0)));
    refused("import.features", &info(|info| info["features"]["action"]["shape"] = json!("wide")));
    refused("import.texts", &|root| {
        rewrite(root, "meta/subtasks.parquet", &schema::SUBTASKS, |columns| {
            let Column::Int64(rows) = &mut columns[0].1 else { panic!() };
            rows[0] = 9;
        });
    });
    let own = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), own.path()).unwrap();
    let error = import(own.path(), None, &to).unwrap_err().to_string();
    assert!(error.starts_with("import.annotation"), "{error}");
}

/// A dataset that was imported, with three frames that are annotated by nothing, and a declaration of theirs.
fn imported(folder: &Path, name: &str, change: impl FnOnce(&Path)) -> std::path::PathBuf {
    let (source, to) = (folder.join(format!("{name}-theirs")), folder.join(name));
    theirs(&source);
    rewrite_any(&source.join(DATA), "subtask_index", |rows| rows[..3].fill(-1));
    change_info(&source, |info| info["tools"] = json!([{ "type": "function" }]));
    change(&source);
    import(&source, None, &to).unwrap();
    to
}

/// Changes a column of numbers of a table that is not of our schemas.
fn rewrite_any(path: &Path, name: &str, change: impl FnOnce(&mut Vec<i64>)) {
    let reader = ParquetRecordBatchReaderBuilder::try_new(std::fs::File::open(path).unwrap()).unwrap().build().unwrap();
    let batches: Vec<RecordBatch> = reader.map(Result::unwrap).collect();
    let rows = concat_batches(&batches[0].schema(), &batches).unwrap();
    let at = rows.schema().index_of(name).unwrap();
    let mut numbers = rows.column(at).as_primitive::<Int64Type>().values().to_vec();
    change(&mut numbers);
    let mut columns = rows.columns().to_vec();
    columns[at] = Arc::new(Int64Array::from(numbers));
    let rows = RecordBatch::try_new(rows.schema(), columns).unwrap();
    let mut writer = ArrowWriter::try_new(std::fs::File::create(path).unwrap(), rows.schema(), None).unwrap();
    writer.write(&rows).unwrap();
    writer.close().unwrap();
}

#[test]
fn an_imported_dataset_is_split_and_merged_to_what_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let whole = imported(folder.path(), "whole", |_| {});
    let parts = folder.path().join("parts");
    split(&whole, &SplitBy::Task, &parts, Carry::Packets).unwrap();
    let mut parts: Vec<_> = std::fs::read_dir(&parts).unwrap().map(|entry| entry.unwrap().path()).collect();
    parts.sort();
    assert_eq!(parts.len(), 3);
    let merged = folder.path().join("merged");
    let summary = merge(&parts, &merged, Carry::Packets).unwrap();
    assert_eq!((summary.episodes, summary.tasks), (6, 3));
    for dataset in parts.iter().chain([&merged]) {
        assert_eq!(validate(dataset).findings, []);
        let info: Value = read_json(&dataset.join("meta/info.json")).unwrap();
        assert_eq!(info["tools"], json!([{ "type": "function" }]));
        LeRobotDatasetV3::load_from_directory(dataset).unwrap();
    }
    let difference = diff(&whole, &merged).unwrap();
    assert!(difference.same == 6 && difference.is_none(), "{difference:?}");
    let filtered = folder.path().join("filtered");
    let condition = Condition { programs: vec!["block_stacking".to_owned()], ..Condition::default() };
    assert!(filter(&whole, &condition, &filtered, Carry::Packets).unwrap().episodes > 0);
    let unknown = Condition { programs: vec!["pick".to_owned()], ..Condition::default() };
    let error = filter(&whole, &unknown, &folder.path().join("none"), Carry::Packets).unwrap_err().to_string();
    assert!(error.starts_with("edit.vocabulary") && error.contains("block_stacking"), "{error}");
    assert_eq!(validate(&filtered).findings, []);
}

#[test]
fn imported_datasets_are_merged_unless_an_episode_is_there_twice_or_they_are_none_of_the_kind() {
    let folder = tempfile::tempdir().unwrap();
    let first = imported(folder.path(), "first", |_| {});
    let other =
        imported(folder.path(), "other", |root| rewrite_any(&root.join(DATA), "subtask_index", |rows| rows[4] = -1));
    let merged = folder.path().join("merged");
    assert_eq!(merge(&[first.clone(), other], &merged, Carry::Packets).unwrap().episodes, 12);
    assert_eq!(validate(&merged).findings, []);
    let refused = |error: EditError, code: &str| assert!(error.to_string().starts_with(code), "{error} is no {code}");
    let to = folder.path().join("refused");
    let again = imported(folder.path(), "again", |_| {});
    refused(merge(&[first.clone(), again], &to, Carry::Packets).unwrap_err(), "edit.episode");
    let own = folder.path().join("own");
    convert_all(&episodes(), &ConvertConfig::default(), &own).unwrap();
    refused(merge(&[first.clone(), own], &to, Carry::Packets).unwrap_err(), "edit.vocabulary");
    rewrite(&first, CALLS, &schema::CALLS, |columns| {
        let at = columns.iter().position(|(name, _)| name == "frame_end").unwrap();
        let Column::Int64(rows) = &mut columns[at].1 else { panic!() };
        rows[0] += 1;
    });
    refused(repair(&first, &to).unwrap_err(), "edit.vocabulary");
    assert!(!to.exists());
}

#[test]
fn a_frame_of_an_imported_dataset_leads_to_the_file_that_it_was_read_from() {
    let folder = tempfile::tempdir().unwrap();
    let whole = imported(folder.path(), "whole", |_| {});
    let source = folder.path().join("whole-theirs");
    let found = explain_episode(&whole, 2, Some(1), std::slice::from_ref(&source)).unwrap();
    let frame = found.frame.unwrap();
    assert_eq!(frame.program, "task/pick_and_place block_D block_B");
    let stack: Vec<_> = frame.stack.iter().map(|call| (call.program.as_str(), call.frames)).collect();
    assert_eq!(stack, [("task", [0, 5]), ("pick_and_place block_D block_B", [0, 4])]);
    assert_eq!((frame.frame_index, frame.recording_frame, frame.is_boundary), (1, 1, false));
    assert_eq!(frame.time_secs, 0.1);
    assert!(explain_episode(&whole, 2, Some(4), &[]).unwrap().frame.unwrap().is_boundary);
    assert_eq!((found.recording.file.as_str(), found.recording.path), (DATA, Some(source.join(DATA))));
    assert_eq!(found.episode.recording_sha256, sha256_file(&source.join(DATA)).unwrap());
}
