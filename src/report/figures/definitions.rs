//! Which figures there are: a new one is an entry of [`DEFINITIONS`].

use crate::perception::{Sensor, Stand};
use crate::report::facts::{Ask, BLOCK_STACKING, OBJECT_SORTING};
use crate::report::figures::Figure;
use crate::report::kind::{Design, Sight};
use crate::report::summary::Aggregate;

/// How a figure is made.
pub(super) struct Definition {
    pub(super) id: &'static str,
    pub(super) title: &'static str,
    pub(super) x_label: &'static str,
    /// Where the paper shows it.
    pub(super) source: &'static str,
    /// What it says there in numbers: told where points of it stand in the figure, and not otherwise.
    pub(super) says: &'static str,
    /// The quantity of a row; `None` where the row is not in the figure.
    pub(super) x: fn(&Aggregate) -> Option<i64>,
    /// Whether models that were trained otherwise on purpose are shown, too.
    pub(super) shows_tagged: bool,
    /// Whether the quantity is the number of training tasks. In other figures a variant is shown after the most alone.
    pub(super) is_over_tasks: bool,
    /// What must be there for the figure to say anything.
    pub(super) is_worth_it: fn(&Figure) -> bool,
}

/// In the order of the report.
pub(super) const DEFINITIONS: [Definition; 12] = [
    Definition {
        id: "sorting_length",
        title: "Object Sorting: length",
        x_label: "objects on the table",
        source: "Experiment 1",
        says: "NTP over 90 % from 4 to 40 objects; flat models from around 40 % to around 25 %",
        x: |row| row.facts.objects().filter(|_| asks(row, OBJECT_SORTING, Ask::Unseen) && is_shown(row)),
        is_over_tasks: false,
        shows_tagged: false,
        is_worth_it: two_places,
    },
    Definition {
        id: "stacking_unseen",
        title: "Block Stacking: unseen end configurations",
        x_label: "training tasks",
        source: "Experiment 2 and table \u{201c}Adversarial Dynamics\u{201d}, no failure",
        says: "0.863 and 0.884 with 1000 tasks",
        x: |row| trained(row, Ask::Unseen).filter(|_| !row.actor.parts.sees()),
        is_over_tasks: true,
        shows_tagged: false,
        is_worth_it: two_places,
    },
    Definition {
        id: "stacking_pictures",
        title: "Block Stacking: from pictures, unseen end configurations",
        x_label: "training tasks",
        source: "Experiment 4: full state above end to end above the detector; the text gives no number",
        says: "",
        x: |row| trained(row, Ask::Unseen).filter(|_| row.actor.parts.is(Design::NTP)),
        is_over_tasks: true,
        shows_tagged: false,
        is_worth_it: |figure| two_places(figure) && figure.series.iter().any(|series| series.parts.sees()),
    },
    Definition {
        id: "stacking_seen",
        title: "Block Stacking: seen end configurations",
        x_label: "training tasks",
        source: "Experiment 2",
        says: "all but Flat around 85 %",
        x: |row| trained(row, Ask::Seen),
        is_over_tasks: true,
        shows_tagged: false,
        is_worth_it: two_places,
    },
    Definition {
        id: "stacking_topology",
        title: "Block Stacking: towers in another order",
        x_label: "training tasks",
        source: "Experiment 2, task topology; the text gives no number",
        says: "",
        x: |row| trained(row, Ask::Topology),
        is_over_tasks: true,
        shows_tagged: false,
        is_worth_it: two_places,
    },
    Definition {
        id: "stacking_adversary",
        title: "Block Stacking: adversary",
        x_label: "chance of a push after each placement, %",
        source: "Table \u{201c}Adversarial Dynamics\u{201d}",
        says: "0.863 to 0.663, with a GRU 0.884 to 0.422",
        x: |row| pushed(row, |_, mns| mns == USUAL_PUSH.1).map(|(percent, _)| percent),
        is_over_tasks: false,
        shows_tagged: false,
        is_worth_it: two_places,
    },
    Definition {
        id: "stacking_adversary_force",
        title: "Block Stacking: force of the adversary",
        x_label: "impulse of a push at 25 %, mN\u{202f}s",
        source: "Ours; the paper gives no force",
        says: "",
        x: |row| pushed(row, |percent, _| percent == USUAL_PUSH.0).map(|(_, mns)| mns),
        is_over_tasks: false,
        shows_tagged: false,
        is_worth_it: |figure| n_places(figure) >= 3,
    },
    Definition {
        id: "stacking_noise",
        title: "Block Stacking: noise",
        x_label: "standard deviation of each observed position, mm",
        source: "Ours; dashed where a model was trained otherwise, as its tag says",
        says: "",
        x: |row| put_off(row, |[frame, offset]| (offset == 0).then_some(frame)),
        is_over_tasks: false,
        shows_tagged: true,
        is_worth_it: |figure| n_places(figure) >= 3,
    },
    Definition {
        id: "stacking_offset",
        title: "Block Stacking: offsets",
        x_label: "standard deviation of an offset of each block, mm",
        source: "Ours; dashed where a model was trained otherwise, as its tag says",
        says: "",
        x: |row| put_off(row, |[frame, offset]| (frame == 0).then_some(offset)),
        is_over_tasks: false,
        shows_tagged: true,
        is_worth_it: |figure| n_places(figure) >= 3,
    },
    Definition {
        id: "robot_stacking_calibration",
        title: "Robot table, Block Stacking: calibration of the camera",
        x_label: CALIBRATION,
        source: "Ours; the paper does not vary it",
        says: "",
        x: |row| calibrated(row, BLOCK_STACKING),
        is_over_tasks: false,
        shows_tagged: false,
        is_worth_it: |figure| n_places(figure) >= 3,
    },
    Definition {
        id: "robot_sorting_calibration",
        title: "Robot table, Object Sorting: calibration of the camera",
        x_label: CALIBRATION,
        source: "Ours; the paper does not vary it",
        says: "",
        x: |row| calibrated(row, OBJECT_SORTING),
        is_over_tasks: false,
        shows_tagged: false,
        is_worth_it: |figure| n_places(figure) >= 3,
    },
    Definition {
        id: "robot_stacking_jaw",
        title: "Robot table, Block Stacking: opening of the gripper",
        x_label: "greatest opening, mm; blocks are 50 mm wide",
        source: "Ours; the paper does not vary it",
        says: "",
        x: |row| seen(row, BLOCK_STACKING).filter(|percent| *percent == 100).map(|_| row.facts.jaw_mm()),
        is_over_tasks: false,
        shows_tagged: false,
        is_worth_it: |figure| n_places(figure) >= 3,
    },
];

/// Of a well calibrated camera's errors.
const CALIBRATION: &str = "errors of the camera, % of 0.1\u{b0}, 1.5 mm and 2 mm in depth";
/// Opening of the gripper of the robot table, in millimetres.
const TABLE_JAW_MM: i64 = 57;
/// The paper's 20 trials say little beside hundreds.
const MANY: u64 = 50;

/// The paper's chance of a push in percent, and the simulator's usual impulse in millinewton seconds.
pub(in crate::report) const USUAL_PUSH: (i64, i64) = (25, 60);

pub(super) fn asks(row: &Aggregate, family: &'static str, ask: Ask) -> bool {
    row.facts.asks(family, ask)
}

/// Whether as much is on the table as in the demonstration.
fn is_shown(row: &Aggregate) -> bool {
    row.facts.shows_what_is_there()
}

/// The training tasks of a row of Block Stacking.
fn trained(row: &Aggregate, ask: Ask) -> Option<i64> {
    row.actor.train_tasks.filter(|_| asks(row, BLOCK_STACKING, ask))
}

/// Chance and impulse of the pushes in a row of Block Stacking: those that are asked for, and none at all.
fn pushed(row: &Aggregate, is_asked_for: fn(i64, i64) -> bool) -> Option<(i64, i64)> {
    let (percent, mns) = row.facts.push_percent().zip(row.facts.push_mns())?;
    let is_in = asks(row, BLOCK_STACKING, Ask::Unseen)
        || asks(row, BLOCK_STACKING, Ask::Adversary) && is_asked_for(percent, mns);
    let sees = row.actor.parts.sight() != Some(Sight::Positions);
    is_in.then_some((percent, mns)).filter(|_| !sees)
}

/// The noise of a row of Block Stacking on unseen tasks, where it is of the kind that is asked for.
fn put_off(row: &Aggregate, kind: fn([i64; 2]) -> Option<i64>) -> Option<i64> {
    let is_in = asks(row, BLOCK_STACKING, Ask::Unseen) || asks(row, BLOCK_STACKING, Ask::Noise);
    kind(row.facts.noise_mm()).filter(|_| is_in && !row.actor.parts.sees())
}

/// The calibration of the camera that an arm sees with, in a row of a family on unseen tasks of many rollouts.
fn seen(row: &Aggregate, family: &'static str) -> Option<i64> {
    let facts = &row.facts;
    let is_robot_table = facts.robot.is_some() && facts.camera.as_deref() == Some(Stand::Front.name());
    let is_noisy = facts.sensor.as_deref() == Some(Sensor::Kinect.name());
    let is_in = is_robot_table && is_noisy && facts.family.as_deref() == Some(family) && row.episodes >= MANY;
    facts.calibration_percent().filter(|_| is_in)
}

/// The same with the gripper of the robot table.
fn calibrated(row: &Aggregate, family: &'static str) -> Option<i64> {
    seen(row, family).filter(|_| row.facts.jaw_mm() == TABLE_JAW_MM)
}

/// How many quantities have a point.
fn n_places(figure: &Figure) -> usize {
    let mut places: Vec<i64> = figure.series.iter().flat_map(|series| &series.ours).map(|point| point.x).collect();
    places.sort_unstable();
    places.dedup();
    places.len()
}

/// With one there is nothing to see.
fn two_places(figure: &Figure) -> bool {
    n_places(figure) >= 2
}
