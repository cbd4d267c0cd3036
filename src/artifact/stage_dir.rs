//! A stage's folder: plan → shards → receipts → manifest.
//!
//! # Invariants
//!
//! - The plan is written before anything else and removed after everything else, so a receipt never outlives it.
//! - A shard counts by its receipt, and the first receipt wins: [`StageDir::commit_shard`] never replaces a good one.
//! - Only [`StageDir::begin`] and [`StageDir::clear`] remove work, and only for a process that has the run directory to
//!   itself. Processes that do shards side by side [`StageDir::join`] a plan.

use std::path::{Path, PathBuf};

use crate::artifact::plan::CONTRACT_VERSION;
use crate::artifact::{
    ContractError, FileEntry, IoError, Manifest, Plan, Receipt, create_json, read_json, sha256_file, write_json,
};
use crate::words::counted;

/// A stage's folder.
#[derive(Clone, Debug)]
pub struct StageDir {
    stage: String,
    path: PathBuf,
    /// Whether the files that receipts and manifests tell of may lie elsewhere.
    has_files_elsewhere: bool,
}

/// What became of a shard's receipt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Committed {
    /// It was written.
    Here,
    /// Another process had committed the shard before; its receipt stays.
    Before,
}

impl StageDir {
    /// The folder of a stage; nothing is read or written.
    pub fn new(stage: &str, path: impl Into<PathBuf>) -> Self {
        Self { stage: stage.to_owned(), path: path.into(), has_files_elsewhere: false }
    }

    /// The same folder where the files may lie elsewhere: that they are there in their sizes is taken from receipts and
    /// manifests. Where hashes are asked for, the files are looked at.
    #[must_use]
    pub fn with_files_elsewhere(self) -> Self {
        Self { has_files_elsewhere: true, ..self }
    }

    /// The stage.
    pub fn stage(&self) -> &str {
        &self.stage
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Where its plan is.
    pub fn plan_path(&self) -> PathBuf {
        self.path.join("plan.json")
    }

    /// Where the receipt of a shard is.
    pub fn receipt_path(&self, shard: u32) -> PathBuf {
        self.path.join(format!("receipts/shard-{shard:05}.json"))
    }

    /// Where its manifest is.
    pub fn manifest_path(&self) -> PathBuf {
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
        self.manifest()?.ok_or_else(|| self.unfinished())
    }

    /// Hash of the manifest file: the version of what the stage made.
    ///
    /// # Errors
    ///
    /// [`ContractError::Unfinished`] when there is none.
    pub fn version(&self) -> Result<String, ContractError> {
        let path = self.manifest_path();
        if path.is_file() { Ok(sha256_file(&path)?) } else { Err(self.unfinished()) }
    }

    fn unfinished(&self) -> ContractError {
        ContractError::Unfinished { stage: self.stage.clone(), path: self.manifest_path() }
    }

    /// The plan to work by: the folder's own where it is for the same work, whichever release of the program wrote it.
    ///
    /// # Errors
    ///
    /// When the folder's plan is there but not readable.
    pub fn settled(&self, plan: Plan) -> Result<Plan, IoError> {
        Ok(self.plan()?.filter(|own| own.difference(&plan).is_none()).unwrap_or(plan))
    }

    /// The receipt of a shard, if it was made by the plan of this id and its files are there in their sizes.
    ///
    /// # Errors
    ///
    /// When it is there but not readable.
    pub fn receipt(&self, plan_id: &str, shard: u32) -> Result<Option<Receipt>, IoError> {
        let receipt: Option<Receipt> = read_if_there(&self.receipt_path(shard))?;
        let of_plan = receipt.filter(|receipt| receipt.plan_id == plan_id && receipt.shard == shard);
        Ok(of_plan.filter(|receipt| receipt.files.iter().all(|file| self.check_file(file, false).is_ok())))
    }

    /// Begins (or goes on with) a plan: what another plan left is removed first. For one process alone.
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

    /// Goes on with a plan beside other processes: writes it where there is none, and removes nothing.
    ///
    /// # Errors
    ///
    /// [`ContractError::OtherPlan`] when the folder is of another plan; an I/O error when it cannot be written.
    pub fn join(&self, plan: &Plan) -> Result<(), ContractError> {
        if self.plan()?.is_none() && create_json(&self.plan_path(), plan)? {
            return Ok(());
        }
        match self.plan()?.and_then(|own| own.difference(plan)) {
            Some(difference) => Err(ContractError::OtherPlan { path: self.path.clone(), difference }),
            None => Ok(()),
        }
    }

    /// Writes the plan beside what is there already: for a folder that is made elsewhere and moved here when whole.
    ///
    /// # Errors
    ///
    /// When the folder cannot be written.
    pub fn write_plan(&self, plan: &Plan) -> Result<(), IoError> {
        write_json(&self.plan_path(), plan)
    }

    /// How many receipts there are, of whichever plan.
    ///
    /// # Errors
    ///
    /// When the folder cannot be listed.
    pub fn count_receipts(&self) -> Result<usize, IoError> {
        let folder = self.path.join("receipts");
        match std::fs::read_dir(&folder) {
            Ok(entries) => Ok(entries.count()),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(0),
            Err(source) => Err(IoError::system("list", folder)(source)),
        }
    }

    /// Removes everything the stage made: what says that something is done first, the plan last.
    ///
    /// # Errors
    ///
    /// When the system refuses.
    pub fn clear(&self) -> Result<(), IoError> {
        remove(&self.manifest_path(), |path| std::fs::remove_file(path))?;
        remove(&self.path.join("receipts"), |path| std::fs::remove_dir_all(path))?;
        remove(&self.path, |path| std::fs::remove_dir_all(path))
    }

    /// Commits a shard, whose files are already under their final names. A receipt of the same plan whose files are
    /// there stays as it is.
    ///
    /// # Errors
    ///
    /// When the receipt cannot be written.
    pub fn commit_shard(&self, receipt: &Receipt) -> Result<Committed, IoError> {
        let path = self.receipt_path(receipt.shard);
        if create_json(&path, receipt)? {
            return Ok(Committed::Here);
        }
        if self.receipt(&receipt.plan_id, receipt.shard)?.is_some() {
            return Ok(Committed::Before);
        }
        write_json(&path, receipt)?;
        Ok(Committed::Here)
    }

    /// Removes the receipt of a shard whose files are not whole.
    ///
    /// # Errors
    ///
    /// When the system refuses.
    pub fn forget_shard(&self, shard: u32) -> Result<(), IoError> {
        remove(&self.receipt_path(shard), |path| std::fs::remove_file(path))
    }

    /// Commits a shard in place of an earlier receipt. Where that told of other files, the stage is no longer finished.
    ///
    /// # Errors
    ///
    /// When the receipt cannot be written.
    pub fn replace_shard(&self, receipt: &Receipt) -> Result<(), IoError> {
        let before: Option<Receipt> = read_if_there(&self.receipt_path(receipt.shard))?;
        if before.as_ref() == Some(receipt) {
            return Ok(());
        }
        remove(&self.manifest_path(), |path| std::fs::remove_file(path))?;
        write_json(&self.receipt_path(receipt.shard), receipt)
    }

    /// The shards of a plan that have no receipt, or whose files have changed since.
    ///
    /// # Errors
    ///
    /// When a receipt is there but not readable.
    pub fn missing(&self, plan: &Plan) -> Result<Vec<u32>, IoError> {
        self.receipts(plan).map(|(_, missing)| missing)
    }

    /// The receipts of a plan, and the shards that have none or whose files have changed since.
    ///
    /// # Errors
    ///
    /// When a receipt is there but not readable.
    pub fn receipts(&self, plan: &Plan) -> Result<(Vec<Receipt>, Vec<u32>), IoError> {
        let plan_id = plan.id();
        let (mut receipts, mut missing) = (Vec::new(), Vec::new());
        for shard in 0..plan.shards {
            match self.receipt(&plan_id, shard)?.filter(|receipt| self.is_untouched(receipt)) {
                Some(receipt) => receipts.push(receipt),
                None => missing.push(shard),
            }
        }
        Ok((receipts, missing))
    }

    /// Whether the files of a receipt are those that it tells of: one that came to its name after the receipt, from
    /// another process that did the same shard, must have the same bytes.
    fn is_untouched(&self, receipt: &Receipt) -> bool {
        if self.has_files_elsewhere {
            return true;
        }
        let committed = changed_at(&self.receipt_path(receipt.shard));
        let is_older = |file: &FileEntry| changed_at(&self.path.join(&file.path)) <= committed;
        receipt.files.iter().all(|file| is_older(file) || self.check_file(file, true).is_ok())
    }

    /// The receipts of a plan, of which none is missing.
    ///
    /// # Errors
    ///
    /// [`ContractError::MissingShards`] when one is.
    pub fn all_receipts(&self, plan: &Plan) -> Result<Vec<Receipt>, ContractError> {
        let (receipts, missing) = self.receipts(plan)?;
        if missing.is_empty() {
            return Ok(receipts);
        }
        Err(ContractError::MissingShards { stage: self.stage.clone(), missing, total: plan.shards })
    }

    /// Commits the stage from its receipts, and the files that were made of all shards together.
    ///
    /// # Errors
    ///
    /// [`ContractError::MissingShards`] when a receipt is missing.
    pub fn commit(&self, plan: &Plan, of_all_shards: &[&str]) -> Result<Manifest, ContractError> {
        let receipts = self.all_receipts(plan)?;
        Ok(self.commit_receipts(plan, receipts, of_all_shards)?)
    }

    /// The same from the receipts of all shards, in their order, that were read before.
    ///
    /// # Errors
    ///
    /// When a file that was made of all shards cannot be read, or the manifest cannot be written.
    pub fn commit_receipts(
        &self,
        plan: &Plan,
        receipts: Vec<Receipt>,
        of_all_shards: &[&str],
    ) -> Result<Manifest, IoError> {
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

    /// Compares the files, by hash, with the manifest, if there is one.
    ///
    /// # Errors
    ///
    /// As [`StageDir::check_files`].
    pub fn check_whole(&self) -> Result<(), ContractError> {
        self.manifest()?.map_or(Ok(()), |manifest| self.check_files(&manifest, true))
    }

    /// Compares one file with what a manifest says of it, as [`StageDir::check_files`] does.
    ///
    /// # Errors
    ///
    /// [`ContractError::FileDiffers`] when it is not as it should be.
    pub fn check_file(&self, expected: &FileEntry, deep: bool) -> Result<(), ContractError> {
        if self.has_files_elsewhere && !deep {
            return Ok(());
        }
        let path = self.path.join(&expected.path);
        let differs = |problem: String| ContractError::FileDiffers { path: path.clone(), problem };
        let metadata = match std::fs::metadata(&path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Err(differs("missing".to_owned())),
            metadata => metadata.map_err(IoError::system("read", &path))?,
        };
        if metadata.len() != expected.bytes {
            return Err(differs(format!(
                "{}, but its manifest says {}",
                counted(metadata.len(), "byte"),
                expected.bytes
            )));
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

/// When a file came to its name or was last written, by the file system's own clock; it is only compared, and never
/// written. Where a system has no such time all are alike.
fn changed_at(path: &Path) -> Option<(i64, i64)> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt as _;
        let metadata = std::fs::metadata(path).ok()?;
        Some((metadata.ctime(), metadata.ctime_nsec()))
    }
    #[cfg(not(unix))]
    {
        let _none = path;
        None
    }
}

/// Removes something, if it is there.
fn remove(path: &Path, how: impl FnOnce(&Path) -> std::io::Result<()>) -> Result<(), IoError> {
    match how(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(IoError::system("remove", path)(source)),
        _removed => Ok(()),
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
