//! A folder that holds files: each comes under its name when it is whole.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};

use crate::artifact::{self, AtomicFile, IoError, PARTIAL_PREFIX, remove_partials, sha256_file};
use crate::store::{Creation, Store, StoreError};

/// Bytes of one step of copying.
const STEP: usize = 1 << 18;

/// A folder.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// The folder of a path, which need not be there.
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }
}

impl Store for Folder {
    fn path(&self, file: &str) -> PathBuf {
        self.root.join(file)
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, StoreError> {
        let root = self.root.join(folder);
        if !root.exists() {
            return Ok(Vec::new());
        }
        let whole = |file: String| if folder.is_empty() { file } else { format!("{folder}/{file}") };
        Ok(files_below(&root)?.into_iter().map(whole).collect())
    }

    fn read(&self, file: &str) -> Result<Option<Vec<u8>>, StoreError> {
        let path = self.path(file);
        if path.is_file() { Ok(Some(artifact::read(&path)?)) } else { Ok(None) }
    }

    fn sha256(&self, file: &str) -> Result<Option<String>, StoreError> {
        let path = self.path(file);
        if path.is_file() { Ok(Some(sha256_file(&path)?)) } else { Ok(None) }
    }

    fn prepare(&self) -> Result<(), StoreError> {
        artifact::create_dir(&self.root)?;
        Ok(remove_partials(&self.root)?)
    }

    fn check_conditions(&self) -> Result<(), StoreError> {
        Ok(artifact::create_dir(&self.root)?)
    }

    fn copy(&self, source: &Path, file: &str) -> Result<(), StoreError> {
        Ok(copy(source, &self.path(file))?)
    }

    fn fetch(&self, file: &str, to: &Path, sha256: &str) -> Result<(), StoreError> {
        let place = self.path(file);
        let found = sha256_file(&place)?;
        if found != sha256 {
            return Err(StoreError::Spoiled { place, found, expected: sha256.to_owned() });
        }
        Ok(copy(&place, to)?)
    }

    fn create(&self, file: &str, content: &[u8]) -> Result<Creation, StoreError> {
        let path = self.path(file);
        if path.exists() {
            return Ok(Creation::Taken);
        }
        let mut writer = AtomicFile::create(&path)?;
        writer.write_all(content).map_err(IoError::system("write", &path))?;
        Ok(if writer.commit_if_absent()? { Creation::Stored } else { Creation::Taken })
    }

    fn replace(&self, file: &str, content: &[u8]) -> Result<(), StoreError> {
        Ok(artifact::write(&self.path(file), content)?)
    }

    fn folder(&self) -> Option<&Path> {
        Some(&self.root)
    }
}

fn copy(source: &Path, target: &Path) -> Result<(), IoError> {
    let mut reader = File::open(source).map_err(IoError::system("open", source))?;
    let mut writer = AtomicFile::create(target)?;
    let mut buffer = vec![0_u8; STEP];
    loop {
        let n_read = reader.read(&mut buffer).map_err(IoError::system("read", source))?;
        if n_read == 0 {
            return writer.commit();
        }
        writer.write_all(&buffer[..n_read]).map_err(IoError::system("write", target))?;
    }
}

/// Every file below a folder, relative to it with `/`, in order; without a `.git` folder and unfinished files.
///
/// # Errors
///
/// When the system refuses.
pub fn files_below(root: &Path) -> Result<Vec<String>, IoError> {
    let mut files = Vec::new();
    let mut folders: Vec<PathBuf> = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).map_err(IoError::system("list", &folder))? {
            let entry = entry.map_err(IoError::system("list", &folder))?;
            let (path, name) = (entry.path(), entry.file_name());
            let is_partial = name.to_string_lossy().starts_with(PARTIAL_PREFIX);
            if is_partial || (name == ".git" && folder == root) {
                continue;
            }
            // A link counts as a file: what it leads to is no part of the folder.
            if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                folders.push(path);
            } else if let Ok(relative) = path.strip_prefix(root) {
                let parts: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
                files.push(parts.join("/"));
            }
        }
    }
    files.sort();
    Ok(files)
}
