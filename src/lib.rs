//! Neural Task Programming as a dataset pipeline.
//!
//! ```text
//! tasks ─► generate ─► convert ─► train ─► rollout ─► report
//! ```
//!
//! Stages meet only through files whose schema is in `schemas/`. The modules below are in reading order; none uses a
//! later one. ARCHITECTURE.md is the map.

pub mod arm;
pub mod artifact;
pub mod date;
pub mod feature;
pub mod geometry;
pub mod process;
pub mod program;
pub mod progress;
pub mod scene;
pub mod seed;
pub mod store;
pub mod table;
pub mod words;

pub mod annotate;
pub mod cluster;
pub mod dataset;
pub mod deploy;
pub mod expert;
pub mod ingest;
pub mod lineage;
pub mod model;
pub mod perception;
pub mod pipeline;
pub mod publish;
#[cfg(feature = "query")]
pub mod query;
pub mod recording;
pub mod remote;
pub mod render;
#[cfg(feature = "report")]
pub mod report;
pub mod robot;
pub mod rollout;
pub mod sim;
pub mod task;
pub mod trace;
pub mod training;
pub mod video;
#[cfg(feature = "viewer")]
pub mod visualize;

pub mod cli;
pub mod commands;
