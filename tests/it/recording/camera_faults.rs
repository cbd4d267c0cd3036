//! What cameras saw, damaged under right checksums: the error names file, episode, camera and topic.

use std::fs;
use std::path::{Path, PathBuf};

use mcap::Message;
use ntp::recording::ShardReader;
use tempfile::TempDir;

use super::PLAN;
use super::cameras::write;
use super::faults::rewritten_with_plan;

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
