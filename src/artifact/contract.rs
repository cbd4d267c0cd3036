//! Plan, receipt and manifest of one stage's folder.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, read_json, sha256_bytes, sha256_file, write_json};

/// Version of the three files below.
const CONTRACT_VERSION: u32 = 1;

/// What a stage is about to do, written before it does it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// [`CONTRACT_VERSION`].
    pub version: u32,
    /// The stage's name.
    pub stage: String,
    /// Version of the program that planned.
    pub ntp_version: String,
    /// How many shards there are.
    pub shards: u32,
    /// Hash of the manifest of what is read, by the stage's name; empty for the first stage.
    pub inputs: std::collections::BTreeMap<String, String>,
    /// The stage's resolved settings.
    pub config: serde_json::Value,
}

impl Plan {
    /// A plan of the current version.
    pub fn new(
        stage: &str,
        shards: u32,
        inputs: std::collections::BTreeMap<String, String>,
        config: serde_json::Value,
    ) -> Self {
        Self {
            version: CONTRACT_VERSION,
            stage: stage.to_owned(),
            ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
            shards,
            inputs,
            config,
        }
    }

    /// Hash of everything in it. A receipt of another plan is not taken.
    pub fn id(&self) -> String {
        sha256_bytes(&serde_json::to_vec(self).unwrap_or_default())
    }
}

/// One file of a shard or stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// Relative to the stage's folder, with `/`.
    pub path: String,
    /// Size in bytes.
    pub bytes: u64,
    /// SHA-256 in hexadecimal.
    pub sha256: String,
}

impl FileEntry {
    /// Measures a file in a stage's folder.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub fn of(folder: &Path, relative: &str) -> Result<Self, IoError> {
        let path = folder.join(relative);
        let bytes = std::fs::metadata(&path).map_err(IoError::system("read", &path))?.len();
        Ok(Self { path: relative.to_owned(), bytes, sha256: sha256_file(&path)? })
    }
}

/// That one shard is done: the commit.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Receipt {
    /// Of which plan.
    pub plan_id: String,
    /// Which shard.
    pub shard: u32,
    /// How many episodes it holds.
    pub episodes: u64,
    /// How many of them failed.
    pub failed: u64,
    /// Its files.
    pub files: Vec<FileEntry>,
}

/// That a stage is done.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// [`CONTRACT_VERSION`].
    pub version: u32,
    /// The stage's name.
    pub stage: String,
    /// Of which plan.
    pub plan_id: String,
    /// Episodes in all shards.
    pub episodes: u64,
    /// How many of them failed.
    pub failed: u64,
    /// Every file, in order of shard and path.
    pub files: Vec<FileEntry>,
}

/// What does not fit together in a stage's folder.
#[derive(Debug, thiserror::Error)]
pub enum ContractError {
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The stage has not been run to its end.
    #[error("{stage} is not finished: no {}", path.display())]
    Unfinished {
        /// The stage.
        stage: String,
        /// The manifest that is missing.
        path: PathBuf,
    },
    /// Shards are missing.
    #[error("{stage}: {} of {total} shards have no receipt, the first is {}", missing.len(), missing.first().copied().unwrap_or(0))]
    MissingShards {
        /// The stage.
        stage: String,
        /// Which.
        missing: Vec<u32>,
        /// Out of how many.
        total: u32,
    },
    /// A file that the manifest names is not as the manifest says.
    #[error("{}: {problem}", path.display())]
    FileDiffers {
        /// Which file.
        path: PathBuf,
        /// `missing`, or size or hash with found and expected.
        problem: String,
    },
}

/// A stage's folder.
#[derive(Clone, Debug)]
pub struct StageDir {
    stage: String,
    path: PathBuf,
}

impl StageDir {
    /// The folder of a stage; nothing is read or written.
    pub fn new(stage: &str, path: impl Into<PathBuf>) -> Self {
        Self { stage: stage.to_owned(), path: path.into() }
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn plan_path(&self) -> PathBuf {
        self.path.join("plan.json")
    }

    pub(super) fn receipt_path(&self, shard: u32) -> PathBuf {
        self.path.join(format!("receipts/shard-{shard:05}.json"))
    }

    fn manifest_path(&self) -> PathBuf {
        self.path.join("manifest.json")
    }

    /// The plan that the folder was made by, if it has one.
    ///
    /// # Errors
    ///
    /// When it is there but not readable.
    pub fn plan(&self) -> Result<Option<Plan>, IoError> {
        read_if_there(&self.plan_path())
    }

    /// The manifest, if the stage is finished.
    ///
    /// # Errors
    ///
    /// When it is there but not readable.
    pub fn manifest(&self) -> Result<Option<Manifest>, IoError> {
        read_if_there(&self.manifest_path())
    }

    /// The manifest of a stage that must be finished.
    ///
    /// # Errors
    ///
    /// [`ContractError::Unfinished`] when it is not.
    pub fn finished(&self) -> Result<Manifest, ContractError> {
        self.manifest()?
            .ok_or_else(|| ContractError::Unfinished { stage: self.stage.clone(), path: self.manifest_path() })
    }

    /// Hash of the manifest file: the version of what the stage made.
    ///
    /// # Errors
    ///
    /// [`ContractError::Unfinished`] when there is none.
    pub fn version(&self) -> Result<String, ContractError> {
        self.finished()?;
        Ok(sha256_file(&self.manifest_path())?)
    }

    /// The receipt of a shard, if it was made by this plan and its files are there in their sizes.
    ///
    /// # Errors
    ///
    /// When it is there but not readable.
    pub fn receipt(&self, plan: &Plan, shard: u32) -> Result<Option<Receipt>, IoError> {
        let receipt: Option<Receipt> = read_if_there(&self.receipt_path(shard))?;
        let of_plan = receipt.filter(|receipt| receipt.plan_id == plan.id() && receipt.shard == shard);
        Ok(of_plan.filter(|receipt| receipt.files.iter().all(|file| self.check_file(file, false).is_ok())))
    }

    /// Begins (or goes on with) a plan: what another plan left is removed first.
    ///
    /// # Errors
    ///
    /// When the folder cannot be written.
    pub fn begin(&self, plan: &Plan) -> Result<(), IoError> {
        if self.plan()?.as_ref() != Some(plan) {
            self.clear()?;
            self.write_plan(plan)?;
        }
        Ok(())
    }

    /// Writes the plan beside what is there already: for a folder that is made elsewhere and moved here when whole.
    ///
    /// # Errors
    ///
    /// When the folder cannot be written.
    pub fn write_plan(&self, plan: &Plan) -> Result<(), IoError> {
        write_json(&self.plan_path(), plan)
    }

    /// Removes everything the stage made.
    ///
    /// # Errors
    ///
    /// When the system refuses.
    pub fn clear(&self) -> Result<(), IoError> {
        match std::fs::remove_dir_all(&self.path) {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
            Err(source) => Err(IoError::system("remove", &self.path)(source)),
        }
    }

    /// Commits a shard, whose files are already under their final names.
    ///
    /// # Errors
    ///
    /// When the receipt cannot be written.
    pub fn commit_shard(&self, receipt: &Receipt) -> Result<(), IoError> {
        write_json(&self.receipt_path(receipt.shard), receipt)
    }

    /// Commits the stage from its receipts, and the files that were made of all shards together.
    ///
    /// # Errors
    ///
    /// [`ContractError::MissingShards`] when a receipt is missing.
    pub fn commit(&self, plan: &Plan, of_all_shards: &[&str]) -> Result<Manifest, ContractError> {
        let mut receipts = Vec::new();
        let mut missing = Vec::new();
        for shard in 0..plan.shards {
            match self.receipt(plan, shard)? {
                Some(receipt) => receipts.push(receipt),
                None => missing.push(shard),
            }
        }
        if !missing.is_empty() {
            return Err(ContractError::MissingShards { stage: self.stage.clone(), missing, total: plan.shards });
        }
        let together: Vec<FileEntry> =
            of_all_shards.iter().map(|file| FileEntry::of(&self.path, file)).collect::<Result<_, _>>()?;
        let manifest = Manifest {
            version: CONTRACT_VERSION,
            stage: self.stage.clone(),
            plan_id: plan.id(),
            episodes: receipts.iter().map(|receipt| receipt.episodes).sum(),
            failed: receipts.iter().map(|receipt| receipt.failed).sum(),
            files: receipts.into_iter().flat_map(|receipt| receipt.files).chain(together).collect(),
        };
        write_json(&self.manifest_path(), &manifest)?;
        Ok(manifest)
    }

    /// Compares the files with the manifest: by size, and by hash when `deep`.
    ///
    /// # Errors
    ///
    /// [`ContractError::FileDiffers`] for the first one that is not as it should be.
    pub fn check_files(&self, manifest: &Manifest, deep: bool) -> Result<(), ContractError> {
        manifest.files.iter().try_for_each(|file| self.check_file(file, deep))
    }

    /// Compares one file with what a manifest says of it, as [`StageDir::check_files`] does.
    ///
    /// # Errors
    ///
    /// [`ContractError::FileDiffers`] when it is not as it should be.
    pub fn check_file(&self, expected: &FileEntry, deep: bool) -> Result<(), ContractError> {
        let path = self.path.join(&expected.path);
        let differs = |problem: String| ContractError::FileDiffers { path: path.clone(), problem };
        let metadata = match std::fs::metadata(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Err(differs("missing".to_owned())),
            metadata => metadata.map_err(IoError::system("read", &path))?,
        };
        if metadata.len() != expected.bytes {
            return Err(differs(format!("{} bytes, but its manifest says {}", metadata.len(), expected.bytes)));
        }
        if deep {
            let found = sha256_file(&path)?;
            if found != expected.sha256 {
                return Err(differs(format!("sha256 is {found}, but its manifest says {}", expected.sha256)));
            }
        }
        Ok(())
    }
}

pub(super) fn read_if_there<T: serde::de::DeserializeOwned>(path: &Path) -> Result<Option<T>, IoError> {
    match read_json(path) {
        Ok(value) => Ok(Some(value)),
        // A recording by itself is no folder, and so has none of the three.
        Err(IoError::System { source, .. })
            if matches!(source.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) =>
        {
            Ok(None)
        }
        Err(error) => Err(error),
    }
}
