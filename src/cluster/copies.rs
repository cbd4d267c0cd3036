//! Copies of pipeline files and of what they name, which keep their places to each other.

use std::path::{Component, Path, PathBuf};

use crate::artifact::{IoError, read, sha256_bytes, write};
use crate::pipeline::PipelineFile;

/// The files that a pipeline is read from, below the folder that holds them all.
pub(super) struct Copies {
    base: PathBuf,
    /// The pipeline file first, each relative to the base.
    files: Vec<PathBuf>,
}

impl Copies {
    /// The file itself, those of its experiments, and the task files that these import.
    ///
    /// # Errors
    ///
    /// When a file is not there.
    pub(super) fn of(file: &PipelineFile) -> Result<Self, IoError> {
        let experiments = match file {
            PipelineFile::Experiment(pipeline) => std::slice::from_ref(pipeline.as_ref()),
            PipelineFile::Study(study) => &study.experiments,
        };
        let mut paths = vec![full(file.path())?];
        for pipeline in experiments {
            paths.push(full(&pipeline.path)?);
            paths.extend(pipeline.import_path().map(|path| full(&path)).transpose()?);
        }
        let base = paths.iter().skip(1).fold(parent(&paths[0]), |base, path| common(&base, path));
        let mut files: Vec<PathBuf> = Vec::new();
        for path in paths {
            let relative = path.strip_prefix(&base).unwrap_or(&path).to_owned();
            if !files.contains(&relative) {
                files.push(relative);
            }
        }
        Ok(Self { base, files })
    }

    /// Hash of every file with its place.
    ///
    /// # Errors
    ///
    /// When a file cannot be read.
    pub(super) fn hash(&self) -> Result<String, IoError> {
        let mut told = Vec::new();
        for file in &self.files {
            told.extend(format!("{} {}\n", file.display(), sha256_bytes(&read(&self.base.join(file))?)).into_bytes());
        }
        Ok(sha256_bytes(&told))
    }

    /// The place of one of the files among the copies.
    ///
    /// # Errors
    ///
    /// When it cannot be found.
    pub(super) fn place(&self, path: &Path) -> Result<PathBuf, IoError> {
        let path = full(path)?;
        Ok(path.strip_prefix(&self.base).unwrap_or(&path).to_owned())
    }

    /// Writes the copies below a folder; the place of the pipeline file among them.
    ///
    /// # Errors
    ///
    /// When a file cannot be read or written.
    pub(super) fn write(&self, folder: &Path) -> Result<PathBuf, IoError> {
        for file in &self.files {
            write(&folder.join(file), &read(&self.base.join(file))?)?;
        }
        Ok(self.files[0].clone())
    }
}

fn full(path: &Path) -> Result<PathBuf, IoError> {
    let absolute = std::path::absolute(path).map_err(IoError::system("find", path))?;
    // `a/../b` is b wherever a leads to: that is how the pipeline file reads it where no link is on the way.
    let mut clean = PathBuf::new();
    for part in absolute.components() {
        match part {
            Component::ParentDir => {
                clean.pop();
            }
            Component::CurDir => {}
            part => clean.push(part),
        }
    }
    Ok(clean)
}

fn parent(path: &Path) -> PathBuf {
    path.parent().unwrap_or(path).to_owned()
}

/// The deepest folder that holds both.
fn common(base: &Path, path: &Path) -> PathBuf {
    base.ancestors().find(|folder| path.starts_with(folder)).unwrap_or(base).to_owned()
}
