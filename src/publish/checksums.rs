//! `SHA256SUMS`: written last, so that a folder that has one is whole; read to check a copy.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use serde::Serialize;

use crate::artifact::{FileEntry, IoError, PARTIAL_PREFIX, read, sha256_file};

/// Name of the file.
pub(super) const FILE: &str = "SHA256SUMS";

/// How a copy differs from what it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Difference {
    /// A file is not there.
    Missing,
    /// It has other content.
    Changed,
    /// It cannot be read.
    Unreadable,
    /// It is there, but should not be.
    Extra,
    /// The line of `SHA256SUMS` is none, or names a place outside the copy.
    BadLine,
}

impl Difference {
    /// The name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Missing => "missing",
            Self::Changed => "changed",
            Self::Unreadable => "unreadable",
            Self::Extra => "extra",
            Self::BadLine => "bad_line",
        }
    }
}

/// One file of a copy that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct FileDifference {
    /// The file, relative to the copy; a bad line in its own words.
    pub path: String,
    /// How it differs.
    pub difference: Difference,
    /// What was found, where that says more.
    pub detail: String,
}

/// What the check of a copy found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verified {
    /// Files that `SHA256SUMS` names.
    pub files: u64,
    /// Those that are not as they should be, in order of their names.
    pub differences: Vec<FileDifference>,
}

/// The text of `SHA256SUMS`, as `sha256sum -c` reads it.
pub(super) fn render(files: &[FileEntry]) -> String {
    let lines: BTreeMap<&str, &str> = files.iter().map(|file| (file.path.as_str(), file.sha256.as_str())).collect();
    lines.into_iter().map(|(path, sha256)| format!("{sha256}  {path}\n")).collect()
}

/// Compares a copy with its `SHA256SUMS`, file by file. A `.git` folder is no part of the copy.
///
/// # Errors
///
/// When there is no `SHA256SUMS`, or a folder cannot be listed.
pub fn verify(copy: &Path) -> Result<Verified, IoError> {
    let text = read(&copy.join(FILE))?;
    let mut expected = BTreeMap::new();
    let mut verified = Verified::default();
    for line in String::from_utf8_lossy(&text).lines() {
        match parse(line) {
            Some((sha256, path)) => drop(expected.insert(path.to_owned(), sha256.to_owned())),
            None => verified.differences.push(FileDifference {
                path: line.to_owned(),
                difference: Difference::BadLine,
                detail: "a line is a SHA-256, two spaces, and a path inside the folder".to_owned(),
            }),
        }
    }
    verified.files = expected.len() as u64;
    for (path, sha256) in &expected {
        let found = check(copy, path, sha256);
        verified.differences.extend(found.map(|(difference, detail)| FileDifference {
            path: path.clone(),
            difference,
            detail,
        }));
    }
    for path in files_below(copy)? {
        if path != FILE && !expected.contains_key(&path) {
            let detail = String::new();
            verified.differences.push(FileDifference { path, difference: Difference::Extra, detail });
        }
    }
    verified.differences.sort();
    Ok(verified)
}

fn parse(line: &str) -> Option<(&str, &str)> {
    let (sha256, path) = line.split_once("  ")?;
    let is_hash = sha256.len() == 64 && sha256.bytes().all(|byte| byte.is_ascii_hexdigit());
    let is_inside = !path.is_empty() && Path::new(path).components().all(|part| matches!(part, Component::Normal(_)));
    (is_hash && is_inside).then_some((sha256, path))
}

fn check(copy: &Path, path: &str, expected: &str) -> Option<(Difference, String)> {
    let file = copy.join(path);
    if !file.is_file() {
        return Some((Difference::Missing, String::new()));
    }
    match sha256_file(&file) {
        Ok(found) if found.eq_ignore_ascii_case(expected) => None,
        Ok(found) => Some((Difference::Changed, format!("sha256 is {found}, but should be {expected}"))),
        Err(error) => Some((Difference::Unreadable, error.to_string())),
    }
}

/// Every file below a folder, relative to it with `/`, in order; without a `.git` folder and unfinished files.
pub(super) fn files_below(root: &Path) -> Result<Vec<String>, IoError> {
    let mut files = Vec::new();
    let mut folders: Vec<PathBuf> = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).map_err(IoError::system("list", &folder))? {
            let entry = entry.map_err(IoError::system("list", &folder))?;
            let (path, name) = (entry.path(), entry.file_name());
            let is_partial = name.to_string_lossy().starts_with(PARTIAL_PREFIX);
            if is_partial || (name == ".git" && folder == root) {
                continue;
            }
            // A link counts as a file: what it leads to is no part of the folder.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path);
            } else if let Ok(relative) = path.strip_prefix(root) {
                let parts: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
                files.push(parts.join("/"));
            }
        }
    }
    files.sort();
    Ok(files)
}
