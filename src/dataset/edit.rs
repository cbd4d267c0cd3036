//! Datasets made of datasets: merged, filtered, split, compared.
//!
//! # Input and output
//!
//! [`merge`], [`filter`] and [`split`] read whole datasets episode by episode and write a new folder, which appears
//! whole or not at all; [`repair`] does so with what can be read of a broken one. Rows of every table are carried over as
//! Arrow batches, whatever columns they have, and the samples of videos as they are; indices, places, task and sub-task
//! texts and statistics are made anew. [`diff`] says what differs between two.
//!
//! # Errors
//!
//! [`EditError`]. What would make no whole dataset is refused by a code that schemas/findings.md explains.
//!
//! # Invariants
//!
//! Memory holds some thousand rows of each table and one video file, whatever the number of episodes; an entry for each
//! recording and distinct task; and the number of each episode. The same sources and settings give the same bytes. Sources are never written to.

mod annotation;
mod condition;
mod cursor;
mod diff;
mod error;
mod fit;
mod left_behind;
mod pictures;
mod pieces;
mod plain;
mod renumber;
mod repair;
mod samples;
mod source;
mod split;
mod target;
mod words;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::artifact::{FileEntry, IoError, Plan, Receipt, StageDir, StagedDir, read_json};
use crate::dataset::files::info::NtpInfo;
use crate::dataset::files::layout;
use crate::dataset::plain::{PlainSource, ProgramTables, has_programs, program_tables};

use annotation::Kept;
pub use condition::{Condition, Ending, EpisodeRange};
pub use diff::{ChangedEpisode, Difference, EpisodeName, diff};
pub use error::EditError;
use fit::{Seen, check_like, check_version};
pub use plain::Carry;
pub use repair::{DatasetRepair, repair};
use source::{Source, SourceDescription, SourceEpisode, describe};
use split::{Draw, part_names};
pub use split::{SplitBy, Unit};
pub use target::EditSummary;
use target::Target;
use words::EpisodeWords;

/// Writes the episodes of all datasets into one, in order.
///
/// # Errors
///
/// [`EditError::Refused`] when they do not fit together, or have an episode in common.
pub fn merge(sources: &[PathBuf], to: &Path, carry: Carry) -> Result<EditSummary, EditError> {
    let staged = StagedDir::begin(to)?;
    let summary = write("merge", sources, carry, staged.partial_path(), json!({}), |_episode, _calls| true)?;
    staged.commit()?;
    Ok(summary)
}

/// Writes the episodes of a dataset for which a condition holds.
///
/// # Errors
///
/// [`EditError::Refused`] when there are none, or something is asked for that is none of the dataset's.
pub fn filter(source: &Path, condition: &Condition, to: &Path, carry: Carry) -> Result<EditSummary, EditError> {
    check_condition(source, condition)?;
    let staged = StagedDir::begin(to)?;
    let settings = json!({ "condition": condition });
    let is_wanted = |episode: &EpisodeWords<'_>, calls: &dyn Fn(&str) -> bool| condition.holds(episode, calls);
    let summary = write("filter", &[source.to_owned()], carry, staged.partial_path(), settings, is_wanted)?;
    staged.commit()?;
    Ok(summary)
}

/// Writes the parts of a dataset as folders of their names below `to`, which appear together.
///
/// # Errors
///
/// [`EditError::Refused`] when a part would be empty, or there would be too many.
pub fn split(root: &Path, by: &SplitBy, to: &Path, carry: Carry) -> Result<Vec<(String, EditSummary)>, EditError> {
    let names = part_names(root, by)?;
    let staged = StagedDir::begin(to)?;
    let mut summaries = Vec::new();
    for name in names {
        let mut draw = Draw::new(root, by)?;
        let settings = json!({ "by": by, "part": name });
        let is_wanted = |episode: &EpisodeWords<'_>, _calls: &dyn Fn(&str) -> bool| draw.part_of(episode) == name;
        let folder = staged.partial_path().join(&name);
        let summary = write("split", &[root.to_owned()], carry, &folder, settings, is_wanted)?;
        summaries.push((name, summary));
    }
    staged.commit()?;
    Ok(summaries)
}

/// Refuses what no episode of the dataset can be.
fn check_condition(root: &Path, condition: &Condition) -> Result<(), EditError> {
    let source = PlainSource::open(root)?;
    let refused = |code, file: &str, problem: String| Err(EditError::refused(code, &root.join(file), problem));
    let n_episodes = source.episodes.len() as u64;
    if let Some(last) = condition.last_episode().filter(|last| *last >= n_episodes) {
        return refused("edit.empty", layout::INFO, format!("there is no episode {last}; there are {n_episodes}"));
    }
    if has_programs(root) {
        let ntp: NtpInfo = read_json(&root.join(layout::NTP_INFO))?;
        return match condition.programs.iter().find(|program| !ntp.vocabulary.contains(program)) {
            None => Ok(()),
            Some(unknown) => {
                let problem = format!("there is no program {unknown:?}; allowed: {}", ntp.vocabulary.join(", "));
                refused("edit.vocabulary", layout::NTP_INFO, problem)
            }
        };
    }
    if !(condition.programs.is_empty() && condition.families.is_empty() && condition.outcomes.is_empty()) {
        let problem = "it has no program tables, so that nothing tells programs, families and outcomes; allowed: \
                       episodes, tasks, split, numbers of frames";
        return refused("edit.vocabulary", layout::INFO, problem.to_owned());
    }
    let names: Vec<&str> = source.info.splits.iter().map(|(name, _)| name.as_str()).collect();
    match condition.split.as_deref().filter(|split| !names.contains(split)) {
        Some(unknown) => {
            refused("edit.split", layout::INFO, format!("there is no split {unknown:?}; allowed: {}", names.join(", ")))
        }
        None => Ok(()),
    }
}

/// Writes the wanted episodes of sources into an empty folder, with plan, receipt and manifest.
fn write(
    stage: &str,
    roots: &[PathBuf],
    carry: Carry,
    folder: &Path,
    settings: Value,
    mut is_wanted: impl FnMut(&EpisodeWords<'_>, &dyn Fn(&str) -> bool) -> bool,
) -> Result<EditSummary, EditError> {
    // What is not there is named before its programs are held against those of others.
    let is_there = |root: &PathBuf| read_json::<serde::de::IgnoredAny>(&root.join(layout::INFO)).map(drop);
    roots.iter().try_for_each(is_there)?;
    // Nothing is made of a file that is not, by its hash, as it was made.
    roots.iter().try_for_each(|root| StageDir::new("convert", root).check_whole())?;
    let is_own = |root: &PathBuf| program_tables(root) == ProgramTables::Own;
    let n_own = roots.iter().filter(|root| is_own(root)).count();
    let (mut summary, descriptions) = if n_own == roots.len() && n_own > 0 {
        write_own(roots, folder, |episode| {
            is_wanted(&EpisodeWords::of_row(&episode.row), &|name| episode.calls_program(name))
        })?
    } else if n_own == 0 {
        plain::write(roots, folder, carry, |candidate| {
            let calls = |name: &str| candidate.calls_program(name);
            match candidate.programs {
                Some(programs) => is_wanted(&EpisodeWords::of_row(&programs.row), &calls),
                None => is_wanted(&EpisodeWords::of_plain(candidate.episode(), &candidate.reading.source.info), &calls),
            }
        })?
    } else {
        let path = roots.iter().find(|root| !is_own(root)).map_or(folder, PathBuf::as_path);
        let problem = "its programs are not those of an expert of ours, as those of another source are; both must be";
        return Err(EditError::refused("edit.vocabulary", &path.join(layout::NTP_INFO), problem));
    };
    commit(stage, &descriptions, settings, folder, &summary)?;
    summary.left_behind = left_behind::left_behind(roots);
    Ok(summary)
}

/// The same of datasets of ours.
fn write_own(
    roots: &[PathBuf],
    folder: &Path,
    mut is_wanted: impl FnMut(&SourceEpisode) -> bool,
) -> Result<(EditSummary, Vec<SourceDescription>), EditError> {
    let sources = roots.iter().map(|root| Source::open(root)).collect::<Result<Vec<_>, _>>()?;
    let Some(first) = sources.first() else {
        return Err(EditError::refused("edit.empty", folder, "there is no dataset to make it of"));
    };
    for source in &sources {
        check_version(source)?;
        check_like(first, source)?;
    }
    let mut target = Target::create(folder, first)?;
    let (mut descriptions, mut kept) = (Vec::new(), Vec::new());
    let mut seen = Seen::default();
    let failed_left_out = sources.iter().map(|source| source.ntp.failed_left_out).sum();
    let path = first.root().to_owned();
    for mut source in sources {
        let begin = target.n_episodes();
        let mut description = describe(source.root())?;
        let (mut numbers, mut n_source) = (BTreeMap::new(), 0);
        while let Some(episode) = source.next_episode()? {
            if is_wanted(&episode) {
                seen.note(source.root(), &episode.row)?;
                numbers.insert(n_source, target.n_episodes());
                target.append(&episode, &source)?;
            } else {
                target.leave_out(1);
            }
            n_source += 1;
        }
        kept.push(Kept { root: source.root().to_owned(), numbers, n_source });
        description.episodes = [begin, target.n_episodes()];
        descriptions.push(description);
    }
    if target.n_episodes() == 0 {
        return Err(EditError::refused("edit.empty", &path, "no episode is left: none is as it is asked for"));
    }
    let mut summary = target.finish(failed_left_out)?;
    annotation::carry(&kept, folder, &mut summary)?;
    Ok((summary, descriptions))
}

/// Says where the dataset comes from, and writes its manifest.
fn commit(
    stage: &str,
    sources: &[SourceDescription],
    settings: Value,
    folder: &Path,
    summary: &EditSummary,
) -> Result<(), EditError> {
    let numbered = sources.iter().enumerate();
    let inputs: BTreeMap<String, String> =
        numbered.map(|(at, source)| (format!("{at:03} {}", source.name), source.version.clone())).collect();
    let plan = Plan::new(stage, 1, inputs, json!({ "sources": sources, "settings": settings }));
    let dir = StageDir::new(stage, folder);
    let files: Result<Vec<FileEntry>, IoError> = summary.files.iter().map(|file| FileEntry::of(folder, file)).collect();
    dir.write_plan(&plan)?;
    let (episodes, failed) = (summary.episodes, summary.failed);
    dir.commit_shard(&Receipt { plan_id: plan.id(), shard: 0, episodes, failed, files: files? })?;
    dir.commit(&plan, &[])?;
    Ok(())
}
