//! The stages, and what they share: folders, devices, and which part of the work one process does.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use crate::model::ComputeDevice;
use crate::pipeline::{ItemRanges, Stage};
use crate::store::StoreAddress;

/// How stages run.
#[derive(Clone, Debug, Args)]
pub struct StageArgs {
    /// The pipeline file, or a study that names several.
    #[arg(value_name = "PIPELINE.toml")]
    pub pipeline: PathBuf,
    /// The run's folder [default: data/runs/NAME, with the name that the pipeline has].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// How many threads [default: one a core]. Results are the same bytes with any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Only say what would be done, and why.
    #[arg(long)]
    pub dry_run: bool,
    /// Do again what is up to date.
    #[arg(long)]
    pub force: bool,
    /// How much of a stage.
    #[command(flatten)]
    pub scope: ScopeArgs,
    /// Go on where the file system has no locks and nothing else writes into the run directory.
    #[arg(long)]
    pub no_lock: bool,
    #[expect(clippy::doc_markdown, reason = "a help text")]
    /// The run is in a store, s3://BUCKET/RUN or a folder; --out is this machine's copy of what is needed here.
    #[arg(long, value_name = "URL")]
    pub store: Option<StoreAddress>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp train`, `ntp rollout`.
#[derive(Debug, Args)]
pub struct LearnArgs {
    /// What all stages take.
    #[command(flatten)]
    pub stage: StageArgs,
    /// What networks are computed on.
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// What networks are computed on. See docs/gpu.md.
#[derive(Debug, Args)]
pub struct DeviceArgs {
    /// Compute networks on: cpu, wgpu or wgpu:N (a graphics card), cuda or cuda:N (one of NVIDIA's).
    #[arg(long, value_name = "DEVICE", default_value = "cpu")]
    pub device: ComputeDevice,
}

/// How much of one stage is done by this process; the whole when none is given. See docs/cluster.md.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "For many processes side by side")]
pub struct ScopeArgs {
    /// Do these items alone, by their numbers as `ntp items` lists them, e.g. 0-3,7.
    #[arg(long, value_name = "A-B", group = "scope")]
    pub items: Option<ItemRanges>,
    /// Do part T, from 0, of N equal parts of all items.
    #[arg(long, value_name = "T/N", group = "scope")]
    pub part: Option<Part>,
    /// Do shard I alone of every unit that has so many, in stages that have shards (generate, rollout).
    #[arg(long, value_name = "I", group = "scope")]
    pub shard: Option<u32>,
    /// Write the plans alone; with --force, what other plans have finished is removed.
    #[arg(long, group = "scope")]
    pub begin: bool,
    /// Commit what others have done; nothing is done that is missing.
    #[arg(long, group = "scope")]
    pub commit: bool,
    /// With --commit: wait so many seconds for what is missing.
    #[arg(long, value_name = "S", requires = "commit", default_value_t = 0)]
    pub wait: u64,
    /// With --store: bring what is finished there into --out, and do nothing else.
    #[arg(long, group = "scope", requires = "store")]
    pub fetch: bool,
}

/// One of equal parts, as it is written: `3/64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Which, from 0.
    pub part: u64,
    /// Of how many; at least 1.
    pub of: u64,
}

impl FromStr for Part {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        let numbers = word.split_once('/').and_then(|(part, of)| Some((part.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((part, of)) if part < of => Ok(Self { part, of }),
            _ => Err("is no part; written as T/N with T from 0 and below N, e.g. 0/64 to 63/64".to_owned()),
        }
    }
}

/// `ntp run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// What all stages take.
    #[command(flatten)]
    pub stage: StageArgs,
    /// What networks are computed on.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// First stage: tasks, generate, convert, train, rollout or report.
    #[arg(long, value_name = "STAGE", default_value = "tasks")]
    pub from: Stage,
    /// Last stage.
    #[arg(long, value_name = "STAGE", default_value = "report")]
    pub to: Stage,
}

/// `ntp tasks`.
#[derive(Debug, Args)]
pub struct TasksArgs {
    /// The pipeline file.
    #[arg(value_name = "PIPELINE.toml", required_unless_present = "import", conflicts_with = "import")]
    pub pipeline: Option<PathBuf>,
    /// Read a task file in the format of the paper's authors, and write it as tasks.json.
    #[arg(long, value_name = "FILE")]
    pub import: Option<PathBuf>,
    /// With --import: how many of the first tasks may be trained on.
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "import")]
    pub train: u32,
    /// The run's folder [default: data/runs/NAME]. With --import: the file to write; without it none is written.
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// Only say what would be done and why.
    #[arg(long, conflicts_with = "import")]
    pub dry_run: bool,
    /// Do again what is up to date.
    #[arg(long, conflicts_with = "import")]
    pub force: bool,
    #[expect(clippy::doc_markdown, reason = "a help text")]
    /// The run is in a store, s3://BUCKET/RUN or a folder; --out is this machine's copy of what is needed here.
    #[arg(long, value_name = "URL", conflicts_with = "import")]
    pub store: Option<StoreAddress>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
