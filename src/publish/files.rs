//! What is published, and how it comes to its destination: file by file, each whole or not there.

use std::collections::BTreeSet;
use std::path::Path;

use crate::artifact::{FileEntry, StageDir, sha256_bytes};
use crate::pipeline::Stage;
use crate::publish::PublishError;
use crate::store::{Creation, Store, files_below};

/// Folders of a dataset that has no manifest.
const FOLDERS: [&str; 5] = ["annotations", "data", "meta", "ntp", "videos"];
/// The contract's own files, which make the published folder the same artifact.
const CONTRACT: [&str; 2] = ["plan.json", "manifest.json"];

/// How many files came to the destination, and how many were there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Moved {
    pub(super) copied: u64,
    pub(super) kept: u64,
}

/// The files of a dataset, with their hashes: those of its manifest, or else of its folders.
pub(super) fn of_dataset(dataset: &Path) -> Result<Vec<FileEntry>, PublishError> {
    let dir = StageDir::new(Stage::Convert.name(), dataset);
    let Some(manifest) = dir.manifest()? else {
        let below = files_below(dataset)?;
        // What systems and editors leave behind has names that begin with a dot.
        let is_litter = |path: &str| path.split('/').any(|part| part.starts_with('.'));
        let is_in_folder = |path: &str| path.split_once('/').is_some_and(|(folder, _)| FOLDERS.contains(&folder));
        let is_part = |path: &String| is_in_folder(path) && !is_litter(path);
        let entries = below.iter().filter(|path| is_part(path)).map(|path| FileEntry::of(dataset, path));
        return Ok(entries.collect::<Result<_, _>>()?);
    };
    dir.check_files(&manifest, true)?;
    let contract = CONTRACT.into_iter().filter(|file| dataset.join(file).is_file());
    let contract = contract.map(|file| FileEntry::of(dataset, file)).collect::<Result<Vec<_>, _>>()?;
    Ok(manifest.files.into_iter().chain(contract).collect())
}

/// Refuses a destination in which something else lies.
pub(super) fn check_destination(to: &dyn Store, expected: &BTreeSet<&str>) -> Result<(), PublishError> {
    match to.list("")?.into_iter().find(|file| !expected.contains(file.as_str())) {
        Some(file) => Err(PublishError::Foreign { path: to.path(&file) }),
        None => Ok(()),
    }
}

/// Brings a file of the dataset to the destination, unless it is there already, and reads it back.
pub(super) fn copy(dataset: &Path, to: &dyn Store, file: &FileEntry, moved: &mut Moved) -> Result<(), PublishError> {
    if is_there(to, file)? {
        moved.kept += 1;
        return Ok(());
    }
    to.keep(&dataset.join(&file.path), &file.path, &file.sha256)?;
    moved.copied += 1;
    Ok(())
}

/// Writes a document to the destination, unless it is there already.
pub(super) fn write(to: &dyn Store, path: &str, content: &[u8], moved: &mut Moved) -> Result<FileEntry, PublishError> {
    let entry = FileEntry { path: path.to_owned(), bytes: content.len() as u64, sha256: sha256_bytes(content) };
    match to.create(path, content)? {
        Creation::Stored => moved.copied += 1,
        Creation::Taken => moved.kept += 1,
    }
    // Also what was stored just now: another process may publish to the same place.
    if is_there(to, &entry)? { Ok(entry) } else { Err(PublishError::Differs { path: to.path(path) }) }
}

/// Whether a file is there with its content. Files come under their names when they are whole, so one of other content
/// is of another publication.
fn is_there(to: &dyn Store, file: &FileEntry) -> Result<bool, PublishError> {
    match to.sha256(&file.path)? {
        None => Ok(false),
        Some(found) if found == file.sha256 => Ok(true),
        Some(_) => Err(PublishError::Differs { path: to.path(&file.path) }),
    }
}
