//! What a suite asks for, as its rollouts say. Figures, claims and order go by this and never by a suite's name.

use polars::prelude::DataType;
use schemars::JsonSchema;
use serde::Serialize;

use crate::perception::PerceptionConfig;
use crate::report::ReportError;
use crate::report::frames::Rows;
use crate::robot::RobotKind;
use crate::task::Split;
use crate::words::counted;

/// The families of the paper's experiments, as files name them.
pub(super) const BLOCK_STACKING: &str = "block_stacking";
pub(super) const OBJECT_SORTING: &str = "object_sorting";
pub(super) const TABLE_CLEANUP: &str = "table_cleanup";

/// The columns of [`SuiteFacts`].
pub(super) const COLUMNS: [(&str, DataType); 19] = [
    ("split", DataType::String),
    ("family", DataType::String),
    ("blocks", DataType::Int64),
    ("order", DataType::String),
    ("adversary_probability", DataType::Float64),
    ("adversary_impulse_ns", DataType::Float64),
    ("demonstrated_min", DataType::Int64),
    ("demonstrated_max", DataType::Int64),
    ("on_table_min", DataType::Int64),
    ("on_table_max", DataType::Int64),
    ("bowls", DataType::Int64),
    ("objects", DataType::Int64),
    ("robot", DataType::String),
    ("jaw_m", DataType::Float64),
    ("camera", DataType::String),
    ("sensor", DataType::String),
    ("calibration_deg", DataType::Float64),
    ("calibration_mm", DataType::Float64),
    ("depth_mm", DataType::Float64),
];

/// What a file does not say of itself: how far positions were off.
pub(super) const NOISE: [&str; 2] = ["noise_frame_m", "noise_offset_m"];

/// How far the gripper opens where nothing is said of it, in metres.
const USUAL_JAW_M: f64 = 0.07;

/// What a suite asks for. A fact is null where the suite has no such thing, where its episodes differ in it, and where
/// it was not written down: then `family` is null too.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct SuiteFacts {
    /// `seen` or `unseen`: whether its tasks were trained on.
    pub split: Option<String>,
    /// The kind of tasks.
    pub family: Option<String>,
    /// Blocks within reach.
    pub blocks: Option<i64>,
    /// In which order the sub-tasks are demonstrated: `own` or `shuffled`.
    pub order: Option<String>,
    /// Chance of a push of an adversary after each placement; 0 without one.
    pub adversary_probability: Option<f64>,
    /// Impulse of a push in newton seconds; 0 without an adversary.
    pub adversary_impulse_ns: Option<f64>,
    /// The fewest instances of a category in the demonstration.
    pub demonstrated_min: Option<i64>,
    /// The most.
    pub demonstrated_max: Option<i64>,
    /// The fewest instances of a category on the table.
    pub on_table_min: Option<i64>,
    /// The most.
    pub on_table_max: Option<i64>,
    /// Bowls that each task asks for.
    pub bowls: Option<i64>,
    /// The fewest things on the table that may be moved.
    pub objects_min: Option<i64>,
    /// The most.
    pub objects_max: Option<i64>,
    /// Which robot acts, where it is not the gripper that flies freely.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// How far its gripper opens at most, in metres, where it is not the usual one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jaw_m: Option<f64>,
    /// Where a camera stands that tells robot and model where things are; null where they know it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// What its depths are like: `kinect` or `exact`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sensor: Option<String>,
    /// Standard deviation of the error of its turn about each axis, in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_deg: Option<f64>,
    /// Standard deviation of the error of its place along each axis, in millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_mm: Option<f64>,
    /// Standard deviation of what is added to all of its depths, in millimetres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth_mm: Option<f64>,
    /// Standard deviation of the error of each observed position, anew in each observation, in metres; null without noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_frame_m: Option<f64>,
    /// Standard deviation of an error that stays the same, in metres; null without noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_offset_m: Option<f64>,
}

/// What a suite of the paper asks for, whichever the family.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Ask {
    /// Tasks that were not trained on, as they are.
    Unseen,
    /// Tasks that were trained on, as they are.
    Seen,
    /// Towers in another order than their own.
    Topology,
    /// An adversary pushes.
    Adversary,
    /// Tasks that were not trained on, with positions that are off.
    Noise,
}

impl SuiteFacts {
    /// The facts of each row of a grouped table: the columns' lowest values, and their highest under [`highest`].
    pub(super) fn read(rows: &Rows<'_>) -> Result<Vec<Self>, ReportError> {
        let text =
            |name: &str| Ok::<_, ReportError>(same(rows.optional_text(name)?, rows.optional_text(&highest(name))?));
        let whole =
            |name: &str| Ok::<_, ReportError>(same(rows.optional_whole(name)?, rows.optional_whole(&highest(name))?));
        let real =
            |name: &str| Ok::<_, ReportError>(same(rows.optional_real(name)?, rows.optional_real(&highest(name))?));
        let (mut split, mut family, mut order) = (text("split")?, text("family")?, text("order")?);
        let (mut robot, mut camera, mut sensor) = (text("robot")?, text("camera")?, text("sensor")?);
        let (jaw_m, depth_mm) = (real("jaw_m")?, real("depth_mm")?);
        let (calibration_deg, calibration_mm) = (real("calibration_deg")?, real("calibration_mm")?);
        let (probability, impulse) = (real("adversary_probability")?, real("adversary_impulse_ns")?);
        let (demonstrated_min, demonstrated_max) = (whole("demonstrated_min")?, whole("demonstrated_max")?);
        let (on_table_min, on_table_max) = (whole("on_table_min")?, whole("on_table_max")?);
        let (blocks, bowls) = (whole("blocks")?, whole("bowls")?);
        let [noise_frame_m, noise_offset_m] = [real(NOISE[0])?, real(NOISE[1])?];
        let (objects_min, objects_max) = (rows.optional_whole("objects")?, rows.optional_whole(&highest("objects"))?);
        let facts = |row: usize| Self {
            split: split[row].take(),
            family: family[row].take(),
            blocks: blocks[row],
            order: order[row].take(),
            adversary_probability: probability[row],
            adversary_impulse_ns: impulse[row],
            demonstrated_min: demonstrated_min[row],
            demonstrated_max: demonstrated_max[row],
            on_table_min: on_table_min[row],
            on_table_max: on_table_max[row],
            bowls: bowls[row],
            objects_min: objects_min[row],
            objects_max: objects_max[row],
            robot: robot[row].take().filter(|robot| robot != RobotKind::default().name()),
            jaw_m: jaw_m[row].filter(|jaw_m| *jaw_m != USUAL_JAW_M),
            camera: camera[row].take(),
            sensor: sensor[row].take(),
            calibration_deg: calibration_deg[row],
            calibration_mm: calibration_mm[row],
            depth_mm: depth_mm[row],
            noise_frame_m: noise_frame_m[row].filter(|noise| *noise > 0.0),
            noise_offset_m: noise_offset_m[row].filter(|noise| *noise > 0.0),
        };
        Ok((0..blocks.len()).map(facts).collect())
    }

    /// Which part of the paper's experiments it is, as far as it is known; `None` with another robot than they
    /// have, or one that has to see.
    pub(super) fn ask(&self) -> Option<Ask> {
        if self.robot.is_some() || self.camera.is_some() || self.jaw_m.is_some() {
            return None;
        }
        let split = self.split.as_deref()?;
        Some(match self.order.as_deref()? {
            _ if self.noise_frame_m.or(self.noise_offset_m).is_some() => Ask::Noise,
            _ if self.adversary_probability? > 0.0 => Ask::Adversary,
            "own" if split == Split::Unseen.name() => Ask::Unseen,
            "own" => Ask::Seen,
            _ => Ask::Topology,
        })
    }

    /// Whether it asks so of a family.
    pub(super) fn asks(&self, family: &str, ask: Ask) -> bool {
        self.family.as_deref() == Some(family) && self.ask() == Some(ask)
    }

    /// Whether as many instances of each category are on the table as in the demonstration.
    pub(super) fn shows_what_is_there(&self) -> bool {
        (self.demonstrated_min, self.demonstrated_max) == (self.on_table_min, self.on_table_max)
    }

    /// Instances of each category, in the demonstration and on the table; `None` where they differ.
    pub(super) fn instances(&self) -> Option<i64> {
        self.on_table_min.filter(|_| self.shows_what_is_there() && self.on_table_min == self.on_table_max)
    }

    /// Things on the table that may be moved, where all episodes have as many.
    pub(super) fn objects(&self) -> Option<i64> {
        self.objects_min.filter(|_| self.objects_min == self.objects_max)
    }

    /// Chance of a push after each placement, in percent.
    pub(super) fn push_percent(&self) -> Option<i64> {
        self.adversary_probability.map(|share| (100.0 * share).round() as i64)
    }

    /// Impulse of a push in millinewton seconds.
    pub(super) fn push_mns(&self) -> Option<i64> {
        self.adversary_impulse_ns.map(|impulse| (1000.0 * impulse).round() as i64)
    }

    /// Standard deviations of what is off, anew in each observation and always, in millimetres.
    pub(super) fn noise_mm(&self) -> [i64; 2] {
        [self.noise_frame_m, self.noise_offset_m].map(|noise| noise.map_or(0, |noise| (1000.0 * noise).round() as i64))
    }

    /// How far the gripper opens at most, in millimetres.
    pub(super) fn jaw_mm(&self) -> i64 {
        (1000.0 * self.jaw_m.unwrap_or(USUAL_JAW_M)).round() as i64
    }

    /// The errors of a camera whose turn, place and depths are off in the proportion of a well calibrated one, in percent
    /// of that one's.
    pub(super) fn calibration_percent(&self) -> Option<i64> {
        let usual = PerceptionConfig::default();
        let pairs = [
            (self.calibration_deg?, usual.calibration_deg),
            (self.calibration_mm?, usual.calibration_mm),
            (self.depth_mm?, usual.depth_mm),
        ];
        let [deg, mm, depth] = pairs.map(|(found, usual)| (100.0 * found / f64::from(usual)).round() as i64);
        (deg == mm && mm == depth).then_some(deg)
    }

    /// The camera and its errors in a few words; nothing without one.
    pub(super) fn camera_words(&self) -> Option<String> {
        let camera = self.camera.as_deref()?;
        let errors = [(self.calibration_deg, "\u{b0}"), (self.calibration_mm, " mm"), (self.depth_mm, " mm in depth")];
        let errors: Vec<String> =
            errors.into_iter().filter_map(|(error, unit)| Some(format!("{}{unit}", error?))).collect();
        let exact = if self.sensor.as_deref() == Some("exact") { ", exact depths" } else { "" };
        Some(format!("{camera} camera off by {}{exact}", errors.join(", ")))
    }

    /// In a few words: `Block Stacking, 4 blocks, unseen tasks, a push at 25 %`. Empty where nothing is known.
    pub(super) fn words(&self) -> String {
        let Some(family) = &self.family else { return String::new() };
        let mut words = vec![capitalized(family)];
        words.extend(self.blocks.map(|blocks| format!("{blocks} blocks")));
        words.extend(self.bowls.map(|bowls| counted(bowls, "bowl")));
        words.extend(self.objects().filter(|_| self.blocks.is_none()).map(|objects| counted(objects, "object")));
        words.extend(self.split.as_ref().map(|split| format!("{split} tasks")));
        words.extend((self.order.as_deref() == Some("shuffled")).then(|| "towers in another order".to_owned()));
        let push = self.push_percent().zip(self.push_mns()).filter(|&(percent, _)| percent > 0);
        words.extend(push.map(|(percent, mns)| format!("a push of {mns} mN\u{202f}s at {percent} %")));
        words.extend(self.robot.as_deref().map(|robot| format!("acted by {}", capitalized(robot))));
        words.extend(self.camera_words().map(|camera| format!("seen by the {camera}")));
        words.extend(self.jaw_m.map(|_| format!("a gripper that opens {} mm", self.jaw_mm())));
        let [frame, offset] = self.noise_mm();
        words.extend((frame > 0).then(|| format!("positions off by {frame} mm")));
        words.extend((offset > 0).then(|| format!("positions always off by {offset} mm")));
        if !self.shows_what_is_there() {
            words.push("more on the table than was shown".to_owned());
        }
        words.join(", ")
    }
}

/// Under which name a grouped table has the highest value of a column.
pub(super) fn highest(name: &str) -> String {
    format!("{name}_highest")
}

/// The value of each group whose lowest and highest are the same.
fn same<T: PartialEq>(lowest: Vec<Option<T>>, highest: Vec<Option<T>>) -> Vec<Option<T>> {
    lowest.into_iter().zip(highest).map(|(low, high)| low.filter(|low| Some(low) == high.as_ref())).collect()
}

/// `block_stacking` as `Block Stacking`.
fn capitalized(name: &str) -> String {
    let word = |word: &str| {
        let mut letters = word.chars();
        letters.next().into_iter().flat_map(char::to_uppercase).chain(letters).collect::<String>()
    };
    name.split('_').map(word).collect::<Vec<_>>().join(" ")
}
