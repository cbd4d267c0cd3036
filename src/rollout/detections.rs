//! What a detector found in demonstrations, beside the truth: rows of `detections.parquet`
//! (schemas/parquet/detections.message).

use std::path::Path;

use crate::rollout::Acted;
use crate::scene::{BodyIndex, Mobility, Scene};
use crate::table::{self, Column, TableError, TableSchema};
use crate::trace::{Episode, Observation};

/// One row a movable body and boundary frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetectionRows {
    rows: Vec<DetectionRow>,
}

/// The columns of schemas/parquet/detections.message.
#[derive(Clone, Debug, PartialEq)]
struct DetectionRow {
    variant: String,
    suite: String,
    training_seed: i64,
    train_tasks: i64,
    episode: i64,
    frame: i64,
    slot: String,
    error_m: [f64; 3],
    visible_share: f64,
}

/// A demonstration as a detector saw it.
pub struct Detected<'d> {
    /// Position of the episode in its suite.
    pub episode: u64,
    /// What was shown.
    pub demonstration: &'d Episode,
    /// An observation row for each boundary frame.
    pub rows: &'d [f32],
    /// The visible share of each body in each boundary frame.
    pub visible_shares: &'d [Vec<f64>],
}

impl DetectionRows {
    /// Adds the errors of a demonstration.
    pub fn push(&mut self, variant: &str, suite: &str, by: &Acted, detected: &Detected<'_>) {
        let Detected { episode, demonstration, rows, visible_shares } = *detected;
        let scene = &demonstration.scene;
        let width = Observation::width(scene.slots.len());
        let frames = demonstration.boundary_frames().zip(rows.chunks_exact(width)).zip(visible_shares).enumerate();
        for (frame, (((_, recorded), found), shares)) in frames {
            let truth = recorded.observation();
            for (slot, body) in movable_slots(scene) {
                let error = |axis: usize| f64::from(found[3 * slot + axis]) - f64::from(truth.slots_m[slot][axis]);
                self.rows.push(DetectionRow {
                    variant: variant.to_owned(),
                    suite: suite.to_owned(),
                    training_seed: by.training_seed as i64,
                    train_tasks: by.train_tasks.map_or(0, i64::from),
                    episode: episode as i64,
                    frame: frame as i64,
                    slot: scene.slots[slot].name.clone(),
                    error_m: [error(0), error(1), error(2)],
                    visible_share: shares[usize::from(body.0)],
                });
            }
        }
    }

    /// Adds rows at the end.
    pub fn append(&mut self, other: Self) {
        self.rows.extend(other.rows);
    }

    /// Writes the table.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TableError> {
        let rows = &self.rows;
        let text = |get: fn(&DetectionRow) -> &String| Column::Text(rows.iter().map(|row| get(row).clone()).collect());
        let int = |get: fn(&DetectionRow) -> i64| Column::Int64(rows.iter().map(get).collect());
        let float = |get: fn(&DetectionRow) -> f64| Column::Float64(rows.iter().map(get).collect());
        let columns = vec![
            ("variant", text(|row| &row.variant)),
            ("suite", text(|row| &row.suite)),
            ("training_seed", int(|row| row.training_seed)),
            ("train_tasks", int(|row| row.train_tasks)),
            ("episode", int(|row| row.episode)),
            ("frame", int(|row| row.frame)),
            ("slot", text(|row| &row.slot)),
            ("error_x_m", float(|row| row.error_m[0])),
            ("error_y_m", float(|row| row.error_m[1])),
            ("error_z_m", float(|row| row.error_m[2])),
            ("visible_share", float(|row| row.visible_share)),
        ];
        table::write(path, &TableSchema::DETECTIONS, columns)
    }

    /// Reads the table.
    ///
    /// # Errors
    ///
    /// When it is not there or not such a table.
    pub fn read(path: &Path) -> Result<Self, TableError> {
        let mut columns = table::read(path, &TableSchema::DETECTIONS)?;
        let mut variant = columns.text("variant")?.into_iter();
        let mut suite = columns.text("suite")?.into_iter();
        let mut training_seed = columns.int64("training_seed")?.into_iter();
        let mut train_tasks = columns.int64("train_tasks")?.into_iter();
        let mut episode = columns.int64("episode")?.into_iter();
        let mut frame = columns.int64("frame")?.into_iter();
        let mut slot = columns.text("slot")?.into_iter();
        let mut x = columns.float64("error_x_m")?.into_iter();
        let mut y = columns.float64("error_y_m")?.into_iter();
        let mut z = columns.float64("error_z_m")?.into_iter();
        let mut visible_share = columns.float64("visible_share")?.into_iter();
        let mut next = || {
            Some(DetectionRow {
                variant: variant.next()?,
                suite: suite.next()?,
                training_seed: training_seed.next()?,
                train_tasks: train_tasks.next()?,
                episode: episode.next()?,
                frame: frame.next()?,
                slot: slot.next()?,
                error_m: [x.next()?, y.next()?, z.next()?],
                visible_share: visible_share.next()?,
            })
        };
        Ok(Self { rows: std::iter::from_fn(&mut next).collect() })
    }
}

/// The slots of what moves, with the body that each shows. What is fixed stands aside, or is no thing to be found.
fn movable_slots(scene: &Scene) -> impl Iterator<Item = (usize, BodyIndex)> {
    let shown = scene.slots.iter().enumerate().filter(|(_, slot)| slot.bodies.len() == 1);
    let bodies = shown.map(|(slot, of)| (slot, of.bodies[0]));
    bodies.filter(|&(_, body)| scene.body(body).mobility == Mobility::Movable)
}
