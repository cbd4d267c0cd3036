//! Datasets: brought in, labelled, made of each other, mended, sent on.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::dataset::LabelsForm;
use crate::dataset::edit::{Ending, EpisodeRange};
use crate::dataset::export::LabelForm;
use crate::date::Date;
use crate::publish::{License, Release};
use crate::store::StoreAddress;
use crate::task::Family;

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

/// `ntp publish`.
#[derive(Debug, Args)]
pub struct PublishArgs {
    /// The dataset.
    pub dataset: PathBuf,
    #[expect(clippy::doc_markdown, reason = "a help text")]
    /// The folder to publish it into, or s3://BUCKET[/PREFIX]. After an interruption, the same command carries on.
    #[arg(long, value_name = "DIR|URL")]
    pub to: StoreAddress,
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
    pub copy: StoreAddress,
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

/// A share, 0 to 1.
fn share(text: &str) -> Result<f32, String> {
    let share: f32 = text.parse().map_err(|_error| format!("{text:?} is no number"))?;
    if (0.0..=1.0).contains(&share) { Ok(share) } else { Err("allowed: 0 to 1".to_owned()) }
}
