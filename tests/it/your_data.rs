//! The way from a robot's recording to a labelled dataset, followed word by word in an empty directory.

use std::path::Path;

use ntp::artifact::read_json;
use serde_json::Value;

use crate::tutorial::{blocks, follow_commands};

/// The files that a page says to save: the name stands in the last line before the fence.
fn save_files(page: &str, folder: &Path) -> usize {
    let toml = blocks(page, "toml");
    for text in &toml {
        let before = page.split(text).next().unwrap().rsplit("\n\n").nth(1).unwrap();
        let name = before.rsplit("Save this as `").next().unwrap().split('`').next().unwrap();
        std::fs::write(folder.join(name), text).unwrap();
    }
    toml.len()
}

#[test]
fn every_command_of_the_way_from_a_recording_to_a_labelled_dataset_does_what_it_says() {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/your_data.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(save_files(&page, folder.path()), 3);
    follow_commands(&page, folder.path());
    let at = |path: &str| folder.path().join(path);
    for made in ["labelled.rrd", "towers/README.md", "towers/ntp/annotation.json"] {
        assert!(at(made).is_file(), "{made} is not there");
    }
    let told: Value = read_json(&at("measured/ntp/annotation.json")).unwrap();
    assert_eq!(told["measured"]["episodes"], 6);
    let card = std::fs::read_to_string(at("towers/README.md")).unwrap();
    let said = "These labels are predictions: the model `ntp-seed0` (variant ntp, version `";
    assert!(card.contains(said) && card.contains("on 2026-11-30") && card.contains("was not measured"), "{card}");
}
