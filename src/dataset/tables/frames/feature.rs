//! The features of a frame, as `meta/info.json` declares them.

use serde::{Deserialize, Serialize};

/// Values of `action`: how far the gripper's reference point moves until the next row, and whether it holds something
/// then. The last row of an episode moves nowhere. Relative, because so is what the learner sees.
pub(crate) const ACTION_NAMES: [&str; 4] = ["gripper.dx_m", "gripper.dy_m", "gripper.dz_m", "gripper.closed"];
const POSITION_NAMES: [&str; 3] = ["x", "y", "z"];

/// What one value of a feature is, among the types that all readers know.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Dtype {
    Float32,
    Float64,
    Int64,
    Bool,
    String,
    /// Encoded pictures in a column.
    Image,
    /// Pictures in video files beside the tables.
    Video,
    /// Rows of text in a column.
    Language,
    /// Of others: numbers of other sizes.
    #[serde(other)]
    Other,
}

/// How many values a row has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Width {
    Scalar,
    State,
    Vector(&'static [&'static str]),
}

/// One column of the frames.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Feature {
    pub(crate) name: &'static str,
    pub(crate) dtype: Dtype,
    pub(crate) width: Width,
}

const fn scalar(name: &'static str, dtype: Dtype) -> Feature {
    Feature { name, dtype, width: Width::Scalar }
}

/// Every feature, in the order of the columns.
pub(crate) const FEATURES: [Feature; 16] = [
    Feature { name: "observation.state", dtype: Dtype::Float32, width: Width::State },
    Feature { name: "action", dtype: Dtype::Float32, width: Width::Vector(&ACTION_NAMES) },
    scalar("timestamp", Dtype::Float32),
    scalar("frame_index", Dtype::Int64),
    scalar("episode_index", Dtype::Int64),
    scalar("index", Dtype::Int64),
    scalar("task_index", Dtype::Int64),
    scalar("subtask_index", Dtype::Int64),
    scalar("next.done", Dtype::Bool),
    scalar("next.success", Dtype::Bool),
    scalar("ntp.time_secs", Dtype::Float64),
    scalar("ntp.boundary", Dtype::Bool),
    scalar("ntp.recording_frame", Dtype::Int64),
    Feature { name: "ntp.gripper_in_world_m", dtype: Dtype::Float32, width: Width::Vector(&POSITION_NAMES) },
    scalar("ntp.call_id", Dtype::Int64),
    scalar("ntp.program", Dtype::String),
];

impl Feature {
    /// How many values a row has in scenes of `n_slots` slots.
    pub(crate) fn width(&self, n_slots: usize) -> usize {
        match self.width {
            Width::Scalar => 1,
            Width::State => crate::trace::Observation::width(n_slots),
            Width::Vector(names) => names.len(),
        }
    }

    /// Names of the values; `None` for a single one.
    pub(crate) fn value_names(&self, slots: &[String]) -> Option<Vec<String>> {
        match self.width {
            Width::Scalar => None,
            Width::Vector(names) => Some(names.iter().map(|&name| name.to_owned()).collect()),
            Width::State => {
                let of_slot = |slot: &String| POSITION_NAMES.map(|axis| format!("{slot}.{axis}_m"));
                let gripper = ["gripper.open", "gripper.closed"].map(ToOwned::to_owned);
                Some(slots.iter().flat_map(of_slot).chain(gripper).collect())
            }
        }
    }

    /// Whether each episode has statistics of its own: those that a robot learner takes in, and the numbers of rows.
    pub(crate) fn has_episode_statistics(&self) -> bool {
        self.is_numeric() && !self.name.starts_with("ntp.") && !self.name.starts_with("next.")
    }

    /// Whether it has statistics.
    pub(crate) fn is_numeric(&self) -> bool {
        !matches!(self.dtype, Dtype::String | Dtype::Image | Dtype::Video | Dtype::Language | Dtype::Other)
    }
}
