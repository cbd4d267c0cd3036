//! Recordings to a dataset and back: what a learner reads is what the episodes hold, and faults are named.

use std::collections::BTreeSet;
use std::convert::Infallible;
use std::path::Path;

use ntp::dataset::{
    ConvertConfig, ConvertError, ConvertSummary, FailedEpisodes, FrameChoice, RecordingEpisodes, TrialData, convert,
    read_trials, schema, summarize, validate,
};
use ntp::program::Program;
use ntp::rollout::{Limits, Oracle, Start, run};
use ntp::table::{self, Column, ColumnKind, ColumnSpec, Form, TableSchema, Value};
use ntp::task::{Split, Task};
use ntp::trace::{
    Actor, Cause, Episode, EpisodeParts, Frame, Outcome, ProgramCall, Provenance, ScopingLabel, Span, instructions,
};

use crate::kinematic::{KinematicWorld, demonstration, sorting, tower, trial};

/// Six episodes of three tasks, two of them held out.
pub(crate) fn episodes() -> Vec<Episode> {
    let tasks = [
        tower("stack_0", &[2, 5, 0], Split::Seen),
        tower("stack_1", &[1, 3], Split::Unseen),
        tower("stack_2", &[7, 6, 4, 2], Split::Unseen),
    ];
    let trials = tasks.iter().flat_map(|task| [(task, 0), (task, 1)]);
    trials.enumerate().map(|(at, (task, index))| demonstration(task, &trial(task, index, 1), at as u64)).collect()
}

pub(crate) fn sorting_episodes() -> Vec<Episode> {
    let task: Task = sorting("sort_0", [2, 3, 0, 1], Split::Seen);
    (0..3).map(|index| demonstration(&task, &trial(&task, index, index as u16 + 1), u64::from(index))).collect()
}

/// The episode with `n_between` frames that are no boundaries between any two of its own.
pub(crate) fn densify(episode: &Episode, n_between: u32) -> Episode {
    let mut parts: EpisodeParts = episode.clone().into_parts();
    let stride = n_between + 1;
    let span = |span: Span| Span { begin: span.begin * stride, end: (span.end - 1) * stride + 1 };
    for call in &mut parts.calls {
        call.input = span(call.input);
        call.output = call.output.map(span);
        call.frames = span(call.frames);
    }
    let frames: Vec<Frame> = parts.frames.clone();
    parts.frames = frames
        .iter()
        .enumerate()
        .flat_map(|(at, frame)| {
            let n_after = if at + 1 < frames.len() { n_between } else { 0 };
            let between = (1..=n_after).map(|step| {
                let mut between = frame.clone();
                between.boundary = false;
                between.time_nanos += u64::from(step) * 1_000_000;
                between.state.gripper_in_world.translation.vector.x += step as f32 * 1e-3;
                between
            });
            std::iter::once(frame.clone()).chain(between).collect::<Vec<_>>()
        })
        .collect();
    parts.specification_frames = parts.frames.len() as u32;
    Episode::new(parts).unwrap()
}

pub(crate) fn failed(episode: &Episode) -> Episode {
    let mut parts = episode.clone().into_parts();
    parts.outcome = Outcome::Failure(Cause::MissedGrasp);
    Episode::new(parts).unwrap()
}

pub(crate) fn convert_all(
    episodes: &[Episode],
    config: &ConvertConfig,
    root: &Path,
) -> Result<ConvertSummary, ConvertError> {
    let shards = episodes.chunks(4).enumerate().map(|(shard, episodes)| {
        Ok::<_, Infallible>(RecordingEpisodes {
            file: format!("recordings/shard-{shard:05}.mcap"),
            sha256: format!("{shard:064x}"),
            episodes: episodes.iter().cloned().map(Ok),
        })
    });
    convert(shards, config, root)
}

fn config(frames: FrameChoice) -> ConvertConfig {
    ConvertConfig { frames, ..ConvertConfig::default() }
}

/// What a learner should read of a dataset's episodes, made with a choice of frames.
fn expected_trials(episodes: &[Episode], frames: FrameChoice) -> Vec<TrialData> {
    let of_dataset = |(at, episode): (usize, &Episode)| {
        let trial = expected_trial(episode);
        let boundaries = episode.boundary_frames().map(|(row, _)| row as u32);
        let rows = if frames == FrameChoice::All { boundaries.collect() } else { trial.rows.clone() };
        TrialData { episode: at, rows, ..trial }
    };
    episodes.iter().enumerate().map(of_dataset).collect()
}

/// The same of one that is the only one in a dataset of boundary frames.
fn expected_trial(episode: &Episode) -> TrialData {
    let boundaries: Vec<usize> = episode.boundary_frames().map(|(at, _)| at).collect();
    let row = |frame: u32| boundaries.iter().position(|&boundary| boundary == frame as usize).unwrap() as u32;
    let span = |span: Span| Span { begin: row(span.begin), end: row(span.last()) + 1 };
    let call = |call: &ProgramCall| ProgramCall {
        input: span(call.input),
        output: call.output.map(span),
        frames: span(call.frames),
        ..call.clone()
    };
    TrialData {
        task_id: episode.provenance.task_id.clone(),
        family: episode.provenance.family,
        split: episode.provenance.split,
        trial: episode.provenance.trial,
        episode: 0,
        n_frames: boundaries.len(),
        rows: (0..boundaries.len() as u32).collect(),
        observations: episode.boundary_frames().flat_map(|(_, frame)| frame.observation().to_flat()).collect(),
        grippers: episode.boundary_frames().map(|(_, frame)| frame.gripper()).collect(),
        calls: episode.calls.iter().map(call).collect(),
        instructions: instructions(&episode.calls, &episode.scene.slots),
    }
}

fn read_column(root: &Path, file: &str, schema: &TableSchema, column: &str) -> Column {
    table::read(&root.join(file), schema).unwrap().get(column).unwrap().clone()
}

const FIRST_DATA: &str = "data/chunk-000/file-000.parquet";
const FIRST_CALLS: &str = "ntp/calls/chunk-000/file-000.parquet";
const FIRST_SCOPES: &str = "ntp/scopes/chunk-000/file-000.parquet";
const FIRST_META: &str = "meta/episodes/chunk-000/file-000.parquet";

#[test]
fn a_learner_reads_what_the_episodes_hold() {
    for episodes in [episodes(), sorting_episodes()] {
        let folder = tempfile::tempdir().unwrap();
        let summary = convert_all(&episodes, &ConvertConfig::default(), folder.path()).unwrap();
        assert_eq!(summary.episodes, episodes.len() as u64);
        let trials = read_trials(folder.path()).unwrap();
        assert_eq!(trials.n_slots, 8);
        assert_eq!(trials.trials, expected_trials(&episodes, FrameChoice::Boundaries));
    }
}

#[test]
fn frames_between_boundaries_change_nothing_for_a_learner() {
    let sparse = episodes();
    let dense: Vec<Episode> = sparse.iter().map(|episode| densify(episode, 3)).collect();
    assert_eq!(expected_trials(&dense, FrameChoice::Boundaries), expected_trials(&sparse, FrameChoice::Boundaries));
    for frames in [FrameChoice::Boundaries, FrameChoice::All] {
        let folder = tempfile::tempdir().unwrap();
        let summary = convert_all(&dense, &config(frames), folder.path()).unwrap();
        let n_frames = match frames {
            FrameChoice::Boundaries => sparse.iter().map(|episode| episode.frames.len()).sum::<usize>(),
            FrameChoice::All => dense.iter().map(|episode| episode.frames.len()).sum(),
        };
        assert_eq!(summary.frames, n_frames as u64);
        assert_eq!(read_trials(folder.path()).unwrap().trials, expected_trials(&dense, frames));
    }
}

#[test]
fn the_same_episodes_give_the_same_bytes() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let summaries =
        folders.each_ref().map(|folder| convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap());
    assert_eq!(summaries[0], summaries[1]);
    assert_eq!(summaries[0].files.len(), 10);
    for file in &summaries[0].files {
        let [a, b] = folders.each_ref().map(|folder| std::fs::read(folder.path().join(file)).unwrap());
        assert!(a == b, "{file} differs");
    }
}

#[test]
fn failed_episodes_are_left_out_and_counted_unless_asked_for() {
    let mut episodes = episodes();
    episodes[1] = failed(&episodes[1]);
    let folder = tempfile::tempdir().unwrap();
    let summary = convert_all(&episodes, &ConvertConfig::default(), folder.path()).unwrap();
    assert_eq!((summary.episodes, summary.failed_left_out, summary.failed_included), (5, 1, 0));
    let folder = tempfile::tempdir().unwrap();
    let include = ConvertConfig { failed: FailedEpisodes::Include, ..ConvertConfig::default() };
    let summary = convert_all(&episodes, &include, folder.path()).unwrap();
    assert_eq!((summary.episodes, summary.failed_left_out, summary.failed_included), (6, 0, 1));
    let causes = read_column(folder.path(), "ntp/episodes.parquet", &schema::EPISODES, "cause");
    let Column::OptionalText(causes) = causes else { panic!("{causes:?}") };
    assert_eq!(causes[..2], [None, Some("missed_grasp".to_owned())]);
    assert_eq!(read_trials(folder.path()).unwrap().trials.len(), 5);
    let folder = tempfile::tempdir().unwrap();
    let error = convert_all(&episodes[1..2], &ConvertConfig::default(), folder.path()).unwrap_err();
    assert!(matches!(error, ConvertError::NoEpisodes { failed: 1 }), "{error}");
}

#[test]
fn a_dataset_is_only_written_into_an_empty_directory() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("note.txt"), "mine").unwrap();
    let error = convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap_err();
    assert!(matches!(error, ConvertError::NotEmpty { .. }), "{error}");
}

#[test]
fn timestamps_are_regular_and_true_times_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    let mut columns = table::read(&folder.path().join(FIRST_DATA), &schema::FRAMES).unwrap();
    let frame_index = columns.int64("frame_index").unwrap();
    let timestamps = columns.float32("timestamp").unwrap();
    let times_secs = columns.float64("ntp.time_secs").unwrap();
    for ((frame, timestamp), time_secs) in frame_index.iter().zip(&timestamps).zip(&times_secs) {
        assert_eq!(*timestamp, (*frame as f64 / 10.0) as f32);
        assert!((time_secs - 0.5 * *frame as f64).abs() < 1e-9);
    }
}

#[test]
fn actions_lead_from_each_observation_to_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    convert_all(&episodes, &ConvertConfig::default(), folder.path()).unwrap();
    let mut columns = table::read(&folder.path().join(FIRST_DATA), &schema::FRAMES).unwrap();
    let actions = columns.float32_list("action").unwrap();
    let frames = &episodes[0].frames;
    for (at, frame) in frames.iter().enumerate() {
        let next = frames.get(at + 1).unwrap_or(frame);
        let moved = next.state.gripper_in_world.translation.vector - frame.state.gripper_in_world.translation.vector;
        let closed = f32::from(u8::from(next.state.held.is_some()));
        assert_eq!(actions[at], [moved.x, moved.y, moved.z, closed]);
    }
}

#[test]
fn frames_are_labelled_with_the_programs_that_go_on_from_them() {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes()[2..3], &ConvertConfig::default(), folder.path()).unwrap();
    let mut columns = table::read(&folder.path().join(FIRST_DATA), &schema::FRAMES).unwrap();
    let bring = "block_stacking/pick_and_place";
    let expected = [
        format!("{bring}/pick/move_to"),
        format!("{bring}/pick/grip"),
        format!("{bring}/place/move_to"),
        format!("{bring}/place/release"),
        "block_stacking".to_owned(),
    ];
    assert_eq!(columns.text("ntp.program").unwrap(), expected);
    assert_eq!(columns.int64("ntp.call_id").unwrap(), [3, 4, 6, 7, 0]);
    assert_eq!(columns.int64("subtask_index").unwrap(), [1, 1, 1, 1, 0]);
    assert_eq!(columns.boolean("next.done").unwrap(), [false, false, false, false, true]);
    let subtasks = read_column(folder.path(), "meta/subtasks.parquet", &schema::SUBTASKS, "subtask");
    assert_eq!(subtasks, Column::Text(vec!["block_stacking".into(), "pick_and_place block_D block_B".into()]));
}

#[test]
fn scoping_labels_are_those_of_the_spans() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    let summary = convert_all(&episodes, &ConvertConfig::default(), folder.path()).unwrap();
    let mut columns = table::read(&folder.path().join(FIRST_SCOPES), &schema::SCOPES).unwrap();
    assert_eq!(columns.n_rows() as u64, summary.scopes);
    let episode = columns.int64("episode_index").unwrap();
    let call = columns.int64("call_id").unwrap();
    let frame = columns.int64("specification_frame").unwrap();
    let label = columns.int64("label").unwrap();
    let (is_start, is_end) = (columns.boolean("is_start").unwrap(), columns.boolean("is_end").unwrap());
    let mut row = 0;
    for (episode_index, value) in episodes.iter().enumerate() {
        for of in value.calls.iter().filter(|call| call.program != Program::None) {
            let output = of.output.unwrap();
            for at in of.input.begin..of.input.end {
                let found = (episode[row], call[row], frame[row], label[row], is_start[row], is_end[row]);
                let expected = ScopingLabel::ALL.iter().position(|&label| label == output.label(at)).unwrap() as i64;
                let (is_first, is_last) = (at == output.begin, at == output.last());
                let ids = (episode_index as i64, i64::from(of.id.0), i64::from(at));
                assert_eq!(found, (ids.0, ids.1, ids.2, expected, is_first, is_last));
                row += 1;
            }
        }
    }
    assert_eq!(row, label.len());
}

#[test]
fn task_texts_are_the_pandas_index_and_rows_are_in_order_of_their_numbers() {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    let folder = tempfile::tempdir().unwrap();
    let summary = convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    assert_eq!(summary.tasks, 3);
    let path = folder.path().join("meta/tasks.parquet");
    let mut columns = table::read(&path, &schema::TASKS).unwrap();
    assert_eq!(columns.int64("task_index").unwrap(), [0, 1, 2]);
    let texts = columns.text("__index_level_0__").unwrap();
    assert_eq!(texts[1], "put block_D on block_B");
    let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
    let metadata = reader.metadata().file_metadata().key_value_metadata().unwrap().clone();
    let value = |key: &str| metadata.iter().find(|entry| entry.key == key).unwrap().value.clone().unwrap();
    let pandas: serde_json::Value = serde_json::from_str(&value("pandas")).unwrap();
    assert_eq!(pandas["index_columns"], serde_json::json!(["__index_level_0__"]));
    assert_eq!(pandas["columns"][1]["field_name"], "__index_level_0__");
    assert!(pandas["columns"][1]["name"].is_null());
    assert!(!value("ARROW:schema").is_empty());
}

#[test]
fn info_declares_every_column_in_types_that_all_readers_know() {
    let folder = tempfile::tempdir().unwrap();
    let summary = convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    let text = std::fs::read_to_string(folder.path().join("meta/info.json")).unwrap();
    let info: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(info["codebase_version"], "v3.0");
    assert_eq!(info["total_episodes"], summary.episodes);
    assert_eq!(info["total_frames"], summary.frames);
    assert_eq!(info["data_path"], "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet");
    assert_eq!(info["video_path"], "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4");
    let safe = ["float32", "float64", "int64", "bool", "string", "image", "video", "language"];
    let features = info["features"].as_object().unwrap();
    let columns = schema::FRAMES.columns();
    assert_eq!(features.len(), columns.len());
    for (name, _) in columns {
        let feature = features[&name].as_object().unwrap();
        assert!(safe.contains(&feature["dtype"].as_str().unwrap()), "{name}");
        assert!(feature.contains_key("names"), "{name}");
        assert!(feature["shape"].is_array(), "{name}");
        assert!(!name.contains('/'));
    }
    assert_eq!(info["features"]["observation.state"]["shape"], serde_json::json!([26]));
    assert_eq!(info["features"]["observation.state"]["names"][3], "block_B.x_m");
    assert!(text.find("observation.state") < text.find("ntp.program"), "features are in the order of the columns");
}

#[test]
fn statistics_are_exact() {
    let folder = tempfile::tempdir().unwrap();
    let episodes = episodes();
    convert_all(&episodes, &ConvertConfig::default(), folder.path()).unwrap();
    let stats = std::fs::read(folder.path().join("meta/stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
    let frames = episodes.iter().flat_map(|episode| &episode.frames);
    let mut values: Vec<f64> = frames.map(|frame| f64::from(frame.observation().to_flat()[4])).collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let std = (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
    let quantile = |share: f64| {
        let place = share * (n - 1) as f64;
        let (below, above) = (values[place.floor() as usize], values[place.ceil() as usize]);
        below + (above - below) * place.fract()
    };
    let state = &stats["observation.state"];
    let found = |name: &str| state[name][4].as_f64().unwrap();
    assert_eq!((found("min"), found("max")), (values[0], values[n - 1]));
    assert!((found("mean") - mean).abs() < 1e-12 && (found("std") - std).abs() < 1e-12);
    for (name, share) in [("q01", 0.01), ("q10", 0.1), ("q50", 0.5), ("q90", 0.9), ("q99", 0.99)] {
        assert!((found(name) - quantile(share)).abs() < 1e-12, "{name}");
    }
    assert_eq!(state["count"], serde_json::json!([n]));
    assert_eq!(stats["index"]["q50"], serde_json::json!([(n - 1) as f64 / 2.0]));
    assert_eq!(stats["next.done"]["max"], serde_json::json!([1.0]));
    assert!(stats["ntp.program"].is_null());
}

/// Writes a table again after a change of its columns.
pub(crate) fn rewrite(root: &Path, file: &str, schema: &TableSchema, change: impl FnOnce(&mut Vec<(String, Column)>)) {
    let path = root.join(file);
    let mut columns = table::read(&path, schema).unwrap().into_inner();
    change(&mut columns);
    let named = columns.iter().map(|(name, column)| (name.as_str(), column.clone())).collect();
    table::write(&path, schema, named).unwrap();
}

fn int64<'c>(columns: &'c mut [(String, Column)], name: &str) -> &'c mut Vec<i64> {
    match columns.iter_mut().find(|(column, _)| column == name) {
        Some((_, Column::Int64(values))) => values,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn fault(make: impl FnOnce(&Path), expected: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    make(folder.path());
    let error = read_trials(folder.path()).unwrap_err().to_string();
    for part in expected {
        assert!(error.contains(part), "{error:?} does not contain {part:?}");
    }
}

#[test]
fn a_missing_file_is_named() {
    for file in [FIRST_DATA, FIRST_CALLS, FIRST_META, "ntp/episodes.parquet", "meta/info.json"] {
        fault(|root| std::fs::remove_file(root.join(file)).unwrap(), &[file]);
    }
}

#[test]
fn a_truncated_file_is_named() {
    for file in [FIRST_DATA, FIRST_CALLS, FIRST_META, "ntp/episodes.parquet", "meta/info.json"] {
        let truncate = |root: &Path| {
            let bytes = std::fs::read(root.join(file)).unwrap();
            std::fs::write(root.join(file), &bytes[..bytes.len() / 2]).unwrap();
        };
        fault(truncate, &[file]);
    }
}

#[test]
fn swapped_rows_are_named_by_file_and_row() {
    let swap = |root: &Path| {
        rewrite(root, FIRST_DATA, &schema::FRAMES, |columns| int64(columns, "index").swap(3, 4));
    };
    fault(swap, &[FIRST_DATA, "row 3: index is 4, but should be 3"]);
    let swap = |root: &Path| {
        rewrite(root, FIRST_CALLS, &schema::CALLS, |columns| int64(columns, "call_id").swap(1, 2));
    };
    fault(swap, &[FIRST_CALLS, "episode 0, call 1: its id is 2, not its position"]);
    let swap = |root: &Path| {
        rewrite(root, FIRST_META, &schema::META_EPISODES, |columns| int64(columns, "dataset_from_index").swap(1, 2));
    };
    fault(swap, &[FIRST_META, "row 1"]);
}

#[test]
fn rows_too_few_or_too_many_are_named() {
    let halve = |columns: &mut Vec<(String, Column)>| {
        for (_, column) in columns {
            match column {
                Column::Int64(rows) => rows.truncate(rows.len() / 2),
                Column::OptionalInt64(rows) => rows.truncate(rows.len() / 2),
                Column::Boolean(rows) => rows.truncate(rows.len() / 2),
                Column::Text(rows) => rows.truncate(rows.len() / 2),
                Column::OptionalText(rows) => rows.truncate(rows.len() / 2),
                other => panic!("{other:?}"),
            }
        }
    };
    fault(|root| rewrite(root, FIRST_CALLS, &schema::CALLS, halve), &[FIRST_CALLS, "it ends before"]);
    let once_more = |columns: &mut Vec<(String, Column)>| {
        for (_, column) in columns {
            match column {
                Column::Int64(rows) => rows.push(0),
                Column::OptionalInt64(rows) => rows.push(None),
                Column::Boolean(rows) => rows.push(false),
                Column::Text(rows) => rows.push("none".to_owned()),
                Column::OptionalText(rows) => rows.push(None),
                other => panic!("{other:?}"),
            }
        }
    };
    fault(|root| rewrite(root, FIRST_CALLS, &schema::CALLS, once_more), &[FIRST_CALLS, "more rows"]);
}

#[test]
fn a_broken_program_tree_is_named_by_its_rule() {
    let unknown = |columns: &mut Vec<(String, Column)>| {
        let Some((_, Column::Text(programs))) = columns.iter_mut().find(|(name, _)| name == "program") else {
            panic!("no program")
        };
        programs[4] = "grab".to_owned();
    };
    fault(
        |root| rewrite(root, FIRST_CALLS, &schema::CALLS, unknown),
        &[FIRST_CALLS, "row 4", "unknown program \"grab\""],
    );
    let deeper = |columns: &mut Vec<(String, Column)>| int64(columns, "depth")[2] = 7;
    fault(
        |root| rewrite(root, FIRST_CALLS, &schema::CALLS, deeper),
        &[FIRST_CALLS, "episode 0, call 2: its depth is 7, but its caller's is 1"],
    );
}

#[test]
fn a_dropped_column_is_named() {
    const NUMBERS: ColumnKind = ColumnKind { value: Value::Int64, form: Form::Required };
    const WITHOUT: TableSchema = TableSchema::new(
        "without",
        "",
        &[
            ColumnSpec::new("frame_index", NUMBERS, ""),
            ColumnSpec::new("episode_index", NUMBERS, ""),
            ColumnSpec::new("index", NUMBERS, ""),
        ],
    );
    let drop_columns = |root: &Path| {
        let path = root.join(FIRST_DATA);
        let columns = table::read(&path, &WITHOUT).unwrap().into_inner();
        let named = columns.iter().map(|(name, column)| (name.as_str(), column.clone())).collect();
        table::write(&path, &WITHOUT, named).unwrap();
    };
    fault(drop_columns, &[FIRST_DATA, r#"column "observation.state" is missing"#]);
}

/// An oracle's rollout of each task on a table of its own, the demonstration with frames between its boundaries.
fn rollouts() -> Vec<Episode> {
    let task = tower("stack_0", &[2, 5, 0], Split::Unseen);
    let own_trial = trial(&task, 1, 1);
    let start = Start {
        task: &task,
        demonstration: densify(&demonstration(&task, &trial(&task, 0, 1), 0), 4),
        world: Box::new(KinematicWorld::new(task.family, &own_trial)),
        sight: None,
        provenance: Provenance::new(&task, &own_trial, Actor::Policy(String::new()), 0),
    };
    let starts = vec![start];
    let mut oracle = Oracle::for_starts(&starts);
    run(&mut oracle, starts, Limits::default()).unwrap().into_iter().map(|rollout| rollout.episode).collect()
}

#[test]
fn a_rollout_keeps_its_spans_over_the_demonstration() {
    let rollout = densify_frames_alone(&rollouts()[0], 2);
    for frames in [FrameChoice::Boundaries, FrameChoice::All] {
        let folder = tempfile::tempdir().unwrap();
        convert_all(std::slice::from_ref(&rollout), &config(frames), folder.path()).unwrap();
        let mut columns = table::read(&folder.path().join(FIRST_CALLS), &schema::CALLS).unwrap();
        let input_end = columns.int64("input_end").unwrap();
        let expected: Vec<i64> = rollout.calls.iter().map(|call| i64::from(call.input.end)).collect();
        assert_eq!(input_end, expected);
        let mut episodes = table::read(&folder.path().join("ntp/episodes.parquet"), &schema::EPISODES).unwrap();
        assert_eq!(episodes.text("specification").unwrap(), ["demonstration"]);
        assert_eq!(episodes.int64("specification_frames").unwrap(), [i64::from(rollout.specification_frames)]);
        assert_eq!(validate(folder.path()).findings, []);
        let error = read_trials(folder.path()).unwrap_err().to_string();
        assert!(error.contains("episode 0: it was acted by \"oracle\" on a demonstration"), "{error}");
    }
}

/// As [`densify`], but the specification stays as it is.
fn densify_frames_alone(rollout: &Episode, n_between: u32) -> Episode {
    let original = rollout.clone().into_parts();
    let mut as_own = original.clone();
    as_own.specification_frames = as_own.frames.len() as u32;
    for call in &mut as_own.calls {
        call.input = Span { begin: 0, end: 1 };
        call.output = call.output.map(|_| Span { begin: 0, end: 1 });
    }
    let mut parts = densify(&Episode::new(as_own).unwrap(), n_between).into_parts();
    parts.specification_frames = original.specification_frames;
    for (call, before) in parts.calls.iter_mut().zip(original.calls) {
        (call.input, call.output) = (before.input, before.output);
    }
    Episode::new(parts).unwrap()
}

#[test]
fn whatever_is_converted_is_valid() {
    let dense: Vec<Episode> = episodes().iter().map(|episode| densify(episode, 3)).collect();
    let mut with_failure = episodes();
    with_failure[2] = failed(&with_failure[2]);
    let include = ConvertConfig { failed: FailedEpisodes::Include, ..ConvertConfig::default() };
    let cases = [
        (episodes(), ConvertConfig::default()),
        (sorting_episodes(), ConvertConfig::default()),
        (dense.clone(), ConvertConfig::default()),
        (dense, config(FrameChoice::All)),
        (with_failure, include),
        ([episodes(), sorting_episodes()].concat(), ConvertConfig::default()),
    ];
    for (episodes, config) in cases {
        let folder = tempfile::tempdir().unwrap();
        let summary = convert_all(&episodes, &config, folder.path()).unwrap();
        let validation = validate(folder.path());
        assert_eq!(validation.findings, []);
        let checked = (validation.episodes, validation.frames, validation.calls, validation.scopes);
        assert_eq!(checked, (summary.episodes, summary.frames, summary.calls, summary.scopes));
    }
}

#[test]
fn a_summary_counts_episodes_by_split_actor_and_outcome() {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    let summary = summarize(folder.path()).unwrap();
    assert_eq!((summary.total_episodes, summary.total_tasks), (6, 3));
    assert_eq!(summary.splits["seen"], 2);
    assert_eq!(summary.actors["expert"], 6);
    assert_eq!(summary.outcomes["success"], 6);
    assert_eq!(summary.episode_frames, [5, 13]);
}

/// Spoils a dataset and holds the first finding's code, file and a part of its message.
#[track_caller]
fn finding(make: impl FnOnce(&Path), code: &str, file: &str, message: &str) {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    make(folder.path());
    let validation = validate(folder.path());
    assert!(!validation.is_valid());
    let first = &validation.findings[0];
    assert_eq!((first.code, first.path.as_path()), (code, folder.path().join(file).as_path()), "{first:?}");
    assert!(first.message.contains(message), "{first:?} does not contain {message:?}");
}

/// Changes one value of one column.
fn spoil(file: &'static str, schema: TableSchema, column: &'static str, row: usize) -> impl FnOnce(&Path) {
    move |root| {
        rewrite(root, file, &schema, |columns| {
            match columns.iter_mut().find(|(name, _)| name == column).map(|(_, column)| column) {
                Some(Column::Int64(rows)) => rows[row] += 1,
                Some(Column::Float32(rows)) => rows[row] += 0.5,
                Some(Column::Float64(rows)) => rows[row] -= 100.0,
                Some(Column::Boolean(rows)) => rows[row] = !rows[row],
                Some(Column::Text(rows)) => rows[row] = "other".to_owned(),
                Some(Column::OptionalText(rows)) => rows[row] = Some("other".to_owned()),
                Some(Column::Float32List(rows)) => rows[row].iter_mut().for_each(|value| *value += 0.5),
                other => panic!("{other:?}"),
            }
        });
    }
}

/// A link to itself: it is there, but nothing can be read behind it.
#[cfg(unix)]
fn link_to_itself(path: &Path) {
    std::os::unix::fs::symlink(path.file_name().unwrap(), path).unwrap();
}

#[cfg(unix)]
#[test]
fn what_cannot_be_listed_or_read_is_a_finding() {
    let chunk = |root: &Path| link_to_itself(&root.join("data/chunk-001"));
    finding(chunk, "file.unreadable", "data/chunk-001", "failed to read");
    let next = |root: &Path| link_to_itself(&root.join("meta/episodes/chunk-000/file-001.parquet"));
    finding(next, "file.unreadable", "meta/episodes/chunk-000/file-001.parquet", "failed to read");
    let card = |root: &Path| std::fs::create_dir(root.join("README.md")).unwrap();
    finding(card, "file.unreadable", "README.md", "failed to read");
}

#[test]
fn a_file_that_no_episode_names_is_found_at_any_depth() {
    for file in ["data/stray.parquet", "data/chunk-000/deep/stray.parquet"] {
        let stray = |root: &Path| {
            std::fs::create_dir_all(root.join(file).parent().unwrap()).unwrap();
            std::fs::copy(root.join(FIRST_DATA), root.join(file)).unwrap();
        };
        finding(stray, "file.unlisted", file, "no episode is in this file");
    }
}

#[test]
fn statistics_that_are_no_statistics_are_told_as_such() {
    let spoil = |root: &Path| {
        let path = root.join("meta/stats.json");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replacen("\"q01\"", "\"q02\"", 1)).unwrap();
    };
    finding(spoil, "stats.value", "meta/stats.json", "missing field `q01`");
}

#[test]
fn every_wrong_value_has_a_finding_of_its_own_code() {
    let frames = |column, row| spoil(FIRST_DATA, schema::FRAMES, column, row);
    finding(frames("index", 3), "frames.row", FIRST_DATA, "index is 4, but should be 3");
    finding(frames("timestamp", 3), "frames.time", FIRST_DATA, "timestamp");
    finding(frames("ntp.time_secs", 3), "frames.time", FIRST_DATA, "ntp.time_secs");
    finding(frames("action", 3), "frames.action", FIRST_DATA, "the action of the row before");
    finding(frames("action", 8), "frames.action", FIRST_DATA, "the last action");
    finding(frames("observation.state", 3), "frames.state", FIRST_DATA, "(open, closed)");
    finding(frames("ntp.call_id", 3), "frames.label", FIRST_DATA, "but the calls make them");
    finding(frames("ntp.program", 3), "frames.label", FIRST_DATA, "other");
    finding(frames("task_index", 3), "frames.task", FIRST_DATA, "put block_D on block_B");
    finding(frames("next.done", 3), "frames.done", FIRST_DATA, "next.done");
    let calls = |column, row| spoil(FIRST_CALLS, schema::CALLS, column, row);
    finding(calls("depth", 3), "calls.tree", FIRST_CALLS, "its depth is");
    finding(calls("argument", 3), "calls.argument", FIRST_CALLS, "other");
    finding(calls("instruction", 3), "calls.instruction", FIRST_CALLS, "other");
    finding(calls("program", 3), "calls.row", FIRST_CALLS, "unknown program");
    let scopes = |column, row| spoil(FIRST_SCOPES, schema::SCOPES, column, row);
    finding(scopes("label", 3), "scopes.label", FIRST_SCOPES, "but the span makes them");
    finding(scopes("call_id", 3), "scopes.row", FIRST_SCOPES, "should be (0, 0, 3)");
    let episodes = |column, row| spoil("ntp/episodes.parquet", schema::EPISODES, column, row);
    finding(episodes("split", 3), "episodes.value", "ntp/episodes.parquet", "unknown split");
    finding(episodes("success", 3), "episodes.value", "ntp/episodes.parquet", "do not go together");
    finding(episodes("n_scopes", 5), "scopes.row", FIRST_SCOPES, "n_scopes");
}

#[test]
fn an_unknown_word_of_an_instruction_is_named_with_file_and_row_and_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    spoil(FIRST_CALLS, schema::CALLS, "instruction", 3)(folder.path());
    let error = read_trials(folder.path()).unwrap_err().to_string();
    for part in [FIRST_CALLS, "unknown word \"other\"", "row 3", "block_A", "pick", "into"] {
        assert!(error.contains(part), "{error} does not name {part}");
    }
}

#[test]
fn a_task_in_two_splits_is_a_leak() {
    let relabel = |root: &Path| {
        rewrite(root, "ntp/episodes.parquet", &schema::EPISODES, |columns| {
            let Some((_, Column::Text(splits))) = columns.iter_mut().find(|(name, _)| name == "split") else {
                panic!("no split")
            };
            splits[3] = "seen".to_owned();
        });
    };
    finding(relabel, "split.leak", "ntp/episodes.parquet", "is seen here and unseen before");
}

#[test]
fn faults_of_whole_files_are_found() {
    let remove = |file: &'static str| move |root: &Path| std::fs::remove_file(root.join(file)).unwrap();
    finding(remove(FIRST_DATA), "file.unreadable", FIRST_DATA, "");
    finding(remove("meta/stats.json"), "file.unreadable", "meta/stats.json", "");
    finding(remove("meta/info.json"), "file.unreadable", "meta/info.json", "");
    finding(remove("ntp/info.json"), "file.unreadable", "ntp/info.json", "");
    let stray = |root: &Path| {
        std::fs::copy(root.join(FIRST_DATA), root.join("data/chunk-000/file-001.parquet")).unwrap();
    };
    finding(stray, "file.unlisted", "data/chunk-000/file-001.parquet", "no episode is in this file");
    let plain_tasks = |root: &Path| rewrite(root, "meta/tasks.parquet", &schema::TASKS, |_| ());
    finding(plain_tasks, "tasks.index", "meta/tasks.parquet", "row numbers");
    let swap = |root: &Path| {
        rewrite(root, "meta/tasks.parquet", &schema::TASKS, |columns| int64(columns, "task_index").swap(0, 1));
    };
    finding(swap, "meta.row", "meta/tasks.parquet", "task_index is 1, but should be 0");
    let edit = |file: &'static str, from: &'static str, to: &'static str| {
        move |root: &Path| {
            let text = std::fs::read_to_string(root.join(file)).unwrap();
            assert!(text.contains(from));
            std::fs::write(root.join(file), text.replacen(from, to, 1)).unwrap();
        }
    };
    finding(edit("meta/info.json", "v3.0", "v2.1"), "info.value", "meta/info.json", "v2.1");
    finding(edit("meta/info.json", "ntp.program", "ntp.other"), "info.value", "meta/info.json", "is not declared");
    finding(edit("meta/stats.json", "\"action\"", "\"other\""), "stats.value", "meta/stats.json", "no statistics");
}

#[test]
fn a_file_of_another_dataset_in_the_place_of_its_own_is_found() {
    let other = tempfile::tempdir().unwrap();
    let mut turned = episodes();
    turned.reverse();
    convert_all(&turned, &ConvertConfig::default(), other.path()).unwrap();
    let take = |file: &'static str| {
        let from = other.path().join(file);
        move |root: &Path| assert!(std::fs::copy(&from, root.join(file)).unwrap() > 0)
    };
    let meta = "meta/episodes/chunk-000/file-000.parquet";
    for (file, code) in
        [(FIRST_DATA, "frames.row"), (FIRST_CALLS, "calls.row"), (FIRST_SCOPES, "scopes.row"), (meta, "episodes.row")]
    {
        let folder = tempfile::tempdir().unwrap();
        convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
        take(file)(folder.path());
        let found = validate(folder.path()).findings;
        let is_named = found.iter().any(|of| of.code == code && of.path == folder.path().join(file));
        assert!(is_named, "{file}: {found:#?}");
    }
}

#[test]
fn rows_of_two_episodes_that_changed_places_are_found() {
    let swap = |root: &Path| {
        rewrite(root, FIRST_DATA, &schema::FRAMES, |columns| {
            for (_, column) in columns.iter_mut() {
                // Both episodes have nine frames.
                match column {
                    Column::Int64(rows) => (0..9).for_each(|at| rows.swap(at, 9 + at)),
                    Column::Float32List(rows) => (0..9).for_each(|at| rows.swap(at, 9 + at)),
                    _ => {}
                }
            }
        });
    };
    finding(swap, "frames.row", FIRST_DATA, "index is 9, but should be 0");
}

#[test]
fn a_card_without_a_licence_is_found() {
    let card = |text: &'static str| move |root: &Path| std::fs::write(root.join("README.md"), text).unwrap();
    for text in ["# A dataset\nlicense: mit\n", "---\nlicense:\n---\n", "---\ntags: []\n---\nlicense: mit\n"] {
        finding(card(text), "card.license", "README.md", "names no licence");
    }
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    card("---\nlicense: mit\n---\n# A dataset\n")(folder.path());
    assert!(validate(folder.path()).is_valid());
}

#[test]
fn findings_beyond_the_first_hundred_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    convert_all(&episodes(), &ConvertConfig::default(), folder.path()).unwrap();
    rewrite(folder.path(), FIRST_SCOPES, &schema::SCOPES, |columns| {
        int64(columns, "label").iter_mut().for_each(|label| *label += 1);
    });
    let validation = validate(folder.path());
    assert_eq!(validation.findings.len(), 100);
    assert_eq!(validation.findings.len() as u64 + validation.findings_left_out, validation.scopes);
}

#[test]
fn every_code_of_a_finding_is_documented_and_no_other() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = String::new();
    let mut folders =
        vec![root.join("src/dataset/files"), root.join("src/dataset/tables"), root.join("src/dataset/validate")];
    let mut files = vec![root.join("src/dataset/validate.rs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { folders.push(path) } else { files.push(path) }
        }
    }
    files.iter().for_each(|file| text.push_str(&std::fs::read_to_string(file).unwrap()));
    let is_code = |word: &&str| {
        let groups = [
            "calls.",
            "card.",
            "episodes.",
            "file.",
            "frames.",
            "info.",
            "meta.",
            "scopes.",
            "split.",
            "stats.",
            "tasks.",
        ];
        groups.iter().any(|group| word.starts_with(group)) && word.chars().all(|c| c.is_ascii_lowercase() || c == '.')
    };
    let used: BTreeSet<&str> = text.split('"').filter(is_code).collect();
    let page = std::fs::read_to_string(root.join("schemas/findings.md")).unwrap();
    let documented: BTreeSet<&str> = page.split('`').filter(is_code).collect();
    assert!(used.len() > 20);
    assert_eq!(used, documented);
}
