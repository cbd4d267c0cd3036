//! Atomic writing, reading with the path in the error, hashing.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest as _, Sha256};
use tempfile::NamedTempFile;

use crate::artifact::open::{open, refuse_pointer};
use crate::artifact::unfinished::Unfinished;

/// How names begin of what is not whole yet.
pub const PARTIAL_PREFIX: &str = ".partial-";

/// A file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The operating system said no.
    #[error("failed to {action} {}: {source}", path.display())]
    System {
        /// What was tried.
        action: &'static str,
        /// On which file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// There is something at the place of a file that is none: renamed over, a device or a pipe would be gone.
    #[error("cannot write {}: it is {found}; allowed: a new name, or the name of a file", path.display())]
    NoFile {
        /// Where.
        path: PathBuf,
        /// What is there.
        found: &'static str,
    },
    /// Content that lies in Git LFS was not fetched.
    #[error("{}: it is a Git LFS pointer and not the file itself: fetch it with `git lfs pull`", path.display())]
    Pointer {
        /// Which file.
        path: PathBuf,
    },
    /// The content is not the JSON it should be.
    #[error("{}:{}:{}: {source}", path.display(), source.line(), source.column())]
    Json {
        /// Which file.
        path: PathBuf,
        /// Where and what.
        source: serde_json::Error,
    },
}

impl IoError {
    /// The file that it is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::System { path, .. }
            | Self::NoFile { path, .. }
            | Self::Pointer { path }
            | Self::Json { path, .. } => path,
        }
    }

    /// Names action and path of a system error.
    pub fn system(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::System { action, path, source }
    }
}

/// A file being written under a temporary name beside its final one. Dropped without [`AtomicFile::commit`] it leaves
/// nothing behind.
#[derive(Debug)]
pub struct AtomicFile {
    writer: BufWriter<NamedTempFile>,
    path: PathBuf,
    unfinished: Unfinished,
}

impl AtomicFile {
    /// Begins a file that shall be at `path`, or where a link there leads; its folder is made if needed.
    ///
    /// # Errors
    ///
    /// [`IoError::NoFile`] when there is something at `path` that is no file; or when folder or temporary file cannot be
    /// made.
    pub fn create(path: &Path) -> Result<Self, IoError> {
        let path = &behind_link(path)?;
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        create_dir(folder)?;
        let file = tempfile::Builder::new()
            .prefix(PARTIAL_PREFIX)
            .tempfile_in(folder)
            .map_err(IoError::system("create a temporary file in", folder))?;
        let unfinished = Unfinished::note(file.path());
        Ok(Self { writer: BufWriter::with_capacity(1 << 18, file), path: path.to_owned(), unfinished })
    }

    /// Flushes, syncs and renames to the final name, replacing what was there.
    ///
    /// # Errors
    ///
    /// When the disk is full or the name cannot be taken; then nothing is at the final name that was not before.
    pub fn commit(self) -> Result<(), IoError> {
        let (file, path, unfinished) = self.synced()?;
        file.persist(&path).map_err(|error| IoError::system("rename to", &path)(error.error))?;
        drop(unfinished);
        sync_folder(&path)
    }

    /// Flushes, syncs and takes the final name if nothing has it; whether this file is there now. Of several processes
    /// that do so at once one alone succeeds, also on shared folders.
    ///
    /// # Errors
    ///
    /// When the disk is full or the name cannot be taken for another reason than that something has it.
    pub fn commit_if_absent(self) -> Result<bool, IoError> {
        let (file, path, unfinished) = self.synced()?;
        match file.persist_noclobber(&path) {
            Err(error) if error.error.kind() == std::io::ErrorKind::AlreadyExists => return Ok(false),
            kept => kept.map_err(|error| IoError::system("take the name", &path)(error.error))?,
        };
        drop(unfinished);
        sync_folder(&path)?;
        Ok(true)
    }

    /// The whole file on disk, under its temporary name.
    fn synced(self) -> Result<(NamedTempFile, PathBuf, Unfinished), IoError> {
        let Self { writer, path, unfinished } = self;
        let file = writer.into_inner().map_err(|error| IoError::system("write", &path)(error.into_error()))?;
        file.as_file().sync_all().map_err(IoError::system("sync", &path))?;
        set_usual_permissions(file.as_file()).map_err(IoError::system("set permissions of", &path))?;
        Ok((file, path, unfinished))
    }
}

/// Where the file of a name lies: behind a link, which stays as it is.
fn behind_link(path: &Path) -> Result<PathBuf, IoError> {
    // Of what is not there, or behind a link that leads nowhere, there is nothing to spare.
    let Ok(metadata) = std::fs::metadata(path) else { return Ok(path.to_owned()) };
    if !metadata.is_file() {
        return Err(IoError::NoFile { path: path.to_owned(), found: kind_of(&metadata) });
    }
    if path.is_symlink() { path.canonicalize().map_err(IoError::system("find", path)) } else { Ok(path.to_owned()) }
}

/// What is no file, in words.
fn kind_of(metadata: &std::fs::Metadata) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt as _;
        let kind = metadata.file_type();
        if kind.is_fifo() {
            return "a pipe";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
    }
    if metadata.is_dir() { "a folder" } else { "no file" }
}

/// A temporary file is made for its owner alone; a result is for everyone.
fn set_usual_permissions(file: &File) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        file.set_permissions(std::fs::Permissions::from_mode(0o644))?;
    }
    Ok(())
}

/// Syncs the folder that a path is in.
pub(super) fn sync_folder(path: &Path) -> Result<(), IoError> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let sync = || File::open(folder)?.sync_all();
    sync().map_err(IoError::system("sync", folder))
}

impl Write for AtomicFile {
    fn write(&mut self, buffer: &[u8]) -> std::io::Result<usize> {
        self.writer.write(buffer)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.flush()
    }
}

/// Reads back what has been written.
impl Read for AtomicFile {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.writer.flush()?;
        self.writer.get_mut().read(buffer)
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, position: SeekFrom) -> std::io::Result<u64> {
        self.writer.seek(position)
    }
}

/// Removes the temporary files that a killed process left below a folder. No other process may be writing there.
///
/// # Errors
///
/// When the system refuses.
pub fn remove_partials(folder: &Path) -> Result<(), IoError> {
    let entries = match std::fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(source) => return Err(IoError::system("list", folder)(source)),
    };
    for entry in entries {
        let path = entry.map_err(IoError::system("list", folder))?.path();
        let is_partial = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(PARTIAL_PREFIX));
        match (path.is_dir(), is_partial) {
            (true, true) => std::fs::remove_dir_all(&path).map_err(IoError::system("remove", &path))?,
            (true, false) => remove_partials(&path)?,
            (false, true) => std::fs::remove_file(&path).map_err(IoError::system("remove", &path))?,
            (false, false) => {}
        }
    }
    Ok(())
}

/// Makes a folder and its parents.
///
/// # Errors
///
/// When the system refuses.
pub fn create_dir(path: &Path) -> Result<(), IoError> {
    std::fs::create_dir_all(path).map_err(IoError::system("create folder", path))
}

/// Reads a whole file.
///
/// # Errors
///
/// When it is not there, cannot be read, or is a pointer of Git LFS.
pub fn read(path: &Path) -> Result<Vec<u8>, IoError> {
    let bytes = std::fs::read(path).map_err(IoError::system("read", path))?;
    refuse_pointer(path, &bytes)?;
    Ok(bytes)
}

/// Writes a whole file atomically.
///
/// # Errors
///
/// As [`AtomicFile::commit`].
pub fn write(path: &Path, content: &[u8]) -> Result<(), IoError> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(content).map_err(IoError::system("write", path))?;
    file.commit()
}

/// Reads JSON.
///
/// # Errors
///
/// With line and column when the content is not a `T`.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, IoError> {
    serde_json::from_slice(&read(path)?).map_err(|source| IoError::Json { path: path.to_owned(), source })
}

/// Writes indented JSON with a line feed at its end, atomically.
///
/// # Errors
///
/// As [`write()`].
pub fn write_json<T: Serialize>(path: &Path, value: &T) -> Result<(), IoError> {
    write(path, &to_json(path, value)?)
}

/// Writes indented JSON if nothing is at the path; whether it is there now.
///
/// # Errors
///
/// As [`AtomicFile::commit_if_absent`].
pub fn create_json<T: Serialize>(path: &Path, value: &T) -> Result<bool, IoError> {
    let mut file = AtomicFile::create(path)?;
    file.write_all(&to_json(path, value)?).map_err(IoError::system("write", path))?;
    file.commit_if_absent()
}

/// Indented JSON with a line feed at its end, as it is written; the path is for errors.
///
/// # Errors
///
/// When the value has no JSON.
pub fn to_json<T: Serialize>(path: &Path, value: &T) -> Result<Vec<u8>, IoError> {
    let mut text =
        serde_json::to_vec_pretty(value).map_err(|source| IoError::Json { path: path.to_owned(), source })?;
    text.push(b'\n');
    Ok(text)
}

/// Lower-case hexadecimal.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// SHA-256 of bytes, in hexadecimal.
pub fn sha256_bytes(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// SHA-256 of a file, in hexadecimal, read in pieces.
///
/// # Errors
///
/// When it cannot be read.
pub fn sha256_file(path: &Path) -> Result<String, IoError> {
    let file = open(path)?;
    let mut reader = BufReader::with_capacity(1 << 18, file);
    let mut hasher = Sha256::new();
    let mut buffer = vec![0_u8; 1 << 18];
    loop {
        let n = reader.read(&mut buffer).map_err(IoError::system("read", path))?;
        if n == 0 {
            return Ok(hex(&hasher.finalize()));
        }
        hasher.update(&buffer[..n]);
    }
}
