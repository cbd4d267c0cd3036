//! Filmstrips: episodes as a row of small pictures, drawn elsewhere and shown here.

use schemars::JsonSchema;
use serde::Serialize;

/// An episode in a few pictures.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Filmstrip {
    /// Of which experiment.
    pub experiment: String,
    /// The set of evaluation tasks.
    pub suite: String,
    /// What it shows: `demonstration`, `success` or `failure`.
    pub shows: Shows,
    /// Who acted: `expert`, or a model.
    pub actor: String,
    /// The episode's position in the suite.
    pub episode: u64,
    /// The task in words.
    pub task: String,
    /// Why it failed; null unless it did.
    pub cause: Option<String>,
    /// The call at which it left the expert's decisions, in words; null when it never did.
    pub left: Option<String>,
    /// The command that shows the whole episode, from the run's folder.
    pub replay: String,
    /// The pictures in order.
    pub pictures: Vec<StripPicture>,
}

/// What a filmstrip shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shows {
    /// What a model was given to repeat.
    Demonstration,
    /// A rollout that succeeded.
    Success,
    /// One that did not.
    Failure,
}

/// One picture of a filmstrip.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct StripPicture {
    /// Milliseconds since the episode began.
    pub time_ms: u64,
    /// The call that has just ended, in words.
    pub call: String,
    /// Whether it shows the world as it was when the expert's decisions were left.
    pub is_departure: bool,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// JPEG; on the page alone.
    #[serde(skip)]
    #[schemars(skip)]
    pub jpeg: Vec<u8>,
}
