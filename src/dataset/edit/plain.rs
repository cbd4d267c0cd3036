//! Datasets of anybody's features made of others: episodes are carried over, and nothing is decoded.
//!
//! # Input and output
//!
//! Sources are in the formats v3.0, v2.1 or v2.0; what is made is v3.0. Program tables of datasets that were annotated
//! elsewhere are carried along.
//!
//! # Invariants
//!
//! Splits are kept: where sources have several, episodes come split by split, so that each stays one range. Memory holds
//! an entry for each episode, and some thousand rows.

pub(super) mod diff;
mod exact;
mod json;
mod meta;
mod pictures;
mod programs;
pub(super) mod repair;
mod schema;
mod target;
mod videos;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::dataset::edit::annotation::{self, Kept};
use crate::dataset::edit::error::EditError;
use crate::dataset::edit::fit::Seen;
use crate::dataset::edit::source::{SourceDescription, describe};
use crate::dataset::edit::target::EditSummary;
use crate::dataset::files::layout;
use crate::dataset::plain::{Declared, PlainEpisode};
use meta::other_column;
use programs::EpisodePrograms;
pub(super) use target::{PlainTarget, Reading};
pub use videos::Carry;

/// An episode that may be wanted.
pub(super) struct Candidate<'c> {
    pub(super) reading: &'c Reading,
    pub(super) position: usize,
    pub(super) programs: Option<&'c EpisodePrograms>,
}

impl Candidate<'_> {
    pub(super) fn episode(&self) -> &PlainEpisode {
        &self.reading.source.episodes[self.position]
    }

    /// Whether a program is called in it.
    pub(super) fn calls_program(&self, name: &str) -> bool {
        self.programs.is_some_and(|programs| programs.calls_program(name))
    }
}

/// Writes the wanted episodes of sources into an empty folder; says what was written, and of which sources.
pub(super) fn write(
    roots: &[PathBuf],
    folder: &Path,
    carry: Carry,
    mut is_wanted: impl FnMut(&Candidate<'_>) -> bool,
) -> Result<(EditSummary, Vec<SourceDescription>), EditError> {
    let Some(first) = roots.first() else {
        return Err(EditError::refused("edit.empty", folder, "there is no dataset to make it of"));
    };
    check_apart(roots)?;
    let like = Reading::open(first)?;
    check_declared(&like)?;
    let mut target = PlainTarget::create(folder, &like, carry)?;
    let splits = split_names(roots)?;
    let mut descriptions = roots.iter().map(|root| describe(root)).collect::<Result<Vec<_>, _>>()?;
    let (mut n_seen, mut seen) = (0, Seen::default());
    let nothing = |root: &PathBuf| Kept { root: root.clone(), numbers: BTreeMap::new(), n_source: 0 };
    let mut kept: Vec<Kept> = roots.iter().map(nothing).collect();
    for split in &splits {
        for ((root, description), kept) in roots.iter().zip(&mut descriptions).zip(&mut kept) {
            let begin = target.n_episodes();
            let mut reading = Reading::open(root)?;
            check_declared(&reading)?;
            check_like(&like, &reading, &target)?;
            kept.n_source = reading.source.episodes.len() as u64;
            for position in 0..reading.source.episodes.len() {
                let programs = match &mut reading.programs {
                    Some(programs) => programs.next()?,
                    None => None,
                };
                let of_split = reading.source.info.split_of(position as u64).unwrap_or_default();
                if splits.len() > 1 && of_split != split {
                    continue;
                }
                n_seen += 1;
                let candidate = Candidate { reading: &reading, position, programs: programs.as_ref() };
                if is_wanted(&candidate) {
                    if let Some(programs) = &programs {
                        seen.note_episode(root, &programs.row)?;
                    }
                    kept.numbers.insert(position as u64, target.n_episodes());
                    target.append(&mut reading, position, programs.as_ref())?;
                }
            }
            if description.episodes == [0, 0] {
                description.episodes[0] = begin;
            }
            description.episodes[1] = target.n_episodes();
        }
    }
    if target.n_episodes() == 0 {
        return Err(EditError::refused("edit.empty", first, "no episode is left: none is as it is asked for"));
    }
    target.leave_out(n_seen - target.n_episodes());
    let statistics = first.join(layout::STATS);
    let mut summary = target.finish(Some(statistics.as_path()).filter(|_| roots.len() == 1))?;
    annotation::carry(&kept, folder, &mut summary)?;
    Ok((summary, descriptions))
}

/// The splits of all sources, in the order in which they come; one entry where episodes can stay in their order.
fn split_names(roots: &[PathBuf]) -> Result<Vec<String>, EditError> {
    let mut names: Vec<String> = Vec::new();
    for root in roots {
        let source = crate::dataset::plain::PlainSource::open(root)?;
        for position in 0..source.episodes.len() as u64 {
            let name = source.info.split_of(position).unwrap_or_default();
            if !names.iter().any(|known| known == name) {
                names.push(name.to_owned());
            }
        }
    }
    // In one source each split is a range already.
    let is_in_order = roots.len() == 1 || names.len() <= 1;
    Ok(if is_in_order { vec![String::new()] } else { names })
}

/// A dataset is not merged with itself.
fn check_apart(roots: &[PathBuf]) -> Result<(), EditError> {
    let mut seen = BTreeSet::new();
    for root in roots {
        if !seen.insert(root.canonicalize().unwrap_or_else(|_gone| root.clone())) {
            return Err(EditError::refused("edit.episode", root, "each of its episodes would be there twice"));
        }
    }
    Ok(())
}

/// Refuses what an edit would lose: a feature of which nothing tells how much a row has, and splits that are no ranges.
fn check_declared(reading: &Reading) -> Result<(), EditError> {
    let info = &reading.source.info;
    let refused = |code, problem: String| Err(EditError::refused(code, &info.root().join(layout::INFO), problem));
    if let Some(feature) = info.features.iter().find(|feature| !feature.has_shape()) {
        let (name, found, allowed) = (&feature.name, &feature.json["shape"], Declared::allowed_shape());
        let problem = format!("shape of {name:?} is {found}, expected {allowed}");
        return refused("edit.features", problem);
    }
    match info.problems.iter().find(|problem| problem.place.starts_with("splits")) {
        Some(of) => refused("edit.split", format!("{}: {}", of.place, of.message)),
        None => Ok(()),
    }
}

/// Whether a source fits to the first one.
fn check_like(first: &Reading, other: &Reading, target: &PlainTarget) -> Result<(), EditError> {
    let (a, b) = (&first.source.info, &other.source.info);
    let refused = |code, file: &str, found: String, expected: String| {
        let problem = format!("{found}, but in {} it is {expected}; both must be the same", a.root().display());
        Err(EditError::refused(code, &b.root().join(file), problem))
    };
    if a.fps != b.fps {
        return refused("edit.fps", layout::INFO, format!("fps is {}", b.fps), a.fps.to_string());
    }
    if first.programs.is_some() != other.programs.is_some() {
        let words = |reading: &Reading| if reading.programs.is_some() { "there" } else { "not there" }.to_owned();
        let found = format!("the table of program calls is {}", words(other));
        return refused("edit.vocabulary", layout::NTP_INFO, found, words(first));
    }
    let annotated = |reading: &Reading| reading.programs.as_ref().and_then(|of| of.ntp.annotated_by.clone());
    if annotated(first) != annotated(other) {
        let words = |reading: &Reading| annotated(reading).unwrap_or_else(|| "an expert of ours".to_owned());
        let found = format!("its programs are annotated by {}", words(other));
        return refused("edit.vocabulary", layout::NTP_INFO, found, words(first));
    }
    let words = |feature: Option<&Declared>| feature.map_or_else(|| "not there".to_owned(), feature_words);
    let names: BTreeSet<&String> = a.features.iter().chain(&b.features).map(|feature| &feature.name).collect();
    for name in names {
        let (expected, found) = (words(a.feature(name)), words(b.feature(name)));
        if expected != found {
            return refused("edit.features", layout::INFO, format!("feature {name:?} is {found}"), expected);
        }
    }
    if let Some(name) = other_column(target.meta_schema(), &meta::schema_of(&other.source)?) {
        let found = format!("episodes have a column {name:?}");
        return refused("edit.columns", layout::META_EPISODES, found, "not there".to_owned());
    }
    let schema = other.schema()?;
    let columns = |schema: &arrow::datatypes::SchemaRef| -> BTreeSet<String> {
        schema.fields().iter().map(|field| field.name().clone()).collect()
    };
    let (expected, found) = (columns(target.schema()), columns(&schema));
    match expected.symmetric_difference(&found).next() {
        Some(name) => {
            let words = |has: bool| if has { "there" } else { "not there" }.to_owned();
            let problem = format!("column {name:?} is {}", words(found.contains(name)));
            refused("edit.columns", layout::DATA, problem, words(expected.contains(name)))
        }
        None => Ok(()),
    }
}

/// What must be the same of a feature in all sources.
fn feature_words(feature: &Declared) -> String {
    let codec = feature.video("video.codec").and_then(Value::as_str).unwrap_or_default();
    format!("{} {:?} {codec}", feature.dtype, feature.shape).trim_end().to_owned()
}
