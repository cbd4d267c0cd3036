//! Stage `report`: everything that was rolled out and trained, on one page; of one experiment, or of all of a study.

#[cfg(feature = "report")]
mod gather;

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::annotate::ANNOTATION;
use crate::artifact::{StageDir, sha256_file};
#[cfg(not(feature = "report"))]
use crate::feature::{Feature, NotBuiltIn};
use crate::pipeline::unit::{Amount, Job, Looked, Unit, Worker};
use crate::pipeline::{Pipeline, PipelineError, RunDir, Stage, Study, costs, rollout, train};

/// Raised when a report says something else of the same results.
const VERSION: u32 = 6;

/// The report of an experiment, or of all of a study.
pub(super) struct Report<'p> {
    title: &'p str,
    /// The study that it is of: each experiment has a folder of its name below the run directory.
    study: Option<&'p Study>,
    experiments: Vec<&'p Pipeline>,
}

pub(super) fn units(pipeline: &Pipeline) -> Vec<Report<'_>> {
    let title = pipeline.spec.report.title.as_deref().unwrap_or(&pipeline.spec.name);
    vec![Report { title, study: None, experiments: vec![pipeline] }]
}

/// The one report of a study.
pub(super) fn of_study(study: &Study) -> Report<'_> {
    Report { title: study.title(), study: Some(study), experiments: study.experiments.iter().collect() }
}

impl<'p> Report<'p> {
    /// The experiments with their run directories.
    fn runs(&self, run: &RunDir) -> Vec<(&'p Pipeline, RunDir)> {
        let own = |pipeline: &Pipeline| match self.study {
            Some(_) => run.experiment(&pipeline.spec.name),
            None => run.clone(),
        };
        self.experiments.iter().map(|&pipeline| (pipeline, own(pipeline))).collect()
    }

    /// Everything that was acted of an experiment.
    fn acted(&self, pipeline: &'p Pipeline) -> Vec<rollout::Suite<'p>> {
        let of_study = self.study.map(|study| rollout::units_of_study(study, pipeline));
        rollout::units(pipeline).into_iter().chain(of_study.unwrap_or_default()).collect()
    }
}

impl Unit for Report<'_> {
    fn stage(&self) -> Stage {
        Stage::Report
    }

    fn stage_version(&self) -> u32 {
        VERSION
    }

    fn name(&self) -> String {
        Stage::Report.name().to_owned()
    }

    fn dir(&self, run: &RunDir) -> StageDir {
        run.report()
    }

    fn amount(&self, _shard: u32) -> Amount {
        Amount { count: self.experiments.len() as u64, of: "experiment" }
    }

    fn reads(&self, run: &RunDir) -> Vec<StageDir> {
        let units = |(pipeline, run): (&'_ Pipeline, RunDir)| {
            self.acted(pipeline).into_iter().map(|unit| unit.dir(&run)).collect::<Vec<_>>()
        };
        self.runs(run).into_iter().flat_map(units).collect()
    }

    fn looks_at(&self, run: &RunDir) -> Vec<Looked> {
        let of_run = |(pipeline, run): (&'_ Pipeline, RunDir)| {
            let records = [run.recordings(), run.dataset()].map(Looked::Record);
            let models = train::units(pipeline).into_iter().map(|model| Looked::Files(model.dir(&run)));
            let others = [Looked::Files(run.tasks()), Looked::Notes(costs::FOLDER)];
            records.into_iter().chain(models).chain(others).collect::<Vec<_>>()
        };
        self.runs(run).into_iter().flat_map(of_run).collect()
    }

    fn inputs(&self, run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
        let mut inputs = BTreeMap::new();
        for (pipeline, run) in self.runs(run) {
            let experiment = self.study.map(|_| format!("{}: ", pipeline.spec.name)).unwrap_or_default();
            for unit in self.acted(pipeline) {
                inputs.insert(format!("{experiment}{}", unit.name()), unit.dir(&run).version()?);
            }
            for (name, path) in annotations(pipeline, &run) {
                inputs.insert(format!("{experiment}annotations {name}"), sha256_file(&path)?);
            }
        }
        Ok(inputs)
    }

    fn settings(&self) -> Value {
        json!({ "title": self.title })
    }

    #[cfg(feature = "report")]
    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        Ok(Box::new(gather::Reporter::new(self, job)?))
    }

    #[cfg(not(feature = "report"))]
    fn open<'j>(&'j self, _job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        Err(NotBuiltIn(Feature::Report).into())
    }
}

/// The annotated datasets that a pipeline names, each with what is told of its labels.
fn annotations(pipeline: &Pipeline, run: &RunDir) -> Vec<(String, PathBuf)> {
    let named = pipeline.spec.report.annotations.iter();
    named.map(|name| (name.clone(), run.root().join(name).join(ANNOTATION))).collect()
}
