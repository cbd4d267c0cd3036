//! The contracts of a dataset's tables.

use crate::table::TableSchema;

/// One row per frame: `data/`.
pub const FRAMES: TableSchema = TableSchema::new("frames", include_str!("../../schemas/parquet/frames.message"));
/// One row per episode as `LeRobot` reads it: `meta/episodes/`.
pub const META_EPISODES: TableSchema =
    TableSchema::new("meta_episodes", include_str!("../../schemas/parquet/meta_episodes.message"));
/// One row per task text: `meta/tasks.parquet`.
pub const TASKS: TableSchema = TableSchema::new("tasks", include_str!("../../schemas/parquet/tasks.message"));
/// One row per sub-task text: `meta/subtasks.parquet`.
pub const SUBTASKS: TableSchema = TableSchema::new("subtasks", include_str!("../../schemas/parquet/subtasks.message"));
/// One row per program call: `ntp/calls/`.
pub const CALLS: TableSchema = TableSchema::new("calls", include_str!("../../schemas/parquet/calls.message"));
/// One row per call and frame of its caller's window: `ntp/scopes/`.
pub const SCOPES: TableSchema = TableSchema::new("scopes", include_str!("../../schemas/parquet/scopes.message"));
/// One row per episode, its provenance: `ntp/episodes.parquet`.
pub const EPISODES: TableSchema = TableSchema::new("episodes", include_str!("../../schemas/parquet/episodes.message"));

/// Every table of a dataset.
pub const ALL: [TableSchema; 7] = [FRAMES, META_EPISODES, TASKS, SUBTASKS, CALLS, SCOPES, EPISODES];
