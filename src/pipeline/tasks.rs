//! Stage `tasks`: draws or imports the task set and writes it.

use std::collections::BTreeMap;

use serde_json::json;

use crate::artifact::{FileEntry, Plan, Receipt};
use crate::pipeline::runner::{Context, Part, Unit};
use crate::pipeline::{PipelineError, Stage};
use crate::seed::Seed;
use crate::task::{self, TaskSet};

const FILE: &str = "tasks.json";

pub(super) fn units(context: &Context<'_>) -> Result<Vec<Unit>, PipelineError> {
    let spec = &context.pipeline.spec;
    let config = json!({ "seed": spec.seed, "tasks": spec.tasks });
    let inputs = context.pipeline.import_hash()?.map(|hash| ("import".to_owned(), hash));
    let plan = Plan::new(Stage::Tasks.name(), 1, inputs.into_iter().collect(), config);
    Ok(vec![Unit { name: "tasks".to_owned(), dir: context.dir.tasks(), plan, part: Part::Whole }])
}

pub(super) fn work(context: &Context<'_>, unit: &Unit) -> Result<(), PipelineError> {
    let tasks = make(context)?;
    tasks.validate()?;
    unit.dir.begin(&unit.plan)?;
    tasks.write(&unit.dir.path().join(FILE))?;
    let receipt = Receipt {
        plan_id: unit.plan.id(),
        shard: 0,
        episodes: 0,
        failed: 0,
        files: vec![FileEntry::of(unit.dir.path(), FILE)?],
    };
    unit.dir.commit_shard(&receipt)?;
    unit.dir.commit(&unit.plan, &[])?;
    Ok(())
}

fn make(context: &Context<'_>) -> Result<TaskSet, PipelineError> {
    let spec = &context.pipeline.spec;
    let Some(path) = context.pipeline.import_path() else {
        let seed = Seed(spec.seed).derive("tasks", &[]);
        return Ok(task::sample(spec.tasks.pool(), spec.tasks.train, context.pipeline.n_unseen(), seed)?);
    };
    let mut tasks = task::import(&path, spec.tasks.train)?;
    if tasks.family != spec.tasks.family {
        return Err(PipelineError::Value {
            path: context.pipeline.path.clone(),
            key: "tasks.family".to_owned(),
            problem: format!("is {}, but {} holds {}", spec.tasks.family.name(), path.display(), tasks.family.name()),
        });
    }
    if let Some(unseen) = spec.tasks.unseen {
        let wanted = (spec.tasks.train + unseen) as usize;
        if tasks.tasks.len() < wanted {
            return Err(PipelineError::Value {
                path: context.pipeline.path.clone(),
                key: "tasks.unseen".to_owned(),
                problem: format!("asks for {wanted} tasks in all, but {} holds {}", path.display(), tasks.tasks.len()),
            });
        }
        tasks.tasks.truncate(wanted);
    }
    Ok(tasks)
}

/// The task set of a finished stage, with the version that later stages name as their input.
pub(super) fn read(context: &Context<'_>) -> Result<(TaskSet, BTreeMap<String, String>), PipelineError> {
    let dir = context.dir.tasks();
    let version = dir.version()?;
    let tasks = TaskSet::read(&dir.path().join(FILE))?;
    Ok((tasks, BTreeMap::from([(Stage::Tasks.name().to_owned(), version)])))
}
