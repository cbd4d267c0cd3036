//! What is published, and how it comes into the folder: file by file, each whole or not there.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::Path;

use crate::artifact::{self, AtomicFile, FileEntry, IoError, StageDir, remove_partials, sha256_bytes, sha256_file};
use crate::pipeline::Stage;
use crate::publish::{PublishError, checksums};

/// Folders of a dataset that has no manifest.
const FOLDERS: [&str; 4] = ["data", "meta", "ntp", "videos"];
/// The contract's own files, which make the published folder the same artifact.
const CONTRACT: [&str; 2] = ["plan.json", "manifest.json"];
/// Bytes of one step of copying.
const STEP: usize = 1 << 18;

/// How many files came into the folder, and how many were there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Moved {
    pub(super) copied: u64,
    pub(super) kept: u64,
}

/// The files of a dataset, with their hashes: those of its manifest, or else of its folders.
pub(super) fn of_dataset(dataset: &Path) -> Result<Vec<FileEntry>, PublishError> {
    let dir = StageDir::new(Stage::Convert.name(), dataset);
    let Some(manifest) = dir.manifest()? else {
        let below = checksums::files_below(dataset)?;
        let is_part = |path: &String| path.split_once('/').is_some_and(|(folder, _)| FOLDERS.contains(&folder));
        let entries = below.iter().filter(|path| is_part(path)).map(|path| FileEntry::of(dataset, path));
        return Ok(entries.collect::<Result<_, _>>()?);
    };
    dir.check_files(&manifest, true)?;
    let contract = CONTRACT.into_iter().filter(|file| dataset.join(file).is_file());
    let contract = contract.map(|file| FileEntry::of(dataset, file)).collect::<Result<Vec<_>, _>>()?;
    Ok(manifest.files.into_iter().chain(contract).collect())
}

/// Refuses a folder in which something else lies, and removes what a killed process left half-written.
pub(super) fn check_folder(to: &Path, expected: &BTreeSet<&str>) -> Result<(), PublishError> {
    if !to.exists() {
        return Ok(artifact::create_dir(to)?);
    }
    let foreign = checksums::files_below(to)?.into_iter().find(|path| !expected.contains(path.as_str()));
    if let Some(path) = foreign {
        return Err(PublishError::Foreign { path: to.join(path) });
    }
    Ok(remove_partials(to)?)
}

/// Brings a file of the dataset into the folder, unless it is there already.
pub(super) fn copy(dataset: &Path, to: &Path, file: &FileEntry, moved: &mut Moved) -> Result<(), PublishError> {
    let target = to.join(&file.path);
    if is_there(&target, file)? {
        moved.kept += 1;
        return Ok(());
    }
    let source = dataset.join(&file.path);
    let mut reader = File::open(&source).map_err(IoError::system("open", &source))?;
    let mut writer = AtomicFile::create(&target)?;
    let mut buffer = vec![0_u8; STEP];
    loop {
        let n_read = reader.read(&mut buffer).map_err(IoError::system("read", &source))?;
        if n_read == 0 {
            break;
        }
        writer.write_all(&buffer[..n_read]).map_err(IoError::system("write", &target))?;
    }
    writer.commit()?;
    let found = sha256_file(&target)?;
    if found != file.sha256 {
        return Err(PublishError::Copied { path: target, found, expected: file.sha256.clone() });
    }
    moved.copied += 1;
    Ok(())
}

/// Writes a document into the folder, unless it is there already.
pub(super) fn write(to: &Path, path: &str, content: &[u8], moved: &mut Moved) -> Result<FileEntry, PublishError> {
    let entry = FileEntry { path: path.to_owned(), bytes: content.len() as u64, sha256: sha256_bytes(content) };
    let target = to.join(path);
    if is_there(&target, &entry)? {
        moved.kept += 1;
    } else {
        artifact::write(&target, content)?;
        moved.copied += 1;
    }
    Ok(entry)
}

/// Whether a file is there with its content. Files come under their names when they are whole, so one of other content
/// is of another publication.
fn is_there(target: &Path, file: &FileEntry) -> Result<bool, PublishError> {
    if !target.exists() {
        return Ok(false);
    }
    if sha256_file(target)? == file.sha256 {
        return Ok(true);
    }
    Err(PublishError::Differs { path: target.to_owned() })
}
