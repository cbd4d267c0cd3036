//! `ntp validate PATH`: checksums, and what the files hold; each finding has a code.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::artifact::StageDir;
use crate::cli::PathArgs;
use crate::commands::kind::{self, Kind};
use crate::commands::{CommandOutcome, output, replay};
use crate::recording::{RecordingError, ShardReader};
use crate::rollout::RolloutRows;
use crate::task::TaskSet;
use crate::trace::Episode;
use crate::words::counted;
use crate::{dataset, model};

/// How many findings of an artifact's recordings are told; the others are counted.
const MOST_TOLD: usize = 100;

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Finding {
    code: &'static str,
    path: PathBuf,
    message: String,
}

/// What was checked and found.
#[derive(Debug, Default, Serialize)]
struct Validation {
    checked: Vec<String>,
    warnings: Vec<Finding>,
    findings: Vec<Finding>,
}

pub(super) fn run(args: &PathArgs) -> anyhow::Result<CommandOutcome> {
    let mut validation = Validation::default();
    match Kind::of(&args.path)? {
        Kind::Run => check_run(&args.path, &mut validation)?,
        Kind::Study => {
            for experiment in kind::experiments(&args.path)? {
                check_run(&experiment, &mut validation)?;
            }
            check_run(&args.path, &mut validation)?;
        }
        kind => check(&args.path, kind, &mut validation)?,
    }
    if args.json {
        output::print_json(&validation)?;
    } else {
        output::print(&to_text(&validation))?;
    }
    Ok(match (validation.findings.is_empty(), validation.warnings.is_empty()) {
        (false, _) => CommandOutcome::CheckFailed,
        (true, false) => CommandOutcome::LeftOut,
        (true, true) => CommandOutcome::Done,
    })
}

/// Checks what lies in a run directory.
fn check_run(path: &Path, validation: &mut Validation) -> anyhow::Result<()> {
    for part in kind::parts_of_run(path)? {
        check(&part, Kind::of(&part)?, validation)?;
    }
    Ok(())
}

fn to_text(validation: &Validation) -> String {
    let mut lines: Vec<String> = validation.checked.iter().map(|line| format!("ok      {line}")).collect();
    let line = |finding: &Finding| format!("{}  {}: {}", finding.code, finding.path.display(), finding.message);
    lines.extend(validation.warnings.iter().map(|warning| format!("warning {}", line(warning))));
    lines.extend(validation.findings.iter().map(line));
    lines.push(match validation.findings.len() {
        0 => "nothing wrong".to_owned(),
        n => counted(n, "finding"),
    });
    lines.join("\n")
}

/// Checks one artifact: the files against its manifest, then what they hold.
fn check(path: &Path, kind: Kind, validation: &mut Validation) -> anyhow::Result<()> {
    let before = validation.findings.len();
    check_manifest(path, kind, validation);
    let held = match kind {
        Kind::Recording => check_recordings(path, kind, validation).map(|(_, episodes)| counted(episodes, "episode")),
        Kind::Recordings => check_recordings(path, kind, validation)
            .map(|(files, episodes)| format!("{}, {}", counted(files, "file"), counted(episodes, "episode"))),
        Kind::Tasks => check_tasks(path),
        Kind::Dataset => {
            check_dataset(path, validation);
            return Ok(());
        }
        Kind::Model => model::inspect(path).map(|found| counted(found.parameters, "parameter")).map_err(Into::into),
        Kind::Rollouts => check_rollouts(path, validation),
        Kind::Report | Kind::Run | Kind::Study => Ok("report".to_owned()),
    };
    match held {
        Ok(held) if validation.findings.len() == before => {
            validation.checked.push(format!("{}: {}, {held}", path.display(), kind.name()));
        }
        Ok(_) => {}
        Err(error) => {
            let code = content_code(kind);
            validation.findings.push(Finding { code, path: path.to_owned(), message: format!("{error:#}") });
        }
    }
    Ok(())
}

fn content_code(kind: Kind) -> &'static str {
    match kind {
        Kind::Recording | Kind::Recordings => "RECORDING",
        Kind::Tasks => "TASKS",
        Kind::Dataset => "DATASET",
        Kind::Model => "MODEL",
        Kind::Rollouts => "ROLLOUTS",
        Kind::Report | Kind::Run | Kind::Study => "REPORT",
    }
}

/// Files against the manifest, by size and hash, where there is one.
fn check_manifest(path: &Path, kind: Kind, validation: &mut Validation) {
    let dir = StageDir::new(kind.name(), path);
    let checked = match dir.manifest() {
        Ok(None) => Ok(()),
        Ok(Some(manifest)) => {
            let checked = dir.check_files(&manifest, true).and_then(|()| dir.check_record(&manifest));
            checked.map_err(|error| error.to_string())
        }
        Err(error) => Err(error.to_string()),
    };
    if let Err(message) = checked {
        validation.findings.push(Finding { code: "MANIFEST", path: path.to_owned(), message });
    }
}

/// The recordings at a path: how many files there are, and episodes that are as they should be.
fn check_recordings(path: &Path, kind: Kind, validation: &mut Validation) -> anyhow::Result<(usize, u64)> {
    let files = replay::recordings(path)?;
    let (mut episodes, mut n_wrong) = (0, 0);
    for file in &files {
        for checked in check_recording(file) {
            let Err(error) = checked else {
                episodes += 1;
                continue;
            };
            n_wrong += 1;
            if n_wrong <= MOST_TOLD {
                let (code, path, message) = (content_code(kind), file.clone(), error.to_string());
                validation.findings.push(Finding { code, path, message });
            }
        }
    }
    if n_wrong > MOST_TOLD {
        let message = counted(n_wrong - MOST_TOLD, "more finding");
        validation.findings.push(Finding { code: content_code(kind), path: path.to_owned(), message });
    }
    Ok((files.len(), episodes))
}

/// Each episode of a file with what cameras saw, or what is wrong.
fn check_recording(file: &Path) -> impl Iterator<Item = Result<Episode, RecordingError>> {
    let (episodes, error) = match ShardReader::open(file) {
        Ok(reader) => (Some(reader.checked()), None),
        Err(error) => (None, Some(Err(error))),
    };
    episodes.into_iter().flatten().chain(error)
}

fn check_tasks(path: &Path) -> anyhow::Result<String> {
    let tasks = TaskSet::read(&path.join("tasks.json"))?;
    tasks.validate()?;
    Ok(format!("{}, no unseen goal among the seen", counted(tasks.tasks.len(), "task")))
}

fn check_rollouts(path: &Path, validation: &mut Validation) -> anyhow::Result<String> {
    let rows = RolloutRows::read(&path.join("rollouts.parquet"))?;
    if path.join("recordings").is_dir() {
        check_recordings(&path.join("recordings"), Kind::Rollouts, validation)?;
    }
    let (episodes, successes) = rows.successes();
    Ok(format!("{}, {successes} succeeded", counted(episodes, "episode")))
}

/// Every cross-reference of a dataset; warnings are told, but fail nothing.
fn check_dataset(path: &Path, validation: &mut Validation) {
    let found = dataset::validate(path);
    if found.is_valid() {
        let dataset::Validation { episodes, frames, calls, scopes, .. } = found;
        let held = [(episodes, "episode"), (frames, "frame"), (calls, "call"), (scopes, "scoping label")];
        let held = held.map(|(n, thing)| counted(n, thing)).join(", ");
        validation.checked.push(format!("{}: dataset, {held}", path.display()));
    }
    for finding in found.findings {
        let is_warning = finding.severity == dataset::Severity::Warning;
        let message = match finding.place.as_str() {
            "" => finding.message,
            place => format!("{place}: {}", finding.message),
        };
        let finding = Finding { code: finding.code, path: finding.path, message };
        if is_warning { &mut validation.warnings } else { &mut validation.findings }.push(finding);
    }
    if found.findings_left_out > 0 {
        let message = counted(found.findings_left_out, "more finding");
        validation.findings.push(Finding { code: "DATASET", path: path.to_owned(), message });
    }
}
