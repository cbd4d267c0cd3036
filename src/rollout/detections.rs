//! What a detector found in demonstrations, beside the truth: rows of `detections.parquet`.

use std::path::Path;

use crate::rollout::Acted;
use crate::scene::{BodyIndex, Mobility, Scene};
use crate::table::{TableError, TableRows as _, table};
use crate::trace::{Episode, ObservationRows};

/// One row a movable body and boundary frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DetectionRows {
    rows: Rows,
}

table! {
    /// `detections.parquet` of a suite that a model behind a detector acted: a row for each movable body in each boundary frame of each demonstration that it was given. A detection is of that one picture, of a body's place in the world; the gripper's, which positions are told from, the robot knows.
    detections {
        /// the model's variant
        variant: Text,
        /// which suite
        suite: Text,
        /// of the model's training
        training_seed: Int64,
        /// tasks that the model was trained on
        train_tasks: Int64,
        /// position in the suite
        episode: Int64,
        /// boundary frame of the demonstration
        frame: Int64,
        /// which body: `block_A`
        slot: Text,
        /// detected minus true position along the world's x
        error_x_m: Float64,
        /// the same along y
        error_y_m: Float64,
        /// the same along z
        error_z_m: Float64,
        /// how much of the body's outline in the picture nothing hides, 0 to 1; 0 also outside of the picture
        visible_share: Float64,
    }
}

/// A demonstration as a detector saw it.
pub struct Detected<'d> {
    /// Position of the episode in its suite.
    pub episode: u64,
    /// What was shown.
    pub demonstration: &'d Episode,
    /// What it found in each boundary frame.
    pub rows: &'d ObservationRows,
    /// The visible share of each body in each boundary frame.
    pub visible_shares: &'d [Vec<f64>],
}

impl DetectionRows {
    /// Adds the errors of a demonstration.
    pub fn push(&mut self, variant: &str, suite: &str, by: &Acted, detected: &Detected<'_>) {
        let Detected { episode, demonstration, rows, visible_shares } = *detected;
        let scene = &demonstration.scene;
        let frames = demonstration.boundary_frames().zip(rows.iter()).zip(visible_shares).enumerate();
        for (frame, (((_, recorded), found), shares)) in frames {
            let truth = recorded.observation();
            for (slot, body) in movable_slots(scene) {
                let error = |axis: usize| f64::from(found.positions[slot][axis]) - f64::from(truth.slots_m[slot][axis]);
                self.rows.push(Row {
                    variant: variant.into(),
                    suite: suite.into(),
                    training_seed: by.training_seed as i64,
                    train_tasks: by.train_tasks.map_or(0, i64::from),
                    episode: episode as i64,
                    frame: frame as i64,
                    slot: scene.slots[slot].name.as_str().into(),
                    error_x_m: error(0),
                    error_y_m: error(1),
                    error_z_m: error(2),
                    visible_share: shares[usize::from(body.0)],
                });
            }
        }
    }

    /// Adds rows at the end.
    pub fn append(&mut self, other: Self) {
        self.rows.append(other.rows);
    }

    /// Writes the table.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TableError> {
        self.rows.write(path)
    }

    /// Reads the table.
    ///
    /// # Errors
    ///
    /// When it is not there or not such a table.
    pub fn read(path: &Path) -> Result<Self, TableError> {
        Ok(Self { rows: Rows::read(path)? })
    }
}

/// The slots of what moves, with the body that each shows. What is fixed stands aside, or is no thing to be found.
fn movable_slots(scene: &Scene) -> impl Iterator<Item = (usize, BodyIndex)> {
    let shown = scene.slots.iter().enumerate().filter(|(_, slot)| slot.bodies.len() == 1);
    let bodies = shown.map(|(slot, of)| (slot, of.bodies[0]));
    bodies.filter(|&(_, body)| scene.body(body).mobility == Mobility::Movable)
}
