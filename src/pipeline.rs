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
mod failures;
#[cfg(feature = "report")]
mod filmstrips;
mod gallery;
mod generate;
mod items;
mod layout;
mod options;
mod recorded;
mod report;
mod resolve;
mod rollout;
mod runner;
mod shared;
mod spec;
mod stage;
mod stage_report;
mod stale;
mod stored;
mod study;
mod tasks;
mod train;
mod trials;
mod unit;
mod upstream;
mod verify;

pub use demonstration::demonstration_of;
pub use error::PipelineError;
pub use failures::Failure;
pub use items::{Item, ItemRanges, ItemState, items, plans};
pub use layout::RunDir;
pub use options::{Options, Scope};
pub use recorded::Recorded;
pub use resolve::Pipeline;
pub use runner::{run, run_study};
pub use spec::{
    CountsSpec, GenerateSpec, ModelSpec, OrderSpec, PipelineSpec, RecordedFrames, ReportSpec, RolloutSpec, SuiteSpec,
    TasksSpec,
};
pub use stage::Stage;
pub use stage_report::{StageReport, Status};
pub use stale::{Stale, stale};
pub use stored::bring_records;
pub use study::{PipelineFile, Study, StudySpec};
pub use verify::{Verification, verify};
