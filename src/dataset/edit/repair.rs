//! What can be verified of a broken dataset.
//!
//! Episodes are kept from the first one on, until one breaks a rule, cannot be read, or lies in a file that is not as
//! the manifest says. Nothing behind it is looked at: indices and texts count from the beginning, and what follows a
//! fault would have to be guessed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::json;

use crate::artifact::{StageDir, StagedDir};
use crate::dataset::edit::fit::check_version;
use crate::dataset::edit::plain::repair::write_prefix;
use crate::dataset::edit::samples::video_place;
use crate::dataset::edit::source::{Source, SourceEpisode, describe};
use crate::dataset::edit::target::Target;
use crate::dataset::edit::{EditError, EditSummary, commit};
use crate::dataset::files::finding::{Finding, Severity, Validation};
use crate::dataset::files::info::Dtype;
use crate::dataset::files::layout;
use crate::dataset::plain::{ProgramTables, program_tables};
use crate::dataset::tables::episodes::read::EpisodeRows;
use crate::dataset::validate::EpisodeChecks;

/// What became of a dataset.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DatasetRepair {
    /// Why it is not whole; empty when it is, and then nothing is written.
    pub reasons: Vec<String>,
    /// What was written.
    pub written: Option<EditSummary>,
}

/// Writes the longest verified prefix of a dataset that is not whole.
///
/// # Errors
///
/// [`EditError::Refused`] when not even the first episode can be verified.
pub fn repair(root: &Path, to: &Path) -> Result<DatasetRepair, EditError> {
    if program_tables(root) == ProgramTables::None {
        return repair_plain(root, to);
    }
    let (files, unreadable) = changed_files(root);
    let validation = crate::dataset::validate(root);
    let told = validation.findings.iter().filter(|finding| finding.severity == Severity::Error);
    let told = told.map(|of| format!("{} {}: {} {}", of.code, of.path.display(), of.place, of.message));
    let mut reasons: Vec<String> = unreadable.into_iter().chain(files.values().cloned()).chain(told.take(1)).collect();
    if reasons.is_empty() {
        return Ok(DatasetRepair { reasons, written: None });
    }
    check_roots(root, &files)?;
    let staged = StagedDir::begin(to)?;
    let (info, rows, total) = EpisodeRows::open_prefix(root)?;
    let mut prefix = Prefix::open(root, info, rows, files)?;
    let mut target = Target::create(staged.partial_path(), &prefix.source)?;
    let mut description = describe(root)?;
    let end = loop {
        match prefix.next_verified() {
            Ok(Some(episode)) => match target.append(&episode, &prefix.source) {
                Ok(()) => {}
                Err(EditError::Dataset(unreadable)) => break Some(unreadable.to_string()),
                Err(error) => return Err(error),
            },
            Ok(None) => break None,
            Err(reason) => break Some(reason),
        }
    };
    reasons.extend(end.into_iter().filter(|end| !reasons.contains(end)).collect::<Vec<_>>());
    let n_kept = target.n_episodes();
    if n_kept == 0 {
        return Err(nothing(root, &reasons));
    }
    target.leave_out(total.saturating_sub(n_kept));
    description.episodes = [0, n_kept];
    let summary = target.finish(prefix.source.ntp.failed_left_out)?;
    let settings = json!({ "left_out": summary.left_out });
    commit("repair", &[description], settings, staged.partial_path(), &summary)?;
    staged.commit()?;
    Ok(DatasetRepair { reasons, written: Some(summary) })
}

/// The same of a dataset without program tables.
fn repair_plain(root: &Path, to: &Path) -> Result<DatasetRepair, EditError> {
    let validation = crate::dataset::validate(root);
    let first = validation.findings.iter().find(|finding| finding.severity == Severity::Error);
    let told = |of: &Finding| format!("{} {}: {} {}", of.code, of.path.display(), of.place, of.message);
    let Some(first) = first else { return Ok(DatasetRepair { reasons: Vec::new(), written: None }) };
    let staged = StagedDir::begin(to)?;
    let (summary, end) = write_prefix(root, staged.partial_path())?;
    let mut reasons = vec![told(first)];
    reasons.extend(end.into_iter().filter(|end| *end != reasons[0]).collect::<Vec<_>>());
    let mut description = describe(root)?;
    description.episodes = [0, summary.episodes];
    let settings = json!({ "left_out": summary.left_out });
    commit("repair", &[description], settings, staged.partial_path(), &summary)?;
    staged.commit()?;
    Ok(DatasetRepair { reasons, written: Some(summary) })
}

fn nothing(root: &Path, reasons: &[String]) -> EditError {
    let problem = format!("not even its first episode can be verified: {}", reasons.join("; "));
    EditError::refused("edit.empty", root, problem)
}

/// Files that are not as the manifest says, with what is wrong; none where there is no manifest. Where it cannot be read,
/// why not: then rows alone tell what is whole.
fn changed_files(root: &Path) -> (BTreeMap<PathBuf, String>, Option<String>) {
    let dir = StageDir::new("dataset", root);
    let (manifest, unreadable) = match dir.manifest() {
        Ok(manifest) => (manifest, None),
        Err(error) => (None, Some(error.to_string())),
    };
    let files = manifest.iter().flat_map(|manifest| &manifest.files);
    let changed = |file| dir.check_file(file, true).err().map(|error| (root.join(&file.path), error.to_string()));
    (files.filter_map(changed).collect(), unreadable)
}

/// What every episode hangs on must be as it was written. Statistics and task texts are made anew from the rest.
fn check_roots(root: &Path, changed: &BTreeMap<PathBuf, String>) -> Result<(), EditError> {
    let needed = [layout::INFO, layout::NTP_INFO, layout::SUBTASKS, layout::EPISODES].map(|file| root.join(file));
    let reasons: Vec<String> = needed.iter().filter_map(|file| changed.get(file).cloned()).collect();
    if reasons.is_empty() { Ok(()) } else { Err(nothing(root, &reasons)) }
}

/// Episodes from the first one on, each verified.
struct Prefix {
    source: Source,
    checks: EpisodeChecks,
    changed: BTreeMap<PathBuf, String>,
}

impl Prefix {
    fn open(
        root: &Path,
        info: crate::dataset::files::info::Info,
        rows: EpisodeRows,
        changed: BTreeMap<PathBuf, String>,
    ) -> Result<Self, EditError> {
        let checks = EpisodeChecks::new(root, &info)?;
        let source = Source::with_rows(root, info, rows)?;
        check_version(&source)?;
        if let Some(by) = &source.ntp.annotated_by {
            let problem =
                format!("its programs are annotated by {by}: make it again of the dataset that it was made of");
            return Err(EditError::refused("edit.vocabulary", &root.join(layout::NTP_INFO), problem));
        }
        Ok(Self { source, checks, changed })
    }

    /// The next episode, or why it is not verified.
    fn next_verified(&mut self) -> Result<Option<SourceEpisode>, String> {
        let Some(episode) = self.source.next_episode().map_err(|error| error.to_string())? else { return Ok(None) };
        if let Some(reason) = self.changed_file(&episode) {
            return Err(reason);
        }
        let mut validation = Validation::default();
        self.checks.check(&self.source.root().join(layout::EPISODES), &episode.row, &mut validation);
        let found = validation.findings.iter().find(|finding| finding.severity == Severity::Error);
        match found {
            None => Ok(Some(episode)),
            Some(of) => Err(format!("{} {}: {} {}", of.code, of.path.display(), of.place, of.message)),
        }
    }

    /// What the manifest says of the files that an episode lies in, where they are not so.
    fn changed_file(&self, episode: &SourceEpisode) -> Option<String> {
        let (source, row) = (&self.source, &episode.row);
        let tables = [
            (layout::DATA, row.data),
            (layout::CALLS, row.calls),
            (layout::SCOPES, row.scopes),
            (layout::META_EPISODES, row.meta),
        ];
        let tables = tables.into_iter().map(|(folder, place)| place.in_dataset(source.root(), folder));
        let videos = source.info.features.0.iter().filter(|(_, feature)| feature.dtype == Dtype::Video);
        let videos = videos.filter_map(|(name, _)| {
            let (place, _) = video_place(episode, name)?;
            Some(source.root().join(place.video(name)))
        });
        tables.chain(videos).find_map(|file| self.changed.get(&file).cloned())
    }
}
