//! What a check of a dataset found.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::artifact::is_pointer;
use crate::dataset::DatasetError;
use crate::table::TableError;

/// Findings that are kept; those after it are only counted.
const MAX_FINDINGS: usize = 100;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// The dataset says something wrong or cannot be read.
    Error,
    /// It can be used, but somebody may stumble over it.
    Warning,
}

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// What kind it is, e.g. `calls.tree`. Stays the same from version to version.
    pub code: &'static str,
    /// How bad it is.
    pub severity: Severity,
    /// The file.
    pub path: PathBuf,
    /// Where in the file, e.g. `row 12` or `episode 3, call 4`; empty for the whole file.
    pub place: String,
    /// What was expected and found.
    pub message: String,
}

/// Everything that was found, and what was looked at.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Validation {
    /// Episodes that were checked.
    pub episodes: u64,
    /// Rows of `data/` that were checked.
    pub frames: u64,
    /// Rows of `ntp/calls/` that were checked.
    pub calls: u64,
    /// Rows of `ntp/scopes/` that were checked.
    pub scopes: u64,
    /// The first hundred findings, in the order in which the files are read.
    pub findings: Vec<Finding>,
    /// How many more there were.
    pub findings_left_out: u64,
}

impl Validation {
    /// Whether there is no error; there may be warnings.
    pub fn is_valid(&self) -> bool {
        self.findings_left_out == 0 && self.findings.iter().all(|finding| finding.severity == Severity::Warning)
    }

    pub(crate) fn add(&mut self, finding: Finding) {
        if self.findings.len() < MAX_FINDINGS {
            self.findings.push(finding);
        } else {
            self.findings_left_out += 1;
        }
    }

    pub(crate) fn error(&mut self, code: &'static str, path: &Path, place: String, message: String) {
        let is_of_git_lfs = code == "file.unreadable" && is_pointer(path);
        let code = if is_of_git_lfs { "file.pointer" } else { code };
        let message = match message.strip_prefix(&format!("{}: ", path.display())) {
            Some(rest) => rest.to_owned(),
            None => message,
        };
        self.add(Finding { code, severity: Severity::Error, path: path.to_owned(), place, message });
    }

    pub(crate) fn warn(&mut self, code: &'static str, path: &Path, place: String, message: String) {
        self.add(Finding { code, severity: Severity::Warning, path: path.to_owned(), place, message });
    }

    /// Takes down what kept a table from being read on. `code` is for its rows.
    pub(crate) fn failed(&mut self, code: &'static str, error: &DatasetError) {
        let (code, path, place, message) = match error {
            DatasetError::Table(error) => return self.unreadable(error),
            DatasetError::Io(error) => {
                return self.error("file.unreadable", error.path(), String::new(), error.to_string());
            }
            DatasetError::Row { path, row, problem } => (code, path, format!("row {row}"), problem),
            DatasetError::Count { path, problem } => (code, path, String::new(), problem),
            DatasetError::Call { path, episode, call, problem } => {
                ("calls.tree", path, format!("episode {episode}, call {call}"), problem)
            }
            DatasetError::Episode { path, episode, problem } => (code, path, format!("episode {episode}"), problem),
        };
        self.error(code, path, place, message.clone());
    }

    /// The same, but for a file of which something was found already: it was looked at before.
    pub(crate) fn failed_once(&mut self, code: &'static str, error: &DatasetError) {
        let before = self.findings.len();
        self.failed(code, error);
        if let Some(last) = self.findings.get(before)
            && self.findings[..before].iter().any(|finding| finding.path == last.path)
        {
            self.findings.truncate(before);
        }
    }

    fn unreadable(&mut self, error: &TableError) {
        let path = error.path().unwrap_or(Path::new(""));
        let code = match error {
            TableError::MissingColumn { .. } | TableError::ColumnKind { .. } | TableError::UnknownColumn { .. } => {
                "file.columns"
            }
            TableError::Null { .. } => "file.null",
            _ => "file.unreadable",
        };
        self.error(code, path, String::new(), error.to_string());
    }
}
