//! What is handed over: pipeline, program, lists of items and scripts, kept in the run directory.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::artifact::{IoError, PARTIAL_PREFIX, create_dir, read_json, sha256_file, write, write_json};
use crate::cluster::copies::Copies;
use crate::cluster::script;
use crate::pipeline::{self, Item, ItemRanges, ItemState, PipelineError, PipelineFile, RunDir, Stage, Stale};
use crate::store::{AddressError, StoreAddress, StoreError};
use crate::words::shell_path;

/// The folder in a run directory.
pub(super) const FOLDER: &str = "submit";
/// What says of what a submission is.
const ABOUT: &str = "submit.json";
const VERSION: u32 = 1;

/// Who runs the tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// Slurm's job arrays.
    Slurm,
    /// Processes of this machine.
    Local,
}

impl Engine {
    /// Every engine.
    pub const ALL: [Self; 2] = [Self::Slurm, Self::Local];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Slurm => "slurm",
            Self::Local => "local",
        }
    }
}

impl fmt::Display for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Engine {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|engine| engine.name() == word);
        known.ok_or_else(|| format!("unknown engine {word:?}; allowed are {}", Self::ALL.map(Self::name).join(", ")))
    }
}

/// What the command line chooses.
#[derive(Clone, Debug)]
pub struct SubmitOptions {
    /// Who runs the tasks.
    pub engine: Engine,
    /// Tasks that run at a time; for Slurm as many as it likes when left out.
    pub max_running: Option<u32>,
    /// Items that a task does one after the other; by the stage when left out.
    pub per_task: Option<u32>,
    /// Arguments for every `sbatch`.
    pub sbatch_args: Vec<String>,
    /// Where the run is, if it is in a store; the run directory then holds what is handed over alone.
    pub store: Option<StoreAddress>,
    /// Hand over another pipeline or program than before.
    pub force: bool,
}

/// Why work cannot be handed over.
#[derive(Debug, thiserror::Error)]
pub enum ClusterError {
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Io(#[from] IoError),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Pipeline(Box<PipelineError>),
    #[expect(missing_docs, reason = "wraps an error that documents itself")]
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Another pipeline or program was handed over before.
    #[error("{} was made with another {what}; once none of its tasks is left, --force hands over this one in its place", path.display())]
    Other {
        /// The earlier submission.
        path: PathBuf,
        /// `pipeline`, `ntp` or `store`.
        what: &'static str,
    },
    /// A part of the run was made by another plan.
    #[error(
        "{} was begun by another plan: {stale}; ntp run {} --out {} makes it anew, and so does --begin --force with each \
         stage whose settings differ",
        path.display(),
        shell_path(pipeline),
        shell_path(path)
    )]
    Stale {
        /// The run directory.
        path: PathBuf,
        /// What differs.
        stale: Stale,
        /// The pipeline file.
        pipeline: PathBuf,
    },
    /// The program was told to stop while tasks ran as processes of this machine.
    #[error("interrupted: tasks were told to end; submitting again hands over what is left")]
    Interrupted,
    /// Nothing was handed over.
    #[error("nothing was submitted into {}: no submit/submit.json; ntp items PIPELINE with --out RUN or --store URL lists items of any run", path.display())]
    NotSubmitted {
        /// The run directory.
        path: PathBuf,
    },
    /// What is kept of a submission names no store.
    #[error(transparent)]
    NoStore(#[from] AddressError),
    /// The script cannot be written.
    #[error("the template of a script: {0}")]
    Template(#[from] minijinja::Error),
}

impl From<PipelineError> for ClusterError {
    fn from(error: PipelineError) -> Self {
        Self::Pipeline(Box::new(error))
    }
}

impl ClusterError {
    /// Whether the command is at fault, and nothing was written.
    pub fn is_usage(&self) -> bool {
        match self {
            Self::Other { .. } | Self::Stale { .. } => true,
            Self::Pipeline(error) => error.is_usage(),
            Self::Store(error) => error.is_usage(),
            Self::Interrupted | Self::Io(_) | Self::NotSubmitted { .. } | Self::NoStore(_) | Self::Template(_) => false,
        }
    }
}

/// What a submission is of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct About {
    version: u32,
    /// The pipeline file, below `submit/pipeline`.
    pub(super) pipeline: PathBuf,
    pipeline_sha256: String,
    ntp_sha256: String,
    engine: Engine,
    /// Where the run is, if it is in a store.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) store: Option<String>,
}

impl About {
    /// What was handed over in a run directory.
    pub(super) fn read(run: &Path) -> Result<Self, ClusterError> {
        let path = run.join(FOLDER).join(ABOUT);
        if !path.is_file() {
            return Err(ClusterError::NotSubmitted { path: run.to_owned() });
        }
        Ok(read_json(&path)?)
    }

    /// The pipeline file as it was handed over.
    pub(super) fn pipeline_file(&self, run: &Path) -> PathBuf {
        run.join(FOLDER).join("pipeline").join(&self.pipeline)
    }
}

/// Work that was written down for an engine.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Submission {
    /// The script that hands it over.
    pub script: PathBuf,
    /// What is left, a line a stage of an experiment.
    pub stages: Vec<SubmittedStage>,
}

/// What is left of a stage.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SubmittedStage {
    /// The experiment's run directory below that of the whole; `.` for one by itself.
    pub folder: String,
    /// The stage.
    pub stage: Stage,
    /// Items that are left.
    pub items: usize,
    /// Tasks that they are done by.
    pub tasks: usize,
}

impl Submission {
    /// Writes what is left of a pipeline into `submit/` of its run directory. `program` is copied there, so that tasks
    /// which wait see neither an edited pipeline nor a new build.
    ///
    /// # Errors
    ///
    /// [`ClusterError::Other`] when another pipeline or program was handed over before and `force` is not given.
    pub fn write(
        file: &PipelineFile,
        run: &Path,
        program: &Path,
        options: &SubmitOptions,
    ) -> Result<Self, ClusterError> {
        let folder = run.join(FOLDER);
        check_models(file)?;
        check_store(file, options)?;
        // A store that cannot be opened is told of before anything is written.
        options.store.as_ref().map(StoreAddress::open).transpose()?;
        let store = options.store.as_ref().map(whole_name).transpose()?;
        let copies = Copies::of(file)?;
        let (pipeline_sha256, ntp_sha256) = (copies.hash()?, sha256_file(program)?);
        let before: Option<About> = About::read(run).ok();
        let other = |what| ClusterError::Other { path: folder.clone(), what };
        if let Some(before) = before.as_ref().filter(|_| !options.force) {
            if before.pipeline_sha256 != pipeline_sha256 {
                return Err(other("pipeline"));
            }
            if before.ntp_sha256 != ntp_sha256 {
                return Err(other("ntp"));
            }
            if before.store != store {
                return Err(other("store"));
            }
        }
        if options.store.is_none() {
            check_plans(file, run)?;
        }
        if before.is_none_or(|before| before.ntp_sha256 != ntp_sha256) {
            copy_program(program, &folder.join("ntp"))?;
        }
        let pipeline = copies.write(&folder.join("pipeline"))?;
        let about = About { version: VERSION, pipeline, pipeline_sha256, ntp_sha256, engine: options.engine, store };
        write_json(&folder.join(ABOUT), &about)?;
        let copy = tempfile::tempdir().map_err(IoError::system("create a folder for", run))?;
        let chains = chains(file, run, &run_dir(run, about.store.as_deref(), copy.path())?, options)?;
        write(&folder.join("task.sh"), script::TASK.as_bytes())?;
        let path = folder.join("submit.sh");
        write(&path, script::submit(file, &about, &chains, options)?.as_bytes())?;
        let stages = chains.into_iter().flat_map(|chain| chain.stages).filter(|stage| stage.items > 0).collect();
        Ok(Self { script: path, stages })
    }
}

/// The stages of an experiment, in order.
pub(super) struct Chain {
    pub(super) folder: String,
    /// The experiment's pipeline file, below `submit/pipeline`.
    pub(super) pipeline: PathBuf,
    pub(super) stages: Vec<SubmittedStage>,
}

/// What was made by another plan is never joined by items, whoever hands them over.
fn check_plans(file: &PipelineFile, run: &Path) -> Result<(), ClusterError> {
    match pipeline::stale(file, &RunDir::new(run), Stage::Report).into_iter().next() {
        None => Ok(()),
        Some(stale) => Err(ClusterError::Stale { path: run.to_owned(), stale, pipeline: file.path().to_owned() }),
    }
}

/// A model that learns from several experiments belongs to none of the chains.
fn check_models(file: &PipelineFile) -> Result<(), PipelineError> {
    match file {
        PipelineFile::Study(study) if !study.spec.models.is_empty() => Err(PipelineError::Value {
            path: study.path.clone(),
            key: "models".to_owned(),
            problem: "a study with models of its own cannot be submitted: they learn from several experiments, and ntp run alone makes them"
                .to_owned(),
        }),
        PipelineFile::Study(_) | PipelineFile::Experiment(_) => Ok(()),
    }
}

fn check_store(file: &PipelineFile, options: &SubmitOptions) -> Result<(), PipelineError> {
    match (file, &options.store) {
        (PipelineFile::Study(study), Some(_)) => Err(PipelineError::Value {
            path: study.path.clone(),
            key: "--store".to_owned(),
            problem: "is of one experiment: give its own file".to_owned(),
        }),
        _ => Ok(()),
    }
}

/// A place as every folder would name it.
fn whole_name(place: &StoreAddress) -> Result<String, IoError> {
    match place {
        StoreAddress::Folder(path) => {
            let whole = std::path::absolute(path).map_err(IoError::system("find", path))?;
            Ok(whole.to_string_lossy().into_owned())
        }
        StoreAddress::Bucket(url) => Ok(url.to_string()),
    }
}

/// Where it is told how far a run is: in its directory, or in a copy of what a store tells.
pub(super) fn run_dir(run: &Path, store: Option<&str>, copy: &Path) -> Result<RunDir, ClusterError> {
    let Some(store) = store else { return Ok(RunDir::new(run)) };
    let place: StoreAddress = store.parse()?;
    let records = RunDir::new(copy).with_files_elsewhere();
    pipeline::bring_records(place.open()?.as_ref(), &records)?;
    Ok(records)
}

/// What is left of each experiment, with a list a stage of the items of each task.
fn chains(
    file: &PipelineFile,
    run: &Path,
    records: &RunDir,
    options: &SubmitOptions,
) -> Result<Vec<Chain>, ClusterError> {
    let copied = Copies::of(file)?;
    let mut chains = Vec::new();
    for (pipeline, own) in file.experiments(records) {
        let folder = match file {
            PipelineFile::Experiment(_) => ".".to_owned(),
            PipelineFile::Study(_) => pipeline.spec.name.clone(),
        };
        let mut stages = Vec::new();
        for stage in Stage::ALL {
            let left = pipeline::items(pipeline, &own, stage)?.into_iter().filter(|item| item.state != ItemState::Done);
            let left: Vec<Item> = left.collect();
            let tasks = lines(&left, options.per_task.unwrap_or_else(|| usual_per_task(stage)));
            let path = run.join(FOLDER).join("items").join(&folder).join(stage.name());
            write(&path, tasks.iter().map(|line| format!("{line}\n")).collect::<String>().as_bytes())?;
            stages.push(SubmittedStage { folder: folder.clone(), stage, items: left.len(), tasks: tasks.len() });
        }
        chains.push(Chain { folder, pipeline: copied.place(&pipeline.path)?, stages });
    }
    Ok(chains)
}

/// The items of each task, as `--items` takes them.
fn lines(left: &[Item], per_task: u32) -> Vec<String> {
    let tasks = left.chunks(per_task.max(1) as usize);
    tasks.map(|items| items.iter().map(|item| item.item).collect::<ItemRanges>().to_string()).collect()
}

/// How many items make a task worth starting: a shard of demonstrations or rollouts takes a second, a training minutes.
fn usual_per_task(stage: Stage) -> u32 {
    match stage {
        Stage::Generate => 100,
        Stage::Rollout => 40,
        Stage::Tasks | Stage::Convert | Stage::Train | Stage::Report => 1,
    }
}

fn copy_program(from: &Path, to: &Path) -> Result<(), IoError> {
    create_dir(to.parent().unwrap_or(Path::new(".")))?;
    // A task that runs the program that lies there keeps it: the name goes to another file.
    let folder = to.parent().unwrap_or(Path::new("."));
    let beside = tempfile::Builder::new().prefix(PARTIAL_PREFIX).tempfile_in(folder);
    let beside = beside.map_err(IoError::system("create a temporary file in", folder))?.into_temp_path();
    std::fs::copy(from, &beside).map_err(IoError::system("write a copy of this program to", &beside))?;
    beside.persist(to).map_err(|error| IoError::system("rename to", to)(error.error))
}
