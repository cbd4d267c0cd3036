//! Stage `tasks`: draws or imports the task set and writes it.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::artifact::StageDir;
use crate::pipeline::unit::{Amount, Job, Made, Unit, Worker};
use crate::pipeline::{Pipeline, PipelineError, RunDir, Stage};
use crate::seed::Seed;
use crate::task::{self, Split, Task, TaskSet};
use crate::words::counted;

/// Raised when the same settings draw other tasks.
const VERSION: u32 = 1;
const FILE: &str = "tasks.json";

/// The task set of an experiment.
pub(super) struct Tasks<'p>(&'p Pipeline);

pub(super) fn units(pipeline: &Pipeline) -> Vec<Tasks<'_>> {
    vec![Tasks(pipeline)]
}

impl Unit for Tasks<'_> {
    fn stage(&self) -> Stage {
        Stage::Tasks
    }

    fn stage_version(&self) -> u32 {
        VERSION
    }

    fn name(&self) -> String {
        Stage::Tasks.name().to_owned()
    }

    fn dir(&self, run: &RunDir) -> StageDir {
        run.tasks()
    }

    fn amount(&self, _shard: u32) -> Amount {
        Amount { count: u64::from(self.0.spec.tasks.train) + u64::from(self.0.n_unseen()), of: "task" }
    }

    fn reads(&self, _run: &RunDir) -> Vec<StageDir> {
        Vec::new()
    }

    fn inputs(&self, _run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
        Ok(self.0.import_hash()?.map(|hash| ("import".to_owned(), hash)).into_iter().collect())
    }

    fn settings(&self) -> Value {
        json!({ "seed": self.0.spec.seed, "tasks": self.0.spec.tasks })
    }

    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        let tasks = make(self.0)?;
        tasks.validate()?;
        Ok(Box::new(Writer { tasks, job }))
    }
}

struct Writer<'j> {
    tasks: TaskSet,
    job: &'j Job<'j>,
}

impl Worker for Writer<'_> {
    fn shard(&self, _shard: u32) -> Result<Option<Made>, PipelineError> {
        self.tasks.write(&self.job.dir.path().join(FILE))?;
        Ok(Some(Made::files(&self.job.dir, [FILE])?))
    }
}

fn make(pipeline: &Pipeline) -> Result<TaskSet, PipelineError> {
    let spec = &pipeline.spec;
    let Some(path) = pipeline.import_path() else {
        let seed = Seed(spec.seed).derive("tasks", &[]);
        return Ok(task::sample(spec.tasks.pool(), spec.tasks.train, pipeline.n_unseen(), seed)?);
    };
    let mut tasks = task::import(&path, spec.tasks.train)?;
    if tasks.family != spec.tasks.family {
        return Err(PipelineError::Value {
            path: pipeline.path.clone(),
            key: "tasks.family".to_owned(),
            problem: format!("is {}, but {} holds {}", spec.tasks.family.name(), path.display(), tasks.family.name()),
        });
    }
    if let Some(unseen) = spec.tasks.unseen {
        let wanted = (spec.tasks.train + unseen) as usize;
        if tasks.tasks.len() < wanted {
            return Err(PipelineError::Value {
                path: pipeline.path.clone(),
                key: "tasks.unseen".to_owned(),
                problem: format!(
                    "asks for {} in all, but {} holds {}",
                    counted(wanted, "task"),
                    path.display(),
                    tasks.tasks.len()
                ),
            });
        }
        tasks.tasks.truncate(wanted);
    }
    Ok(tasks)
}

/// The task set of a finished stage.
pub(super) fn read(run: &RunDir) -> Result<TaskSet, PipelineError> {
    let dir = run.tasks();
    dir.finished()?;
    Ok(TaskSet::read(&dir.path().join(FILE))?)
}

/// The training tasks of a finished stage.
pub(super) fn training(pipeline: &Pipeline, run: &RunDir) -> Result<Vec<Task>, PipelineError> {
    let mut tasks = read(run)?.tasks;
    tasks.retain(|task| task.split == Split::Seen);
    let asked = pipeline.spec.tasks.train;
    if tasks.len() != asked as usize {
        let found = run.tasks().path().join(FILE);
        let problem = format!("is {asked}, but {} holds {}; stage tasks comes first", found.display(), tasks.len());
        return Err(PipelineError::Value { path: pipeline.path.clone(), key: "tasks.train".to_owned(), problem });
    }
    Ok(tasks)
}

/// The version of a finished task set, as later stages name it among their inputs.
pub(super) fn version(run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
    Ok(BTreeMap::from([(Stage::Tasks.name().to_owned(), run.tasks().version()?)]))
}
