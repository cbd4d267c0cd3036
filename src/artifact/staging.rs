//! A folder that appears whole or not at all.

use std::path::{Path, PathBuf};

use crate::artifact::unfinished::Unfinished;
use crate::artifact::{IoError, LockError, PARTIAL_PREFIX, RunLock, create_dir};

const LOCK: &str = ".lock";

/// A folder could not be made.
#[derive(Debug, thiserror::Error)]
pub enum StagingError {
    /// Another process makes the same folder.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// The system refuses.
    #[error(transparent)]
    Io(#[from] IoError),
    /// There is something under the final name that is no folder.
    #[error("only a new or empty folder is written, but {} is no folder", path.display())]
    NoFolder {
        /// The final name.
        path: PathBuf,
    },
    /// There is something under the final name.
    #[error("only a new or empty folder is written, but there is something in {}", path.display())]
    NotEmpty {
        /// The final name.
        path: PathBuf,
    },
}

/// A folder being made beside its final name. What a killed process left there is removed by the next one that makes
/// the same folder; dropped without [`StagedDir::commit`] it leaves nothing.
#[derive(Debug)]
pub struct StagedDir {
    partial: PathBuf,
    path: PathBuf,
    is_committed: bool,
    _lock: RunLock,
    _unfinished: Unfinished,
}

impl StagedDir {
    /// Begins a folder that shall be at `path`.
    ///
    /// # Errors
    ///
    /// When there is something at `path`, or another process makes the same folder.
    pub fn begin(path: &Path) -> Result<Self, StagingError> {
        let path = &behind_links(path)?;
        if path.exists() && !path.is_dir() {
            return Err(StagingError::NoFolder { path: path.to_owned() });
        }
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let partial = path.with_file_name(format!("{PARTIAL_PREFIX}{name}"));
        let lock = RunLock::take(&partial)?;
        let unfinished = Unfinished::note(&partial);
        let staged = Self { partial, path: path.to_owned(), is_committed: false, _lock: lock, _unfinished: unfinished };
        if name.is_empty() || !is_empty(path)? {
            return Err(StagingError::NotEmpty { path: path.to_owned() });
        }
        staged.clear()?;
        Ok(staged)
    }

    /// Where to write.
    pub fn partial_path(&self) -> &Path {
        &self.partial
    }

    /// Where it will be, behind links.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the folder its name.
    ///
    /// # Errors
    ///
    /// When the system refuses; then nothing is under the final name.
    pub fn commit(mut self) -> Result<(), IoError> {
        // The lock goes with the folder, so that no other process takes a folder that is being renamed for its own.
        std::fs::rename(&self.partial, &self.path).map_err(IoError::system("rename to", &self.path))?;
        self.is_committed = true;
        let lock = self.path.join(LOCK);
        std::fs::remove_file(&lock).map_err(IoError::system("remove", &lock))?;
        super::atomic::sync_folder(&self.path)
    }

    fn clear(&self) -> Result<(), IoError> {
        for entry in std::fs::read_dir(&self.partial).map_err(IoError::system("list", &self.partial))? {
            let path = entry.map_err(IoError::system("list", &self.partial))?.path();
            let removed = match path.is_dir() {
                true => std::fs::remove_dir_all(&path),
                false if path.ends_with(LOCK) => Ok(()),
                false => std::fs::remove_file(&path),
            };
            removed.map_err(IoError::system("remove", &path))?;
        }
        Ok(())
    }
}

impl Drop for StagedDir {
    fn drop(&mut self) {
        if !self.is_committed {
            // Nothing is left to do when the system refuses: the next command of the kind tries again.
            let _refused = std::fs::remove_dir_all(&self.partial);
        }
    }
}

/// Where a folder that is there is, behind links and `.`: only under its own name can another take its place.
fn behind_links(path: &Path) -> Result<PathBuf, IoError> {
    match std::fs::canonicalize(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(path.to_owned()),
        found => found.map_err(IoError::system("find", path)),
    }
}

/// Whether a folder is not there or empty; its parent is made.
fn is_empty(path: &Path) -> Result<bool, IoError> {
    if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty()) {
        create_dir(parent)?;
    }
    match std::fs::read_dir(path) {
        Ok(mut entries) => Ok(entries.next().is_none()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(true),
        Err(source) => Err(IoError::system("list", path)(source)),
    }
}
