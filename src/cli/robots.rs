//! Acting on a robot, and being one.

use std::path::PathBuf;

use clap::Args;

use crate::cli::DeviceArgs;
use crate::dataset::edit::EpisodeRange;
use crate::remote::Address;
use crate::robot::RobotKind;
use crate::task::Family;

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
