//! Damaged datasets of others: none stops the program, and what is said to be whole can be read and edited.
//!
//! LeRobot's format has no checksums: a value that was changed into another value of its kind is not to be told.

use std::path::{Path, PathBuf};

use ntp::dataset::edit::{Carry, Condition, EditError, filter};
use ntp::dataset::{Severity, play_back, summarize, validate};
use ntp::video::{H264Decoder, Mp4Reader, Rgb};

use crate::foreign::Mini;
use crate::foreign::mini::CAMERA;
use crate::fuzz::change::{changed, changes, changes_of_text};
use crate::fuzz::run;

/// Every file of a folder with its bytes, in order.
fn files(root: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() { folders.push(path) } else { found.push((path.clone(), std::fs::read(path).unwrap())) }
        }
    }
    found.sort();
    found
}

/// Asks for everything that a user would, and edits what is said to be whole.
fn use_it(root: &Path, scratch: &Path) {
    let found = validate(root);
    let _described = summarize(root);
    let _played = play_back(root, 1);
    if found.findings.iter().all(|of| of.severity != Severity::Error) {
        let to = scratch.join("edited");
        let all = Condition { max_frames: Some(1_000_000), ..Condition::default() };
        let edited = filter(root, &all, &to, Carry::Packets);
        // An episode that begins at no key frame is whole, and is not cut out without encoding it again.
        let is_refused = matches!(&edited, Err(EditError::Refused { code: "edit.keyframe", .. }));
        assert!(edited.is_ok() || is_refused, "it was said to be whole: {edited:?}");
        assert_eq!(to.exists(), edited.is_ok());
        let _gone = std::fs::remove_dir_all(to);
    }
}

#[test]
fn fuzz_datasets_of_others() {
    for (share, layout) in [(40, "v3.0"), (20, "v2.1")] {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("theirs");
        let mut mini = Mini::new();
        if layout == "v2.1" {
            mini.write_v21(&root);
        } else {
            mini.camera().write(&root);
            mini.write_video(&root, true);
        }
        use_it(&root, folder.path());
        let files = files(&root);
        assert!(files.len() > 4, "{files:?}");
        run(share, &(0..files.len(), changes_of_text()), |(file, changes)| {
            let (path, whole) = &files[file];
            std::fs::write(path, changed(whole, &changes)).unwrap();
            use_it(&root, folder.path());
            std::fs::write(path, whole).unwrap();
        });
    }
}

#[test]
fn fuzz_videos_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("theirs");
    Mini::new().write_video(&root, true);
    let path = root.join(format!("videos/{CAMERA}/chunk-000/file-000.mp4"));
    let whole = std::fs::read(&path).unwrap();
    run(40, &changes(), |changes| {
        std::fs::write(&path, changed(&whole, &changes)).unwrap();
        let Ok(mut video) = Mp4Reader::open(&path) else { return };
        let mut decoder = H264Decoder::new().unwrap();
        let (mut packet, mut picture) = (Vec::new(), Rgb::default());
        for position in 0..video.samples().len() {
            let _shown = video.read(position, &mut packet).map(|()| decoder.decode(&packet, &mut picture));
        }
    });
}
