//! A detector's learning curve, and its table `detector_metrics.parquet`.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::table::{TableError, TableRows as _, table};

table! {
    /// `detector_metrics.parquet` of a model behind a detector: the detector's learning curve, a row a logged step.
    detector_metrics {
        /// the step, from 1; the network behind it begins after the last
        step: Int64,
        /// of positions
        loss: OptionalFloat32,
        /// mean distance between detected and true positions in the step's pictures, before it is learned from
        distance_m: OptionalFloat32,
        /// of the step
        learning_rate: Float32,
        /// pictures learned from
        pictures: Int64,
    }
}

/// One row of `detector_metrics.parquet`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectorMetric {
    /// The step, from 1.
    pub step: u32,
    /// Of positions.
    pub loss: f32,
    /// Mean distance between detected and true positions, in metres.
    pub distance_m: f32,
    /// Of the step.
    pub learning_rate: f64,
    /// How many pictures were learned from.
    pub pictures: u32,
}

/// Writes a detector's learning curve.
pub(super) fn write(path: &Path, metrics: &[DetectorMetric]) -> Result<(), TableError> {
    let mut rows = Rows::default();
    for metric in metrics {
        rows.push(Row {
            step: i64::from(metric.step),
            loss: Some(metric.loss),
            distance_m: Some(metric.distance_m),
            learning_rate: metric.learning_rate as f32,
            pictures: i64::from(metric.pictures),
        });
    }
    rows.write(path)
}
