//! The files that readers find: numbered folders below one, in the order of their paths.

use std::path::{Path, PathBuf};

use crate::artifact::IoError;

/// What readers take below a folder: `FOLDER/*/*.parquet`, in the order of the paths, as `LeRobot` does.
pub(crate) fn parquet_files(folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let mut files = Vec::new();
    for chunk in sorted(folder)? {
        if chunk.is_dir() {
            let inside = sorted(&chunk)?.into_iter();
            files.extend(inside.filter(|path| path.extension().is_some_and(|extension| extension == "parquet")));
        }
    }
    Ok(files)
}

/// Every file below a folder with an extension, at any depth.
pub(crate) fn files_below(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, IoError> {
    let mut files = Vec::new();
    for path in sorted(folder)? {
        if path.is_dir() {
            files.extend(files_below(&path, extension)?);
        } else if path.extension().is_some_and(|of| of == extension) {
            files.push(path);
        }
    }
    Ok(files)
}

/// What is in a folder; nothing where there is none.
fn sorted(folder: &Path) -> Result<Vec<PathBuf>, IoError> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(IoError::system("list", folder))?,
    };
    let paths = entries.map(|entry| entry.map(|entry| entry.path()));
    let mut paths = paths.collect::<std::io::Result<Vec<_>>>().map_err(IoError::system("list", folder))?;
    paths.sort();
    Ok(paths)
}
