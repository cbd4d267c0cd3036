//! A pipeline file, resolved into plans, run stage by stage.
//!
//! # Input and output
//!
//! [`Pipeline::load`] turns a TOML file (pipelines/*.toml, schemas/pipeline.schema.json) into checked settings before
//! anything is written. [`run`] composes the stages; no stage calls another. Each stage writes one folder under the
//! run directory through [`crate::artifact::StageDir`]. A [`Study`] is several pipelines and one report of them all;
//! [`PipelineFile::load`] tells the two kinds of files apart.
//!
//! # Invariants
//!
//! A stage whose manifest is of the plan that would be made now is skipped. Seeds depend on identity alone, so any
//! number of jobs gives the same bytes.

mod convert;
mod costs;
mod demonstration;
mod detections;
mod error;
mod eye;
mod facts;
mod filmstrips;
mod gallery;
mod generate;
mod layout;
mod report;
mod resolve;
mod rollout;
mod runner;
mod spec;
mod stage;
mod study;
mod tasks;
mod train;
mod trials;
mod verify;

pub use demonstration::demonstration_of;
pub use error::PipelineError;
pub use layout::RunDir;
pub use resolve::Pipeline;
pub use runner::{Options, StageReport, Status, run, run_study};
pub use spec::{
    CountsSpec, GenerateSpec, ModelSpec, OrderSpec, PipelineSpec, RecordedFrames, ReportSpec, RolloutSpec, SuiteSpec,
    TasksSpec,
};
pub use stage::Stage;
pub use study::{PipelineFile, Study, StudySpec};
pub use verify::{Verification, verify};
