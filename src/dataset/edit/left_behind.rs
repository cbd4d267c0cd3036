//! What lies in a dataset and is not carried over, by its name: nothing is lost without a word.

use std::path::{Path, PathBuf};

/// What edits carry over or make anew, and what only told of the dataset as it was.
const KNOWN: [&str; 15] = [
    "data",
    "meta",
    "videos",
    "ntp",
    "manifest.json",
    "plan.json",
    "receipts",
    "provenance",
    "pipeline.toml",
    "croissant.json",
    "upload.sh",
    "SHA256SUMS",
    "README.md",
    "LICENSE",
    "CITATION.cff",
];
/// The same below `meta/`.
const KNOWN_OF_META: [&str; 9] = [
    "info.json",
    "stats.json",
    "episodes",
    "tasks.parquet",
    "subtasks.parquet",
    "tasks.jsonl",
    "episodes.jsonl",
    "episodes_stats.jsonl",
    "subtasks.jsonl",
];

/// Files and folders of the sources that an edit leaves behind, in order of their names.
pub(super) fn left_behind(roots: &[PathBuf]) -> Vec<String> {
    let mut all: Vec<String> = roots
        .iter()
        .flat_map(|root| {
            let of_meta = unknown(&root.join("meta"), &KNOWN_OF_META);
            unknown(root, &KNOWN).into_iter().chain(of_meta.into_iter().map(|name| format!("meta/{name}")))
        })
        .collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn unknown(folder: &Path, known: &[&str]) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().filter(|entry| !is_empty(&entry.path()));
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| !name.starts_with('.') && !known.contains(&name.as_str())).collect()
}

/// Whether it is a folder with nothing in it, as recorders leave `images/` behind.
fn is_empty(path: &Path) -> bool {
    std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none())
}
