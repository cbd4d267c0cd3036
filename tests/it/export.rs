//! Labels in others' shapes: they cover each episode without gaps, say what the calls say, and open elsewhere.

use std::collections::BTreeMap;
use std::path::Path;

use arrow::array::{Array as _, AsArray as _, RecordBatch};
use arrow::datatypes::{ArrowPrimitiveType, Int64Type};
use mcap::MessageStream;
use ntp::artifact::read_json;
use ntp::dataset::export::{LabelForm, export};
use ntp::dataset::{ConvertConfig, schema};
use ntp::table;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use re_lerobot::datasetv3::LeRobotDatasetV3;
use re_lerobot::{EpisodeIndex, SubtaskIndex};
use serde_json::{Value, json};

use crate::dataset::{convert_all, episodes};

/// A dataset, and its labels in a form.
fn exported(form: LabelForm) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), &folder.path().join("dataset")).unwrap();
    let to = folder.path().join(if form == LabelForm::Foxglove { "labels.mcap" } else { "labels" });
    let summary = export(&folder.path().join("dataset"), form, &to).unwrap();
    assert_eq!(summary.episodes, 6);
    assert!(summary.labels > 6);
    folder
}

fn rows(path: &Path) -> RecordBatch {
    let file = std::fs::File::open(path).unwrap();
    ParquetRecordBatchReaderBuilder::try_new(file).unwrap().build().unwrap().next().unwrap().unwrap()
}

fn texts(rows: &RecordBatch, column: &str, row: usize) -> Vec<String> {
    let list = rows.column_by_name(column).unwrap().as_list::<i32>().value(row);
    list.as_string::<i32>().iter().map(|text| text.unwrap().to_owned()).collect()
}

fn numbers<T: ArrowPrimitiveType>(rows: &RecordBatch, column: &str, row: usize) -> Vec<T::Native> {
    rows.column_by_name(column).unwrap().as_list::<i32>().value(row).as_primitive::<T>().values().to_vec()
}

const META: &str = "meta/episodes/chunk-000/file-000.parquet";
const DATA: &str = "data/chunk-000/file-000.parquet";

#[test]
fn a_plain_dataset_has_sub_tasks_and_nothing_of_ours() {
    let folder = exported(LabelForm::SubtaskIndex);
    let (dataset, labels) = (folder.path().join("dataset"), folder.path().join("labels"));
    assert!(!labels.join("ntp").exists());
    for file in [META, DATA] {
        let (found, all) = (rows(&labels.join(file)), rows(&dataset.join(file)));
        let names: Vec<_> = found.schema().fields().iter().map(|field| field.name().clone()).collect();
        assert!(names.iter().all(|name| !name.starts_with("ntp")), "{names:?}");
        for name in names {
            assert_eq!(found.column_by_name(&name), all.column_by_name(&name), "{name}");
        }
    }
    let info: Value = read_json(&labels.join("meta/info.json")).unwrap();
    assert_eq!(info["features"]["subtask_index"], json!({ "dtype": "int64", "shape": [1], "names": null }));
    assert!(info["features"].as_object().unwrap().keys().all(|name| !name.starts_with("ntp")));
    let opened = LeRobotDatasetV3::load_from_directory(&labels).unwrap();
    assert_eq!(opened.metadata.episode_count(), 6);
    assert_eq!(opened.read_episode_data(EpisodeIndex(4)).unwrap().num_rows(), 13);
    assert_eq!(opened.subtask_by_index(SubtaskIndex(0)).unwrap().subtask, "block_stacking");
}

/// What each style says at a time, as LeRobot looks it up: the last row that is not later.
fn active_at<'r>(rows: &'r [(f32, String, String)], style: &str, time: f32) -> Option<&'r str> {
    rows.iter().rfind(|(begin, of, _)| of == style && *begin <= time).map(|(.., content)| content.as_str())
}

/// The rows of language of a frame: time, style, content.
fn language(rows: &RecordBatch, frame: usize) -> Vec<(f32, String, String)> {
    let list = rows.column_by_name("language_persistent").unwrap().as_list::<i32>().value(frame);
    let entries = list.as_struct();
    let text = |name: &str| entries.column_by_name(name).unwrap().as_string::<i32>().clone();
    let times = entries.column_by_name("timestamp").unwrap().as_primitive::<arrow::datatypes::Float32Type>().clone();
    let (styles, contents) = (text("style"), text("content"));
    assert!(text("role").iter().all(|role| role == Some("assistant")));
    (0..entries.len()).map(|at| (times.value(at), styles.value(at).to_owned(), contents.value(at).to_owned())).collect()
}

#[test]
fn language_columns_say_what_goes_on_at_each_moment() {
    let folder = exported(LabelForm::Language);
    let labels = folder.path().join("labels");
    let rows = rows(&labels.join(DATA));
    let episodes = rows.column_by_name("episode_index").unwrap().as_primitive::<Int64Type>().values().to_vec();
    let third: Vec<usize> = (0..episodes.len()).filter(|&row| episodes[row] == 2).collect();
    let said = language(&rows, third[0]);
    // Every frame of an episode has the same rows; there are no events.
    assert!(third.iter().all(|&row| language(&rows, row) == said));
    assert_eq!(rows.column_by_name("language_events").unwrap().as_list::<i32>().values().len(), 0);
    let expected = [
        (0.0, "1. pick_and_place block_D block_B", "pick block_D", "move to block_D"),
        (0.1, "1. pick_and_place block_D block_B", "pick block_D", "grip"),
        (0.2, "1. pick_and_place block_D block_B", "place on block_B", "move to block_B"),
        (0.3, "1. pick_and_place block_D block_B", "place on block_B", "release"),
    ];
    for (time, plan, subtask, motion) in expected {
        let found = ["plan", "subtask", "motion"].map(|style| active_at(&said, style, time));
        assert_eq!(found, [Some(plan), Some(subtask), Some(motion)], "{time}");
    }
    let info: Value = read_json(&labels.join("meta/info.json")).unwrap();
    assert_eq!(info["features"]["language_events"], json!({ "dtype": "language", "shape": [1], "names": null }));
    let opened = LeRobotDatasetV3::load_from_directory(&labels).unwrap();
    let read = opened.read_episode_data(EpisodeIndex(2)).unwrap();
    assert!(read.column_by_name("language_persistent").is_some());
    // A plan counts what is left: the last tower has more than one sub-task.
    let last = language(&rows, rows.num_rows() - 1);
    let plans: Vec<usize> =
        last.iter().filter(|(_, style, _)| style == "plan").map(|(.., plan)| plan.lines().count()).collect();
    assert_eq!(plans, [3, 2, 1]);
}

#[test]
fn sarm_s_labels_cover_each_episode_without_gaps() {
    let folder = exported(LabelForm::Sarm);
    let labels = folder.path().join("labels");
    let rows = rows(&labels.join(META));
    let lengths = rows.column_by_name("length").unwrap().as_primitive::<Int64Type>().values().to_vec();
    for level in ["sparse", "dense"] {
        let column = |name: &str| format!("{level}_subtask_{name}");
        for (episode, length) in lengths.iter().enumerate() {
            let starts = numbers::<Int64Type>(&rows, &column("start_frames"), episode);
            let ends = numbers::<Int64Type>(&rows, &column("end_frames"), episode);
            assert_eq!((starts[0], ends.last().unwrap() + 1), (0, *length));
            assert!(starts[1..].iter().zip(&ends).all(|(start, end)| *start == end + 1), "{starts:?} {ends:?}");
            let times = numbers::<arrow::datatypes::Float64Type>(&rows, &column("start_times"), episode);
            assert!(times.iter().zip(&starts).all(|(secs, frame)| *secs == *frame as f64 / 10.0));
            assert_eq!(texts(&rows, &column("names"), episode).len(), starts.len());
        }
        let shares: BTreeMap<String, f64> =
            read_json(&labels.join(format!("meta/temporal_proportions_{level}.json"))).unwrap();
        assert!((shares.values().sum::<f64>() - 1.0).abs() < 1e-9);
    }
    assert_eq!(texts(&rows, "sparse_subtask_names", 2), ["pick_and_place block_D block_B"]);
    assert_eq!(texts(&rows, "dense_subtask_names", 2), ["pick block_D", "place on block_B"]);
    assert_eq!(numbers::<Int64Type>(&rows, "dense_subtask_end_frames", 2), [1, 4]);
    assert_eq!(LeRobotDatasetV3::load_from_directory(&labels).unwrap().metadata.episode_count(), 6);
}

#[test]
fn sarm_s_proportions_are_means_over_episodes() {
    let folder = exported(LabelForm::Sarm);
    let shares: BTreeMap<String, f64> =
        read_json(&folder.path().join("labels/meta/temporal_proportions_sparse.json")).unwrap();
    // The only sub-task of two of the six episodes.
    assert_eq!(shares["pick_and_place block_D block_B"], 2.0 / 6.0);
}

#[test]
fn sarm_s_stages_are_in_the_order_in_which_they_come() {
    let folder = exported(LabelForm::Sarm);
    let text = std::fs::read_to_string(folder.path().join("labels/meta/temporal_proportions_sparse.json")).unwrap();
    let place = |name: &str| text.find(name).unwrap_or_else(|| panic!("{name} is not in {text}"));
    // Of one task: by name the second would come first.
    let rows = rows(&folder.path().join("labels").join(META));
    let [first, second] = [0, 1].map(|at| texts(&rows, "sparse_subtask_names", 4)[at].clone());
    assert!(place(&first) < place(&second), "{first}, {second}: {text}");
}

#[test]
fn behavior_s_annotations_name_skills_and_their_primitives() {
    let folder = exported(LabelForm::Behavior);
    let path = folder.path().join("labels/annotations/task-0001/episode_00000002.json");
    let found: Value = read_json(&path).unwrap();
    assert_eq!(found["meta_data"], json!({ "task_duration": 5, "valid_duration": [0, 5] }));
    let of = |list: &str, field: &str| -> Vec<Value> {
        found[list].as_array().unwrap().iter().map(|item| item[field].clone()).collect()
    };
    assert_eq!(of("skill_annotation", "skill_description"), [json!(["pick block_D"]), json!(["place on block_B"])]);
    assert_eq!(of("skill_annotation", "frame_duration"), [json!([0, 2]), json!([2, 5])]);
    assert_eq!(of("skill_annotation", "object_id"), [json!([["block_D"]]), json!([["block_B"]])]);
    let primitives = ["move_to", "grip", "move_to", "release"].map(|name| json!([name]));
    assert_eq!(of("primitive_annotation", "primitive_description"), primitives);
    assert_eq!(of("primitive_annotation", "skill_idxes"), [json!([0]), json!([0]), json!([1]), json!([1])]);
    assert_eq!(of("primitive_annotation", "frame_duration")[3], json!([3, 5]));
}

#[test]
fn every_call_is_an_event_in_order_of_its_end() {
    let folder = exported(LabelForm::Foxglove);
    let path = folder.path().join("labels.mcap");
    let bytes = std::fs::read(&path).unwrap();
    let messages: Vec<_> = MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
    let calls = folder.path().join("dataset/ntp/calls/chunk-000/file-000.parquet");
    let calls = table::read(&calls, &schema::CALLS).unwrap();
    assert_eq!(messages.len(), calls.n_rows());
    assert!(messages.iter().all(|of| of.channel.schema.as_ref().unwrap().name == "foxglove.Event"));
    assert!(messages.is_sorted_by_key(|message| message.log_time));
    let text = String::from_utf8_lossy(&messages[0].data).into_owned();
    assert!(text.contains("move_to") && text.contains("program"), "{text:?}");
    let error = export(&folder.path().join("dataset"), LabelForm::Foxglove, &path).unwrap_err().to_string();
    assert!(error.starts_with("edit.destination"), "{error}");
    let again = folder.path().join("again.mcap");
    export(&folder.path().join("dataset"), LabelForm::Foxglove, &again).unwrap();
    assert!(std::fs::read(again).unwrap() == bytes);
}
