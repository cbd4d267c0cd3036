//! Rollouts as rows of `rollouts.parquet` (schemas/parquet/rollouts.message).

use std::collections::BTreeMap;
use std::path::Path;

use crate::rollout::{Divergence, DivergenceKind, RolloutEpisode};
use crate::table::{self, Column, TableError, TableSchema};
use crate::trace::Push;

/// One row an episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RolloutRows {
    rows: Vec<RolloutRow>,
}

/// Who acted the episodes of a table, beside the name that is in each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Acted {
    /// The seed of the model's training; 0 for an oracle.
    pub training_seed: u64,
    /// How many tasks it was trained on; `None` for an oracle.
    pub train_tasks: Option<u32>,
    /// What a demonstration is given as: `trajectories`; `None` for an oracle.
    pub specification: Option<&'static str>,
    /// How scopes are decoded; `None` for an oracle.
    pub decoder: Option<&'static str>,
}

/// The columns of schemas/parquet/rollouts.message.
#[derive(Clone, Debug, PartialEq)]
struct RolloutRow {
    variant: String,
    suite: String,
    training_seed: i64,
    episode: i64,
    task_id: String,
    split: String,
    outcome: String,
    success: bool,
    cause: Option<String>,
    calls: i64,
    decisions: i64,
    first_divergence: Option<i64>,
    divergence_kind: Option<String>,
    divergence_program: Option<String>,
    sim_secs: f64,
    train_tasks: Option<i64>,
    specification: Option<String>,
    decoder: Option<String>,
    fault_decision: Option<i64>,
    /// `None` without an adversary.
    pushes: Option<i64>,
    toppled: Option<i64>,
}

impl RolloutRows {
    /// The rows of a suite's episodes.
    pub fn of(suite: &str, by: &Acted, rollouts: &[RolloutEpisode]) -> Self {
        Self { rows: rollouts.iter().map(|rollout| RolloutRow::of(suite, by, rollout)).collect() }
    }

    /// Adds rows at the end.
    pub fn append(&mut self, other: Self) {
        self.rows.extend(other.rows);
    }

    /// How many episodes, and how many of them succeeded.
    pub fn successes(&self) -> (usize, usize) {
        (self.rows.len(), self.rows.iter().filter(|row| row.success).count())
    }

    /// How often each cause of failure was named.
    pub fn causes(&self) -> BTreeMap<String, usize> {
        let mut causes = BTreeMap::new();
        for cause in self.rows.iter().filter_map(|row| row.cause.clone()) {
            *causes.entry(cause).or_default() += 1;
        }
        causes
    }

    /// Where an episode of the suite first left the expert's decisions; `None` when it never did, or is not there.
    pub fn divergence(&self, episode: u64) -> Option<Divergence> {
        let row = self.rows.iter().find(|row| u64::try_from(row.episode) == Ok(episode))?;
        let kind = row.divergence_kind.as_deref()?;
        Some(Divergence {
            decision: u32::try_from(row.first_divergence?).ok()?,
            kind: DivergenceKind::ALL.into_iter().find(|known| known.name() == kind)?,
            program: row.divergence_program.as_deref()?.parse().ok()?,
        })
    }

    /// Writes the table.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TableError> {
        let rows = &self.rows;
        let text = |get: fn(&RolloutRow) -> &String| Column::Text(rows.iter().map(|row| get(row).clone()).collect());
        let optional = |get: fn(&RolloutRow) -> &Option<String>| {
            Column::OptionalText(rows.iter().map(|row| get(row).clone()).collect())
        };
        let int = |get: fn(&RolloutRow) -> i64| Column::Int64(rows.iter().map(get).collect());
        let optional_int = |get: fn(&RolloutRow) -> Option<i64>| Column::OptionalInt64(rows.iter().map(get).collect());
        let columns = vec![
            ("variant", text(|row| &row.variant)),
            ("suite", text(|row| &row.suite)),
            ("training_seed", int(|row| row.training_seed)),
            ("episode", int(|row| row.episode)),
            ("task_id", text(|row| &row.task_id)),
            ("split", text(|row| &row.split)),
            ("outcome", text(|row| &row.outcome)),
            ("success", Column::Boolean(rows.iter().map(|row| row.success).collect())),
            ("cause", optional(|row| &row.cause)),
            ("calls", int(|row| row.calls)),
            ("decisions", int(|row| row.decisions)),
            ("first_divergence", optional_int(|row| row.first_divergence)),
            ("divergence_kind", optional(|row| &row.divergence_kind)),
            ("divergence_program", optional(|row| &row.divergence_program)),
            ("sim_secs", Column::Float64(rows.iter().map(|row| row.sim_secs).collect())),
            ("train_tasks", optional_int(|row| row.train_tasks)),
            ("specification", optional(|row| &row.specification)),
            ("decoder", optional(|row| &row.decoder)),
            ("fault_decision", optional_int(|row| row.fault_decision)),
            ("pushes", Column::OptionalInt64(rows.iter().map(|row| row.pushes).collect())),
            ("toppled", Column::OptionalInt64(rows.iter().map(|row| row.toppled).collect())),
        ];
        table::write(path, &TableSchema::ROLLOUTS, columns)
    }

    /// Reads the table.
    ///
    /// # Errors
    ///
    /// When it is not there or not such a table.
    pub fn read(path: &Path) -> Result<Self, TableError> {
        let mut columns = table::read(path, &TableSchema::ROLLOUTS)?;
        let mut variant = columns.text("variant")?.into_iter();
        let mut suite = columns.text("suite")?.into_iter();
        let mut training_seed = columns.int64("training_seed")?.into_iter();
        let mut episode = columns.int64("episode")?.into_iter();
        let mut task_id = columns.text("task_id")?.into_iter();
        let mut split = columns.text("split")?.into_iter();
        let mut outcome = columns.text("outcome")?.into_iter();
        let mut success = columns.boolean("success")?.into_iter();
        let mut cause = columns.optional_text("cause")?.into_iter();
        let mut calls = columns.int64("calls")?.into_iter();
        let mut decisions = columns.int64("decisions")?.into_iter();
        let mut first_divergence = columns.optional_int64("first_divergence")?.into_iter();
        let mut divergence_kind = columns.optional_text("divergence_kind")?.into_iter();
        let mut divergence_program = columns.optional_text("divergence_program")?.into_iter();
        let mut sim_secs = columns.float64("sim_secs")?.into_iter();
        let mut train_tasks = columns.optional_int64("train_tasks")?.into_iter();
        let mut specification = columns.optional_text("specification")?.into_iter();
        let mut decoder = columns.optional_text("decoder")?.into_iter();
        let mut fault_decision = columns.optional_int64("fault_decision")?.into_iter();
        let mut pushes = columns.optional_int64("pushes")?.into_iter();
        let mut toppled = columns.optional_int64("toppled")?.into_iter();
        let mut next = || {
            Some(RolloutRow {
                variant: variant.next()?,
                suite: suite.next()?,
                training_seed: training_seed.next()?,
                episode: episode.next()?,
                task_id: task_id.next()?,
                split: split.next()?,
                outcome: outcome.next()?,
                success: success.next()?,
                cause: cause.next()?,
                calls: calls.next()?,
                decisions: decisions.next()?,
                first_divergence: first_divergence.next()?,
                divergence_kind: divergence_kind.next()?,
                divergence_program: divergence_program.next()?,
                sim_secs: sim_secs.next()?,
                train_tasks: train_tasks.next()?,
                specification: specification.next()?,
                decoder: decoder.next()?,
                fault_decision: fault_decision.next()?,
                pushes: pushes.next()?,
                toppled: toppled.next()?,
            })
        };
        Ok(Self { rows: std::iter::from_fn(&mut next).collect() })
    }
}

impl RolloutRow {
    fn of(suite: &str, by: &Acted, rollout: &RolloutEpisode) -> Self {
        let RolloutEpisode { episode, decisions, first_divergence, fault_decision, pushes } = rollout;
        let n_toppled = |pushes: &Vec<Push>| pushes.iter().map(|push| push.toppled.len()).sum::<usize>() as i64;
        let provenance = &episode.provenance;
        let last_nanos = episode.frames.last().map_or(0, |frame| frame.time_nanos);
        Self {
            variant: provenance.actor.name().to_owned(),
            suite: suite.to_owned(),
            training_seed: by.training_seed as i64,
            episode: provenance.index as i64,
            task_id: provenance.task_id.clone(),
            split: provenance.split.name().to_owned(),
            outcome: episode.outcome.to_string(),
            success: episode.outcome.is_success(),
            cause: episode.outcome.cause().map(|cause| cause.name().to_owned()),
            calls: episode.calls.len() as i64,
            decisions: i64::from(*decisions),
            first_divergence: first_divergence.map(|divergence| i64::from(divergence.decision)),
            divergence_kind: first_divergence.map(|divergence| divergence.kind.name().to_owned()),
            divergence_program: first_divergence.map(|divergence| divergence.program.name().to_owned()),
            sim_secs: last_nanos as f64 / 1e9,
            train_tasks: by.train_tasks.map(i64::from),
            specification: by.specification.map(str::to_owned),
            decoder: by.decoder.map(str::to_owned),
            fault_decision: fault_decision.map(i64::from),
            pushes: pushes.as_ref().map(|pushes| pushes.len() as i64),
            toppled: pushes.as_ref().map(n_toppled),
        }
    }
}
