//! What LeRobot's own reader takes is taken; what it would refuse or silently misread is a finding with a code.

use std::path::Path;
use std::sync::Arc;

use arrow::array::{ArrayRef, Float32Array, Float64Array, Int32Array, LargeListArray, StringArray};
use arrow::buffer::OffsetBuffer;
use arrow::datatypes::{DataType, Field};
use ntp::dataset::edit::{Carry, Condition, filter};
use ntp::dataset::{Severity, play_back, summarize, validate};
use ntp::query::{Tables, query};
use parquet::basic::{Compression, GzipLevel};
use serde_json::{Value, json};

use crate::foreign::mini::{CAMERA, doubles, lists};
use crate::foreign::{Mini, one, whole};
use crate::pipeline::run;

/// A change of a dataset before it is written.
type Change = Box<dyn FnOnce(&mut Mini)>;

fn written(change: impl FnOnce(&mut Mini)) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut mini = Mini::new();
    change(&mut mini);
    mini.write(folder.path());
    folder
}

/// The findings of a dataset as `code place: message`.
fn found(root: &Path) -> Vec<String> {
    let findings = validate(root).findings;
    findings.iter().map(|of| format!("{} {}: {} {}", of.code, of.path.display(), of.place, of.message)).collect()
}

#[test]
#[expect(clippy::too_many_lines, reason = "one case a line, and nothing else")]
fn what_lerobot_takes_is_taken() {
    let cases: Vec<(&str, Change)> = vec![
        ("as it is", Box::new(|_| {})),
        ("a rate as a float", Box::new(|mini| mini.info["fps"] = json!(10.0))),
        (
            "no optional keys",
            Box::new(|mini| {
                let keys = [
                    "robot_type",
                    "splits",
                    "chunks_size",
                    "data_files_size_in_mb",
                    "total_tasks",
                    "data_path",
                    "video_path",
                ];
                let map = mini.info.as_object_mut().unwrap();
                keys.iter().for_each(|key| {
                    map.remove(*key);
                });
            }),
        ),
        ("keys of others", Box::new(|mini| mini.info["made_by"] = json!({ "tool": 3 }))),
        ("gzip", Box::new(|mini| mini.compression = Compression::GZIP(GzipLevel::default()))),
        ("brotli", Box::new(|mini| mini.compression = Compression::BROTLI(Default::default()))),
        ("lz4", Box::new(|mini| mini.compression = Compression::LZ4_RAW)),
        ("zstd", Box::new(|mini| mini.compression = Compression::ZSTD(Default::default()))),
        ("columns in another order", Box::new(|mini| mini.frames.reverse())),
        (
            "large lists",
            Box::new(|mini| {
                let item = Arc::new(Field::new("item", DataType::Float32, true));
                let values: ArrayRef =
                    Arc::new(Float32Array::from_iter_values((0..15).flat_map(|row| [0.5, row as f32])));
                let list = LargeListArray::new(item, OffsetBuffer::from_lengths([2; 15]), values, None);
                mini.replace("action", Arc::new(list));
            }),
        ),
        (
            "doubles for floats",
            Box::new(|mini| {
                mini.replace(
                    "timestamp",
                    doubles([6, 5, 4].into_iter().flat_map(|n| (0..n).map(|frame| f64::from(frame) / 10.0))),
                );
            }),
        ),
        (
            "numbers of four bytes",
            Box::new(|mini| {
                mini.replace(
                    "frame_index",
                    Arc::new(Int32Array::from_iter_values([6, 5, 4].into_iter().flat_map(|n| 0..n))),
                );
            }),
        ),
        (
            "whole statistics of an episode",
            Box::new(|mini| {
                mini.episodes.push(("stats/index/min".into(), lists(whole([0, 6, 11]), &[1, 1, 1])));
            }),
        ),
        (
            "a vector of whole numbers",
            Box::new(|mini| {
                let feature = json!({ "dtype": "int64", "shape": [2], "names": null });
                mini.stats["cmd"] =
                    json!({ "min": [0, 1], "max": [14, 15], "mean": [7, 8], "std": [4.3, 4.3], "count": [15] });
                mini.column("cmd", feature, lists(whole((0..15).flat_map(|row| [row, row + 1])), &[2; 15]));
            }),
        ),
        (
            "a reward, and a note",
            Box::new(|mini| {
                mini.stats["next.reward"] =
                    json!({ "min": [0.5], "max": [0.5], "mean": [0.5], "std": [0], "count": [15] });
                mini.column("next.reward", one("float32"), Arc::new(Float32Array::from_iter_values([0.5; 15])));
                mini.column("note", one("string"), Arc::new(StringArray::from_iter_values(["so"; 15])));
            }),
        ),
        (
            "a column of episodes of their own",
            Box::new(|mini| {
                mini.episodes.push(("operator".into(), Arc::new(StringArray::from_iter_values(["a", "b", "c"]))));
            }),
        ),
    ];
    for (name, change) in cases {
        let folder = written(change);
        assert_eq!(found(folder.path()), Vec::<String>::new(), "{name}");
        let summary = summarize(folder.path()).unwrap();
        assert_eq!((summary.total_episodes, summary.total_frames, summary.fps), (3, 15, 10.0), "{name}");
        assert_eq!(play_back(folder.path(), 1).unwrap().times_secs.len(), 5, "{name}");
    }
}

#[test]
fn files_may_be_numbered_with_gaps_and_litter_is_passed_over() {
    let folder = written(|mini| {
        let (_, files) = mini.episodes.iter_mut().find(|(name, _)| name == "data/file_index").unwrap();
        *files = whole([0, 2, 2]);
    });
    let data = folder.path().join("data/chunk-000");
    let whole = Mini::new();
    for (file, rows) in [("file-000.parquet", 0..6), ("file-002.parquet", 6..15)] {
        let part: Vec<(String, ArrayRef)> =
            whole.frames.iter().map(|(name, column)| (name.clone(), column.slice(rows.start, rows.len()))).collect();
        crate::foreign::mini::write_table(&data.join(file), &part, None, Compression::SNAPPY);
    }
    std::fs::write(data.join(".DS_Store"), "litter").unwrap();
    assert_eq!(found(folder.path()), Vec::<String>::new());
    assert_eq!(play_back(folder.path(), 2).unwrap().numbers[0].values[..2], [0.5, 11.0]);
}

#[test]
#[expect(clippy::too_many_lines, reason = "one case a line, and nothing else")]
fn what_lerobot_would_refuse_or_misread_is_a_finding() {
    let swap = |name: &'static str, column: ArrayRef| -> Change {
        Box::new(move |mini| {
            mini.replace(name, column);
        })
    };
    let info = |change: fn(&mut Value)| -> Change { Box::new(move |mini| change(&mut mini.info)) };
    let cases: Vec<(&str, &str, Change)> = vec![
        ("tasks.index", "row numbers for texts", Box::new(|mini| mini.is_indexed = false)),
        ("info.value", "total_frames it is 16, but there are 15", info(|info| info["total_frames"] = json!(16))),
        ("info.value", "ends at episode 9, but there are 3", info(|info| info["splits"] = json!({ "train": "0:9" }))),
        ("info.value", "expected a range of episodes", info(|info| info["splits"] = json!({ "train": [0, 1] }))),
        (
            "split.overlap",
            "episodes 1..2 are in val and in train",
            info(|info| info["splits"] = json!({ "train": "0:2", "val": "1:3" })),
        ),
        (
            "info.features",
            "\"names\" is missing",
            info(|info| {
                info["features"]["action"].as_object_mut().unwrap().remove("names");
            }),
        ),
        (
            "info.features",
            "dtype \"complex\" is known to no reader",
            info(|info| info["features"]["action"]["dtype"] = json!("complex")),
        ),
        (
            "info.features",
            "\"index\" is not declared",
            info(|info| {
                info["features"].as_object_mut().unwrap().remove("index");
            }),
        ),
        (
            "file.undeclared",
            "column \"secret\" is not declared",
            Box::new(|mini| {
                mini.frames.push(("secret".into(), whole(0..15)));
            }),
        ),
        ("frames.missing", "no column \"gone\"", info(|info| info["features"]["gone"] = one("float32"))),
        (
            "frames.shape",
            "it has 2 values, but its shape is [3]",
            info(|info| info["features"]["action"]["shape"] = json!([3])),
        ),
        (
            "file.columns",
            "it is declared as float32",
            Box::new(|mini| {
                mini.column("word", one("float32"), Arc::new(StringArray::from_iter_values(["so"; 15])));
            }),
        ),
        (
            "frames.value",
            "dimension 0 is no finite number (episode 1, frame 1)",
            Box::new(|mini| {
                let values = (0..15).map(|row| if row == 7 { f32::NAN } else { 1.0 });
                mini.column("load", one("float32"), Arc::new(Float32Array::from_iter_values(values)));
            }),
        ),
        (
            "file.null",
            "it has no value",
            Box::new(|mini| {
                let values: Float64Array = (0..15).map(|row| (row != 3).then_some(0.5)).collect();
                mini.column("load", one("float64"), Arc::new(values));
            }),
        ),
        ("frames.row", "(6, 1, 0)", swap("frame_index", whole([0, 1, 2, 3, 4, 5, 1, 1, 2, 3, 4, 0, 1, 2, 3]))),
        (
            "frames.time",
            "timestamp is 0.25, but should be 0.2, as in 3 of the frames behind it",
            swap("timestamp", doubles([0.0, 0.1, 0.25, 0.35, 0.45, 0.55, 0.0, 0.1, 0.2, 0.3, 0.4, 0.0, 0.1, 0.2, 0.3])),
        ),
        ("frames.task", "task_index is 7, but there are 2 tasks", swap("task_index", whole([7; 15]))),
        ("frames.task", "task_index 1 is \"open the drawer\"", swap("task_index", whole([1; 15]))),
        ("frames.task", "subtask_index is -1, but there are 2 sub-tasks", swap("subtask_index", whole([-1; 15]))),
        (
            "episodes.row",
            "its task \"other\" is none of the 2 tasks",
            Box::new(|mini| {
                let tasks: ArrayRef = Arc::new(StringArray::from_iter_values([
                    "pick the cube",
                    "other",
                    "open the drawer",
                    "pick the cube",
                ]));
                mini.episodes[1].1 = lists(tasks, &[2, 1, 1]);
            }),
        ),
        ("episodes.row", "readers take rows by position", Box::new(|mini| mini.episodes[0].1 = whole([0, 2, 1]))),
        ("episodes.row", "6 and 11 are of length 5", Box::new(|mini| mini.episodes[5].1 = whole([0, 7, 11]))),
        (
            "episodes.row",
            "data/chunk_index and data/file_index name",
            Box::new(|mini| mini.episodes[4].1 = whole([0, 0, 1])),
        ),
        (
            "stats.range",
            "dimension 1: it is said to be 0 to 9, but is 0 to 14",
            Box::new(|mini| mini.stats["action"]["max"][1] = json!(9)),
        ),
        (
            "stats.value",
            "count is [3.0], but there are 15 frames",
            Box::new(|mini| mini.stats["action"]["count"] = json!([3])),
        ),
        ("stats.value", "max has 1 value,", Box::new(|mini| mini.stats["action"]["max"] = json!([1]))),
    ];
    for (code, words, change) in cases {
        let folder = written(change);
        let found = found(folder.path());
        let is_told = found.iter().any(|of| of.starts_with(&format!("{code} ")) && of.contains(words));
        assert!(is_told, "{code} {words}: {found:#?}");
    }
}

/// Numbers that say how much there is are held against what can be: none of them is a size of memory.
#[test]
fn what_is_declared_beyond_all_measure_is_found_and_never_allocated() {
    for shape in ["[1000000000000000000]", "[1000000000]", "[4294967296, 4294967296]", "[-1]", "\"2\""] {
        let folder = written(|mini| mini.info["features"]["action"]["shape"] = serde_json::from_str(shape).unwrap());
        let found = found(folder.path()).join("\n");
        assert!(found.contains("info.features") && found.contains("expected sides above 0"), "{shape}: {found}");
        let elsewhere = tempfile::tempdir().unwrap();
        let to = elsewhere.path().join("to");
        let condition = Condition { min_frames: Some(1), ..Condition::default() };
        let error = filter(folder.path(), &condition, &to, Carry::Packets).unwrap_err().to_string();
        assert!(error.contains("shape of \"action\" is") && !to.exists(), "{shape}: {error}");
    }
    for total in ["-5", "1e30", "\"15\""] {
        let folder = written(|mini| mini.info["total_frames"] = serde_json::from_str(total).unwrap());
        let found = found(folder.path()).join("\n");
        assert!(found.contains("total_frames") && found.contains("expected a whole number"), "{total}: {found}");
    }
    let folder = written(|mini| mini.info["codebase_version"] = json!("v9.9"));
    let found = found(folder.path()).join("\n");
    assert!(found.contains("codebase_version is \"v9.9\"; v3.0"), "{found}");
}

#[test]
fn an_edit_names_what_it_does_not_carry_over() {
    let folder = written(|_| {});
    std::fs::write(folder.path().join("meta/temporal_proportions_sparse.json"), "{}").unwrap();
    std::fs::create_dir_all(folder.path().join("annotations/task-0000")).unwrap();
    std::fs::create_dir(folder.path().join("images")).unwrap();
    std::fs::write(folder.path().join(".DS_Store"), "").unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let (dataset, to) = (folder.path().to_str().unwrap(), elsewhere.path().join("to"));
    let words = ["dataset", "filter", dataset, "--episodes", "0-1", "--to", to.to_str().unwrap()];
    let (code, _, stderr) = run(&words);
    let told = "not carried over: annotations, meta/temporal_proportions_sparse.json";
    assert!(
        code == 3 && stderr.contains(told) && !stderr.contains("DS_Store") && !stderr.contains("images"),
        "{code} {stderr}"
    );
}

#[test]
fn a_pointer_of_git_lfs_is_named_as_one() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 3\n";
    for file in [
        "data/chunk-000/file-000.parquet",
        "meta/episodes/chunk-000/file-000.parquet",
        "meta/tasks.parquet",
        "meta/info.json",
    ] {
        let folder = written(|_| {});
        std::fs::write(folder.path().join(file), pointer).unwrap();
        let found = found(folder.path()).join("\n");
        assert!(found.contains("Git LFS pointer") && found.contains(file), "{file}: {found}");
    }
    let folder = written(|_| {});
    std::fs::write(folder.path().join("data/chunk-000/file-000.parquet"), pointer).unwrap();
    let error = Tables::default().add_dataset(folder.path()).unwrap_err().to_string();
    assert!(error.contains("git lfs pull"), "{error}");
    // Every command that reads what a file should hold names it.
    let dataset = folder.path().to_str().unwrap().to_owned();
    let recording = folder.path().join("lab.mcap");
    std::fs::write(&recording, pointer).unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let to = elsewhere.path().join("to").to_str().unwrap().to_owned();
    let recording = recording.to_str().unwrap().to_owned();
    for command in [
        vec!["dataset", "filter", &dataset, "--episodes", "0", "--to", &to],
        vec!["dataset", "import", &dataset, "--to", &to],
        vec!["inspect", &recording],
        vec!["validate", &recording],
        vec!["repair", &recording, "--to", &to],
        vec!["ingest", &recording, "--propose"],
    ] {
        let (code, stdout, stderr) = run(&command);
        assert!(
            code == 1 && format!("{stdout}{stderr}").contains("git lfs pull"),
            "{command:?}: {code} {stdout}{stderr}"
        );
    }
}

#[test]
fn videos_are_held_against_the_times_of_frames() {
    let made = |change: &dyn Fn(&mut Mini), has_video: bool| {
        let folder = tempfile::tempdir().unwrap();
        let mut mini = Mini::new();
        mini.camera();
        change(&mut mini);
        mini.write(folder.path());
        if has_video {
            mini.write_video(folder.path(), true);
        }
        folder
    };
    assert_eq!(found(made(&|_| {}, true).path()), Vec::<String>::new());
    let from = |mini: &mut Mini, secs: [f64; 3]| {
        let name = format!("videos/{}/from_timestamp", crate::foreign::mini::CAMERA);
        mini.episodes.iter_mut().find(|(known, _)| *known == name).unwrap().1 = doubles(secs);
    };
    type Case<'c> = (&'c str, &'c str, &'c dyn Fn(&mut Mini), bool);
    let cases: [Case<'_>; 6] = [
        ("pictures.place", "it is missing, but 3 episodes", &|_| {}, false),
        ("pictures.time", "frame 0 has no picture at 0.650000 s", &|mini| from(mini, [0.0, 0.65, 1.1]), true),
        (
            "pictures.place",
            "it begins at 0.5 s, but the one before ends at 0.6",
            &|mini| from(mini, [0.0, 0.5, 1.1]),
            true,
        ),
        ("pictures.time", "frame 3 has no picture at 1.500000 s", &|mini| from(mini, [0.0, 0.6, 1.2]), true),
        (
            "pictures.format",
            "its pictures are 64x48",
            &|mini| mini.info["features"][crate::foreign::mini::CAMERA]["shape"] = json!([32, 64, 3]),
            true,
        ),
        (
            "info.names",
            "expected three of sides",
            &|mini| mini.info["features"][crate::foreign::mini::CAMERA]["names"] = Value::Null,
            true,
        ),
    ];
    for (code, words, change, has_video) in cases {
        let folder = made(change, has_video);
        let found = found(folder.path());
        let is_told = found.iter().any(|of| of.starts_with(&format!("{code} ")) && of.contains(words));
        assert!(is_told, "{code} {words}: {found:#?}");
    }
}

#[test]
fn sql_asks_frames_episodes_and_tasks_of_both_formats() {
    let folder = tempfile::tempdir().unwrap();
    let mini = Mini::new();
    mini.write(&folder.path().join("new"));
    mini.write_v21(&folder.path().join("old"));
    for version in ["new", "old"] {
        let root = folder.path().join(version);
        let mut tables = Tables::default();
        tables.add_dataset(&root).unwrap();
        let ask = |sql: &str| query(&tables, sql).unwrap().to_csv().unwrap();
        assert_eq!(ask("SELECT COUNT(*) AS n FROM frames"), "n\n15\n", "{version}");
        assert_eq!(ask("SELECT length FROM episodes ORDER BY episode_index"), "length\n6\n5\n4\n", "{version}");
        let texts = "SELECT task FROM tasks ORDER BY task_index";
        assert_eq!(ask(texts), "task\npick the cube\nopen the drawer\n", "{version}");
        assert_eq!(play_back(&root, 1).unwrap().facts.task_text, "open the drawer", "{version}");
    }
    let old = folder.path().join("old");
    let errors = validate(&old).findings.into_iter().filter(|of| of.severity == Severity::Error).collect::<Vec<_>>();
    assert_eq!(errors, []);
    assert_eq!(summarize(&old).unwrap().lerobot_version, "v2.1");
}

#[test]
fn statistics_of_episodes_of_older_datasets_are_found_in_any_order_and_what_is_wrong_with_one_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("old");
    Mini::new().write_v21(&root);
    let path = root.join("meta/episodes_stats.jsonl");
    let whole = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = whole.lines().collect();
    let found = |text: &str| -> Vec<String> {
        std::fs::write(&path, text).unwrap();
        let findings = validate(&root).findings.into_iter().filter(|of| of.severity == Severity::Error);
        findings.map(|of| format!("{} {}: {}", of.code, of.place, of.message)).collect()
    };
    assert_eq!(found(&format!("{}\n\n{}\n{}\n", lines[2], lines[0], lines[1])), [""; 0]);
    assert_eq!(found(&lines[..2].join("\n")), ["stats.value row 2: there is no line of episode 2"]);
    assert_eq!(
        found(&whole.replace("\"count\":[5]", "\"count\":[7]")),
        ["stats.value episode 1: index: count is [7.0], but there are 5 frames"]
    );
    let damaged = found(&whole.replacen("\"stats\"", "stats", 1));
    assert!(damaged.len() == 1 && damaged[0].starts_with("stats.value row 0: no JSON"), "{damaged:?}");
    let twice = found(&format!("{}\n{whole}", lines[1]));
    assert_eq!(twice, ["stats.value row 2: episode 1 stands twice"]);
}

#[test]
fn a_video_that_begins_with_no_key_frame_is_a_finding() {
    let folder = tempfile::tempdir().unwrap();
    let mut mini = Mini::new();
    mini.camera().write(folder.path());
    mini.write_video(folder.path(), true);
    let path = folder.path().join(format!("videos/{CAMERA}/chunk-000/file-000.mp4"));
    let mut bytes = std::fs::read(&path).unwrap();
    // The list of key frames: its name, version and flags, how many, and the number of the first.
    let list = bytes.windows(4).position(|name| name == b"stss").unwrap();
    assert_eq!(bytes[list + 12..list + 16], [0, 0, 0, 1]);
    bytes[list + 15] = 2;
    std::fs::write(&path, bytes).unwrap();
    let found = found(folder.path());
    assert!(found.iter().any(|of| of.starts_with("pictures.decode") && of.contains("no key frame")), "{found:#?}");
}
