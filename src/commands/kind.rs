//! What a path is, judged by the files that make each kind of artifact what it is.

use std::path::Path;

use anyhow::Context as _;
use serde::Serialize;

use crate::commands::UsageError;

/// A kind of artifact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Kind {
    /// A recording.
    Recording,
    /// A folder of recordings with plan and manifest.
    Recordings,
    /// A task set.
    Tasks,
    /// A dataset.
    Dataset,
    /// A trained model.
    Model,
    /// The rollouts of one suite.
    Rollouts,
    /// A report.
    Report,
    /// A run directory.
    Run,
    /// The run directory of a study.
    Study,
}

impl Kind {
    /// The name for people.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Recording => "recording",
            Self::Recordings => "recordings",
            Self::Tasks => "tasks",
            Self::Dataset => "dataset",
            Self::Model => "model",
            Self::Rollouts => "rollouts",
            Self::Report => "report",
            Self::Run => "run",
            Self::Study => "study",
        }
    }

    /// The kind of a path.
    ///
    /// # Errors
    ///
    /// When it is not there, or of no kind.
    pub(super) fn of(path: &Path) -> anyhow::Result<Self> {
        if !path.exists() {
            anyhow::bail!("no such file or folder: {}", path.display());
        }
        if path.is_file() {
            return match path.extension().and_then(|extension| extension.to_str()) {
                Some("mcap") => Ok(Self::Recording),
                _ => Err(UsageError(format!("{} is neither a recording (.mcap) nor a folder", path.display())).into()),
            };
        }
        let marks = [
            ("meta/info.json", Self::Dataset),
            ("config.json", Self::Model),
            ("checkpoint", Self::Model),
            ("rollouts.parquet", Self::Rollouts),
            ("report.json", Self::Report),
            ("tasks.json", Self::Tasks),
            ("tasks", Self::Run),
        ];
        let marked = marks.into_iter().find(|(mark, _)| path.join(mark).exists());
        let holds_recordings = || super::replay::recordings(path).is_ok();
        match marked {
            Some((_, kind)) => Ok(kind),
            None if !experiments(path)?.is_empty() => Ok(Self::Study),
            None if holds_recordings() => Ok(Self::Recordings),
            None => anyhow::bail!(
                "{} is none of: recordings, dataset (meta/info.json), model (config.json), rollouts \
                 (rollouts.parquet), report (report.json), tasks (tasks.json), run, study",
                path.display()
            ),
        }
    }
}

/// The run directories in that of a study, in order of names.
pub(super) fn experiments(study: &Path) -> anyhow::Result<Vec<std::path::PathBuf>> {
    let mut experiments = Vec::new();
    for entry in std::fs::read_dir(study)? {
        let path = entry?.path();
        if path.join("tasks/tasks.json").is_file() {
            experiments.push(path);
        }
    }
    experiments.sort();
    Ok(experiments)
}

/// The artifacts of a run directory that are there, in the order of the data.
pub(super) fn parts_of_run(run: &Path) -> anyhow::Result<Vec<std::path::PathBuf>> {
    let mut parts = Vec::new();
    for name in ["tasks", "recordings", "dataset", "models", "rollouts", "report"] {
        collect(&run.join(name), &mut parts)?;
    }
    Ok(parts)
}

/// A folder of a kind, or all below it that are.
fn collect(folder: &Path, parts: &mut Vec<std::path::PathBuf>) -> anyhow::Result<()> {
    if !is_folder(folder)? {
        return Ok(());
    }
    if Kind::of(folder).is_ok() {
        parts.push(folder.to_owned());
        return Ok(());
    }
    let mut below = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        below.push(entry?.path());
    }
    below.sort();
    below.iter().try_for_each(|path| collect(path, parts))
}

/// Whether a folder is there. A link that leads nowhere is an error: what it led to would be passed over in silence.
fn is_folder(path: &Path) -> anyhow::Result<bool> {
    if path.symlink_metadata().is_err_and(|error| error.kind() == std::io::ErrorKind::NotFound) {
        return Ok(false);
    }
    let metadata = std::fs::metadata(path).with_context(|| format!("failed to read {}", path.display()))?;
    Ok(metadata.is_dir())
}
