//! What stages are made of: units, each of which makes one folder by one plan, shard by shard.
//!
//! The runner knows stages and asks them for their units; a unit knows what it is about; neither knows the runner.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use crate::artifact::{Committed, FileEntry, IoError, Manifest, Plan, Receipt, StageDir};
use crate::pipeline::{Options, PipelineError, RunDir, Stage};
use crate::progress::Progress;

/// One thing a stage makes. What it is, and of how many shards, follows from the pipeline file alone.
pub(super) trait Unit: Send + Sync {
    /// The stage.
    fn stage(&self) -> Stage;

    /// Version of the stage: raised when the same settings and inputs make other files.
    fn stage_version(&self) -> u32;

    /// A model, a model's suite, or the stage's own name.
    fn name(&self) -> String;

    /// The folder that it makes.
    fn dir(&self, run: &RunDir) -> StageDir;

    /// How many shards it has.
    fn shards(&self) -> u32 {
        1
    }

    /// How much work a shard is.
    fn amount(&self, shard: u32) -> Amount;

    /// The folders that it reads.
    fn reads(&self, run: &RunDir) -> Vec<StageDir>;

    /// What it looks at besides; its versions follow from what is read.
    fn looks_at(&self, _run: &RunDir) -> Vec<Looked> {
        Vec::new()
    }

    /// What it reads: hash by the stage's name.
    ///
    /// # Errors
    ///
    /// [`crate::artifact::ContractError::Unfinished`] when a stage must come first.
    fn inputs(&self, run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError>;

    /// Its settings, resolved.
    fn settings(&self) -> Value;

    /// Whether the folder is made elsewhere and appears whole; otherwise its plan is there before its first shard.
    fn appears_whole(&self) -> bool {
        false
    }

    /// Reads what its shards share.
    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError>;

    /// Writes the files that are made of all shards together, whose receipts are given, and names them.
    fn gather(&self, _job: &Job<'_>, _receipts: &[Receipt]) -> Result<Vec<&'static str>, PipelineError> {
        Ok(Vec::new())
    }

    /// Whether a file of a shard is read by [`Unit::gather`].
    fn gathers(&self, _file: &str) -> bool {
        false
    }

    /// What was made, in words.
    fn told(&self, _manifest: &Manifest) -> String {
        "done".to_owned()
    }
}

/// A folder that is looked at.
pub(super) enum Looked {
    /// With all its files.
    Files(StageDir),
    /// At its plan and manifest alone.
    Record(StageDir),
    /// Small files of a folder of the run directory that is no stage's.
    Notes(&'static str),
}

/// How much work something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Amount {
    pub(super) count: u64,
    /// What is counted, e.g. `episode`.
    pub(super) of: &'static str,
}

/// Makes the shards of a unit.
pub(super) trait Worker: Sync {
    /// Makes the files of a shard under their final names; `None` when another process has committed it meanwhile.
    fn shard(&self, shard: u32) -> Result<Option<Made>, PipelineError>;
}

/// What was made of a shard.
pub(super) struct Made {
    pub(super) episodes: u64,
    /// How many of them failed.
    pub(super) failed: u64,
    pub(super) files: Vec<FileEntry>,
    /// The same in words, where the manifest does not tell it.
    pub(super) told: Option<String>,
}

impl Made {
    /// Files without episodes.
    pub(super) fn files<'f>(dir: &StageDir, files: impl IntoIterator<Item = &'f str>) -> Result<Self, IoError> {
        let files: Result<_, _> = files.into_iter().map(|file| FileEntry::of(dir.path(), file)).collect();
        Ok(Self { episodes: 0, failed: 0, files: files?, told: None })
    }
}

/// Opens a unit once every file that it reads is, by its hash, as it was made: nothing is made of what was damaged.
///
/// # Errors
///
/// [`crate::artifact::ContractError::FileDiffers`] for the first file that is not, and those of the unit itself.
pub(super) fn open<'j>(unit: &'j dyn Unit, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
    for dir in unit.reads(job.context.dir) {
        dir.check_files(&dir.finished()?, true)?;
    }
    unit.open(job)
}

/// The plan of a unit: the folder's own where that is for the same work.
///
/// # Errors
///
/// [`crate::artifact::ContractError::Unfinished`] when a stage must come first.
pub(super) fn plan(unit: &dyn Unit, run: &RunDir) -> Result<Plan, PipelineError> {
    Ok(unit.dir(run).settled(fresh_plan(unit, unit.inputs(run)?))?)
}

/// The plan of a unit that reads these inputs.
pub(super) fn fresh_plan(unit: &dyn Unit, inputs: BTreeMap<String, String>) -> Plan {
    let plan = Plan::new(unit.stage().name(), unit.shards(), inputs, unit.settings());
    plan.of_stage_version(unit.stage_version())
}

/// What every stage is given.
pub(super) struct Context<'a> {
    pub(super) dir: &'a RunDir,
    pub(super) options: &'a Options,
}

impl Context<'_> {
    /// Fails once the user has pressed Ctrl-C.
    pub(super) fn go_on(&self) -> Result<(), PipelineError> {
        if self.options.stop.load(Ordering::Relaxed) { Err(PipelineError::Interrupted) } else { Ok(()) }
    }

    /// See [`plan`].
    pub(super) fn plan(&self, unit: &dyn Unit) -> Result<Plan, PipelineError> {
        plan(unit, self.dir)
    }

    fn progress(&self, unit: &dyn Unit, shards: &[u32]) -> Progress {
        if !self.options.progress || shards.is_empty() {
            return Progress::hidden();
        }
        let experiment = self.options.experiment.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
        let amounts = shards.iter().map(|&shard| unit.amount(shard));
        let total = amounts.clone().map(|amount| amount.count).sum();
        let of = amounts.map(|amount| amount.of).next().unwrap_or_default();
        Progress::new(&format!("{experiment}{}", unit.name()), total, of)
    }
}

/// Shards of a unit that are to be done now.
pub(super) struct Job<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) dir: StageDir,
    pub(super) plan: Plan,
    pub(super) progress: Progress,
    plan_id: String,
    /// What was committed here.
    done: Mutex<BTreeSet<u32>>,
    /// Whether shards that are done are done again, in place of what is there.
    again: bool,
}

impl<'a> Job<'a> {
    pub(super) fn new(context: &'a Context<'a>, unit: &dyn Unit, plan: Plan, shards: &[u32], again: bool) -> Self {
        let progress = context.progress(unit, shards);
        Self { context, dir: unit.dir(context.dir), plan_id: plan.id(), plan, progress, done: Mutex::default(), again }
    }

    /// The receipt of a shard that is done.
    pub(super) fn receipt(&self, shard: u32) -> Result<Option<Receipt>, IoError> {
        self.dir.receipt(&self.plan_id, shard)
    }

    /// Whether there is nothing left to do for a shard: asked before it is begun, and by whoever makes it before its
    /// files take their names.
    pub(super) fn is_done(&self, shard: u32) -> Result<bool, IoError> {
        Ok(!self.again && self.receipt(shard)?.is_some())
    }

    /// What says of a shard that it is done.
    pub(super) fn receipt_of(&self, shard: u32, made: &Made) -> Receipt {
        let Made { episodes, failed, ref files, .. } = *made;
        Receipt { plan_id: self.plan_id.clone(), shard, episodes, failed, files: files.clone() }
    }

    /// Says that a shard is done.
    pub(super) fn commit_shard(&self, shard: u32, made: &Made) -> Result<(), IoError> {
        let receipt = self.receipt_of(shard, made);
        let by_whom = if self.again {
            self.dir.replace_shard(&receipt).map(|()| Committed::Here)
        } else {
            self.dir.commit_shard(&receipt)
        };
        if by_whom? == Committed::Here {
            self.note_done(shard);
        }
        Ok(())
    }

    /// Notes that another process was first after all.
    pub(super) fn note_lost(&self, shard: u32) {
        self.done.lock().unwrap_or_else(PoisonError::into_inner).remove(&shard);
    }

    /// Notes that a shard was done here.
    pub(super) fn note_done(&self, shard: u32) {
        self.done.lock().unwrap_or_else(PoisonError::into_inner).insert(shard);
    }

    /// The shards that were committed here.
    pub(super) fn done(&self) -> BTreeSet<u32> {
        self.done.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// What a plan that is kept in a recording says.
    pub(super) fn plan_json(&self) -> String {
        serde_json::to_string(&self.plan).unwrap_or_default()
    }
}
