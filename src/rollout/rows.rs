//! Rollouts as rows of `rollouts.parquet`.

use std::collections::BTreeMap;
use std::path::Path;

use crate::rollout::facts::decimal;
use crate::rollout::{Divergence, DivergenceKind, ModelFacts, RolloutEpisode, SuiteFacts};
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
    /// The parts of its network; `None` for an oracle.
    pub model: Option<ModelFacts>,
}

table! {
    /// `rollouts.parquet` of a suite: a row an episode that a policy acted.
    ///
    /// > Why does each row say what its suite and its model are? So that nobody has to read it from their names: figures, claims and queries go by these columns. They are null in files that were written before there were any.
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
        /// end conditions of the task
        goals: OptionalInt64 later,
        /// how many of them hold in the end, at rest; the paper's "proportion of task completed" is this share
        goals_met: OptionalInt64 later,
        /// things on the table that may be moved
        objects: OptionalInt64 later,
        /// the suite's family of tasks; null where facts were not written down
        family: OptionalText later,
        /// blocks within reach; null in a family without blocks
        blocks: OptionalInt64 later,
        /// order in which sub-tasks are demonstrated: `own` or `shuffled`
        order: OptionalText later,
        /// chance of a push of the adversary after each placement; 0 without one
        adversary_probability: OptionalFloat64 later,
        /// impulse of a push in newton seconds; 0 without an adversary
        adversary_impulse_ns: OptionalFloat64 later,
        /// fewest instances of a category that the suite demonstrates; null in a family without categories
        demonstrated_min: OptionalInt64 later,
        /// most instances of a category that the suite demonstrates
        demonstrated_max: OptionalInt64 later,
        /// fewest instances of a category that the suite puts on the table
        on_table_min: OptionalInt64 later,
        /// most instances of a category that the suite puts on the table
        on_table_max: OptionalInt64 later,
        /// bowls that each task of the suite asks for; null where tasks differ in it or ask for none
        bowls: OptionalInt64 later,
        /// how the model remembers the steps of a program call: `reactive` (not at all), `gru` or `lstm`; null for the oracle
        core: OptionalText later,
        /// what the model decides of the specification: `scoped` (what a callee may see), `unscoped`, `primitives` (no hierarchy) or `arguments` (no specification); null for the oracle
        scoping: OptionalText later,
        /// how the model reads observations; null for the oracle
        encoder: OptionalText later,
        /// which robot acts: `gripper`, `sawyer`, or what a robot of others calls itself; null in files that were written before there was an arm
        robot: OptionalText later,
        /// how far the gripper opens at most, in metres; null where nobody knows it
        jaw_m: OptionalFloat64 later,
        /// where the camera stands that tells the robot and the model of the table: `front`, `right` or `above`; null where they know true places
        camera: OptionalText later,
        /// what the depths of that camera are like: `kinect` or `exact`
        sensor: OptionalText later,
        /// standard deviation of the error of that camera's turn about each axis, in degrees
        calibration_deg: OptionalFloat64 later,
        /// standard deviation of the error of its place along each axis, in millimetres
        calibration_mm: OptionalFloat64 later,
        /// standard deviation of what is added to all of its depths, in millimetres
        depth_mm: OptionalFloat64 later,
        /// level distance of what the model was told from true places, the mean over slots and decisions, in millimetres
        localisation_mm: OptionalFloat64 later,
        /// what a failure is due to: `ntp` (the first thing that went wrong is a decision), `localisation` (so it is, and the model decides rightly when it is told true places) or `manipulation` (no decision left the expert's before physics went wrong, or at all); null for a success
        failure: OptionalText later,
    }
}

impl RolloutRows {
    /// The rows of a suite's episodes.
    pub fn of(suite: &str, facts: &SuiteFacts, by: &Acted, rollouts: &[RolloutEpisode]) -> Self {
        let mut rows = Rows::default();
        rollouts.iter().for_each(|rollout| rows.push(row(suite, facts, by, rollout)));
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

fn row<'a>(suite: &'a str, facts: &'a SuiteFacts, by: &Acted, rollout: &'a RolloutEpisode) -> Row<'a> {
    let RolloutEpisode {
        episode,
        decisions,
        first_divergence,
        fault_decision,
        pushes,
        judgement,
        failure,
        localisation_mm,
    } = rollout;
    let end = |range: Option<[u16; 2]>, at: usize| range.map(|range| i64::from(range[at]));
    let part = |get: fn(&ModelFacts) -> &'static str| by.model.as_ref().map(|model| get(model).into());
    let n_toppled = |pushes: &Vec<Push>| pushes.iter().map(|push| push.toppled.len()).sum::<usize>() as i64;
    let perception = facts.perception.as_ref();
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
        goals: Some(i64::from(judgement.goals)),
        goals_met: Some(i64::from(judgement.met)),
        objects: Some(facts.objects(&episode.scene) as i64),
        family: Some(facts.family.name().into()),
        blocks: facts.blocks.map(i64::from),
        order: Some(facts.order.into()),
        adversary_probability: Some(decimal(facts.adversary_probability)),
        adversary_impulse_ns: Some(decimal(facts.adversary_impulse_ns)),
        demonstrated_min: end(facts.demonstrated, 0),
        demonstrated_max: end(facts.demonstrated, 1),
        on_table_min: end(facts.on_table, 0),
        on_table_max: end(facts.on_table, 1),
        bowls: facts.bowls.map(i64::from),
        core: part(|model| model.core),
        scoping: part(|model| model.scoping),
        encoder: part(|model| model.encoder),
        robot: Some(facts.robot.as_str().into()),
        jaw_m: facts.jaw_m.map(decimal),
        camera: perception.map(|perception| perception.camera.name().into()),
        sensor: perception.map(|perception| perception.sensor.name().into()),
        calibration_deg: perception.map(|perception| decimal(perception.calibration_deg)),
        calibration_mm: perception.map(|perception| decimal(perception.calibration_mm)),
        depth_mm: perception.map(|perception| decimal(perception.depth_mm)),
        localisation_mm: *localisation_mm,
        failure: failure.map(|failure| failure.name().into()),
    }
}
