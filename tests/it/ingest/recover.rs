//! Recordings of others that are cut or damaged: what is whole is written, and what was lost is told.

use std::path::Path;

use ntp::recording::{self, Recovery};
use serde_json::{Value, json};

use super::MS;
use super::messages::{Bag, joint_state_cdr};
use crate::pipeline::run;

const N_MESSAGES: usize = 400;

/// Messages of two topics, in ROS 2 and JSON, in some ten chunks.
fn bag() -> Bag {
    let mut bag = Bag::default();
    for step in 0..N_MESSAGES as u64 / 2 {
        let at = step * 10 * MS;
        bag.ros2("/joint_states", at, joint_state_cdr(at, &[("a", step as f64), ("b", 2.0)]));
        bag.json("/gripper", at, json!({ "data": step }));
    }
    bag
}

/// Topic, time and content of each message.
fn messages(path: &Path) -> Vec<(String, u64, Vec<u8>)> {
    let bytes = std::fs::read(path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    messages.map(|of| (of.channel.topic.clone(), of.log_time, of.data.to_vec())).collect()
}

/// Where each chunk begins.
fn chunks(bytes: &[u8]) -> Vec<usize> {
    let summary = mcap::Summary::read(bytes).unwrap().unwrap();
    summary.chunk_indexes.iter().map(|chunk| chunk.chunk_start_offset as usize).collect()
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

#[test]
fn a_recording_of_others_cut_anywhere_keeps_the_chunks_before_the_cut() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, cut, to] = ["whole.mcap", "cut.mcap", "to.mcap"].map(|name| folder.path().join(name));
    bag().write(&whole);
    let bytes = std::fs::read(&whole).unwrap();
    let (all, begins) = (messages(&whole), chunks(&bytes));
    assert!(begins.len() >= 8, "{}", begins.len());
    let mut kept = Vec::new();
    for end in (0..bytes.len()).step_by(bytes.len() / 23) {
        std::fs::write(&cut, &bytes[..end]).unwrap();
        let Ok(found) = recording::recover(&cut, &to) else {
            assert!(!to.exists() && begins.get(1).is_none_or(|second| end < *second), "cut at {end}");
            kept.push(0);
            continue;
        };
        assert_eq!(messages(&to), all[..found.messages as usize], "cut at {end}");
        let summary = mcap::Summary::read(&std::fs::read(&to).unwrap()).unwrap().unwrap();
        assert_eq!(summary.stats.unwrap().message_count, found.messages);
        assert_eq!(summary.channels.len(), 2);
        let [lost] = &found.lost[..] else { panic!("{found:?}") };
        assert_eq!((lost.offset + lost.bytes, lost.problem.as_str(), found.counted), (end as u64, "cut off", None));
        let again = recording::recover(&to, &folder.path().join("again.mcap")).unwrap();
        assert_eq!((again.lost.len(), again.messages), (0, found.messages));
        kept.push(found.messages);
        std::fs::remove_file(&to).unwrap();
    }
    assert!(kept.is_sorted() && kept[1] < kept[20] && kept.last().unwrap() + 1 > N_MESSAGES as u64, "{kept:?}");
}

#[test]
fn a_chunk_that_is_damaged_is_left_out_and_those_behind_it_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let [broken, to] = ["broken.mcap", "to.mcap"].map(|name| folder.path().join(name));
    bag().write(&broken);
    let all = messages(&broken);
    let mut bytes = std::fs::read(&broken).unwrap();
    let begins = chunks(&bytes);
    // Behind the chunk's own fields, in what is compressed.
    bytes[begins[1] + 200] ^= 0x10;
    std::fs::write(&broken, bytes).unwrap();
    let (code, stdout, stderr) = run(&["repair", &text(&broken), "--to", &text(&to), "--json"]);
    assert_eq!(code, 3, "{stdout} {stderr}");
    let found: Value = serde_json::from_str(&stdout).unwrap();
    let kept = messages(&to);
    let n_lost = all.len() - kept.len();
    assert!((1..N_MESSAGES / 4).contains(&n_lost), "{n_lost}");
    let first = all.iter().zip(&kept).take_while(|(a, b)| a == b).count();
    assert!(first > 0 && all[first + n_lost..] == kept[first..]);
    assert_eq!((&found["counted"], &found["messages"]), (&json!(N_MESSAGES), &json!(kept.len())));
    assert_eq!((found["lost"].as_array().unwrap().len(), &found["lost"][0]["offset"]), (1, &json!(begins[1])));
    std::fs::remove_file(&to).unwrap();
    let (_, stdout, _) = run(&["repair", &text(&broken), "--to", &text(&to)]);
    assert!(stdout.contains(&format!("kept     {} messages of {N_MESSAGES} on 2 topics: ", kept.len())), "{stdout}");
    assert!(stdout.contains(&format!("from byte {} on: a chunk: ", begins[1])), "{stdout}");
}

#[test]
fn a_recording_of_others_that_is_whole_is_left_alone_and_what_is_none_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, none, to] = ["whole.mcap", "none.mcap", "to.mcap"].map(|name| folder.path().join(name));
    bag().write(&whole);
    let found = recording::recover(&whole, &to).unwrap();
    assert_eq!(found, Recovery { messages: 400, topics: 2, counted: Some(400), ..Recovery::default() });
    let (code, stdout, _) = run(&["repair", &text(&whole), "--to", &text(&to)]);
    assert!(code == 0 && stdout.contains("is whole: nothing to repair") && !to.exists(), "{stdout}");
    std::fs::write(&none, "no recording at all").unwrap();
    let (code, _, stderr) = run(&["repair", &text(&none), "--to", &text(&to)]);
    assert!(code == 1 && stderr.contains("not an MCAP file") && !to.exists(), "{stderr}");
}
