//! A run in a store: what is brought to this machine before work is done, and what is kept in the store behind it.
//!
//! # Input and output
//!
//! A run directory holds this machine's copy of what was needed here. In the store lie
//!
//! ```text
//! STAGE/plan.json, STAGE/receipts/*.json, STAGE/manifest.json    under the names that they have in a run directory
//! sha256/HASH                                                    every file that a receipt or a manifest names
//! failed/, costs/                                                as in a run directory
//! ```
//!
//! # Invariants
//!
//! A name is created once, on the condition that nothing has it: the first plan, receipt and manifest win. Files come
//! before the receipt that names them, receipts before the manifest; so what is named is there. Files are brought by their
//! hashes. Nothing is removed.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use rayon::iter::{IntoParallelRefIterator as _, ParallelIterator as _};
use serde::de::DeserializeOwned;

use crate::artifact::{self, ContractError, FileEntry, IoError, Manifest, Plan, Receipt, StageDir};
use crate::pipeline::layout::FOLDERS;
use crate::pipeline::unit::{Context, Looked, Unit};
use crate::pipeline::{PipelineError, RunDir, failures};
use crate::store::{Creation, Store};

/// A run in a store, and the run directory that is this machine's copy of a part of it.
#[derive(Clone, Copy)]
pub(super) struct Stored<'a> {
    store: &'a dyn Store,
    run: &'a RunDir,
}

/// Brings what tells how far an experiment is into a run directory of its own: plans, receipts, manifests, failures.
///
/// # Errors
///
/// When the store cannot be read, or the files cannot be written.
pub fn bring_records(store: &dyn Store, run: &RunDir) -> Result<(), PipelineError> {
    Stored { store, run }.bring_all_records()
}

impl<'a> Stored<'a> {
    /// The run in a store, if it is in one.
    pub(super) fn of(context: &Context<'a>) -> Option<Self> {
        let store = context.options.store.as_ref()?;
        Some(Self { store: store.as_ref(), run: context.dir })
    }

    /// The name in the store of what lies in the run directory.
    fn name(&self, path: &Path) -> String {
        let relative = path.strip_prefix(self.run.root()).unwrap_or(path);
        relative.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
    }

    fn bring_all_records(&self) -> Result<(), PipelineError> {
        let mut names = Vec::new();
        for folder in FOLDERS.into_iter().chain([failures::FOLDER]) {
            names.extend(self.store.list(folder)?);
        }
        let finished: BTreeSet<&str> = names.iter().filter_map(|name| name.strip_suffix("/manifest.json")).collect();
        // What is finished needs no receipts to tell it.
        let is_needed = |name: &&String| !name.rsplit_once("/receipts/").is_some_and(|(dir, _)| finished.contains(dir));
        self.bring(&names.iter().filter(is_needed).cloned().collect::<Vec<_>>())
    }

    /// Brings small files under their names.
    fn bring(&self, names: &[String]) -> Result<(), PipelineError> {
        for (name, found) in names.iter().zip(self.store.read_all(names)?) {
            if let Some(content) = found {
                lay(&self.below(self.run.root(), name)?, &content)?;
            }
        }
        Ok(())
    }

    /// Where a file that the store names lies in a folder.
    fn below(&self, folder: &Path, file: &str) -> Result<PathBuf, ContractError> {
        let path = Path::new(file);
        if path.components().all(|part| matches!(part, Component::Normal(_))) && !file.is_empty() {
            return Ok(folder.join(path));
        }
        let problem = "the name leads out of the run; allowed are names below it".to_owned();
        Err(ContractError::FileDiffers { path: self.store.path(file), problem })
    }

    /// Brings the plan and manifest of a unit, and of all that it reads and looks at, which must be finished.
    ///
    /// # Errors
    ///
    /// [`ContractError::Unfinished`] when something that is read is not; [`ContractError::OtherPlan`] when the run
    /// directory holds what was made by another plan than the store.
    pub(super) fn bring_plans(&self, unit: &dyn Unit) -> Result<(), PipelineError> {
        let looked_at = unit.looks_at(self.run).into_iter().filter_map(|looked| match looked {
            Looked::Files(dir) | Looked::Record(dir) => Some(dir),
            Looked::Notes(_) => None,
        });
        let mut dirs = unit.reads(self.run);
        dirs.extend(looked_at);
        let n_inputs = dirs.len();
        dirs.push(unit.dir(self.run));
        let names = dirs.iter().flat_map(|dir| [dir.plan_path(), dir.manifest_path()]);
        let names: Vec<String> = names.map(|path| self.name(&path)).collect();
        let found = self.store.read_all(&names)?;
        for (idx, (dir, record)) in dirs.iter().zip(found.chunks_exact(2)).enumerate() {
            let (plan, manifest) = (&record[0], &record[1]);
            if idx < n_inputs && manifest.is_none() {
                let (stage, path) = (dir.stage().to_owned(), self.store.path(&names[2 * idx + 1]));
                return Err(ContractError::Unfinished { stage, path }.into());
            }
            if let Some(plan) = plan {
                self.bring_plan(dir, plan)?;
            }
            if let Some(manifest) = manifest {
                lay(&dir.manifest_path(), manifest)?;
            }
        }
        Ok(())
    }

    fn bring_plan(&self, dir: &StageDir, content: &[u8]) -> Result<(), PipelineError> {
        let plan: Plan = self.parse(&dir.plan_path(), content)?;
        if let Some(difference) = dir.plan()?.and_then(|own| own.difference(&plan)) {
            let difference = format!("{difference} in the store; a fresh --out takes a copy of what is there");
            return Err(ContractError::OtherPlan { path: dir.path().to_owned(), difference }.into());
        }
        Ok(lay(&dir.plan_path(), content)?)
    }

    fn parse<T: DeserializeOwned>(&self, path: &Path, content: &[u8]) -> Result<T, IoError> {
        let path = self.store.path(&self.name(path));
        serde_json::from_slice(content).map_err(|source| IoError::Json { path, source })
    }

    /// The plan in the store, which is this one where there is none yet.
    ///
    /// # Errors
    ///
    /// [`ContractError::OtherPlan`] when the store has one of other work.
    pub(super) fn settle(&self, dir: &StageDir, plan: &Plan) -> Result<Plan, PipelineError> {
        let path = dir.plan_path();
        let name = self.name(&path);
        let found = match self.store.read(&name)? {
            Some(found) => found,
            None => {
                let content = artifact::to_json(&path, plan)?;
                self.store.create(&name, &content)?;
                self.store.read(&name)?.unwrap_or(content)
            }
        };
        let kept: Plan = self.parse(&path, &found)?;
        match kept.difference(plan) {
            Some(difference) => {
                let path = self.store.path(&self.name(dir.path()));
                let difference = format!("{difference}; nothing in a store is removed: begin anew in another --store");
                Err(ContractError::OtherPlan { path, difference }.into())
            }
            None => Ok(kept),
        }
    }

    /// Brings the receipts of shards, by the shards that have one.
    pub(super) fn receipts(
        &self,
        dir: &StageDir,
        plan: &Plan,
        shards: &[u32],
    ) -> Result<BTreeMap<u32, Receipt>, PipelineError> {
        let plan_id = plan.id();
        let names: Vec<String> = shards.iter().map(|&shard| self.name(&dir.receipt_path(shard))).collect();
        let mut receipts = BTreeMap::new();
        for ((&shard, name), found) in shards.iter().zip(&names).zip(self.store.read_all(&names)?) {
            let Some(content) = found else { continue };
            let path = dir.receipt_path(shard);
            let receipt: Receipt = self.parse(&path, &content)?;
            if (receipt.plan_id.as_str(), receipt.shard) != (plan_id.as_str(), shard) {
                let problem = format!("is of shard {} of plan {}", receipt.shard, receipt.plan_id);
                return Err(ContractError::FileDiffers { path: self.store.path(name), problem }.into());
            }
            lay(&path, &content)?;
            receipts.insert(shard, receipt);
        }
        Ok(receipts)
    }

    /// Whether a unit is committed.
    pub(super) fn is_committed(&self, dir: &StageDir) -> Result<bool, PipelineError> {
        Ok(self.store.read(&self.name(&dir.manifest_path()))?.is_some())
    }

    /// Brings all of a stage, the manifest last; `None` when it is not finished.
    ///
    /// # Errors
    ///
    /// [`ContractError::OtherPlan`] when the run directory holds what was made by another plan.
    pub(super) fn bring_stage(&self, dir: &StageDir) -> Result<Option<Manifest>, PipelineError> {
        let (plan_path, manifest_path) = (dir.plan_path(), dir.manifest_path());
        let found = self.store.read_all(&[self.name(&plan_path), self.name(&manifest_path)])?;
        let [Some(plan_content), Some(manifest_content)] = found.as_slice() else { return Ok(None) };
        let plan: Plan = self.parse(&plan_path, plan_content)?;
        let manifest: Manifest = self.parse(&manifest_path, manifest_content)?;
        self.bring_plan(dir, plan_content)?;
        self.receipts(dir, &plan, &(0..plan.shards).collect::<Vec<_>>())?;
        self.bring_files(dir, &manifest.files.iter().collect::<Vec<_>>())?;
        lay(&manifest_path, manifest_content)?;
        Ok(Some(manifest))
    }

    /// Brings all files that a unit reads and looks at.
    pub(super) fn bring_inputs(&self, unit: &dyn Unit) -> Result<(), PipelineError> {
        let mut dirs = unit.reads(self.run);
        for looked in unit.looks_at(self.run) {
            match looked {
                Looked::Files(dir) => dirs.push(dir),
                Looked::Record(_) => {}
                Looked::Notes(folder) => self.bring(&self.store.list(folder)?)?,
            }
        }
        for dir in dirs {
            let manifest = dir.finished()?;
            self.bring_files(&dir, &manifest.files.iter().collect::<Vec<_>>())?;
        }
        Ok(())
    }

    /// Brings files of a stage, but for those that are here.
    pub(super) fn bring_files(&self, dir: &StageDir, files: &[&FileEntry]) -> Result<(), PipelineError> {
        files.par_iter().try_for_each(|file| {
            let path = self.below(dir.path(), &file.path)?;
            if dir.check_file(file, true).is_err() {
                self.store.fetch(&content_of(file), &path, &file.sha256)?;
            }
            Ok(())
        })
    }

    /// Keeps a shard that is done here: its files, then its receipt; false when another process was first.
    pub(super) fn keep_shard(&self, dir: &StageDir, shard: u32) -> Result<bool, PipelineError> {
        let path = dir.receipt_path(shard);
        let content = artifact::read(&path)?;
        let receipt: Receipt = self.parse(&path, &content)?;
        self.keep_files(dir, &receipt.files.iter().collect::<Vec<_>>())?;
        self.keep_record(&path, &content)
    }

    /// Keeps what a unit made of all shards together, then its manifest.
    pub(super) fn keep_manifest(
        &self,
        dir: &StageDir,
        manifest: &Manifest,
        tables: &[&str],
    ) -> Result<(), PipelineError> {
        let is_table = |file: &&FileEntry| tables.contains(&file.path.as_str());
        self.keep_files(dir, &manifest.files.iter().filter(is_table).collect::<Vec<_>>())?;
        let path = dir.manifest_path();
        self.keep_record(&path, &artifact::read(&path)?)?;
        Ok(())
    }

    fn keep_files(&self, dir: &StageDir, files: &[&FileEntry]) -> Result<(), PipelineError> {
        for file in files {
            self.store.keep(&dir.path().join(&file.path), &content_of(file), &file.sha256)?;
        }
        Ok(())
    }

    /// Keeps a receipt or manifest, or takes over that of another process that was first.
    fn keep_record(&self, path: &Path, content: &[u8]) -> Result<bool, PipelineError> {
        let name = self.name(path);
        if self.store.create(&name, content)? == Creation::Stored {
            return Ok(true);
        }
        if let Some(first) = self.store.read(&name)? {
            lay(path, &first)?;
        }
        Ok(false)
    }

    /// Brings a note that may be there, before it is written anew.
    pub(super) fn bring_note(&self, path: &Path) -> Result<(), PipelineError> {
        self.bring(&[self.name(path)])
    }

    /// Keeps a note, in place of an earlier one.
    pub(super) fn keep_note(&self, path: &Path) -> Result<(), PipelineError> {
        Ok(self.store.replace(&self.name(path), &artifact::read(path)?)?)
    }
}

/// Where a file's content lies in a store.
fn content_of(file: &FileEntry) -> String {
    format!("sha256/{}", file.sha256)
}

/// Writes a file unless it has this content.
fn lay(path: &Path, content: &[u8]) -> Result<(), IoError> {
    let is_there = std::fs::read(path).is_ok_and(|found| found == content);
    if is_there { Ok(()) } else { artifact::write(path, content) }
}
