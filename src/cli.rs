//! Every clap definition; no logic.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;

use crate::dataset::edit::Ending;
use crate::dataset::export::LabelForm;
use crate::pipeline::Stage;
use crate::publish::{Date, License, Place, Release};
use crate::render::Channel;
use crate::task::{Family, Split};

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
    /// Show episodes in Rerun, rollouts beside their demonstrations, or simulate them again.
    Replay(ReplayArgs),
    /// Draw an episode of a recording as a video, moving pictures or one picture.
    Render(RenderArgs),
    /// Answer an SQL statement over the tables of a dataset, a run, rollouts or a model.
    Query(QueryArgs),
    /// Say where an episode, a frame or a model comes from.
    Explain(ExplainArgs),
    /// Write what can be verified of a broken dataset or recording.
    Repair(RepairArgs),
    /// Make datasets of datasets, or compare two.
    #[command(subcommand)]
    Dataset(DatasetCommand),
    /// Make a dataset ready for others: card, Croissant, checksums, under a named licence.
    Publish(PublishArgs),
    /// Check a published copy against its SHA256SUMS.
    Verify(VerifyArgs),
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
    /// A recording (.mcap), a folder of recordings or rollouts, or a dataset.
    pub path: PathBuf,
    /// Which episode, by its number; several with commas.
    #[arg(long, value_name = "K", value_delimiter = ',', required = true)]
    pub episode: Vec<u64>,
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

/// `ntp render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// A recording (.mcap), or a folder of recordings or rollouts.
    pub path: PathBuf,
    /// Which episode, by its number.
    #[arg(long, value_name = "K")]
    pub episode: u64,
    /// From where: front, wrist, or a camera that the recording names.
    #[arg(long, value_name = "NAME", default_value = "front")]
    pub camera: String,
    /// As the recording's camera of that name filmed, with its size, quality and what was randomized; otherwise
    /// pictures for people are drawn from its place.
    #[arg(long)]
    pub as_filmed: bool,
    /// Width and height in pixels: one even number, or two as 640x480 [default: 480, or as filmed].
    #[arg(long, value_name = "PIXELS")]
    pub size: Option<String>,
    /// Pictures a second.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=60))]
    pub fps: u32,
    /// With --png: which recorded frame [default: the last].
    #[arg(long, value_name = "N", conflicts_with_all = ["mp4", "gif"])]
    pub frame: Option<usize>,
    /// With --png: color, depth (16 bits of grey, in millimetres, 0 for nothing) or segments (8 bits of grey:
    /// background 0, table 1, gripper 2, then the bodies).
    #[arg(long, value_name = "WHAT", default_value = "color", conflicts_with_all = ["mp4", "gif"])]
    pub show: Channel,
    /// Write a video.
    #[arg(long, value_name = "FILE", group = "output", required_unless_present_any = ["gif", "png"])]
    pub mp4: Option<PathBuf>,
    /// Write moving pictures for pages.
    #[arg(long, value_name = "FILE", group = "output")]
    pub gif: Option<PathBuf>,
    /// Write one picture.
    #[arg(long, value_name = "FILE", group = "output")]
    pub png: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp query`.
#[derive(Debug, Args)]
pub struct QueryArgs {
    /// A dataset, a run directory, rollouts or a model.
    pub path: PathBuf,
    /// The statement; without one, the tables and their columns are listed.
    #[arg(value_name = "SELECT …")]
    pub sql: Option<String>,
    /// Print the rows as comma-separated values.
    #[arg(long, requires = "sql", conflicts_with_all = ["json", "parquet"])]
    pub csv: bool,
    /// Print the rows as JSON.
    #[arg(long, conflicts_with = "parquet")]
    pub json: bool,
    /// Write the rows to a Parquet file.
    #[arg(long, value_name = "FILE", requires = "sql")]
    pub parquet: Option<PathBuf>,
}

/// `ntp publish`.
#[derive(Debug, Args)]
pub struct PublishArgs {
    /// The dataset.
    pub dataset: PathBuf,
    #[expect(clippy::doc_markdown, reason = "a help text")]
    /// The folder to publish it into, or s3://BUCKET[/PREFIX]; the same command carries on what was interrupted.
    #[arg(long, value_name = "DIR|URL")]
    pub to: Place,
    /// Under which licence, by its name on the hub or at SPDX, e.g. cc-by-4.0; there is no default.
    #[arg(long, value_name = "ID")]
    pub license: License,
    /// The day of publication; told, because no clock reaches a file.
    #[arg(long, value_name = "YYYY-MM-DD")]
    pub date: Date,
    /// What it is called [default: NTP demonstrations: FAMILIES].
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Whose it is; may be given several times.
    #[arg(long, value_name = "NAME")]
    pub creator: Vec<String>,
    /// Where it will be found, e.g. its address at the Hugging Face hub.
    #[arg(long, value_name = "URL")]
    pub url: Option<String>,
    /// Which release it is.
    #[arg(long, value_name = "X.Y.Z", default_value = "1.0.0")]
    pub release: Release,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp verify`.
#[derive(Debug, Args)]
pub struct VerifyArgs {
    #[expect(clippy::doc_markdown, reason = "a help text")]
    /// The published folder, or s3://BUCKET[/PREFIX].
    #[arg(value_name = "DIR|URL")]
    pub copy: Place,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// A dataset, or a model.
    pub path: PathBuf,
    /// Which episode of the dataset, by its number.
    #[arg(long, value_name = "K")]
    pub episode: Option<u64>,
    /// Which frame of the episode.
    #[arg(long, value_name = "F", requires = "episode")]
    pub frame: Option<u64>,
    /// A folder in which recordings are looked for, besides `recordings` beside the dataset.
    #[arg(long, value_name = "DIR")]
    pub recordings: Vec<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp repair`.
#[derive(Debug, Args)]
pub struct RepairArgs {
    /// A dataset, or a recording (.mcap).
    pub path: PathBuf,
    /// What to write: a new folder or file.
    #[arg(long, value_name = "PATH")]
    pub to: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp dataset`.
#[derive(Debug, Subcommand)]
pub enum DatasetCommand {
    /// Write the episodes of several datasets into one, in order.
    Merge(MergeArgs),
    /// Write the episodes of a dataset that are as asked for.
    Filter(FilterArgs),
    /// Write the parts of a dataset as datasets of their own.
    Split(SplitArgs),
    /// Say which episodes, calls and labels differ between two datasets; exit code 1 when any does.
    Diff(DiffArgs),
    /// Write the labels in the shapes that others read.
    Export(ExportArgs),
    /// Bring in someone else's dataset whose frames are annotated by `subtask_index`.
    Import(ImportArgs),
}

/// `ntp dataset import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// A `LeRobotDataset` v3.0 with `subtask_index` and `meta/subtasks.parquet`.
    pub dataset: PathBuf,
    /// The new folder.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp dataset export`.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The dataset.
    pub dataset: PathBuf,
    /// In which shape: `subtask_index` (a `LeRobotDataset` without what is ours), language (the same with `LeRobot`'s
    /// language columns), sarm (the same with SARM's columns), behavior (BEHAVIOR-1K's annotation files) or foxglove (`foxglove.Event` messages in an MCAP file).
    #[arg(long, value_name = "FORM")]
    pub labels: LabelForm,
    /// The new folder, or with foxglove the new file.
    #[arg(long, value_name = "PATH")]
    pub to: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp dataset merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// The datasets.
    #[arg(value_name = "DATASET", required = true)]
    pub sources: Vec<PathBuf>,
    /// The new folder.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp dataset filter`. Of an option that is given several times, one value is enough; all options must hold.
#[derive(Debug, Args)]
pub struct FilterArgs {
    /// The dataset.
    pub dataset: PathBuf,
    /// The new folder.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    /// A task, by its id or its text.
    #[arg(long, value_name = "TASK")]
    pub task: Vec<String>,
    /// A family of tasks.
    #[arg(long, value_name = "FAMILY")]
    pub family: Vec<Family>,
    /// A program that is called.
    #[arg(long, value_name = "PROGRAM")]
    pub program: Vec<String>,
    /// How it ended: success, failure, or a cause of failure.
    #[arg(long, value_name = "OUTCOME")]
    pub outcome: Vec<Ending>,
    /// Seen or unseen.
    #[arg(long, value_name = "SPLIT")]
    pub split: Option<Split>,
    /// Least number of frames.
    #[arg(long, value_name = "N")]
    pub min_frames: Option<u64>,
    /// Greatest number of frames.
    #[arg(long, value_name = "N")]
    pub max_frames: Option<u64>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp dataset split`.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("parts").required(true).args(["by", "shares"]))]
pub struct SplitArgs {
    /// The dataset.
    pub dataset: PathBuf,
    /// The new folder, with a dataset for each part.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    /// A part for each value: split, task, family or outcome.
    #[arg(long, value_name = "WHAT", value_parser = ["split", "task", "family", "outcome"])]
    pub by: Option<String>,
    /// Parts drawn at random, e.g. train=0.8,val=0.2.
    #[arg(long, value_name = "NAME=SHARE,…", value_delimiter = ',')]
    pub shares: Vec<String>,
    /// With --shares, what stays together: task (no task is in two parts) or episode.
    #[arg(long, value_name = "WHAT", value_parser = ["task", "episode"], default_value = "task")]
    pub unit: String,
    /// With --shares, the seed of the draw.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp dataset diff`.
#[derive(Debug, Args)]
pub struct DiffArgs {
    /// A dataset.
    pub before: PathBuf,
    /// Another one.
    pub after: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
