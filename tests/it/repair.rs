//! What is broken keeps what can be verified from its beginning, and no more; what is whole is left alone.

use std::path::{Path, PathBuf};

use ntp::dataset::edit::{Carry, EditError, EditSummary, diff, merge, repair};
use ntp::dataset::{ConvertConfig, FrameChoice, schema, validate};
use ntp::recording::{self, PlanSource, ShardReader, ShardWriter};
use ntp::table::Column;
use ntp::task::Split;
use ntp::trace::Episode;

use crate::dataset::{convert_all, densify, episodes, rewrite};
use crate::kinematic::{demonstration, tower, trial};
use crate::pipeline::run;

const FRAMES: &str = "data/chunk-000/file-000.parquet";
const PLAN: &str = "{\"stage\":\"generate\"}";
const CALLS: &str = "ntp/calls/chunk-000/file-000.parquet";

fn small(root: &Path) {
    convert_all(&episodes(), &ConvertConfig::default(), root).unwrap();
}

/// Long episodes, whose frames fill files and chunks.
fn long_episodes(n: u16) -> Vec<Episode> {
    let episode = |index: u16| {
        let task = tower(&format!("tower_{index}"), &[index % 8, (index + 3) % 8, (index + 5) % 8], Split::Seen);
        densify(&demonstration(&task, &trial(&task, u32::from(index), 1), u64::from(index)), 400)
    };
    (0..n).map(episode).collect()
}

fn number<'c>(columns: &'c mut [(String, Column)], name: &str) -> &'c mut Vec<i64> {
    match columns.iter_mut().find(|(column, _)| column == name) {
        Some((_, Column::Int64(values))) => values,
        other => panic!("{other:?}"),
    }
}

/// Repairs what `spoil` made of a dataset, and holds the result against the dataset as it was.
#[track_caller]
fn repaired(make: impl Fn(&Path), spoil: impl FnOnce(&Path)) -> (EditSummary, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let [whole, broken, to] = ["whole", "broken", "to"].map(|name| folder.path().join(name));
    make(&whole);
    make(&broken);
    spoil(&broken);
    let repair_of = repair(&broken, &to).unwrap();
    let written = repair_of.written.unwrap();
    assert_eq!(validate(&to).findings, []);
    let difference = diff(&whole, &to).unwrap();
    let found = (difference.same, difference.moved, difference.added, difference.changed);
    assert_eq!(found, (written.episodes, 0, 0, 0));
    let again = repair(&to, &folder.path().join("again")).unwrap();
    assert_eq!((again.written, again.reasons.len()), (None, 0));
    assert!(!folder.path().join("again").exists());
    (written, repair_of.reasons)
}

#[test]
fn a_later_file_that_is_broken_leaves_out_the_episodes_in_it() {
    let config =
        ConvertConfig { frames: FrameChoice::All, file_megabytes: 1.try_into().unwrap(), ..ConvertConfig::default() };
    let second = "data/chunk-000/file-001.parquet";
    let make = |root: &Path| drop(convert_all(&long_episodes(16), &config, root).unwrap());
    for spoil in [
        |path: PathBuf| {
            let bytes = std::fs::read(&path).unwrap();
            std::fs::write(path, &bytes[..bytes.len() / 2]).unwrap();
        },
        |path: PathBuf| std::fs::remove_file(path).unwrap(),
    ] {
        let (written, reasons) = repaired(make, |root| spoil(root.join(second)));
        assert!(written.episodes > 0 && written.left_out > 0, "{written:?}");
        assert!(reasons.iter().any(|reason| reason.contains(second)), "{reasons:?}");
    }
}

#[test]
fn an_episode_that_breaks_a_rule_ends_what_is_kept() {
    let of_episode = |columns: &mut [(String, Column)], episode: i64| {
        number(columns, "episode_index").iter().position(|&index| index == episode).unwrap()
    };
    let (written, reasons) = repaired(small, |root| {
        rewrite(root, CALLS, &schema::CALLS, |columns| {
            let row = of_episode(columns, 3);
            number(columns, "input_end")[row + 1] += 9;
        });
    });
    assert_eq!((written.episodes, written.left_out), (3, 3));
    assert!(reasons[0].contains("calls.tree") && reasons[0].contains("episode 3"), "{reasons:?}");
    let (written, _) = repaired(small, |root| {
        rewrite(root, FRAMES, &schema::FRAMES, |columns| {
            let row = of_episode(columns, 5);
            number(columns, "ntp.call_id")[row] += 1;
        });
    });
    assert_eq!((written.episodes, written.left_out), (5, 1));
}

#[test]
fn totals_and_statistics_are_made_anew_and_leave_nothing_out() {
    let (written, _) = repaired(small, |root| std::fs::remove_file(root.join("meta/stats.json")).unwrap());
    assert_eq!((written.episodes, written.left_out), (6, 0));
    let (written, _) = repaired(small, |root| {
        let info = root.join("meta/info.json");
        let text = std::fs::read_to_string(&info).unwrap();
        std::fs::write(info, text.replace("\"total_episodes\": 6", "\"total_episodes\": 9")).unwrap();
    });
    assert_eq!((written.episodes, written.left_out), (6, 3));
}

#[test]
fn a_file_that_is_not_as_the_manifest_says_is_not_verified() {
    let folder = tempfile::tempdir().unwrap();
    let [small_one, whole, to] = ["small", "whole", "to"].map(|name| folder.path().join(name));
    small(&small_one);
    merge(&[small_one], &whole, Carry::Packets).unwrap();
    // No rule of the tables holds the seed.
    rewrite(&whole, "ntp/episodes.parquet", &schema::EPISODES, |columns| {
        let at = columns.iter().position(|(name, _)| name == "seed").unwrap();
        columns[at].1 = Column::Text(vec!["1".to_owned(); 6]);
    });
    assert_eq!(validate(&whole).findings, []);
    let error = repair(&whole, &to).unwrap_err();
    assert!(matches!(error, EditError::Refused { code: "edit.empty", .. }), "{error}");
    assert!(error.to_string().contains("ntp/episodes.parquet") && !to.exists(), "{error}");
}

fn record(path: &Path, episodes: &[Episode], plan: &str) {
    let mut writer = ShardWriter::create(path, plan).unwrap();
    episodes.iter().for_each(|episode| writer.write(episode).unwrap());
    writer.finish().unwrap();
}

#[test]
fn a_recording_cut_anywhere_keeps_its_whole_episodes_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let episodes = long_episodes(5);
    record(&path("whole.mcap"), &episodes, PLAN);
    let bytes = std::fs::read(path("whole.mcap")).unwrap();
    let mut counts = Vec::new();
    for end in (0..=bytes.len()).step_by(bytes.len() / 12) {
        std::fs::write(path("cut.mcap"), &bytes[..end]).unwrap();
        let to = path(&format!("to-{end}.mcap"));
        let Ok(found) = recording::repair(&path("cut.mcap"), &to) else {
            assert!(!to.exists());
            counts.push(0);
            continue;
        };
        counts.push(found.kept);
        if found.reason.is_some() {
            // The plan lies behind all messages.
            let plan = if found.plan == PlanSource::Lost { "{}" } else { PLAN };
            record(&path("expected.mcap"), &episodes[..found.kept as usize], plan);
            assert!(found.plan != PlanSource::Folder && (plan == "{}" || found.kept == 5), "{found:?}");
            assert!(std::fs::read(&to).unwrap() == std::fs::read(path("expected.mcap")).unwrap(), "cut at {end}");
            assert_eq!(recording::repair(&to, &path("again.mcap")).unwrap().reason, None);
        }
    }
    assert!(counts.is_sorted() && counts[0] == 0, "{counts:?}");
    assert!(counts.iter().any(|&kept| kept > 0 && kept < 5), "{counts:?}");
}

#[test]
fn a_damaged_recording_keeps_what_lies_before_the_damage_and_the_plan_beside_it() {
    let folder = crate::smoke::copy_to("generate");
    let recordings = folder.path().join("recordings");
    let plan = ShardReader::open(&first_recording(&recordings)).unwrap().plan_json().to_owned();
    let (broken, to) = (recordings.join("broken.mcap"), folder.path().join("to.mcap"));
    let episodes = long_episodes(5);
    record(&broken, &episodes, "{}");
    let mut bytes = std::fs::read(&broken).unwrap();
    let chunk = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes[1].chunk_start_offset as usize;
    bytes[chunk + 1000] ^= 0x10;
    std::fs::write(&broken, bytes).unwrap();
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let (code, stdout, stderr) = run(&["repair", &text(&broken), "--to", &text(&to), "--json"]);
    assert_eq!(code, 3, "{stderr}");
    let told: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let kept = told["kept"].as_u64().unwrap() as usize;
    assert!((1..5).contains(&kept) && told["plan"] == "folder", "{told}");
    let reader = ShardReader::open(&to).unwrap();
    assert_eq!(reader.plan_json(), plan);
    assert_eq!(reader.collect::<Result<Vec<_>, _>>().unwrap(), episodes[..kept]);
    assert_eq!(run(&["validate", &text(&to)]).0, 0);
    assert_eq!(run(&["repair", &text(&to), "--to", &text(&folder.path().join("again.mcap"))]).0, 0);
    assert_eq!(run(&["repair", &text(&broken), "--to", &text(&to)]).0, 2);
}

fn first_recording(folder: &Path) -> PathBuf {
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.filter(|path| path.extension().is_some_and(|extension| extension == "mcap")).min().unwrap()
}
