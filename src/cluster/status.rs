//! How far a submitted run is, from receipts and noted failures alone.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::artifact::IoError;
use crate::cluster::submission::{About, ClusterError, FOLDER, run_dir};
use crate::pipeline::{self, Item, ItemRanges, ItemState, PipelineFile, Stage};

/// How far a run is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct RunStatus {
    /// Stage by stage of each experiment.
    pub stages: Vec<StageStatus>,
}

/// How far a stage is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StageStatus {
    /// Which experiment of a study; `None` for one by itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<String>,
    /// The stage.
    pub stage: Stage,
    /// Items in all.
    pub items: usize,
    /// Items that are done.
    pub done: usize,
    /// Items that were not done yet and have not failed.
    pub left: Vec<u64>,
    /// Items that failed, and were not done since.
    pub failed: Vec<FailedItem>,
}

/// An item that failed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FailedItem {
    /// Its number.
    pub item: u64,
    /// What it is a part of.
    pub unit: String,
    /// What was said the last time.
    pub message: String,
    /// How often it has failed.
    pub attempts: u32,
    /// Where it ran, if that is known.
    pub node: Option<String>,
    /// What its task wrote, if it is there.
    pub log: Option<PathBuf>,
}

impl RunStatus {
    /// Whether every item is done.
    pub fn is_done(&self) -> bool {
        self.stages.iter().all(|stage| stage.done == stage.items)
    }
}

/// How far a submitted run is.
///
/// # Errors
///
/// [`ClusterError::NotSubmitted`] when nothing was handed over; otherwise when something cannot be read.
pub fn status(run: &Path) -> Result<RunStatus, ClusterError> {
    let about = About::read(run)?;
    let file = PipelineFile::load(&about.pipeline_file(run))?;
    let copy = tempfile::tempdir().map_err(IoError::system("create a folder for", run))?;
    let mut stages = Vec::new();
    for (pipeline, own) in file.experiments(&run_dir(run, about.store.as_deref(), copy.path())?) {
        let experiment = matches!(file, PipelineFile::Study(_)).then(|| pipeline.spec.name.clone());
        for stage in Stage::ALL {
            let folder = experiment.as_deref().unwrap_or(".");
            let items = pipeline::items(pipeline, &own, stage)?;
            stages.push(stage_status(run, folder, stage, items).of(experiment.clone()));
        }
    }
    Ok(RunStatus { stages })
}

fn stage_status(run: &Path, folder: &str, stage: Stage, items: Vec<Item>) -> StageStatus {
    let of = |state| items.iter().filter(move |item| item.state == state);
    let log = |item| log_of(run, folder, stage, item);
    let failed = of(ItemState::Failed).filter_map(|item| {
        let failure = item.failure.clone()?;
        Some(FailedItem {
            item: item.item,
            unit: item.unit.clone(),
            message: failure.message,
            attempts: failure.attempts,
            node: failure.node,
            log: log(item.item),
        })
    });
    StageStatus {
        experiment: None,
        stage,
        items: items.len(),
        done: of(ItemState::Done).count(),
        left: of(ItemState::Left).map(|item| item.item).collect(),
        failed: failed.collect(),
    }
}

impl StageStatus {
    fn of(self, experiment: Option<String>) -> Self {
        Self { experiment, ..self }
    }
}

/// What the task of an item wrote: it is named by the first item of the task's line.
fn log_of(run: &Path, folder: &str, stage: Stage, item: u64) -> Option<PathBuf> {
    let submit = run.join(FOLDER);
    let below = |name: &str| if folder == "." { submit.join(name) } else { submit.join(name).join(folder) };
    let lists = std::fs::read_to_string(below("items").join(stage.name())).ok()?;
    let of_item = |line: &&str| line.parse().is_ok_and(|ItemRanges(ranges)| ranges.iter().any(|r| r.contains(&item)));
    let first = lists.lines().find(of_item)?.split(['-', ',']).next()?;
    let log = below("logs").join(format!("{stage}-{first}.log"));
    log.is_file().then_some(log)
}
