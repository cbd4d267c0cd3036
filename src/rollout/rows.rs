//! Rollouts as rows of `rollouts.parquet`.

use std::collections::BTreeMap;
use std::path::Path;

use crate::rollout::{Divergence, DivergenceKind, RolloutEpisode};
use crate::table::{TableError, TableRows as _, table};
use crate::trace::Push;

/// One row an episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RolloutRows {
    rows: Rows,
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

table! {
    /// `rollouts.parquet` of a suite: a row an episode that a policy acted.
    rollouts {
        /// the model's variant, or `oracle`
        variant: Text,
        /// which suite
        suite: Text,
        /// of the model's training; 0 for the oracle
        training_seed: Int64,
        /// position in the suite
        episode: Int64,
        /// which task
        task_id: Text,
        /// `seen` or `unseen`
        split: Text,
        /// `success`, or the cause of failure
        outcome: Text,
        /// whether the model ended by itself and the goal held at rest
        success: Boolean,
        /// the first cause of failure that was noticed
        cause: OptionalText,
        /// program calls, the root's too
        calls: Int64,
        /// decisions of the model
        decisions: Int64,
        /// the first decision that differs from the expert's; null when none does
        first_divergence: OptionalInt64,
        /// `program`, `argument`, `scope`, `early_end` or `late_end`
        divergence_kind: OptionalText,
        /// the program that decided so
        divergence_program: OptionalText,
        /// simulated time
        sim_secs: Float64,
        /// tasks that the model was trained on; null for the oracle
        train_tasks: OptionalInt64,
        /// `trajectories` or `instructions`; null for the oracle
        specification: OptionalText,
        /// `mss` or `argmax`; null for the oracle
        decoder: OptionalText,
        /// the decision after which the first fault was noticed
        fault_decision: OptionalInt64,
        /// pushes of the adversary; null without one
        pushes: OptionalInt64,
        /// bodies that they knocked off what they stood on; null without one
        toppled: OptionalInt64,
    }
}

impl RolloutRows {
    /// The rows of a suite's episodes.
    pub fn of(suite: &str, by: &Acted, rollouts: &[RolloutEpisode]) -> Self {
        let mut rows = Rows::default();
        rollouts.iter().for_each(|rollout| rows.push(row(suite, by, rollout)));
        Self { rows }
    }

    /// Adds rows at the end.
    pub fn append(&mut self, other: Self) {
        self.rows.append(other.rows);
    }

    /// How many episodes, and how many of them succeeded.
    pub fn successes(&self) -> (usize, usize) {
        (self.rows.success.len(), self.rows.success.iter().filter(|&&success| success).count())
    }

    /// How often each cause of failure was named.
    pub fn causes(&self) -> BTreeMap<String, usize> {
        let mut causes = BTreeMap::new();
        for cause in self.rows.cause.iter().flatten() {
            *causes.entry(cause.clone()).or_default() += 1;
        }
        causes
    }

    /// Where an episode of the suite first left the expert's decisions; `None` when it never did, or is not there.
    pub fn divergence(&self, episode: u64) -> Option<Divergence> {
        let rows = &self.rows;
        let at = rows.episode.iter().position(|&found| u64::try_from(found) == Ok(episode))?;
        let kind = rows.divergence_kind[at].as_deref()?;
        Some(Divergence {
            decision: u32::try_from(rows.first_divergence[at]?).ok()?,
            kind: DivergenceKind::ALL.into_iter().find(|known| known.name() == kind)?,
            program: rows.divergence_program[at].as_deref()?.parse().ok()?,
        })
    }

    /// Writes the table.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TableError> {
        self.rows.write(path)
    }

    /// Reads the table.
    ///
    /// # Errors
    ///
    /// When it is not there or not such a table.
    pub fn read(path: &Path) -> Result<Self, TableError> {
        Ok(Self { rows: Rows::read(path)? })
    }
}

fn row<'a>(suite: &'a str, by: &Acted, rollout: &'a RolloutEpisode) -> Row<'a> {
    let RolloutEpisode { episode, decisions, first_divergence, fault_decision, pushes } = rollout;
    let n_toppled = |pushes: &Vec<Push>| pushes.iter().map(|push| push.toppled.len()).sum::<usize>() as i64;
    let provenance = &episode.provenance;
    let last_nanos = episode.frames.last().map_or(0, |frame| frame.time_nanos);
    Row {
        variant: provenance.actor.name().into(),
        suite: suite.into(),
        training_seed: by.training_seed as i64,
        episode: provenance.index as i64,
        task_id: provenance.task_id.as_str().into(),
        split: provenance.split.name().into(),
        outcome: episode.outcome.to_string().into(),
        success: episode.outcome.is_success(),
        cause: episode.outcome.cause().map(|cause| cause.name().into()),
        calls: episode.calls.len() as i64,
        decisions: i64::from(*decisions),
        first_divergence: first_divergence.map(|divergence| i64::from(divergence.decision)),
        divergence_kind: first_divergence.map(|divergence| divergence.kind.name().into()),
        divergence_program: first_divergence.map(|divergence| divergence.program.name().into()),
        sim_secs: last_nanos as f64 / 1e9,
        train_tasks: by.train_tasks.map(i64::from),
        specification: by.specification.map(Into::into),
        decoder: by.decoder.map(Into::into),
        fault_decision: fault_decision.map(i64::from),
        pushes: pushes.as_ref().map(|pushes| pushes.len() as i64),
        toppled: pushes.as_ref().map(n_toppled),
    }
}
