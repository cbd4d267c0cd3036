//! Acted episodes as a folder like a suite's: recordings, `rollouts.parquet`, plan and manifest.
//!
//! # Invariants
//!
//! A trial that has ended is in the folder at once, whole and under its final name, and the table tells of it; so a
//! process that is killed loses the trial that it is acting, and no other. The manifest comes at the end.

use std::path::{Path, PathBuf};

use serde_json::json;

use crate::artifact::{FileEntry, Plan, Receipt, StageDir, StagedDir};
use crate::deploy::{DeployError, Driver, Trials};
use crate::model::Decoder;
use crate::recording::ShardWriter;
use crate::remote::Session;
use crate::rollout::{Acted, RolloutEpisode, RolloutRows, SuiteFacts};

/// The name of the stage in plan and manifest, and of the suite in the table.
const STAGE: &str = "deploy";
const TABLE: &str = "rollouts.parquet";

/// What the episodes depend on.
pub struct Recorded<'a> {
    /// What was acted; at least one.
    pub trials: &'a [Trials<'a>],
    /// Who decided.
    pub driver: &'a Driver,
    /// The model's manifest, if it has one: its version.
    pub model: Option<String>,
    /// Who acted.
    pub session: &'a Session,
    /// How many trials were asked for, of all demonstrations together.
    pub n_asked: usize,
}

impl Recorded<'_> {
    /// What is asked for, as of a suite. Counts are those of the demonstration and of the robot's table.
    fn suite(&self) -> SuiteFacts {
        let first = &self.trials[0];
        let family = first.task.family;
        // Counts begin with those of the bowls, where there are any.
        let n_bowls = family.max_bowls().map_or(0, usize::from);
        let has_categories = family.has_categories();
        let range = |counts: &[u16]| {
            let counts = counts.get(n_bowls..).filter(|_| has_categories)?;
            Some([*counts.iter().min()?, *counts.iter().max()?])
        };
        let within_reach = |most: u16| {
            if first.counts.is_empty() { most } else { first.counts.iter().sum() }
        };
        SuiteFacts {
            family,
            blocks: family.max_blocks().map(within_reach),
            order: "own",
            adversary_probability: 0.0,
            adversary_impulse_ns: 0.0,
            demonstrated: range(&first.demonstration.provenance.counts),
            on_table: range(&first.counts),
            bowls: None,
            jaw_m: None,
            perception: None,
            robot: self.session.robot(),
        }
    }

    fn acted(&self) -> Acted {
        let Driver::Model { config, .. } = self.driver else { return Acted::default() };
        Acted {
            specification: Some(config.network.specification().name()),
            decoder: Some(Decoder::default().name()),
            model: Some(config.variant.into()),
            ..Acted::default()
        }
    }

    fn plan(&self) -> Plan {
        let Self { trials, driver, model, session, n_asked: _ } = self;
        let shown = |trials: &Trials<'_>| {
            let shown = &trials.demonstration.provenance;
            json!({ "task_id": shown.task_id, "trial": shown.trial, "seed": shown.seed })
        };
        let config = json!({
            "seed": trials.first().map(|trials| trials.seed),
            "policy": driver.name(),
            "demonstrations": trials.iter().map(shown).collect::<Vec<_>>(),
            "robot": session.robot(),
            "capabilities": session.capabilities(),
        });
        let inputs = model.iter().map(|version| ("train".to_owned(), version.clone())).collect();
        Plan::new(STAGE, 1, inputs, config)
    }
}

/// A folder that is written trial by trial. It appears with the first.
pub struct Record {
    /// Until it has appeared.
    staged: Option<StagedDir>,
    folder: PathBuf,
    files: Vec<FileEntry>,
}

impl Record {
    /// Begins a folder, which must be new or empty: before a robot moves, so that nothing is acted that cannot be kept.
    ///
    /// # Errors
    ///
    /// When there is something in it, or it cannot be made.
    pub fn begin(folder: &Path) -> Result<Self, DeployError> {
        let staged = StagedDir::begin(folder)?;
        let folder = staged.path().to_owned();
        Ok(Self { staged: Some(staged), folder, files: Vec::new() })
    }

    /// Adds the last of the trials that were acted.
    ///
    /// # Errors
    ///
    /// When it cannot be written; those before it stay.
    pub fn add(&mut self, recorded: &Recorded<'_>, acted: &[RolloutEpisode]) -> Result<(), DeployError> {
        let Some((last, before)) = acted.split_last() else { return Ok(()) };
        let folder = self.staged.as_ref().map_or(self.folder.as_path(), StagedDir::partial_path).to_owned();
        let (dir, plan) = (StageDir::new(STAGE, &folder), recorded.plan());
        if self.staged.is_some() {
            dir.write_plan(&plan)?;
        }
        let name = recording_name(before.len(), recorded.n_asked);
        let mut writer = ShardWriter::create(&folder.join(&name), &serde_json::to_string(&plan).unwrap_or_default())?;
        writer.write(&last.episode)?;
        writer.finish()?;
        self.files.push(FileEntry::of(&folder, &name)?);
        RolloutRows::of(STAGE, &recorded.suite(), &recorded.acted(), acted).write(&folder.join(TABLE))?;
        dir.replace_shard(&Receipt {
            plan_id: plan.id(),
            shard: 0,
            episodes: acted.len() as u64,
            failed: acted.iter().filter(|rollout| !rollout.episode.outcome.is_success()).count() as u64,
            files: self.files.clone(),
        })?;
        self.staged.take().map_or(Ok(()), |staged| Ok(staged.commit()?))
    }

    /// Says that there are no more trials.
    ///
    /// # Errors
    ///
    /// When the manifest cannot be written.
    pub fn finish(self, recorded: &Recorded<'_>) -> Result<(), DeployError> {
        // Where no trial has ended there is no folder.
        if self.staged.is_none() {
            StageDir::new(STAGE, &self.folder).commit(&recorded.plan(), &[TABLE])?;
        }
        Ok(())
    }
}

/// A recording for each trial, named so that they are in order.
fn recording_name(trial: usize, n_asked: usize) -> String {
    format!("recordings/shard-{trial:05}-of-{n_asked:05}.mcap")
}
