//! What came of units and items, for people and for `--json`.

use serde::Serialize;

use crate::pipeline::Stage;

/// What came of one unit of a stage, or of a shard of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Nothing to do.
    UpToDate,
    /// Done now.
    Done,
    /// A shard was done now.
    ShardDone,
    /// Its plan was written now, and nothing else done.
    Begun,
    /// It was brought here from the store (with `--fetch`).
    Fetched,
    /// Would be done (with `--dry-run`).
    Needed,
    /// Shards are missing (with `--commit`), or all of it (with `--fetch`).
    Missing,
    /// It failed; others were done.
    Failed,
}

/// What came of one unit of a stage, for people and for `--json`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StageReport {
    /// Which experiment of a study; `None` for one by itself, and for the study's own report.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<String>,
    /// The stage.
    pub stage: Stage,
    /// Which of its units: a model, a model's suite, or the stage's own name.
    pub unit: String,
    /// Which of its items, where items were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub item: Option<u64>,
    /// Which of the unit's shards, where items were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shard: Option<u32>,
    /// How many shards the unit has.
    pub shards: u32,
    /// What came of it.
    pub status: Status,
    /// Why it was or would be done, or how it failed; `up to date` otherwise.
    pub reason: String,
    /// The items that are missing, with `--commit`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub missing: Vec<u64>,
    /// Episodes it holds.
    pub episodes: u64,
    /// How many of them failed.
    pub failed: u64,
}
