//! A dataset made ready for others: checked, licensed, described, with checksums; and the check of a copy.
//!
//! # Input and output
//!
//! [`publish`] reads a dataset that validates and writes to a [`Store`], a folder beside it or a place in a bucket:
//!
//! ```text
//! README.md            the card: what it is, how it was made, tables, splits, limits, how to cite
//! croissant.json       the same for machines (Croissant 1.1)
//! pipeline.toml        the settings that make it again, and provenance/ with the plans they are from
//! data/ meta/ ntp/     the dataset, byte for byte
//! upload.sh            how it comes to the Hugging Face hub, with the tag that LeRobot wants; .gitattributes
//! SHA256SUMS           of all of them, written last
//! ```
//!
//! [`verify`] compares a copy with its `SHA256SUMS`.
//!
//! # Invariants
//!
//! The same dataset and the same words give the same bytes; the day is told, no clock is read. A publication that was
//! killed goes on with the same command, and a file that is there already is not copied again. Nothing is overwritten;
//! what was written is read back.
//! Memory grows with the number of files alone.

mod card;
mod checksums;
mod croissant;
mod error;
mod facts;
mod files;
mod license;
mod modelled;
mod origin;
mod provenance;
mod publication;
mod tables;

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;

use crate::dataset::{self, Severity};
use crate::store::Store;

pub use checksums::{Difference, FileDifference, Verified, verify};
pub use error::PublishError;
use facts::Facts;
use files::Moved;
pub use license::{License, UnknownLicense};
pub use publication::{NoRelease, Publication, Release};

/// Words under which the dataset is found.
const CARD: &str = "README.md";
const CROISSANT: &str = "croissant.json";
const UPLOAD: (&str, &str) = ("upload.sh", include_str!("publish/upload.sh"));
/// Large files go to the hub's file storage.
const ATTRIBUTES: (&str, &str) =
    (".gitattributes", "*.parquet filter=lfs diff=lfs merge=lfs -text\n*.mp4 filter=lfs diff=lfs merge=lfs -text\n");

/// What was published.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct PublishSummary {
    /// Files at the destination, `SHA256SUMS` too.
    pub files: u64,
    /// Their size in bytes, without `SHA256SUMS`.
    pub bytes: u64,
    /// Files that were written now.
    pub copied: u64,
    /// Files that were there already, from a publication that was interrupted.
    pub kept: u64,
    /// What the check of the dataset warned of.
    pub warnings: u64,
    /// What the publication lacks because it was not at hand; empty when it lacks nothing.
    pub left_out: Vec<String>,
}

/// Publishes a dataset. `go_on` is asked before each file.
///
/// # Errors
///
/// [`PublishError::Invalid`] for a dataset with faults; [`PublishError::Foreign`] and [`PublishError::Differs`] for a
/// destination in which something else lies; [`PublishError::Store`] for a bucket that would mix two publications.
pub fn publish(
    dataset: &Path,
    to: &dyn Store,
    publication: &Publication,
    go_on: impl Fn() -> bool,
) -> Result<PublishSummary, PublishError> {
    to.folder().map_or(Ok(()), |folder| check_apart(dataset, folder))?;
    let warnings = check_dataset(dataset)?;
    let facts = Facts::gather(dataset, publication)?;
    let files = files::of_dataset(dataset)?;
    let documents = documents(&facts, publication, &files)?;
    let names = files.iter().map(|file| file.path.as_str()).chain(documents.iter().map(|(name, _)| name.as_str()));
    files::check_destination(to, &names.chain([checksums::FILE]).collect::<BTreeSet<_>>())?;
    to.prepare()?;
    let mut moved = Moved::default();
    for file in &files {
        if !go_on() {
            return Err(PublishError::Interrupted);
        }
        files::copy(dataset, to, file, &mut moved)?;
    }
    let mut entries = files;
    for (name, content) in &documents {
        entries.push(files::write(to, name, content, &mut moved)?);
    }
    files::write(to, checksums::FILE, checksums::render(&entries).as_bytes(), &mut moved)?;
    Ok(PublishSummary {
        files: entries.len() as u64 + 1,
        bytes: entries.iter().map(|file| file.bytes).sum(),
        copied: moved.copied,
        kept: moved.kept,
        warnings,
        left_out: facts.left_out,
    })
}

/// Neither folder may lie in the other.
fn check_apart(dataset: &Path, to: &Path) -> Result<(), PublishError> {
    let absolute = |path: &Path| {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        path.canonicalize().unwrap_or(path)
    };
    let (from, into) = (absolute(dataset), absolute(to));
    if from.starts_with(&into) || into.starts_with(&from) {
        return Err(PublishError::Nested { dataset: dataset.to_owned(), to: to.to_owned() });
    }
    Ok(())
}

/// Refuses a dataset with faults; returns how many warnings there are.
fn check_dataset(dataset: &Path) -> Result<u64, PublishError> {
    let found = dataset::validate(dataset);
    let warnings = found.findings.iter().filter(|finding| finding.severity == Severity::Warning).count() as u64;
    match found.findings.into_iter().find(|finding| finding.severity == Severity::Error) {
        Some(first) => Err(PublishError::Invalid { dataset: dataset.to_owned(), first: Box::new(first) }),
        None => Ok(warnings),
    }
}

/// Everything in the folder that is no file of the dataset, by name.
fn documents(
    facts: &Facts,
    publication: &Publication,
    files: &[crate::artifact::FileEntry],
) -> Result<Vec<(String, Vec<u8>)>, PublishError> {
    let render = |document, problem| PublishError::Render { document, problem };
    let mut documents = vec![
        (CARD.to_owned(), card::render(facts, publication).map_err(|problem| render(CARD, problem))?),
        (
            CROISSANT.to_owned(),
            croissant::render(facts, publication, files).map_err(|problem| render(CROISSANT, problem))?,
        ),
    ];
    documents.extend([UPLOAD, ATTRIBUTES].map(|(name, text)| (name.to_owned(), text.as_bytes().to_vec())));
    documents.extend(facts.provenance_files.iter().cloned());
    Ok(documents)
}
