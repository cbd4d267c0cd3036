//! The work of a pipeline handed to a cluster, or to processes of one machine.
//!
//! # Input and output
//!
//! [`Submission::write`] turns a pipeline file and what is left of it into a folder `submit/` in the run directory: a copy
//! of the pipeline and of this program, lists of items, and scripts in plain bash that a lab can read and edit.
//! [`status`] says what was done.
//!
//! # Invariants
//!
//! Nothing here knows how work is done; it knows items and commands. No daemon, no data base, and no accounting of a
//! scheduler: receipts alone tell what is done, so handing over again hands over what is left.

mod copies;
mod script;
mod status;
mod submission;

pub use status::{FailedItem, RunStatus, StageStatus, status};
pub use submission::{ClusterError, Engine, Submission, SubmitOptions, SubmittedStage};
