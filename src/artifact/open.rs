//! Opening files to read, and telling those of Git LFS whose content was not fetched: a few lines stand where it should be.

use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::path::Path;

use crate::artifact::IoError;

/// The first bytes of a file that stands for another.
const POINTER_HEAD: &[u8] = b"version https://git-lfs";

/// Opens a file to read.
///
/// # Errors
///
/// [`IoError::System`] when it cannot be opened, [`IoError::Pointer`] when it is not the file itself.
pub fn open(path: &Path) -> Result<File, IoError> {
    let mut file = File::open(path).map_err(IoError::system("open", path))?;
    // A pipe has no beginning to go back to.
    if !file.metadata().map_err(IoError::system("read", path))?.is_file() {
        return Ok(file);
    }
    let mut head = [0; POINTER_HEAD.len()];
    if file.read_exact(&mut head).is_ok() && head == POINTER_HEAD {
        return Err(IoError::Pointer { path: path.to_owned() });
    }
    file.rewind().map_err(IoError::system("read", path))?;
    Ok(file)
}

/// The same of bytes that were read already.
pub(super) fn refuse_pointer(path: &Path, bytes: &[u8]) -> Result<(), IoError> {
    match bytes.starts_with(POINTER_HEAD) {
        true => Err(IoError::Pointer { path: path.to_owned() }),
        false => Ok(()),
    }
}

/// Whether it stands for a file that was not fetched.
pub fn is_pointer(path: &Path) -> bool {
    matches!(open(path), Err(IoError::Pointer { .. }))
}
