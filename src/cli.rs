//! Every clap definition; no logic.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;

use crate::pipeline::Stage;

/// Neural Task Programming as a dataset pipeline.
#[derive(Debug, Parser)]
#[command(name = "ntp", version, max_term_width = 100, after_help = AFTER_HELP)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const AFTER_HELP: &str = "\
Results go to stdout, progress to stderr.
Exit codes: 0 done; 1 failed, or a check failed; 2 wrong usage or pipeline file; \
3 done, but something was left out; 130 interrupted (the same command carries on).";

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a pipeline: all stages, or those from --from to --to.
    Run(RunArgs),
    /// Draw or import tasks.
    Tasks(TasksArgs),
    /// Let the expert demonstrate the training tasks, recorded as MCAP.
    Generate(StageArgs),
    /// Turn recordings into a LeRobotDataset with program tables.
    Convert(StageArgs),
    /// Train models on the dataset.
    Train(StageArgs),
    /// Let the models act the suites, closed loop in physics.
    Rollout(StageArgs),
    /// Show results: one HTML page, JSON and CSV.
    Report(StageArgs),
    /// Say what a file or folder is: recording, dataset, model, rollouts, run.
    Inspect(PathArgs),
    /// Check the checksums and the content of a file or folder.
    Validate(PathArgs),
    /// Show an episode of a recording in Rerun, or simulate it again.
    Replay(ReplayArgs),
    /// Print a completion script.
    Completions {
        /// For which shell.
        shell: Shell,
    },
}

/// How stages run.
#[derive(Debug, Args)]
pub struct StageArgs {
    /// The pipeline file, or a study that names several.
    #[arg(value_name = "PIPELINE.toml")]
    pub pipeline: PathBuf,
    /// The run directory [default: data/runs/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Threads [default: one a core]; never changes a byte.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Only say what would be done and why.
    #[arg(long)]
    pub dry_run: bool,
    /// Do again what is up to date.
    #[arg(long)]
    pub force: bool,
    /// Do this shard alone, in stages that have shards (generate, rollout).
    #[arg(long, value_name = "I")]
    pub shard: Option<u32>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// As for one stage.
    #[command(flatten)]
    pub stage: StageArgs,
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
    /// Import a task file of the authors' format, as tasks.json.
    #[arg(long, value_name = "FILE")]
    pub import: Option<PathBuf>,
    /// With --import: how many of the first tasks may be trained on.
    #[arg(long, value_name = "N", default_value_t = 1000, requires = "import")]
    pub train: u32,
    /// The run directory [default: data/runs/NAME]; with --import the file to write [default: none].
    #[arg(long, value_name = "PATH")]
    pub out: Option<PathBuf>,
    /// Only say what would be done and why.
    #[arg(long, conflicts_with = "import")]
    pub dry_run: bool,
    /// Do again what is up to date.
    #[arg(long, conflicts_with = "import")]
    pub force: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// A command about one path.
#[derive(Debug, Args)]
pub struct PathArgs {
    /// A file or folder.
    pub path: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp replay`.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// A recording (.mcap), or a folder of recordings or rollouts.
    pub path: PathBuf,
    /// Which episode, by its number.
    #[arg(long, value_name = "K")]
    pub episode: u64,
    /// Write a Rerun file.
    #[arg(long, value_name = "FILE.rrd", conflicts_with_all = ["spawn", "verify"])]
    pub save: Option<PathBuf>,
    /// Open the Rerun viewer.
    #[arg(long, conflicts_with = "verify")]
    pub spawn: bool,
    /// Simulate it again from its seed and compare every frame.
    #[arg(long)]
    pub verify: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
