//! Every clap definition; no logic.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;

use crate::cluster::Engine;
use crate::dataset::LabelsForm;
use crate::dataset::edit::{Ending, EpisodeRange};
use crate::dataset::export::LabelForm;
use crate::model::ComputeDevice;
use crate::pipeline::{ItemRanges, Stage};
use crate::publish::{Date, License, Release};
use crate::remote::Address;
use crate::render::Channel;
use crate::robot::RobotKind;
use crate::store::Place;
use crate::task::Family;

/// Hierarchical robot demonstrations with true labels: made, learned from, acted and judged by one pipeline file.
///
/// Neural Task Programming (NTP) reads one demonstration of a task that it has never seen, takes it apart into programs
/// that call each other, and acts the task.
#[derive(Debug, Parser)]
#[command(name = "ntp", version, max_term_width = 100, after_help = AFTER_HELP)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const AFTER_HELP: &str = "\
Begin with: ntp run pipelines/quickstart.toml

Words:
  pipeline   a TOML file that says what to make; a study is one that names several
  run        the folder of what a pipeline made
  stage      a step of a pipeline: tasks, generate, convert, train, rollout, report
  shard      a part of a stage's work, done and repeated by itself
  item       a shard of something that a stage makes, with a number: work for one process
  family     what tasks have in common: Block Stacking, Object Sorting, Table Clean-up, Kitting
  task       a goal and the things that it is about; training may use seen tasks, not unseen ones
  program    a step of how a task is done: the task itself, a sub-task, pick or place, or a
             primitive, which moves the robot (move_to, grip, release)
  slot       a place in the observation: one thing, or one of several things that are alike
  scope      the part of a demonstration that a called program may see; frames have scoping labels
  boundary   a frame at which a primitive has just ended
  episode    one attempt at a task, by the expert (a demonstration) or by a model (a rollout)
  recording  episodes as they happened, in an MCAP file
  dataset    episodes as Parquet tables: a LeRobotDataset v3.0 with program tables beside it
  model      a trained network with its settings; its variant is the kind of network
  suite      tasks and conditions in which models are tested, by the name that the pipeline gives it
  decoder    how the part of a demonstration that a program may see is chosen from scores of its
             frames: argmax takes the likeliest start and end, mss the likeliest part as a whole
             (a maximum contiguous subsequence sum), am the likeliest start and the best end for it

Results go to stdout, progress to stderr.
Datasets and recordings are written under new names alone. A picture, a video, a table or another
file of results takes the place of one of its name, unless the command reads it.
Exit codes: 0 done; 1 failed, or a check failed; 2 wrong usage or pipeline file; \
3 done, but something was left out, or left to do; 130 interrupted (the same command carries on).";

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a pipeline: all its stages, or those from --from to --to.
    Run(RunArgs),
    /// Draw the tasks, or import them, and divide them into seen and unseen.
    Tasks(TasksArgs),
    /// Let the scripted expert demonstrate the seen tasks in physics; writes MCAP recordings.
    Generate(StageArgs),
    /// Turn recordings into a dataset: a LeRobotDataset with program tables.
    Convert(StageArgs),
    /// Train models on the dataset.
    Train(LearnArgs),
    /// Let the trained models act the tasks of each suite in physics.
    Rollout(LearnArgs),
    /// Put the results together: an HTML page, JSON and CSV; prints Markdown.
    Report(StageArgs),
    /// List the items of a pipeline's stages: the work that processes can share.
    Items(ItemsArgs),
    /// Hand the items that are left to Slurm, or to processes of this machine.
    Submit(SubmitArgs),
    /// Say how far a submitted run is; exit code 3 while something is left.
    Status(StatusArgs),
    /// Turn recordings of robots, MCAP of any writer, into a LeRobotDataset.
    Ingest(IngestArgs),
    /// Label demonstrations that have no labels: models take them apart into program calls.
    Annotate(AnnotateArgs),
    /// Say what a file or folder is, and how much is in it.
    Inspect(PathArgs),
    /// Check a file or folder: its checksums, and all that a reader relies on.
    Validate(PathArgs),
    /// Show episodes in the Rerun viewer, or simulate them again and compare.
    Replay(ReplayArgs),
    /// Draw an episode as a video, a GIF or one picture.
    Render(RenderArgs),
    /// Answer an SQL statement about a dataset, a run, rollouts or a model.
    ///
    /// Files are read as they are, without a look at their hashes: `ntp validate` is the check.
    Query(QueryArgs),
    /// Say where an episode, a frame or a model comes from: recording, settings, commit.
    Explain(ExplainArgs),
    /// Save what is whole of a broken dataset or recording.
    ///
    /// Of a recording of others, whatever is in it, every chunk that is whole is kept.
    Repair(RepairArgs),
    /// Merge, filter, split, compare, export and import datasets.
    #[command(subcommand)]
    Dataset(DatasetCommand),
    /// Make a dataset ready for others, with a card, metadata, checksums and a licence.
    Publish(PublishArgs),
    /// Check a published copy against its checksums.
    Verify(VerifyArgs),
    /// Let a model act on a robot, yours or a simulated one, as a demonstration shows.
    Act(ActArgs),
    /// Be a simulated robot for `ntp act`.
    Robot(RobotArgs),
    /// Print a script by which a shell completes commands.
    Completions {
        /// For which shell.
        shell: Shell,
    },
}

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
    pub store: Option<Place>,
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
            Some((part, of)) if of > 0 => Ok(Self { part, of }),
            _ => Err("is no part; written as T/N, e.g. 0/64 to 63/64".to_owned()),
        }
    }
}

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
    pub store: Option<Place>,
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
    pub store: Option<Place>,
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
    pub store: Option<Place>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp ingest`.
#[derive(Debug, Args)]
pub struct IngestArgs {
    /// The recordings (.mcap), in the order of their episodes.
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Which topics and fields become which features.
    #[arg(long, value_name = "MAP.toml", conflicts_with = "propose")]
    pub map: Option<PathBuf>,
    /// The dataset, a new folder.
    #[arg(long, value_name = "DIR", conflicts_with = "propose")]
    pub to: Option<PathBuf>,
    /// Only print a map for what is in the first file.
    #[arg(long)]
    pub propose: bool,
    /// Threads [default: one a core]; never changes a byte.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
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
    /// Numbers of episodes, such as 0-9,12.
    #[arg(long, alias = "episodes", value_name = "RANGES", value_delimiter = ',', required = true)]
    pub episode: Vec<EpisodeRange>,
    /// Write a file that `rerun FILE.rrd` opens.
    #[arg(long, value_name = "FILE.rrd", conflicts_with_all = ["spawn", "verify"])]
    pub save: Option<PathBuf>,
    /// Open the Rerun viewer.
    #[arg(long, conflicts_with = "verify")]
    pub spawn: bool,
    /// Simulate the episode again from its seed, and compare every frame.
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
    /// The episode's number.
    #[arg(long, alias = "episodes", value_name = "K", value_parser = one_episode)]
    pub episode: u64,
    /// The camera: front, wrist, or one that the recording names.
    #[arg(long, value_name = "NAME", default_value = "front")]
    pub camera: String,
    /// Draw as the recording's camera filmed, with its size, its quality and what was randomised for it. Without this,
    /// fine pictures for people are drawn from the camera's place.
    #[arg(long)]
    pub as_filmed: bool,
    /// Width and height in pixels: one even number, or two as in 640x480 [default: 480, or as filmed].
    #[arg(long, value_name = "PIXELS")]
    pub size: Option<String>,
    /// Pictures a second.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u32).range(1..=60))]
    pub fps: u32,
    /// How many simulated seconds pass in a second.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = speed, conflicts_with = "png")]
    pub speed: f32,
    /// Show the running programs below, a lane for each depth.
    #[arg(long, conflicts_with = "png")]
    pub programs: bool,
    /// With --png: the number of the recorded frame [default: the last].
    #[arg(long, value_name = "N", conflicts_with_all = ["mp4", "gif"])]
    pub frame: Option<usize>,
    /// With --png: color, depth or segments. Depths are 16 bits of grey, in millimetres, 0 where there is nothing.
    /// Segments are 8 bits of grey: 0 the background, 1 the table, 2 the gripper, then the bodies.
    #[arg(long, value_name = "WHAT", default_value = "color", conflicts_with_all = ["mp4", "gif"])]
    pub show: Channel,
    /// Write a video.
    #[arg(long, value_name = "FILE", group = "output", required_unless_present_any = ["gif", "png"])]
    pub mp4: Option<PathBuf>,
    /// Write a GIF, which pages show without a player.
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
    /// A dataset, a run's folder, rollouts or a model.
    pub path: PathBuf,
    /// The statement. Without one, tables and columns are listed.
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
    /// The folder to publish it into, or s3://BUCKET[/PREFIX]. After an interruption, the same command carries on.
    #[arg(long, value_name = "DIR|URL")]
    pub to: Place,
    /// The licence, by its name at the Hugging Face hub or SPDX, such as cc-by-4.0. There is no default.
    #[arg(long, value_name = "ID")]
    pub license: License,
    /// The day of publication. It is asked for, because no clock reaches a file.
    #[arg(long, value_name = "YYYY-MM-DD")]
    pub date: Date,
    /// The dataset's name [default: NTP demonstrations: FAMILIES].
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// Whose it is. May be given several times.
    #[arg(long, value_name = "NAME")]
    pub creator: Vec<String>,
    /// Where it will be found, such as its address at the Hugging Face hub.
    #[arg(long, value_name = "URL")]
    pub url: Option<String>,
    /// The release's number.
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

/// `ntp act`.
#[derive(Debug, Args)]
pub struct ActArgs {
    /// A model's folder; `oracle` does what the demonstration shows, to try a robot.
    #[arg(value_name = "MODEL")]
    pub model: PathBuf,
    /// A recording (.mcap) with the demonstration, or a folder of recordings.
    #[arg(long, value_name = "PATH")]
    pub demonstration: PathBuf,
    /// Numbers of its episodes, such as 0-9,12: one task after the other.
    #[arg(long, alias = "episodes", value_name = "RANGES", value_delimiter = ',', default_value = "0")]
    pub episode: Vec<EpisodeRange>,
    /// The robot: a command that starts it, or tcp://HOST:PORT.
    #[arg(long, value_name = "ROBOT")]
    pub robot: Address,
    /// Let the robot set its table before each trial; otherwise it acts on the table as it is.
    #[arg(long, conflicts_with = "dry_run")]
    pub reset: bool,
    /// How often it acts what a demonstration shows, each time from other initial positions.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "reset",
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub trials: u32,
    /// How many bodies each slot has that can have several, with commas [default: as demonstrated].
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(0..=100))]
    pub counts: Option<Vec<u16>>,
    /// What initial positions are drawn from.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// How long each answer of the robot may take, in seconds.
    #[arg(long, value_name = "SECS", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub deadline: u32,
    /// What the model is computed on.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Record what happens: a new folder with a recording (.mcap) and a table of the trials.
    #[arg(long, value_name = "DIR", conflicts_with = "dry_run")]
    pub record: Option<PathBuf>,
    /// Only ask the robot where things are; act in simulation from there, and print what would be sent.
    #[arg(long)]
    pub dry_run: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp robot`.
#[derive(Debug, Args)]
pub struct RobotArgs {
    /// The family of tasks that its table is for.
    #[arg(long, value_name = "FAMILY")]
    pub family: Family,
    /// Which robot: `gripper`, which flies freely, or the arm `sawyer` before a table of its own.
    #[arg(long, value_name = "ROBOT", default_value = "gripper")]
    pub robot: RobotKind,
    /// Listen on a port of this machine, or on HOST:PORT [default: speak on stdin and stdout].
    #[arg(long, value_name = "PORT")]
    pub listen: Option<String>,
    /// What initial positions are drawn from, where `ntp act` sets no table.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
}

/// `ntp explain`.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// A dataset, or a model.
    pub path: PathBuf,
    /// The number of an episode of the dataset.
    #[arg(long, alias = "episodes", value_name = "K", value_parser = one_episode)]
    pub episode: Option<u64>,
    /// The number of a frame of the episode.
    #[arg(long, value_name = "F", requires = "episode")]
    pub frame: Option<u64>,
    /// A folder with recordings, besides `recordings` beside the dataset. May be given several times.
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
    /// The new folder or file.
    #[arg(long, value_name = "PATH")]
    pub to: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp annotate`.
#[derive(Debug, Args)]
pub struct AnnotateArgs {
    /// A `LeRobotDataset` v3.0 whose `observation.state` holds positions of objects relative to the gripper.
    pub dataset: PathBuf,
    /// A trained model that knows the dataset's slots. Several: each episode has the labels of the surest, and where
    /// they disagree it is doubtful.
    #[arg(long, value_name = "MODEL", required = true)]
    pub model: Vec<PathBuf>,
    /// The new folder.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    /// A dataset with true labels of the same episodes: says how well the new ones agree with them.
    #[arg(long, value_name = "TRUTH")]
    pub against: Option<PathBuf>,
    /// Episodes with a call of less confidence than this are listed for a person to look at, 0 to 1.
    #[arg(long, value_name = "CONFIDENCE", default_value_t = 0.5, value_parser = share)]
    pub doubt_below: f32,
    /// Which rows are the ends of primitives. rows: all. found: those that the gripper's motion shows. auto: as the
    /// dataset says.
    #[arg(long, value_name = "WHICH", value_enum, default_value = "auto")]
    pub key_frames: KeyFrameChoice,
    /// How parts of a demonstration are chosen from scores of its frames.
    #[arg(long, value_name = "DECODER", value_parser = ["argmax", "mss", "am"], default_value = "mss")]
    pub decoder: String,
    /// The day, for the dataset's card, as YYYY-MM-DD.
    #[arg(long, value_name = "DATE")]
    pub date: Option<Date>,
    /// How many threads [default: one a core]. Results are the same bytes with any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Which rows of a dataset are key frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum KeyFrameChoice {
    /// As the dataset says.
    Auto,
    /// All.
    Rows,
    /// Those that are found.
    Found,
}

/// `ntp dataset`.
#[derive(Debug, Subcommand)]
pub enum DatasetCommand {
    /// Write the episodes of several datasets into one, in the order given.
    Merge(MergeArgs),
    /// Write those episodes of a dataset that meet all conditions.
    Filter(FilterArgs),
    /// Write the parts of a dataset as datasets of their own.
    Split(SplitArgs),
    /// Say which episodes, calls and labels differ between two datasets; exit code 1 when any does.
    Diff(DiffArgs),
    /// Write the labels in a form that other programs read.
    Export(ExportArgs),
    /// Bring in a dataset from elsewhere, whose frames are annotated by `subtask_index`.
    Import(ImportArgs),
}

/// `ntp dataset import`.
#[derive(Debug, Args)]
pub struct ImportArgs {
    /// A `LeRobotDataset` v3.0 with labels below the task.
    pub dataset: PathBuf,
    /// The form of the labels: `subtask_index` (with `meta/subtasks.parquet` or without), language (`LeRobot`'s
    /// `language_persistent`), sarm, or behavior (BEHAVIOR-1K's annotation files). Without it, what the dataset has.
    #[arg(long, value_name = "FORM")]
    pub labels: Option<LabelsForm>,
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
    /// The form. `subtask_index`: a `LeRobotDataset` without what is ours. language: the same with `LeRobot`'s language
    /// columns. sarm: the same with SARM's columns. behavior: BEHAVIOR-1K's annotation files. foxglove:
    /// `foxglove.Event` messages in an MCAP file.
    #[arg(long, value_name = "FORM")]
    pub labels: LabelForm,
    /// The new folder; with foxglove, the new file.
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
    /// Decode and encode again the H.264 videos of episodes that begin at no key frame, instead of refusing them. Of
    /// datasets of others; all other pictures are copied as they are.
    #[arg(long)]
    pub reencode: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `ntp dataset filter`. An option that is given several times holds when one of its values does; all options must hold.
#[derive(Debug, Args)]
pub struct FilterArgs {
    /// The dataset.
    pub dataset: PathBuf,
    /// The new folder.
    #[arg(long, value_name = "DIR")]
    pub to: PathBuf,
    /// The task, by its id or its text.
    #[arg(long, value_name = "TASK")]
    pub task: Vec<String>,
    /// The family of the task, such as `block_stacking`.
    #[arg(long, value_name = "FAMILY")]
    pub family: Vec<Family>,
    /// A program that the episode calls.
    #[arg(long, value_name = "PROGRAM")]
    pub program: Vec<String>,
    /// How the episode ended: success, failure, or a cause of failure.
    #[arg(long, value_name = "OUTCOME")]
    pub outcome: Vec<Ending>,
    /// The split: seen or unseen; of datasets of others a name that `meta/info.json` gives, such as train.
    #[arg(long, value_name = "SPLIT")]
    pub split: Option<String>,
    /// Numbers of episodes, such as 0-9,12.
    #[arg(long, alias = "episode", value_name = "RANGES", value_delimiter = ',')]
    pub episodes: Vec<EpisodeRange>,
    /// The least number of frames.
    #[arg(long, value_name = "N")]
    pub min_frames: Option<u64>,
    /// The greatest number of frames.
    #[arg(long, value_name = "N")]
    pub max_frames: Option<u64>,
    /// Decode and encode again the H.264 videos of episodes that begin at no key frame, instead of refusing them. Of
    /// datasets of others; all other pictures are copied as they are.
    #[arg(long)]
    pub reencode: bool,
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
    /// Make a part for each value of: split, task, family or outcome.
    #[arg(long, value_name = "WHAT", value_parser = ["split", "task", "family", "outcome"])]
    pub by: Option<String>,
    /// Draw parts at random, such as train=0.8,val=0.2.
    #[arg(long, value_name = "NAME=SHARE,…", value_delimiter = ',')]
    pub shares: Vec<String>,
    /// With --shares: what stays together, task or episode. With task, no task is in two parts.
    #[arg(long, value_name = "WHAT", value_parser = ["task", "episode"], default_value = "task")]
    pub unit: String,
    /// With --shares: the seed of the draw.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Decode and encode again the H.264 videos of episodes that begin at no key frame, instead of refusing them. Of
    /// datasets of others; all other pictures are copied as they are.
    #[arg(long)]
    pub reencode: bool,
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

/// A speed that shows something: above 0, and not faster than a thousand times.
fn speed(text: &str) -> Result<f32, String> {
    let speed: f32 = text.parse().map_err(|_error| format!("{text:?} is no number"))?;
    if speed > 0.0 && speed <= 1000.0 { Ok(speed) } else { Err("allowed: above 0, up to 1000".to_owned()) }
}

/// The number of one episode, where several make no sense.
fn one_episode(text: &str) -> Result<u64, String> {
    text.trim().parse().map_err(|_error| format!("{text:?} is not the number of one episode, such as 3"))
}

/// A share, 0 to 1.
fn share(text: &str) -> Result<f32, String> {
    let share: f32 = text.parse().map_err(|_error| format!("{text:?} is no number"))?;
    if (0.0..=1.0).contains(&share) { Ok(share) } else { Err("allowed: 0 to 1".to_owned()) }
}
