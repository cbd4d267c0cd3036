//! What cameras saw, damaged under right checksums: the error names file, episode, camera and topic.

use std::fs;
use std::path::{Path, PathBuf};

use mcap::Message;
use ntp::artifact::Plan;
use ntp::recording::{PlanSource, ShardReader, ShardWriter, repair};
use serde_json::json;
use tempfile::TempDir;

use super::PLAN;
use super::cameras::{cameras, episodes, write};
use super::faults::rewritten_with_plan;
use crate::pipeline::run;

/// A folder with a filmed recording whose messages were changed.
struct Spoiled {
    folder: TempDir,
}

impl Spoiled {
    /// Messages for which `change` says no are left out.
    fn new(plan: &str, mut change: impl FnMut(&mut Message<'_>) -> bool) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let spoiled = Self { folder };
        let whole = spoiled.at("whole.mcap");
        write(&whole);
        let bytes = rewritten_with_plan(&fs::read(&whole).unwrap(), plan, |_, message| change(message));
        fs::write(spoiled.path(), bytes).unwrap();
        spoiled
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn path(&self) -> PathBuf {
        self.at("shard.mcap")
    }
}

fn is_nth(message: &Message<'_>, topic: &str, n: u32) -> bool {
    message.channel.topic == topic && message.sequence == n
}

/// What the reading of episodes with their pictures says.
fn said_by_reader(path: &Path) -> String {
    let error = ShardReader::open(path).unwrap().pictured().find_map(Result::err).unwrap();
    error.to_string()
}

#[track_caller]
fn is_said(text: &str, parts: &[&str]) {
    assert!(text.ends_with("shard.mcap") && parts.iter().all(|part| text.contains(part)), "{text}");
}

#[test]
fn a_missing_picture_is_told_with_episode_topic_and_camera() {
    let spoiled = Spoiled::new(PLAN, |message| !is_nth(message, "/camera/wrist/video", 3));
    let place = "episode 0 of the file: message 4 of /camera/wrist/video at ";
    let text = said_by_reader(&spoiled.path());
    is_said(&text, &[place, " ns: camera wrist: number of pictures is 4, not 5: "]);
    assert!(text.starts_with(place), "{text}");
}

#[test]
fn a_missing_calibration_is_told_with_episode_and_camera() {
    let spoiled = Spoiled::new(PLAN, |message| !is_nth(message, "/camera/front/calibration", 1));
    let parts = ["episode 1 of the file: message 1 of /ntp/episode/end at ", ": camera front: no calibration: "];
    is_said(&said_by_reader(&spoiled.path()), &parts);
}

#[test]
fn a_picture_that_is_cut_off_is_told_with_topic_and_camera() {
    let spoiled = Spoiled::new(PLAN, |message| {
        if is_nth(message, "/camera/front/image", 2) {
            let half = message.data.len() / 2;
            message.data.to_mut().truncate(half);
        }
        true
    });
    let parts = ["episode 0 of the file: message 2 of /camera/front/image at ", ": camera front: ", "CompressedImage"];
    is_said(&said_by_reader(&spoiled.path()), &parts);
}

/// A plan that names the cameras, as that of `generate` does.
fn plan() -> String {
    let plan = Plan::new("generate", 1, [].into(), json!({"generate": {"cameras": cameras()}}));
    serde_json::to_string(&plan).unwrap()
}

/// Changes the `n`th message of a topic.
fn changed(topic: &str, n: u32, change: impl Fn(&mut Vec<u8>)) -> Spoiled {
    Spoiled::new(&plan(), |message| {
        if is_nth(message, topic, n) {
            change(message.data.to_mut());
        }
        true
    })
}

/// Number of a message of the second episode, of a topic with one a frame.
fn in_second() -> u32 {
    episodes()[0].frames.len() as u32 + 2
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

/// What `ntp validate` finds wrong with the second episode; `ntp repair` keeps the first one with all that was seen.
#[track_caller]
fn finding(spoiled: &Spoiled) -> String {
    let (path, to) = (text(&spoiled.path()), spoiled.at("to.mcap"));
    let (code, stdout, stderr) = run(&["validate", &path, "--json"]);
    assert_eq!(code, 1, "{stdout}{stderr}");
    let told: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    let findings = told["findings"].as_array().unwrap();
    assert_eq!(findings.len(), 1, "{stdout}");
    assert_eq!((findings[0]["code"].as_str(), findings[0]["path"].as_str()), (Some("RECORDING"), Some(path.as_str())));
    let message = findings[0]["message"].as_str().unwrap().to_owned();
    // The plan in the file lies behind the damage.
    fs::write(spoiled.at("plan.json"), plan()).unwrap();
    let repaired = repair(&spoiled.path(), &to).unwrap();
    assert_eq!((repaired.reason.as_ref(), repaired.kept, repaired.plan), (Some(&message), 1, PlanSource::Folder));
    let expected = spoiled.at("expected.mcap");
    let mut writer = ShardWriter::create(&expected, &plan()).unwrap().with_cameras(&cameras());
    writer.write(&episodes()[0]).unwrap();
    writer.finish().unwrap();
    assert!(fs::read(&to).unwrap() == fs::read(expected).unwrap(), "the first episode is not as it was written");
    assert_eq!(run(&["validate", &text(&to)]).0, 0);
    message
}

#[test]
fn what_is_whole_is_valid_with_its_pictures_and_left_alone() {
    let spoiled = Spoiled::new(&plan(), |_| true);
    let (code, stdout, _) = run(&["validate", &text(&spoiled.path())]);
    assert!(code == 0 && stdout.contains("2 episodes"), "{stdout}");
    let repaired = repair(&spoiled.path(), &spoiled.at("to.mcap")).unwrap();
    assert_eq!((repaired.reason, repaired.kept), (None, 2));
}

#[test]
fn validate_and_repair_notice_a_picture_that_is_missing() {
    let spoiled = Spoiled::new(&plan(), |message| !is_nth(message, "/camera/front/image", in_second()));
    let message = finding(&spoiled);
    is_said(
        &message,
        &["episode 1 of the file: message ", " of /camera/front/image ", "camera front: number of pictures"],
    );
}

#[test]
fn validate_and_repair_notice_a_calibration_that_is_missing() {
    let spoiled = Spoiled::new(&plan(), |message| !is_nth(message, "/camera/wrist/calibration", 1));
    is_said(&finding(&spoiled), &["episode 1 of the file: ", ": camera wrist: no calibration: "]);
}

#[test]
fn validate_and_repair_notice_a_camera_that_is_missing_in_an_episode() {
    let n_frames = episodes()[0].frames.len() as u32;
    let spoiled = Spoiled::new(&plan(), |message| match message.channel.topic.as_str() {
        "/camera/wrist/video" => message.sequence < n_frames,
        "/camera/wrist/calibration" | "/camera/wrist/tf" => message.sequence < 1,
        _ => true,
    });
    is_said(&finding(&spoiled), &["episode 1 of the file: ", ": camera wrist: number of pictures is 0, not "]);
    is_said(&said_by_reader(&spoiled.path()), &[": camera wrist: number of pictures is 0, not "]);
}

#[test]
fn a_camera_of_which_there_is_nothing_is_missed_where_the_plan_names_it() {
    let without_wrist = |plan: &str| Spoiled::new(plan, |message| !message.channel.topic.starts_with("/camera/wrist/"));
    let spoiled = without_wrist(&plan());
    let said = "camera wrist: number of pictures is 0, not ";
    let (code, stdout, _) = run(&["validate", &text(&spoiled.path())]);
    assert!(code == 1 && stdout.contains("episode 0 of the file: ") && stdout.contains(said), "{stdout}");
    let error = repair(&spoiled.path(), &spoiled.at("to.mcap")).unwrap_err().to_string();
    is_said(&error, &["episode 0 of the file: ", said]);
    assert!(!spoiled.at("to.mcap").exists());
    assert_eq!(run(&["validate", &text(&without_wrist(PLAN).path())]).0, 0);
}

#[test]
fn validate_and_repair_notice_pictures_that_cannot_be_decoded() {
    let garble = |data: &mut Vec<u8>| {
        let (begin, end) = (data.len() / 3, data.len() / 2);
        data[begin..end].iter_mut().for_each(|byte| *byte ^= 0x5a);
    };
    for (topic, camera, codec) in [("/camera/front/image", "front", "PNG"), ("/camera/wrist/video", "wrist", "H.264")] {
        let spoiled = changed(topic, in_second(), garble);
        let place = format!("episode 1 of the file, camera {camera}: picture of frame 2: failed to decode {codec}: ");
        is_said(&finding(&spoiled), &[&place]);
        let spoiled = changed(topic, in_second(), |data| data.truncate(data.len() / 2));
        is_said(&finding(&spoiled), &["episode 1 of the file: message ", topic, &format!(": camera {camera}: ")]);
    }
}

#[test]
fn validate_and_repair_hold_pictures_against_the_calibration() {
    // Field 2 is the width.
    let narrow = |data: &mut Vec<u8>| {
        let at = data.windows(5).position(|bytes| bytes == [0x15, 64, 0, 0, 0]).unwrap();
        data[at + 1] = 32;
    };
    let message = finding(&changed("/camera/front/calibration", 1, narrow));
    is_said(&message, &["camera front: picture of frame 0: a picture is 64x64 pixels, expected 32x64: "]);
}

#[test]
fn every_episode_whose_pictures_are_damaged_is_told() {
    let numbers = [1, in_second()];
    let spoiled = Spoiled::new(&plan(), |message| {
        if numbers.iter().any(|&n| is_nth(message, "/camera/front/image", n)) {
            let middle = message.data.len() / 2;
            message.data.to_mut()[middle] ^= 0xff;
        }
        true
    });
    let (code, stdout, _) = run(&["validate", &text(spoiled.folder.path())]);
    assert_eq!(code, 1);
    for place in ["episode 0 of the file, camera front: picture of frame 1: ", "episode 1 of the file, camera front: "]
    {
        assert!(stdout.contains(place), "{stdout}");
    }
    assert!(stdout.ends_with("2 findings\n"), "{stdout}");
}

#[test]
fn a_filmed_recording_without_its_end_is_mended_with_all_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let [whole, cut, to] = ["whole.mcap", "cut.mcap", "to.mcap"].map(|name| folder.path().join(name));
    write(&whole);
    let bytes = fs::read(&whole).unwrap();
    fs::write(&cut, &bytes[..bytes.len() - 100]).unwrap();
    let repaired = repair(&cut, &to).unwrap();
    assert_eq!((repaired.reason.is_some(), repaired.kept), (true, 2));
    assert!(fs::read(&to).unwrap() == bytes, "not as it was written");
}
