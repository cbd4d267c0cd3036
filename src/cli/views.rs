//! Looking at what was made: pictures, replays, questions.

use std::path::PathBuf;

use clap::Args;

use crate::dataset::edit::EpisodeRange;
use crate::render::Channel;

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

/// A speed that shows something: above 0, and not faster than a thousand times.
fn speed(text: &str) -> Result<f32, String> {
    let speed: f32 = text.parse().map_err(|_error| format!("{text:?} is no number"))?;
    if speed > 0.0 && speed <= 1000.0 { Ok(speed) } else { Err("allowed: above 0, up to 1000".to_owned()) }
}

/// The number of one episode, where several make no sense.
fn one_episode(text: &str) -> Result<u64, String> {
    text.trim().parse().map_err(|_error| format!("{text:?} is not the number of one episode, such as 3"))
}
