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
//! Memory holds some thousand rows of each table and one video file, whatever the number of episodes; and an entry for each recording and
//! distinct task. The same sources and settings give the same bytes. Sources are never written to.

mod annotation;
mod condition;
mod cursor;
mod diff;
mod error;
mod fit;
mod pictures;
mod pieces;
mod renumber;
mod repair;
mod samples;
mod source;
mod split;
mod target;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use crate::artifact::{FileEntry, IoError, Plan, Receipt, StageDir, StagedDir};
use crate::dataset::files::layout;

pub use condition::{Condition, Ending};
pub use diff::{ChangedEpisode, Difference, EpisodeName, diff};
pub use error::EditError;
use fit::{Seen, check_like, check_version};
pub use repair::{DatasetRepair, repair};
use source::{Source, SourceDescription, SourceEpisode};
pub use split::{SplitBy, Unit, split};
pub use target::EditSummary;
use target::Target;

/// Writes the episodes of all datasets into one, in order.
///
/// # Errors
///
/// [`EditError::Refused`] when they do not fit together, or have an episode in common.
pub fn merge(sources: &[PathBuf], to: &Path) -> Result<EditSummary, EditError> {
    let sources = sources.iter().map(|root| Source::open(root)).collect::<Result<Vec<_>, _>>()?;
    let staged = StagedDir::begin(to)?;
    let summary = write("merge", sources, staged.partial_path(), json!({}), |_episode| true)?;
    staged.commit()?;
    Ok(summary)
}

/// Writes the episodes of a dataset for which a condition holds.
///
/// # Errors
///
/// [`EditError::Refused`] when there are none, or a program that is asked for is none of the dataset's.
pub fn filter(source: &Path, condition: &Condition, to: &Path) -> Result<EditSummary, EditError> {
    let source = Source::open(source)?;
    if let Some(unknown) = condition.programs.iter().find(|program| !source.ntp.vocabulary.contains(program)) {
        let problem = format!("there is no program {unknown:?}; allowed: {}", source.ntp.vocabulary.join(", "));
        return Err(EditError::refused("edit.vocabulary", &source.root().join(layout::NTP_INFO), problem));
    }
    let staged = StagedDir::begin(to)?;
    let settings = json!({ "condition": condition });
    let summary = write("filter", vec![source], staged.partial_path(), settings, |episode| condition.holds(episode))?;
    staged.commit()?;
    Ok(summary)
}

/// Writes the wanted episodes of sources into an empty folder, with plan, receipt and manifest.
fn write(
    stage: &str,
    sources: Vec<Source>,
    folder: &Path,
    settings: Value,
    mut is_wanted: impl FnMut(&SourceEpisode) -> bool,
) -> Result<EditSummary, EditError> {
    let Some(first) = sources.first() else {
        return Err(EditError::refused("edit.empty", folder, "there is no dataset to make it of"));
    };
    for source in &sources {
        check_version(source)?;
        check_like(first, source)?;
    }
    let mut target = Target::create(folder, first)?;
    let mut descriptions = Vec::new();
    let mut seen = Seen::default();
    let roots: Vec<PathBuf> = sources.iter().map(|source| source.root().to_owned()).collect();
    let failed_left_out = sources.iter().map(|source| source.ntp.failed_left_out).sum();
    let path = first.root().to_owned();
    for mut source in sources {
        let begin = target.n_episodes();
        let mut description = source.describe()?;
        while let Some(episode) = source.next_episode()? {
            if is_wanted(&episode) {
                seen.note(source.root(), &episode.row)?;
                target.append(&episode, &source)?;
            } else {
                target.leave_out(1);
            }
        }
        description.episodes = [begin, target.n_episodes()];
        descriptions.push(description);
    }
    if target.n_episodes() == 0 {
        return Err(EditError::refused("edit.empty", &path, "no episode is left: none is as it is asked for"));
    }
    let mut summary = target.finish(failed_left_out)?;
    annotation::carry(&roots, folder, &mut summary.files)?;
    commit(stage, &descriptions, settings, folder, &summary)?;
    Ok(summary)
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
