//! One run a directory: the second says so and stops.

use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

use crate::artifact::{IoError, create_dir};

/// Held while a command writes into a run directory. The system drops it with the process, so a killed run leaves no
/// stale lock.
#[derive(Debug)]
pub struct RunLock {
    _file: File,
}

/// The lock could not be taken.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process holds it.
    #[error("another ntp command is writing into {}; wait for it or choose another --out", directory.display())]
    Held {
        /// The run directory.
        directory: PathBuf,
    },
    /// The file system has no locks.
    #[error("the file system of {} has no file locks ({source}); --no-lock goes without, where nothing else writes there", directory.display())]
    Unsupported {
        /// The run directory.
        directory: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The lock file could not be opened.
    #[error(transparent)]
    Io(#[from] IoError),
}

impl RunLock {
    /// Takes the lock of a run directory, which is made if needed, for this process alone.
    ///
    /// # Errors
    ///
    /// [`LockError::Held`] at once when another process has it; [`LockError::Unsupported`] where there are no locks.
    pub fn take(directory: &Path) -> Result<Self, LockError> {
        Self::lock(directory, File::try_lock)
    }

    /// Takes it together with other processes that do the same: each does shards of its own.
    ///
    /// # Errors
    ///
    /// [`LockError::Held`] at once when another process has it alone; [`LockError::Unsupported`] where there are none.
    pub fn share(directory: &Path) -> Result<Self, LockError> {
        Self::lock(directory, File::try_lock_shared)
    }

    fn lock(directory: &Path, lock: fn(&File) -> Result<(), TryLockError>) -> Result<Self, LockError> {
        create_dir(directory)?;
        let path = directory.join(".lock");
        let file = OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path)
            .map_err(IoError::system("open", &path))?;
        match lock(&file) {
            Ok(()) => Ok(Self { _file: file }),
            Err(TryLockError::WouldBlock) => Err(LockError::Held { directory: directory.to_owned() }),
            Err(TryLockError::Error(source)) if has_no_locks(&source) => {
                Err(LockError::Unsupported { directory: directory.to_owned(), source })
            }
            Err(TryLockError::Error(source)) => Err(IoError::system("lock", &path)(source).into()),
        }
    }
}

/// ENOSYS, EOPNOTSUPP and ENOLCK on Linux: a shared folder that was mounted without locks.
fn has_no_locks(error: &std::io::Error) -> bool {
    const ENOLCK: i32 = 37;
    error.kind() == std::io::ErrorKind::Unsupported
        || (cfg!(target_os = "linux") && error.raw_os_error() == Some(ENOLCK))
}
