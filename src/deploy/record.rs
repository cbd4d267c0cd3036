//! Acted episodes as a folder like a suite's: a recording, `rollouts.parquet`, plan and manifest.

use std::path::Path;

use serde_json::json;

use crate::artifact::{FileEntry, Plan, Receipt, StageDir, StagedDir};
use crate::deploy::{DeployError, Driver, Trials};
use crate::model::Decoder;
use crate::recording::ShardWriter;
use crate::remote::Session;
use crate::rollout::{Acted, RolloutEpisode, RolloutRows, SuiteFacts};

/// The name of the stage in plan and manifest, and of the suite in the table.
const STAGE: &str = "deploy";
const RECORDING: &str = "recordings/shard-00000-of-00001.mcap";
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
}

impl Recorded<'_> {
    /// What is asked for, as of a suite. Counts are those of the demonstration and of the robot's table.
    fn suite(&self) -> SuiteFacts {
        let first = &self.trials[0];
        let family = first.task.family;
        // Counts begin with those of the bowls, where there are any.
        let n_bowls = family.max_bowls().map_or(0, usize::from);
        let has_categories = family.max_instances().is_some();
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
        let Self { trials, driver, model, session } = self;
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

/// A folder to be written, which appears whole.
pub struct Record(StagedDir);

impl Record {
    /// Begins a folder, which must be new or empty: before a robot moves, so that nothing is acted that cannot be kept.
    ///
    /// # Errors
    ///
    /// When there is something in it, or it cannot be made.
    pub fn begin(folder: &Path) -> Result<Self, DeployError> {
        Ok(Self(StagedDir::begin(folder)?))
    }

    /// Writes it.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn finish(self, recorded: &Recorded<'_>, acted: &[RolloutEpisode]) -> Result<(), DeployError> {
        write(self.0.partial_path(), recorded, acted)?;
        Ok(self.0.commit()?)
    }
}

fn write(path: &Path, recorded: &Recorded<'_>, acted: &[RolloutEpisode]) -> Result<(), DeployError> {
    let (dir, plan) = (StageDir::new(STAGE, path), recorded.plan());
    dir.write_plan(&plan)?;
    let mut writer = ShardWriter::create(&path.join(RECORDING), &serde_json::to_string(&plan).unwrap_or_default())?;
    acted.iter().try_for_each(|rollout| writer.write(&rollout.episode))?;
    writer.finish()?;
    RolloutRows::of(STAGE, &recorded.suite(), &recorded.acted(), acted).write(&path.join(TABLE))?;
    dir.commit_shard(&Receipt {
        plan_id: plan.id(),
        shard: 0,
        episodes: acted.len() as u64,
        failed: acted.iter().filter(|rollout| !rollout.episode.outcome.is_success()).count() as u64,
        files: vec![FileEntry::of(path, RECORDING)?],
    })?;
    dir.commit(&plan, &[TABLE])?;
    Ok(())
}
