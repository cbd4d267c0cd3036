//! Rollouts and metrics into tables, plots and one page, by Polars.
//!
//! # Input and output
//!
//! Reads rollouts.parquet, metrics.parquet and detections.parquet files (schemas/parquet/); writes `report.json`
//! (schemas/report.schema.json), `report.md`, `results.csv`, `curves.csv` and `index.html`, which needs no other file.
//!
//! # Invariants
//!
//! The same inputs give the same bytes: no clock, no host, no thread count and no order of rows shows. One input is
//! measured: what stages took ([`ReportInputs::costs`], and each model's own). Two equal runs differ in that alone.

mod actor;
mod aggregate;
mod chart;
mod claims;
mod csv;
mod detections;
mod facts;
mod figures;
mod filmstrip;
mod frames;
mod interval;
mod kind;
mod markdown;
mod metrics;
mod order;
mod page;
mod paper;
mod robot_table;
mod rollouts;
mod section;
mod suite_names;
mod summary;

pub use actor::{Actor, ModelParts};
pub use claims::{Claim, Note, Verdict};
pub use detections::{DetectionError, DetectionsInput, InSight};
pub use facts::SuiteFacts;
pub use figures::{Figure, Grid, GridCell, PaperPoint, Point, Series};
pub use filmstrip::{Filmstrip, Shows, StripPicture};
pub use interval::{student, wilson};
pub use metrics::MetricsInput;
pub use paper::{PaperValue, paper_values};
pub use robot_table::{PaperRobot, RobotRow, Share};
pub use rollouts::RolloutsInput;
pub use summary::{
    Aggregate, AnnotationResult, Divergence, Fact, FirstError, InputFile, ModelSummary, Report, StageCost, SuiteResult,
    TrainingEnd,
};

use std::path::{Path, PathBuf};

use polars::error::PolarsError;

use crate::annotate::Measured;
use crate::artifact::{self, IoError};
use crate::words::counted;

/// What a report is made of. Any part may be empty: a report of a run that has only trained is a report.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportInputs {
    /// What the run is called.
    pub title: String,
    /// rollouts.parquet files, in any order.
    pub rollouts: Vec<RolloutsInput>,
    /// metrics.parquet files, in any order.
    pub metrics: Vec<MetricsInput>,
    /// detections.parquet files, in any order.
    pub detections: Vec<DetectionsInput>,
    /// Annotated datasets, in the order they are to be shown.
    pub annotations: Vec<AnnotationsInput>,
    /// Episodes in pictures, in the order they are to be shown.
    pub filmstrips: Vec<Filmstrip>,
    /// What else there is to say of the run, in the order it is to be told.
    pub facts: Vec<Fact>,
    /// What each stage took, as far as it was measured.
    pub costs: Vec<StageCost>,
    /// Of which commits the pipeline files were.
    pub commits: Vec<String>,
    /// What to set beside the results; [`paper_values`] as a rule.
    pub paper: Vec<PaperValue>,
}

/// An annotated dataset that was measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AnnotationsInput {
    /// Of which experiment.
    pub experiment: String,
    /// What it is called.
    pub name: String,
    /// Its `ntp/annotation.json`.
    pub path: PathBuf,
}

/// A report that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A table could not be read.
    #[error("cannot read the table: {source}: {}", path.display())]
    Table {
        /// Which file, or the first of several.
        path: PathBuf,
        /// What Polars says.
        source: PolarsError,
    },
    /// A table is not of its schema.
    #[error("column {column} {problem}: {}", path.display())]
    Column {
        /// Which file.
        path: PathBuf,
        /// Which column.
        column: String,
        /// What is there instead.
        problem: String,
    },
    /// A rollouts table contradicts itself.
    #[error("{rows} in which {problem}: {}", path.display(), rows = counted(*rows, "row"))]
    Rows {
        /// Which file.
        path: PathBuf,
        /// How many rows.
        rows: i64,
        /// What contradicts what.
        problem: &'static str,
    },
    /// An episode would count twice.
    #[error("{rows} of {}, suite {suite}, training seed {seed} occur more than once", told(actor), rows = counted(*rows, "episode"))]
    Repeated {
        /// Of which actor.
        actor: Box<Actor>,
        /// In which suite.
        suite: String,
        /// Of which training seed.
        seed: i64,
        /// How many rows are too many.
        rows: i64,
    },
    /// A query over checked tables failed.
    #[error("cannot sum up the tables: {0}")]
    Query(#[source] PolarsError),
    /// Labels were made, but not held against true ones.
    #[error("measured: it is missing; annotate with --against: {}", path.display())]
    NotMeasured {
        /// Which file.
        path: PathBuf,
    },
    /// The page could not be filled in.
    #[error("cannot fill in the page: {0}")]
    Page(#[from] minijinja::Error),
}

/// An actor for an error.
fn told(actor: &Actor) -> String {
    let Actor { experiment, variant, parts: _, tag, train_tasks, specification: _, decoder } = actor;
    let mut told = format!("experiment {experiment}, variant {variant}");
    if let Some(tag) = tag {
        told.push_str(&format!(" ({tag})"));
    }
    if let Some(tasks) = train_tasks {
        told.push_str(&format!(" trained on {tasks}", tasks = counted(*tasks, "task")));
    }
    if let Some(decoder) = decoder {
        told.push_str(&format!(", decoder {decoder}"));
    }
    told
}

/// Makes a report in the folder `out`.
///
/// # Errors
///
/// When an input is missing or not of its schema, an episode occurs twice, or a file cannot be written.
pub fn make(inputs: &ReportInputs, out: &Path) -> Result<Report, ReportError> {
    let files = input_files(inputs, out)?;
    let rollouts = rollouts::read(&inputs.rollouts)?;
    let curves = metrics::read(&inputs.metrics)?;
    let aggregates = aggregate::aggregates(&rollouts.results, &inputs.paper);
    let report = Report {
        schema_version: summary::SCHEMA_VERSION,
        ntp_version: env!("CARGO_PKG_VERSION").to_owned(),
        title: inputs.title.clone(),
        claims: claims::claims(&aggregates),
        notes: claims::notes(&aggregates),
        figures: figures::figures(&aggregates),
        grids: figures::grids(&aggregates),
        robot_table: robot_table::rows(&aggregates),
        aggregates,
        detections: detections::read(&inputs.detections, &rollouts.results)?,
        annotations: inputs.annotations.iter().map(annotation).collect::<Result<_, _>>()?,
        results: rollouts.results,
        divergences: rollouts.divergences,
        errors: rollouts.errors,
        filmstrips: inputs.filmstrips.clone(),
        training: metrics::ends(&curves),
        models: inputs.metrics.iter().map(|metrics| metrics.model.clone()).collect(),
        costs: inputs.costs.clone(),
        commits: inputs.commits.clone(),
        paper: inputs.paper.clone(),
        facts: inputs.facts.clone(),
        inputs: files,
    };
    let page = page::render(&report, &curves)?;
    artifact::write(&out.join("results.csv"), &csv::results(&report.results)?)?;
    artifact::write(&out.join("curves.csv"), &csv::curves(&curves)?)?;
    artifact::write(&out.join("index.html"), page.as_bytes())?;
    artifact::write(&out.join("report.md"), markdown::render(&report).as_bytes())?;
    artifact::write_json(&out.join("report.json"), &report)?;
    Ok(report)
}

/// Reads what was measured of an annotated dataset.
fn annotation(input: &AnnotationsInput) -> Result<AnnotationResult, ReportError> {
    #[derive(serde::Deserialize)]
    struct Told {
        measured: Option<Measured>,
    }
    let AnnotationsInput { experiment, name, path } = input.clone();
    let told: Told = artifact::read_json(&path)?;
    let measured = told.measured.ok_or(ReportError::NotMeasured { path })?;
    Ok(AnnotationResult { experiment, name, measured })
}

/// The JSON schema of report.json, as in schemas/report.schema.json.
pub fn json_schema() -> serde_json::Value {
    schemars::schema_for!(Report).to_value()
}

/// Every input with its hash. The run directory is where the report's folder lies; paths within it are told from there,
/// so that a run can be moved without a change of bytes.
fn input_files(inputs: &ReportInputs, out: &Path) -> Result<Vec<InputFile>, IoError> {
    let run_dir = out.parent().unwrap_or(out);
    let paths = (inputs.rollouts.iter().map(|rollouts| &rollouts.path))
        .chain(inputs.metrics.iter().map(|metrics| &metrics.path))
        .chain(inputs.detections.iter().map(|detections| &detections.path))
        .chain(inputs.annotations.iter().map(|annotations| &annotations.path));
    let file = |path: &PathBuf| {
        let shown = path.strip_prefix(run_dir).unwrap_or(path);
        Ok(InputFile { path: shown.display().to_string(), sha256: artifact::sha256_file(path)? })
    };
    let mut files = paths.map(file).collect::<Result<Vec<_>, IoError>>()?;
    files.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(files)
}
