//! Publishing: what is in the folder, what is refused, what an interruption leaves, and the check of a copy.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ntp::dataset::{ConvertConfig, schema};
use ntp::date::Date;
use ntp::publish::{Difference, License, Publication, PublishError, PublishSummary, publish, verify};
use ntp::store::Folder;
use serde_json::Value;

use crate::dataset::{convert_all, episodes};
use crate::lerobot;
use crate::pipeline::{hashes, run};

/// A small dataset, and beside it a folder to publish into.
pub(crate) struct Place {
    _folder: tempfile::TempDir,
    pub(crate) dataset: PathBuf,
    pub(crate) to: PathBuf,
}

pub(crate) fn place() -> Place {
    let folder = tempfile::tempdir().unwrap();
    let (dataset, to) = (folder.path().join("dataset"), folder.path().join("published"));
    convert_all(&episodes(), &ConvertConfig::default(), &dataset).unwrap();
    Place { _folder: folder, dataset, to }
}

pub(crate) fn publication() -> Publication {
    Publication {
        license: "CC-BY-4.0".parse().unwrap(),
        date: "2026-11-24".parse().unwrap(),
        name: "Six towers".to_owned(),
        creators: vec!["Ada Lovelace".to_owned()],
        url: Some("https://huggingface.co/datasets/ada/six-towers".to_owned()),
        release: "1.2.0".parse().unwrap(),
    }
}

fn publish_to(place: &Place) -> Result<PublishSummary, PublishError> {
    publish(&place.dataset, &Folder::new(&place.to), &publication(), || true)
}

fn text(place: &Place, file: &str) -> String {
    std::fs::read_to_string(place.to.join(file)).unwrap()
}

#[test]
fn what_is_published_is_the_dataset_with_card_metadata_and_checksums() {
    let place = place();
    let summary = publish_to(&place).unwrap();
    assert_eq!(summary.kept, 0);
    assert_eq!(hashes(&place.dataset, &["data", "meta", "ntp"]), hashes(&place.to, &["data", "meta", "ntp"]));
    assert_eq!(lerobot::open(&place.dataset), lerobot::open(&place.to));
    let found = verify(&Folder::new(&place.to)).unwrap();
    assert_eq!((found.files + 1, found.differences.len()), (summary.files, 0));
    let card = text(&place, "README.md");
    for part in [
        "license: cc-by-4.0\n",
        "- config_name: frames\n  default: true\n  data_files: data/*/*.parquet\n",
        "- config_name: scopes\n  data_files: ntp/scopes/*/*.parquet\n",
        "| episodes | 6 |",
        "| `seen` | 2 |\n| `unseen` | 4 |\n",
        "6 of 6 episodes succeeded (100.0 %)",
        "Ada Lovelace",
        "1710.01813",
        "| `end_of_program` | boolean |",
        "LeRobotDataset(\"ada/six-towers\")",
    ] {
        assert!(card.contains(part), "the card lacks {part:?}:\n{card}");
    }
    assert!(!card.contains("not described"), "{card}");
}

#[test]
fn the_metadata_names_every_file_with_its_hash_and_every_column_of_a_known_kind() {
    let place = place();
    publish_to(&place).unwrap();
    let croissant: Value = serde_json::from_str(&text(&place, "croissant.json")).unwrap();
    let sums = text(&place, "SHA256SUMS");
    let sums: BTreeMap<&str, &str> =
        sums.lines().map(|line| line.split_once("  ").unwrap()).map(|(a, b)| (b, a)).collect();
    let objects: Vec<&Value> =
        croissant["distribution"].as_array().unwrap().iter().filter(|part| part["@type"] == "cr:FileObject").collect();
    assert_eq!(objects.len(), hashes(&place.dataset, &["data", "meta", "ntp"]).len());
    for object in objects {
        assert_eq!(object["sha256"], sums[object["contentUrl"].as_str().unwrap()]);
    }
    let fields = |name: &str| {
        let sets = croissant["recordSet"].as_array().unwrap();
        sets.iter().find(|set| set["name"] == name).unwrap()["field"].as_array().unwrap().len()
    };
    for schema in [schema::FRAMES, schema::EPISODES, schema::CALLS, schema::SCOPES] {
        assert_eq!(fields(schema.name()), schema.columns().len(), "{}", schema.name());
    }
    assert_eq!(croissant["license"], "https://spdx.org/licenses/CC-BY-4.0");
    assert_eq!(
        (croissant["datePublished"].as_str(), croissant["version"].as_str()),
        (Some("2026-11-24"), Some("1.2.0"))
    );
}

#[test]
fn the_same_words_give_the_same_bytes_and_a_second_time_nothing_is_copied() {
    let place = place();
    let first = publish_to(&place).unwrap();
    let before = hashes(&place.to, &[""]);
    let again = publish_to(&place).unwrap();
    assert_eq!((again.copied, again.kept), (0, first.copied));
    let other = Place { to: place.to.with_file_name("other"), dataset: place.dataset.clone(), _folder: place._folder };
    publish_to(&other).unwrap();
    assert_eq!(before, hashes(&other.to, &[""]));
}

#[test]
fn an_interrupted_publication_goes_on_where_it_was() {
    let place = place();
    let mut n_left = 3;
    let stopped = std::cell::RefCell::new(&mut n_left);
    let go_on = || {
        let mut left = stopped.borrow_mut();
        **left -= 1;
        **left >= 0
    };
    assert!(matches!(
        publish(&place.dataset, &Folder::new(&place.to), &publication(), go_on),
        Err(PublishError::Interrupted)
    ));
    assert!(!place.to.join("SHA256SUMS").exists(), "what is not whole must not look so");
    // A process that was killed leaves a half-written file under a name of its own.
    std::fs::write(place.to.join(".partial-x"), "half").unwrap();
    let summary = publish_to(&place).unwrap();
    assert_eq!(summary.kept, 3);
    assert!(verify(&Folder::new(&place.to)).unwrap().differences.is_empty());
    assert!(!place.to.join(".partial-x").exists());
}

#[test]
fn faulty_datasets_and_folders_with_something_else_in_them_are_refused() {
    let faulty = place();
    std::fs::remove_file(faulty.dataset.join("meta/stats.json")).unwrap();
    let error = publish_to(&faulty).unwrap_err();
    assert!(matches!(error, PublishError::Invalid { .. }));
    assert!(error.to_string().contains("file.unreadable") && error.to_string().contains("ntp validate"), "{error}");
    assert!(!faulty.to.exists(), "nothing is begun for a dataset with faults");

    let occupied = place();
    std::fs::create_dir_all(occupied.to.join("data")).unwrap();
    std::fs::write(occupied.to.join("data/mine.txt"), "precious").unwrap();
    let error = publish_to(&occupied).unwrap_err().to_string();
    assert!(error.contains("data/mine.txt") && error.contains("no part of this publication"), "{error}");

    let other = place();
    publish_to(&other).unwrap();
    std::fs::write(other.to.join("meta/info.json"), "{}").unwrap();
    let error = publish_to(&other).unwrap_err().to_string();
    assert!(error.contains("meta/info.json") && error.contains("nothing is overwritten"), "{error}");

    let nested = place();
    let inside =
        Place { to: nested.dataset.join("published"), dataset: nested.dataset.clone(), _folder: nested._folder };
    assert!(matches!(publish_to(&inside), Err(PublishError::Nested { .. })));
}

#[test]
fn each_way_in_which_a_copy_differs_is_named() {
    let place = place();
    publish_to(&place).unwrap();
    std::fs::remove_file(place.to.join("ntp/info.json")).unwrap();
    std::fs::write(place.to.join("meta/info.json"), "{}").unwrap();
    std::fs::write(place.to.join("stray.txt"), "hello").unwrap();
    let sums = text(&place, "SHA256SUMS");
    std::fs::write(place.to.join("SHA256SUMS"), format!("{sums}{}  ../outside\nno line\n", "0".repeat(64))).unwrap();
    let found = verify(&Folder::new(&place.to)).unwrap().differences;
    let found: Vec<(&str, Difference)> = found.iter().map(|of| (of.path.as_str(), of.difference)).collect();
    let outside = format!("{}  ../outside", "0".repeat(64));
    let expected = [
        (outside.as_str(), Difference::BadLine),
        ("meta/info.json", Difference::Changed),
        ("no line", Difference::BadLine),
        ("ntp/info.json", Difference::Missing),
        ("stray.txt", Difference::Extra),
    ];
    assert_eq!(found, expected);
}

#[test]
fn licences_have_names_at_the_hub_and_at_spdx_and_days_are_days() {
    let license: License = "apache-2.0".parse().unwrap();
    assert_eq!((license.hub, license.spdx), ("apache-2.0", "Apache-2.0"));
    assert_eq!("ODbL-1.0".parse::<License>().unwrap().hub, "odbl");
    let error = "free".parse::<License>().unwrap_err().to_string();
    assert!(error.contains("\"free\"") && error.contains("cc-by-4.0"), "{error}");
    for (day, is_day) in [("2024-02-29", true), ("2026-02-29", false), ("2026-13-01", false), ("2026-1-1", false)] {
        assert_eq!(day.parse::<Date>().is_ok(), is_day, "{day}");
    }
    let hubs: std::collections::BTreeSet<&str> = License::all().map(|license| license.hub).collect();
    assert_eq!(hubs.len(), License::all().count(), "a licence is there twice");
}

#[test]
fn a_publication_asks_for_licence_and_day_and_says_what_is_known() {
    let place = place();
    let (dataset, to) = (place.dataset.to_string_lossy(), place.to.to_string_lossy());
    let base = ["publish", &dataset, "--to", &to, "--date", "2026-11-24"];
    let (code, _, stderr) = run(&base);
    assert_eq!(code, 2);
    assert!(stderr.contains("--license <ID>"), "{stderr}");
    let (code, _, stderr) = run(&[&base[..], &["--license", "free"]].concat());
    assert_eq!(code, 2);
    assert!(stderr.contains("no licence \"free\" is known") && stderr.contains("cc0-1.0"), "{stderr}");
    let (code, _, stderr) = run(&["publish", &dataset, "--to", &to, "--license", "mit"]);
    assert_eq!(code, 2);
    assert!(stderr.contains("--date <YYYY-MM-DD>"), "{stderr}");
    // Without the recordings beside it nothing can say how to make the dataset again: something is left out.
    let (code, stdout, stderr) = run(&[&base[..], &["--license", "mit"]].concat());
    assert_eq!(code, 3, "{stderr}");
    assert!(stdout.contains("MIT") && stderr.contains("left out: pipeline.toml"), "{stdout}{stderr}");
    let (code, stdout, _) = run(&["verify", &to]);
    assert_eq!(code, 0, "{stdout}");
    std::fs::write(place.to.join("extra.txt"), "").unwrap();
    let (code, stdout, _) = run(&["verify", &to]);
    assert_eq!(code, 1);
    assert!(stdout.contains("extra       extra.txt"), "{stdout}");
}

#[test]
fn the_pipeline_of_a_published_dataset_makes_it_again() {
    let folder = crate::smoke::copy_to("convert");
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    let words = ["--license", "cc0-1.0", "--date", "2026-11-24", "--name", "Smoke"];
    let (code, _, stderr) = run(&[&["publish", &path("dataset"), "--to", &path("published")], &words[..]].concat());
    assert_eq!(code, 0, "{stderr}");
    let card = std::fs::read_to_string(folder.path().join("published/README.md")).unwrap();
    assert!(card.contains("ntp run pipeline.toml --out RUN --to convert"), "{card}");
    assert!(card.contains("0 of 9 failed in physics"), "{card}");
    let (code, stdout, _) = run(&["validate", &path("published")]);
    assert_eq!(code, 0, "{stdout}");
    let (code, _, stderr) = run(&["run", &path("published/pipeline.toml"), "--to", "convert", "--out", &path("again")]);
    assert_eq!(code, 0, "{stderr}");
    let parts = ["data", "meta", "ntp"];
    assert_eq!(hashes(&folder.path().join("published"), &parts), hashes(&folder.path().join("again/dataset"), &parts));
}

#[test]
fn a_dataset_made_of_datasets_names_them_on_its_card() {
    let place = place();
    let parts = place.dataset.with_file_name("parts");
    let path = |path: &Path| path.to_string_lossy().into_owned();
    let (code, _, stderr) = run(&["dataset", "split", &path(&place.dataset), "--by", "split", "--to", &path(&parts)]);
    assert_eq!(code, 0, "{stderr}");
    let words = ["--license", "cc0-1.0", "--date", "2026-11-24"];
    let base = ["publish", &path(&parts.join("unseen")), "--to", &path(&place.to)];
    let (code, _, stderr) = run(&[&base[..], &words[..]].concat());
    assert_eq!(code, 0, "{stderr}");
    let card = text(&place, "README.md");
    assert!(card.contains("ntp dataset split dataset") && card.contains("| dataset | `"), "{card}");
    assert!(card.contains("| 0 to 3 |"), "{card}");
}

/// Of data of others only what their files tell.
#[test]
fn the_card_of_a_dataset_that_was_annotated_elsewhere_claims_nothing_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let (theirs, imported, to) =
        (folder.path().join("theirs"), folder.path().join("imported"), folder.path().join("to"));
    crate::import::theirs(&theirs);
    ntp::dataset::import::import(&theirs, None, &imported).unwrap();
    let publication = Publication { creators: Vec::new(), ..publication() };
    publish(&imported, &Folder::new(&to), &publication, || true).unwrap();
    let card = std::fs::read_to_string(to.join("README.md")).unwrap();
    let metadata: Value = serde_json::from_slice(&std::fs::read(to.join("croissant.json")).unwrap()).unwrap();
    let metadata =
        ["description", "keywords", "creator", "citeAs", "prov:wasGeneratedBy"].map(|key| metadata[key].to_string());
    // What columns mean is said of every dataset with these tables.
    let (before, rest) = card.split_once("## Tables").unwrap();
    let prose = [before, rest.split_once("## Limits").unwrap().1, &metadata.concat()].concat();
    for claimed in
        ["simulated", "synthetic", "guessed", "machine-generated", "rapier", "The ntp project", "ntp convert", "unseen"]
    {
        assert!(!prose.contains(claimed), "{claimed}: {prose}");
    }
    for told in [
        "annotations_creators:\n- found\n",
        "These labels are the column `subtask_index` as they were found.",
        "`ntp dataset import THEIRS`",
        "The accuracy of the labels was not measured.",
        "Demonstrations are taken for successes: nobody has judged them.",
        "Unknown: the authors of the dataset that it was brought in from",
    ] {
        assert!(card.contains(told), "{told}: {card}");
    }
}

#[test]
fn what_was_brought_in_has_the_name_of_its_folder_and_paths_are_quoted() {
    let folder = tempfile::tempdir().unwrap();
    let [theirs, dataset, to] = ["theirs", "tea & cups", "Ada's copy"].map(|name| folder.path().join(name));
    crate::import::theirs(&theirs);
    ntp::dataset::import::import(&theirs, None, &dataset).unwrap();
    let words = [&dataset, &to].map(|path| path.to_string_lossy().into_owned());
    let arguments = ["--license", "mit", "--date", "2026-11-30"];
    let (code, _, stderr) = run(&[&["publish", &words[0], "--to", &words[1]], &arguments[..]].concat());
    assert!(code == 0 || code == 3, "{stderr}");
    let card = std::fs::read_to_string(to.join("README.md")).unwrap();
    assert!(card.contains("pretty_name: \"tea & cups\"\n") && card.contains("\n# tea & cups\n"), "{card}");
    let script = words[1].replace('\'', "'\\''");
    assert!(stderr.contains(&format!("sh '{script}/upload.sh' OWNER/NAME")), "{stderr}");
    // Without the hub's client the script gets no further than its arguments.
    let told = std::process::Command::new("sh").arg(to.join("upload.sh")).output().unwrap();
    assert!(String::from_utf8_lossy(&told.stderr).contains("the repository is missing: sh upload.sh OWNER/NAME"));
}
