//! A run that is shared among processes and machines.

use std::path::PathBuf;

use clap::Args;

use crate::cluster::Engine;
use crate::pipeline::Stage;
use crate::store::StoreAddress;

/// `ntp items`.
#[derive(Debug, Args)]
pub struct ItemsArgs {
    /// The pipeline file, or a study that names several.
    #[arg(value_name = "PIPELINE.toml")]
    pub pipeline: PathBuf,
    /// Of this stage alone.
    #[arg(long, value_name = "STAGE")]
    pub stage: Option<Stage>,
    /// The run directory [default: data/runs/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[expect(clippy::doc_markdown, reason = "a help text")]
    /// The run is in a store, s3://BUCKET/RUN or a folder.
    #[arg(long, value_name = "URL", conflicts_with = "out")]
    pub store: Option<StoreAddress>,
    /// Only those that are not done.
    #[arg(long)]
    pub left: bool,
    /// Print the numbers alone, as `--items` and sbatch's `--array` take them; needs --stage.
    #[arg(long, requires = "stage", conflicts_with = "json")]
    pub array: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp submit`.
#[derive(Debug, Args)]
pub struct SubmitArgs {
    /// The pipeline file, or a study that names several.
    #[arg(value_name = "PIPELINE.toml")]
    pub pipeline: PathBuf,
    /// The run directory, which every node sees; what is handed over is kept in its folder `submit`.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Who runs the tasks: slurm or local.
    #[arg(long, value_name = "ENGINE")]
    pub engine: Engine,
    /// Tasks that run at a time [default: with slurm as many as it likes, with local one a core].
    #[arg(long, value_name = "M", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_running: Option<u32>,
    /// Items that a task does one after the other [default: generate 100, rollout 40, train 1].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    pub per_task: Option<u32>,
    #[expect(clippy::doc_markdown, reason = "a help text")]
    /// The run is in a store, s3://BUCKET/RUN or a folder; every node then has its own copy of what it needs, and the
    /// run directory holds scripts and logs alone.
    #[arg(long, value_name = "URL")]
    pub store: Option<StoreAddress>,
    /// An argument for every sbatch, e.g. --sbatch-arg=--partition=cpu; may be given several times.
    #[arg(long, value_name = "ARG", allow_hyphen_values = true)]
    pub sbatch_arg: Vec<String>,
    /// Write the scripts, and hand nothing over.
    #[arg(long)]
    pub dry_run: bool,
    /// Hand over another pipeline or program than before.
    #[arg(long)]
    pub force: bool,
    /// Print what is left as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp status`.
#[derive(Debug, Args)]
pub struct StatusArgs {
    /// The run directory.
    #[arg(value_name = "RUN")]
    pub run: PathBuf,
    /// Look again until nothing is left.
    #[arg(long)]
    pub watch: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
