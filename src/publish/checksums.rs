//! `SHA256SUMS`: written last, so that a copy that has one is whole; read to check it.

use std::collections::BTreeMap;
use std::path::{Component, Path};

use serde::Serialize;

use crate::artifact::FileEntry;
use crate::publish::PublishError;
use crate::store::Store;

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
/// [`PublishError::Unpublished`] when there is no `SHA256SUMS`; when the files cannot be listed.
pub fn verify(copy: &dyn Store) -> Result<Verified, PublishError> {
    let text = copy.read(FILE)?.ok_or_else(|| PublishError::Unpublished { path: copy.path(FILE) })?;
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
    for path in copy.list("")? {
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

fn check(copy: &dyn Store, path: &str, expected: &str) -> Option<(Difference, String)> {
    match copy.sha256(path) {
        Ok(None) => Some((Difference::Missing, String::new())),
        Ok(Some(found)) if found.eq_ignore_ascii_case(expected) => None,
        Ok(Some(found)) => Some((Difference::Changed, format!("sha256 is {found}, but should be {expected}"))),
        Err(error) => Some((Difference::Unreadable, error.to_string())),
    }
}
