//! Detectors' errors in unseen scenes, by how much of a thing is in sight.
//!
//! # Input and output
//!
//! schemas/parquet/detections.message, one row a body and frame; any number of files.
//!
//! # Invariants
//!
//! Errors are summed in whole micrometres and their squares, so that no order of rows shows in the result.

use std::collections::BTreeMap;
use std::path::PathBuf;

use polars::prelude::DataType;
use schemars::JsonSchema;
use serde::Serialize;

use crate::report::actor::{ModelParts, model_name};
use crate::report::facts::BLOCK_STACKING;
use crate::report::frames::{Rows, collect, scan};
use crate::report::paper::{DETECTOR_BLOCKS, DETECTOR_DEVIATION_CM};
use crate::report::summary::SuiteResult;
use crate::report::{ReportError, order};

const COLUMNS: [(&str, DataType); 8] = [
    ("variant", DataType::String),
    ("suite", DataType::String),
    ("training_seed", DataType::Int64),
    ("train_tasks", DataType::Int64),
    ("error_x_m", DataType::Float64),
    ("error_y_m", DataType::Float64),
    ("error_z_m", DataType::Float64),
    ("visible_share", DataType::Float64),
];

/// From this share on a thing is in full sight: its edges may be hidden.
const FULL_SHARE: f64 = 0.75;
/// Below this share it is hidden.
const HIDDEN_SHARE: f64 = 0.25;
const MICROMETRES: f64 = 1e6;
const PER_CM: f64 = 1e4;
/// What counts as a large error.
const LARGE_CM: f64 = 2.0;

/// The detections of one model in one suite.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DetectionsInput {
    /// Of which experiment.
    pub experiment: String,
    /// The model's tag.
    pub tag: Option<String>,
    /// Its detections.parquet.
    pub path: PathBuf,
}

/// How much of a thing is in sight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InSight {
    /// Whatever is in sight of it.
    All,
    /// At least three quarters of its outline.
    Full,
    /// A quarter to three quarters.
    Part,
    /// Less than a quarter.
    Hidden,
}

impl InSight {
    fn of(visible_share: f64) -> Self {
        match visible_share {
            share if share >= FULL_SHARE => Self::Full,
            share if share >= HIDDEN_SHARE => Self::Part,
            _ => Self::Hidden,
        }
    }

    /// In words.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::All => "all",
            Self::Full => "3/4 and more",
            Self::Part => "1/4 to 3/4",
            Self::Hidden => "less than 1/4",
        }
    }
}

/// The errors of a detector in the demonstrations of a suite, over training seeds.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DetectionError {
    /// Of which experiment.
    pub experiment: String,
    /// The variant of the model behind it.
    pub variant: String,
    /// Its parts.
    #[serde(flatten)]
    pub parts: ModelParts,
    /// What tells it apart from other models of its variant; null for most.
    pub tag: Option<String>,
    /// How many tasks it was trained on.
    pub train_tasks: i64,
    /// The set of evaluation tasks.
    pub suite: String,
    /// How many training seeds.
    pub seeds: u64,
    /// Of which things.
    pub in_sight: InSight,
    /// How many detections.
    pub detections: u64,
    /// Median distance between detected and true position, in centimetres.
    pub median_cm: f64,
    /// Mean absolute error along x, y and z, in centimetres.
    pub mean_absolute_cm: [f64; 3],
    /// Standard deviation of the error of a coordinate, all three together, in centimetres: what the paper gives.
    pub deviation_cm: f64,
    /// The 95th percentile of distances, in centimetres.
    pub percentile_95_cm: f64,
    /// The 99th percentile of distances, in centimetres.
    pub percentile_99_cm: f64,
    /// Share of distances above two centimetres.
    pub over_2_cm: f64,
    /// The paper's standard deviation, in centimetres; null where there are not its eight blocks.
    pub paper_deviation_cm: Option<f64>,
}

/// What tells rows of the result apart, in their order.
type Key = (String, String, String, Option<String>, i64, InSight);

/// The errors of some detections.
#[derive(Debug, Default)]
struct Errors {
    seeds: Vec<i64>,
    /// In micrometres.
    distances: Vec<i64>,
    sums: [i64; 3],
    absolute_sums: [i64; 3],
    square_sums: [i128; 3],
}

/// Reads and sums up; nothing when there are no files. What suites ask for and models are, their results say.
pub(super) fn read(inputs: &[DetectionsInput], results: &[SuiteResult]) -> Result<Vec<DetectionError>, ReportError> {
    let mut by_key: BTreeMap<Key, Errors> = BTreeMap::new();
    for input in inputs {
        let table = collect(scan(&input.path, &COLUMNS)?, std::slice::from_ref(&input.path))?;
        let rows = Rows(&table);
        let (variants, suites) = (rows.text("variant")?, rows.text("suite")?);
        let (seeds, train_tasks) = (rows.whole("training_seed")?, rows.whole("train_tasks")?);
        let [x, y, z] = ["error_x_m", "error_y_m", "error_z_m"].map(|name| rows.real(name));
        let (axes, shares) = ([x?, y?, z?], rows.real("visible_share")?);
        for row in 0..table.height() {
            for in_sight in [InSight::All, InSight::of(shares[row])] {
                let (suite, variant) = (suites[row].clone(), variants[row].clone());
                let (experiment, tag) = (input.experiment.clone(), input.tag.clone());
                let key = (suite, experiment, variant, tag, train_tasks[row], in_sight);
                by_key.entry(key).or_default().add(seeds[row], [0, 1, 2].map(|axis| axes[axis][row]));
            }
        }
    }
    let mut errors: Vec<DetectionError> = by_key.into_iter().map(|(key, errors)| errors.summed(key)).collect();
    for error in &mut errors {
        let own = |result: &&SuiteResult| {
            let actor = &result.actor;
            (&actor.experiment, &actor.variant, &actor.tag, &result.suite)
                == (&error.experiment, &error.variant, &error.tag, &error.suite)
        };
        let Some(result) = results.iter().find(own) else { continue };
        error.parts = result.actor.parts.clone();
        error.paper_deviation_cm = is_the_papers(result).then_some(DETECTOR_DEVIATION_CM);
    }
    let place_of = |suite: &str| results.iter().position(|result| result.suite == suite);
    errors.sort_by_cached_key(|error| {
        let model = order::model(&error.variant, &error.parts, false);
        let suite = (place_of(&error.suite), error.suite.clone());
        (suite, error.experiment.clone(), model, error.tag.clone(), -error.train_tasks, error.in_sight)
    });
    Ok(errors)
}

/// Whether the paper's detector looked for the same things, and this model was not trained otherwise on purpose.
fn is_the_papers(result: &SuiteResult) -> bool {
    let is_family = result.facts.family.as_deref() == Some(BLOCK_STACKING);
    is_family && result.facts.blocks == Some(DETECTOR_BLOCKS) && result.actor.tag.is_none()
}

impl DetectionError {
    /// The variant, and the tag where there is one.
    pub(super) fn model(&self) -> String {
        model_name(&self.variant, "", self.tag.as_deref())
    }
}

impl Errors {
    fn add(&mut self, seed: i64, error_m: [f64; 3]) {
        if !self.seeds.contains(&seed) {
            self.seeds.push(seed);
        }
        let micrometres = error_m.map(|value| (value * MICROMETRES).round() as i64);
        for (axis, value) in micrometres.into_iter().enumerate() {
            self.sums[axis] = self.sums[axis].saturating_add(value);
            self.absolute_sums[axis] = self.absolute_sums[axis].saturating_add(value.saturating_abs());
            self.square_sums[axis] = self.square_sums[axis].saturating_add(i128::from(value) * i128::from(value));
        }
        let length = error_m.iter().map(|value| value * value).sum::<f64>().sqrt();
        self.distances.push((length * MICROMETRES).round() as i64);
    }

    fn summed(mut self, (suite, experiment, variant, tag, train_tasks, in_sight): Key) -> DetectionError {
        self.distances.sort_unstable();
        let n = self.distances.len().max(1) as f64;
        let cm = |micrometres: f64| micrometres / PER_CM;
        let percentile = |share: f64| {
            let position =
                ((self.distances.len() as f64 * share).ceil() as usize).clamp(1, self.distances.len().max(1));
            cm(self.distances.get(position - 1).copied().unwrap_or_default() as f64)
        };
        let variance = |axis: usize| self.square_sums[axis] as f64 / n - (self.sums[axis] as f64 / n).powi(2);
        let over = self.distances.iter().filter(|&&distance| cm(distance as f64) > LARGE_CM).count();
        DetectionError {
            experiment,
            variant,
            parts: ModelParts::default(),
            tag,
            train_tasks,
            suite,
            seeds: self.seeds.len() as u64,
            in_sight,
            detections: self.distances.len() as u64,
            median_cm: percentile(0.5),
            mean_absolute_cm: self.absolute_sums.map(|sum| cm(sum as f64 / n)),
            deviation_cm: cm(((variance(0) + variance(1) + variance(2)) / 3.0).max(0.0).sqrt()),
            percentile_95_cm: percentile(0.95),
            percentile_99_cm: percentile(0.99),
            over_2_cm: over as f64 / n,
            paper_deviation_cm: None,
        }
    }
}
