//! Every clap definition; no logic.

mod cluster;
mod datasets;
mod robots;
mod stages;
mod views;

use clap::{Parser, Subcommand};
use clap_complete::Shell;

pub use cluster::{ItemsArgs, StatusArgs, SubmitArgs};
pub use datasets::{
    AnnotateArgs, DatasetCommand, DiffArgs, ExportArgs, FilterArgs, ImportArgs, IngestArgs, KeyFrameChoice, MergeArgs,
    PublishArgs, RepairArgs, SplitArgs, VerifyArgs,
};
pub use robots::{ActArgs, RobotArgs};
pub use stages::{DeviceArgs, LearnArgs, Part, RunArgs, ScopeArgs, StageArgs, TasksArgs};
pub use views::{ExplainArgs, PathArgs, QueryArgs, RenderArgs, ReplayArgs};

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
