//! Labels of every form come in as a program tree and go out again.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float32Array, StringArray, StructArray};
use arrow::datatypes::{DataType, Field};
use ntp::dataset::edit::{Carry, Condition, filter};
use ntp::dataset::export::{LabelForm, export};
use ntp::dataset::import::import;
use ntp::dataset::{LabelsForm, Severity, validate};
use ntp::query::{Tables, query};
use serde_json::json;

use crate::foreign::mini::{doubles, lists};
use crate::foreign::{Mini, whole};

const CALLS: &str =
    "SELECT depth, program, frame_begin AS a, frame_end AS b FROM calls WHERE episode_index = 0 ORDER BY call_id";

fn ask(root: &Path, sql: &str) -> String {
    let mut tables = Tables::default();
    tables.add_dataset(root).unwrap();
    query(&tables, sql).unwrap().to_csv().unwrap()
}

#[track_caller]
fn is_whole(root: &Path) {
    let errors: Vec<_> = validate(root).findings.into_iter().filter(|of| of.severity == Severity::Error).collect();
    assert_eq!(errors, []);
}

fn without_numbers(mini: &mut Mini) {
    mini.frames.retain(|(name, _)| name != "subtask_index");
    mini.info["features"].as_object_mut().unwrap().remove("subtask_index");
    mini.subtasks = None;
}

/// `language_persistent` of an episode: sub-tasks from frames 0 and 3, motions from 0, 2 and 4.
fn language(mini: &mut Mini) {
    without_numbers(mini);
    let entries = [
        ("reach", "subtask", 0.0),
        ("lift", "subtask", 0.3),
        ("go down", "motion", 0.0),
        ("close", "motion", 0.2),
        ("go up", "motion", 0.4),
    ];
    let n_rows: usize = mini.lengths.iter().sum();
    let text = |of: &dyn Fn(usize) -> &'static str| -> ArrayRef {
        Arc::new(StringArray::from_iter_values((0..5 * n_rows).map(|at| of(at % 5))))
    };
    let fields = ["role", "content", "style"].map(|name| Field::new(name, DataType::Utf8, true));
    let times: ArrayRef = Arc::new(Float32Array::from_iter_values((0..5 * n_rows).map(|at| entries[at % 5].2)));
    let columns = vec![
        (Arc::new(fields[0].clone()), text(&|_| "assistant")),
        (Arc::new(fields[1].clone()), text(&|at| entries[at].0)),
        (Arc::new(fields[2].clone()), text(&|at| entries[at].1)),
        (Arc::new(Field::new("timestamp", DataType::Float32, false)), times),
    ];
    let rows: ArrayRef = Arc::new(StructArray::from(columns));
    let feature = json!({ "dtype": "language", "shape": [1], "names": null });
    mini.column("language_persistent", feature, lists(rows, &vec![5; n_rows]));
}

#[test]
fn language_columns_become_two_levels() {
    let folder = tempfile::tempdir().unwrap();
    let (theirs, to) = (folder.path().join("theirs"), folder.path().join("ours"));
    let mut mini = Mini::new();
    language(&mut mini);
    mini.write(&theirs);
    let summary = import(&theirs, None, &to).unwrap();
    assert_eq!((summary.episodes, summary.subtasks, summary.scopes), (3, 5, 0));
    is_whole(&to);
    // The motion from 2 to 4 goes on over the boundary at 3.
    let expected = "depth,program,a,b\n0,task,0,6\n1,reach,0,3\n2,go down,0,2\n2,close,2,3\n1,lift,3,6\n2,close,3,4\n2,go up,4,6\n";
    assert_eq!(ask(&to, CALLS), expected);
    let path =
        "SELECT \"ntp.program\" AS p, subtask_index AS s FROM frames WHERE episode_index = 0 AND frame_index = 3";
    assert_eq!(ask(&to, path), "p,s\ntask/lift/close,1\n");
    // And out again in each form, and in once more: the tree is the same, but for what a form cannot say.
    let forms = [
        (LabelForm::Language, LabelsForm::Language),
        (LabelForm::Sarm, LabelsForm::Sarm),
        (LabelForm::SubtaskIndex, LabelsForm::SubtaskIndex),
    ];
    for (out, back) in forms {
        let (sent, again) = (folder.path().join(back.name()), folder.path().join(format!("{}-again", back.name())));
        export(&to, out, &sent).unwrap();
        is_whole(&sent);
        import(&sent, Some(back), &again).unwrap();
        is_whole(&again);
        let flat = "depth,program,a,b\n0,task,0,6\n1,reach,0,3\n1,lift,3,6\n";
        assert_eq!(ask(&again, CALLS), if back == LabelsForm::SubtaskIndex { flat } else { expected });
    }
    let chosen = folder.path().join("chosen");
    filter(&to, &Condition { programs: vec!["close".to_owned()], ..Condition::default() }, &chosen, Carry::Packets)
        .unwrap();
    is_whole(&chosen);
}

#[test]
fn sub_tasks_without_texts_are_named_by_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let (theirs, to) = (folder.path().join("theirs"), folder.path().join("ours"));
    let mut mini = Mini::new();
    mini.subtasks = None;
    mini.write(&theirs);
    import(&theirs, None, &to).unwrap();
    is_whole(&to);
    assert_eq!(ask(&to, CALLS), "depth,program,a,b\n0,task,0,6\n1,subtask 0,0,3\n1,subtask 1,3,6\n");
}

#[test]
fn columns_of_sarm_and_files_of_behavior_come_in() {
    let folder = tempfile::tempdir().unwrap();
    let sarm = folder.path().join("sarm");
    let mut mini = Mini::new();
    without_numbers(&mut mini);
    let names: ArrayRef = Arc::new(StringArray::from_iter_values(["reach", "lift"].repeat(3)));
    mini.episodes.push(("sparse_subtask_names".into(), lists(names, &[2; 3])));
    // Ends are included.
    for (name, numbers) in [("start_frames", [0, 2, 0, 2, 0, 2]), ("end_frames", [1, 5, 1, 4, 1, 3])] {
        mini.episodes.push((format!("sparse_subtask_{name}"), lists(whole(numbers), &[2; 3])));
    }
    mini.episodes
        .push(("dense_subtask_names".into(), lists(Arc::new(StringArray::from_iter_values(["close"; 3])), &[1; 3])));
    for (name, secs) in [("start_times", 0.2), ("end_times", 0.3)] {
        mini.episodes.push((format!("dense_subtask_{name}"), lists(doubles([secs; 3]), &[1; 3])));
    }
    mini.write(&sarm);
    std::fs::write(sarm.join("meta/temporal_proportions_sparse.json"), "{}").unwrap();
    let expected = "depth,program,a,b\n0,task,0,6\n1,reach,0,2\n1,lift,2,6\n2,close,2,4\n";
    import(&sarm, None, &folder.path().join("from-sarm")).unwrap();
    assert_eq!(ask(&folder.path().join("from-sarm"), CALLS), expected);
    is_whole(&folder.path().join("from-sarm"));

    let behavior = folder.path().join("behavior");
    let mut mini = Mini::new();
    without_numbers(&mut mini);
    mini.write(&behavior);
    std::fs::create_dir_all(behavior.join("annotations/task-0000")).unwrap();
    let annotation = json!({
        "skill_annotation": [
            { "skill_idx": 0, "skill_description": ["reach"], "frame_duration": [0, 2] },
            { "skill_idx": 1, "skill_description": ["lift"], "frame_duration": [[2, 6]] },
        ],
        "primitive_annotation": [{ "primitive_description": ["close"], "frame_duration": [2, 4] }],
    });
    std::fs::write(behavior.join("annotations/task-0000/episode_00000000.json"), annotation.to_string()).unwrap();
    import(&behavior, None, &folder.path().join("from-behavior")).unwrap();
    assert_eq!(ask(&folder.path().join("from-behavior"), CALLS), expected);
    is_whole(&folder.path().join("from-behavior"));
}

#[test]
fn tables_do_not_grow_with_labels_times_frames() {
    let folder = tempfile::tempdir().unwrap();
    let (theirs, to) = (folder.path().join("theirs"), folder.path().join("ours"));
    let mut mini = Mini::of_lengths(&[6000]);
    mini.replace("subtask_index", whole((0..6000).map(|frame| frame % 2)));
    mini.stats = json!({});
    mini.write(&theirs);
    let summary = import(&theirs, None, &to).unwrap();
    assert_eq!((summary.calls, summary.scopes), (6001, 0));
    is_whole(&to);
    let n_bytes = |folder: &Path| std::fs::metadata(folder.join("chunk-000/file-000.parquet")).unwrap().len();
    // Some 13 bytes a call; a row a call and frame would be 36 million.
    assert!(n_bytes(&to.join("ntp/calls")) < 40 * 6001, "{}", n_bytes(&to.join("ntp/calls")));
    assert!(n_bytes(&to.join("ntp/scopes")) < 4000);
}

#[test]
fn splits_of_the_source_are_those_of_episodes() {
    let folder = tempfile::tempdir().unwrap();
    let (theirs, to, kept) = (folder.path().join("theirs"), folder.path().join("ours"), folder.path().join("kept"));
    let mut mini = Mini::new();
    mini.info["splits"] = json!({ "train": "0:2", "test": "2:3" });
    mini.write(&theirs);
    import(&theirs, None, &to).unwrap();
    let by_split = "SELECT split, COUNT(*) AS n FROM episodes GROUP BY split ORDER BY split";
    assert_eq!(ask(&to, by_split), "split,n\ntest,1\ntrain,2\n");
    filter(&to, &Condition { min_frames: Some(1), ..Condition::default() }, &kept, Carry::Packets).unwrap();
    let info: serde_json::Value = serde_json::from_slice(&std::fs::read(kept.join("meta/info.json")).unwrap()).unwrap();
    assert_eq!(info["splits"], json!({ "test": "2:3", "train": "0:2" }));
    is_whole(&kept);
}
