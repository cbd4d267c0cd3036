//! Stage `train`: one model for each variant and seed, from the dataset alone.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::artifact::StageDir;
use crate::dataset::{self, DatasetTrials};
use crate::model::{CONFIG_FILE, WEIGHTS_FILE};
use crate::pipeline::layout::model_name;
use crate::pipeline::unit::{Amount, Job, Made, Unit, Worker};
use crate::pipeline::{ModelSpec, Pipeline, PipelineError, RunDir, Stage, gallery, tasks};
use crate::task::Split;
use crate::training::{self, DETECTOR_METRICS_FILE, Gallery, Hooks, METRICS_FILE};

/// Raised when the same settings train another model.
const VERSION: u32 = 1;

/// One training of a model.
#[derive(Clone, Copy)]
pub(super) struct Model<'p> {
    pipeline: &'p Pipeline,
    pub(super) spec: &'p ModelSpec,
    pub(super) seed: u64,
}

/// Every model with each of its seeds, in the file's order.
pub(super) fn units(pipeline: &Pipeline) -> Vec<Model<'_>> {
    let models = pipeline.spec.models.iter();
    models.flat_map(|spec| spec.seeds.iter().map(move |&seed| Model { pipeline, spec, seed })).collect()
}

impl Model<'_> {
    /// The model's folder.
    pub(super) fn folder_name(&self) -> String {
        model_name(self.spec, self.seed)
    }

    /// How many training tasks it learns from.
    pub(super) fn train_tasks(&self) -> u32 {
        let all = self.pipeline.spec.tasks.train;
        self.spec.train_tasks.map_or(all, |asked| asked.min(all))
    }

    /// What a finished training leaves; checkpoints are not part of it.
    fn result_files(&self) -> impl Iterator<Item = &'static str> {
        let of_detector = self.spec.variant.detects().then_some(DETECTOR_METRICS_FILE);
        [WEIGHTS_FILE, CONFIG_FILE, METRICS_FILE].into_iter().chain(of_detector)
    }
}

impl Unit for Model<'_> {
    fn stage(&self) -> Stage {
        Stage::Train
    }

    fn stage_version(&self) -> u32 {
        VERSION
    }

    fn name(&self) -> String {
        format!("train {}", self.folder_name())
    }

    fn dir(&self, run: &RunDir) -> StageDir {
        run.model(&self.folder_name())
    }

    fn amount(&self, _shard: u32) -> Amount {
        let training = self.spec.training(self.seed).resolved();
        Amount { count: u64::from(training.config.n_steps_in_all()), of: "steps" }
    }

    fn inputs(&self, run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
        Ok(BTreeMap::from([(Stage::Convert.name().to_owned(), run.dataset().version()?)]))
    }

    fn settings(&self) -> Value {
        let mut settings = json!({
            "variant": self.spec.variant,
            "seed": self.seed,
            "train_tasks": self.spec.train_tasks,
            "training": self.spec.training,
        });
        if self.spec.variant.detects() {
            settings["detector_given"] = json!("gripper");
        }
        settings
    }

    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        Ok(Box::new(Trainer { unit: self, job, trials: training_trials(self, job.context.dir)? }))
    }
}

/// Trains a model.
struct Trainer<'j> {
    unit: &'j Model<'j>,
    job: &'j Job<'j>,
    trials: DatasetTrials,
}

impl Worker for Trainer<'_> {
    fn shard(&self, shard: u32) -> Result<Option<Made>, PipelineError> {
        let Self { unit, job, trials } = self;
        let gallery = unit.spec.variant.sees().then(|| gallery::open(unit.pipeline, job.context.dir, trials));
        let gallery = gallery.transpose()?;
        let training = unit.spec.training(unit.seed).resolved();
        let progress = &job.progress;
        let mut shown = None;
        let mut on_progress = |now: training::Progress| {
            let before = shown.replace(now.step).unwrap_or_else(|| {
                progress.carry_on_after(u64::from(now.step - 1));
                now.step - 1
            });
            progress.inc(u64::from(now.step - before));
            progress.message(&format!("loss {:.3}", now.loss));
        };
        // A twin on another machine that was first leaves nothing to do.
        let should_stop = || job.context.go_on().is_err() || job.is_done(shard).unwrap_or(false);
        let mut hooks = Hooks { on_progress: &mut on_progress, should_stop: &should_stop };
        let gallery = gallery.as_ref().map(|gallery| gallery as &dyn Gallery);
        let summary = training::train_on_pictures(&training, trials, gallery, job.dir.path(), &mut hooks);
        job.context.go_on()?;
        if job.is_done(shard)? {
            return Ok(None);
        }
        let summary = summary?;
        let made = Made::files(&job.dir, unit.result_files())?;
        let dropped = match summary.dropped_gradients {
            0 => String::new(),
            n => format!(", {n} gradients that were no numbers left out"),
        };
        let told = Some(format!("{} steps, {} examples{dropped}", summary.steps, summary.examples));
        Ok(Some(Made { episodes: trials.trials.len() as u64, told, ..made }))
    }
}

/// The trials a model may train on: successful ones of the first training tasks.
fn training_trials(unit: &Model<'_>, run: &RunDir) -> Result<DatasetTrials, PipelineError> {
    let mut trials = dataset::read_trials(run.dataset().path())?;
    let allowed: Vec<String> = tasks::training(unit.pipeline, run)?.into_iter().map(|task| task.id).collect();
    let allowed = &allowed[..unit.train_tasks() as usize];
    trials.trials.retain(|trial| trial.split == Split::Seen && allowed.contains(&trial.task_id));
    Ok(trials)
}
