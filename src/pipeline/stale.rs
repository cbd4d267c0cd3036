//! What lies upstream of the stages that are run and was made by other plans than the pipeline file makes now.
//!
//! A stage that is asked for by itself takes what it reads as it is: its own plan tells nothing of settings that have
//! changed since in an earlier one.

use std::fmt;

use crate::artifact::IoError;
use crate::pipeline::unit::{Unit, fresh_plan};
use crate::pipeline::{PipelineFile, RunDir, Stage, rollout, train, upstream};

/// A unit that was made by another plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stale {
    /// Of a study, which experiment.
    pub experiment: Option<String>,
    /// Which unit.
    pub unit: String,
    /// In what the plans differ.
    pub difference: String,
}

impl fmt::Display for Stale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { experiment, unit, difference } = self;
        let experiment = experiment.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
        write!(f, "{experiment}{unit}: {difference}")
    }
}

/// The units of the stages before one that were made by other plans, in their order. What was not made is none of them.
pub fn stale(file: &PipelineFile, dir: &RunDir, before: Stage) -> Vec<Stale> {
    let is_before = |stage: &Stage| *stage < before;
    let mut found = Vec::new();
    let is_study = matches!(file, PipelineFile::Study(_));
    for (pipeline, run) in file.experiments(dir) {
        let experiment = is_study.then(|| pipeline.spec.name.clone());
        for stage in Stage::ALL.into_iter().filter(is_before) {
            add(&upstream::units(pipeline, stage), &run, experiment.as_ref(), &mut found);
        }
    }
    let PipelineFile::Study(study) = file else { return found };
    if is_before(&Stage::Train) {
        add(&upstream::boxed(train::units_of_study(study)), dir, None, &mut found);
    }
    for pipeline in study.experiments.iter().filter(|_| is_before(&Stage::Rollout)) {
        let (name, suites) = (&pipeline.spec.name, upstream::boxed(rollout::units_of_study(study, pipeline)));
        add(&suites, &dir.experiment(name), Some(name), &mut found);
    }
    found
}

fn add(units: &[Box<dyn Unit + '_>], run: &RunDir, experiment: Option<&String>, found: &mut Vec<Stale>) {
    for unit in units {
        let difference = difference(unit.as_ref(), run).unwrap_or_else(|error| Some(error.to_string()));
        let stale = |difference| Stale { experiment: experiment.cloned(), unit: unit.name(), difference };
        found.extend(difference.map(stale));
    }
}

fn difference(unit: &dyn Unit, run: &RunDir) -> Result<Option<String>, IoError> {
    let Some(own) = unit.dir(run).plan()? else { return Ok(None) };
    // What was read may be gone; then nothing of it can have changed.
    let inputs = unit.inputs(run).unwrap_or_else(|_gone| own.inputs.clone());
    Ok(own.difference(&fresh_plan(unit, inputs)))
}
