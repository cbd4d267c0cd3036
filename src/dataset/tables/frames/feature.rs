//! The features of a frame, as `meta/info.json` declares them.

use std::path::Path;
use std::sync::LazyLock;

use crate::arm::JOINT_NAMES;
use crate::dataset::DatasetError;
use crate::dataset::config::ActionChoice;
use crate::dataset::files::info::{Dtype, FeatureInfo, Features, Info};
use crate::dataset::files::layout;
use crate::dataset::tables::frames::{self, column};
use crate::table::{ColumnSpec, DeclaredColumn as _, Value};
use crate::trace::Observation;

/// Values of `action`: how far the gripper's reference point moves until the next row, and whether it holds something
/// then. The last row of an episode moves nowhere. Relative, because so is what the learner sees.
pub(crate) const ACTION_NAMES: [&str; 4] = ["gripper.dx_m", "gripper.dy_m", "gripper.dz_m", "gripper.closed"];
/// Values of a position.
pub(crate) const POSITION_NAMES: [&str; 3] = ["x", "y", "z"];

/// The column of an arm's joints. Datasets of a gripper without an arm do not have it.
pub(crate) const JOINTS: Feature =
    Feature { name: "ntp.joints_rad", dtype: Dtype::Float32, width: Width::Vector(&JOINT_NAMES) };
/// Values of an `action` that says where joints are to be.
pub(crate) const JOINT_ACTION_NAMES: [&str; 8] = [
    "right_j0.rad",
    "right_j1.rad",
    "right_j2.rad",
    "right_j3.rad",
    "right_j4.rad",
    "right_j5.rad",
    "right_j6.rad",
    "gripper.closed",
];

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

/// Every feature, in the order of the columns.
pub(crate) static FEATURES: LazyLock<Vec<Feature>> =
    LazyLock::new(|| frames::SCHEMA.specs().map(Feature::of).collect());

/// The features as they are declared where slots have these names.
pub(crate) fn declared(slots: &[String], action: ActionChoice) -> Features {
    Features(FEATURES.iter().map(|feature| feature.of_action(action).declared(slots)).collect())
}

/// Every feature that this version knows, whether each dataset has it or not.
pub(crate) fn known() -> impl Iterator<Item = &'static Feature> {
    FEATURES.iter().chain([&JOINTS])
}

impl Feature {
    fn of(column: &ColumnSpec) -> Self {
        let width = match column.name() {
            column::state::NAME => Width::State,
            column::action::NAME => Width::Vector(&ACTION_NAMES),
            column::gripper::NAME => Width::Vector(&POSITION_NAMES),
            _ => Width::Scalar,
        };
        let dtype = match column.kind().value {
            Value::Int64 => Dtype::Int64,
            Value::Float32 => Dtype::Float32,
            Value::Float64 => Dtype::Float64,
            Value::Boolean => Dtype::Bool,
            Value::Text => Dtype::String,
            Value::Picture | Value::Channels => Dtype::Other,
        };
        Self { name: column.name(), dtype, width }
    }

    /// The same where actions are told so.
    pub(crate) fn of_action(&self, action: ActionChoice) -> Self {
        match action {
            ActionChoice::Joints if self.name == column::action::NAME => {
                Self { width: Width::Vector(&JOINT_ACTION_NAMES), ..*self }
            }
            ActionChoice::Joints | ActionChoice::Gripper => *self,
        }
    }

    /// As `meta/info.json` declares it where slots have these names.
    pub(crate) fn declared(&self, slots: &[String]) -> (String, FeatureInfo) {
        let (dtype, shape) = (self.dtype, vec![self.width(slots.len())]);
        (self.name.to_owned(), FeatureInfo { dtype, shape, names: self.value_names(slots), info: None })
    }

    /// How many values a row has in scenes of `n_slots` slots.
    pub(crate) fn width(&self, n_slots: usize) -> usize {
        match self.width {
            Width::Scalar => 1,
            Width::State => Observation::width(n_slots),
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

/// What the actions of a dataset tell, from the declared width.
pub(crate) fn action_of(info: &Info) -> ActionChoice {
    let declared = info.features.0.iter().find(|(feature, _)| feature == column::action::NAME);
    let width = declared.and_then(|(_, feature)| feature.shape.first().copied());
    if width == Some(JOINT_ACTION_NAMES.len()) { ActionChoice::Joints } else { ActionChoice::Gripper }
}

/// How many values an action has.
pub(crate) fn action_width(action: ActionChoice) -> usize {
    match action {
        ActionChoice::Gripper => ACTION_NAMES.len(),
        ActionChoice::Joints => JOINT_ACTION_NAMES.len(),
    }
}

/// Slots of every scene, from the declared width of `observation.state`.
pub(crate) fn n_slots(root: &Path, info: &Info) -> Result<usize, DatasetError> {
    let name = "observation.state";
    let declared = info.features.0.iter().find(|(feature, _)| feature == name).map(|(_, feature)| &feature.shape[..]);
    match declared {
        Some(&[width]) if width >= 2 && (width - 2) % 3 == 0 => Ok((width - 2) / 3),
        _ => Err(DatasetError::Count {
            path: root.join(layout::INFO),
            problem: format!("the shape of {name} is {declared:?}, but should be [3 * slots + 2]"),
        }),
    }
}
