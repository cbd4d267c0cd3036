//! Places of many files: a folder, or a bucket of an object store.
//!
//! # Invariants
//!
//! A file appears whole or not at all. What is created on the condition that nothing of its name is there never takes
//! the place of anything, and of several processes that create a name at once one succeeds. Nothing here knows what the
//! files are.

mod address;
#[cfg(feature = "cloud")]
mod bucket;
mod error;
mod folder;

use std::fmt;
use std::path::{Path, PathBuf};

pub use address::{AddressError, BucketUrl, StoreAddress};
#[cfg(feature = "cloud")]
pub use bucket::Bucket;
pub use error::StoreError;
pub use folder::{Folder, files_below};

/// A place that holds files. They are named relative to it, with `/`.
pub trait Store: fmt::Debug + Send + Sync {
    /// A file's name in messages.
    fn path(&self, file: &str) -> PathBuf;

    /// Every file of a folder and the folders in it, in order, by its whole name; none where nothing is there yet. The
    /// folder without a name is the place itself. Files on their way are not told.
    ///
    /// # Errors
    ///
    /// When they cannot be listed.
    fn list(&self, folder: &str) -> Result<Vec<String>, StoreError>;

    /// A small file; `None` when it is not there.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    fn read(&self, file: &str) -> Result<Option<Vec<u8>>, StoreError>;

    /// Small files, in the order of their names, as [`Store::read`] gives each; several at a time where that is faster.
    ///
    /// # Errors
    ///
    /// When one cannot be read.
    fn read_all(&self, files: &[String]) -> Result<Vec<Option<Vec<u8>>>, StoreError> {
        files.iter().map(|file| self.read(file)).collect()
    }

    /// The SHA-256 of what is stored under a name, read back; `None` when nothing is.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    fn sha256(&self, file: &str) -> Result<Option<String>, StoreError>;

    /// Makes ready for files from one process alone, and removes what a killed one left half-written.
    ///
    /// # Errors
    ///
    /// As [`Store::check_conditions`]; when nothing can be written.
    fn prepare(&self) -> Result<(), StoreError>;

    /// Whether conditions are kept to. Several processes may ask at once.
    ///
    /// # Errors
    ///
    /// [`StoreError::NoConditionalWrites`] for a bucket without them; when nothing can be written.
    fn check_conditions(&self) -> Result<(), StoreError>;

    /// Stores a file that lies in a folder, whole or not at all. Nothing of its name is there, or the same.
    ///
    /// # Errors
    ///
    /// When it cannot be read or stored.
    fn copy(&self, source: &Path, file: &str) -> Result<(), StoreError>;

    /// Brings a file into a folder under a name of its own, in place of what is there, once its hash is the expected one.
    ///
    /// # Errors
    ///
    /// [`StoreError::Spoiled`] for another hash; when it is not there, or cannot be read or written.
    fn fetch(&self, file: &str, to: &Path, sha256: &str) -> Result<(), StoreError>;

    /// Stores some bytes, whole or not at all, unless there is something of the name by then.
    ///
    /// # Errors
    ///
    /// When they cannot be stored.
    fn create(&self, file: &str, content: &[u8]) -> Result<Creation, StoreError>;

    /// Stores some bytes in place of what is there.
    ///
    /// # Errors
    ///
    /// When they cannot be stored.
    fn replace(&self, file: &str, content: &[u8]) -> Result<(), StoreError>;

    /// The folder that it is, if it is one.
    fn folder(&self) -> Option<&Path> {
        None
    }

    /// Stores a file that lies in a folder unless it is there already, and reads it back; whether it was there.
    ///
    /// # Errors
    ///
    /// [`StoreError::Spoiled`] when what is stored is another file.
    fn keep(&self, source: &Path, file: &str, sha256: &str) -> Result<bool, StoreError> {
        if self.sha256(file)?.as_deref() == Some(sha256) {
            return Ok(true);
        }
        self.copy(source, file)?;
        let found = self.sha256(file)?.unwrap_or_else(|| "of nothing".to_owned());
        if found == sha256 {
            return Ok(false);
        }
        Err(StoreError::Spoiled { place: self.path(file), found, expected: sha256.to_owned() })
    }
}

/// What became of bytes that were to be stored under a new name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Creation {
    /// They are stored.
    Stored,
    /// There is something of this name.
    Taken,
}
