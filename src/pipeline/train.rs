//! Stage `train`: one model for each variant and seed, from the dataset alone; a study's own models from several.

use std::collections::{BTreeMap, HashSet};

use serde_json::{Value, json};

use crate::artifact::{IoError, StageDir};
use crate::dataset::{self, DatasetTrials, LearnedTrials, TrialData};
use crate::model::{CONFIG_FILE, CoreKind, WEIGHTS_FILE};
use crate::pipeline::gallery::OfBuffers;
use crate::pipeline::layout::model_name;
use crate::pipeline::unit::{Amount, Job, Looked, Made, Unit, Worker};
use crate::pipeline::{ModelSpec, Pipeline, PipelineError, RunDir, Stage, Study, tasks};
use crate::task::Split;
use crate::training::{
    self, DETECTOR_METRICS_FILE, Galleries, Gallery, Hooks, METRICS_FILE, Place, Source, TrialStream,
};
use crate::words::counted;

/// Boundary frames of a dataset above which trials are streamed from disk: those below take 700 MB at most.
const MOST_FRAMES: u64 = 1_500_000;
/// What a plan calls the model that a training begins with.
const START_INPUT: &str = "start_from";
/// Raised when the same settings train another model.
const VERSION: u32 = 1;

/// One training of a model.
#[derive(Clone, Copy)]
pub(super) struct Model<'p> {
    source: LearnsFrom<'p>,
    pub(super) spec: &'p ModelSpec,
    pub(super) seed: u64,
}

/// What a model learns from.
#[derive(Clone, Copy)]
enum LearnsFrom<'p> {
    /// The experiment that it stands in.
    Experiment(&'p Pipeline),
    /// Those experiments of a study that it names.
    Study(&'p Study),
}

/// Every model with each of its seeds, in the file's order.
pub(super) fn units(pipeline: &Pipeline) -> Vec<Model<'_>> {
    models(LearnsFrom::Experiment(pipeline), &pipeline.spec.models)
}

/// The same of a study's own models.
pub(super) fn units_of_study(study: &Study) -> Vec<Model<'_>> {
    models(LearnsFrom::Study(study), &study.spec.models)
}

fn models<'p>(source: LearnsFrom<'p>, specs: &'p [ModelSpec]) -> Vec<Model<'p>> {
    let of_spec = |spec: &'p ModelSpec| spec.seeds.iter().map(move |&seed| Model { source, spec, seed });
    specs.iter().flat_map(of_spec).collect()
}

impl<'p> Model<'p> {
    /// The experiments that it learns from.
    fn experiments(&self) -> Vec<&'p Pipeline> {
        match self.source {
            LearnsFrom::Experiment(pipeline) => vec![pipeline],
            LearnsFrom::Study(study) => study.learned_by(self.spec).collect(),
        }
    }

    /// The model's folder.
    pub(super) fn folder_name(&self) -> String {
        model_name(self.spec, self.seed)
    }

    /// How many training tasks it learns from.
    pub(super) fn train_tasks(&self) -> u32 {
        self.experiments().into_iter().map(|pipeline| self.train_tasks_of(pipeline)).sum()
    }

    /// How many of an experiment.
    fn train_tasks_of(&self, pipeline: &Pipeline) -> u32 {
        let all = pipeline.spec.tasks.train;
        self.spec.train_tasks.map_or(all, |asked| asked.min(all))
    }

    /// An experiment's run directory, from that which the model lies in.
    fn run_of(&self, pipeline: &Pipeline, run: &RunDir) -> RunDir {
        match self.source {
            LearnsFrom::Experiment(_) => run.clone(),
            LearnsFrom::Study(_) => run.of_study().experiment(&pipeline.spec.name),
        }
    }

    /// The model whose weights it begins with.
    fn start(&self, run: &RunDir) -> Option<StageDir> {
        let start_from = self.spec.training.start_from.as_ref()?;
        Some(run.at(Stage::Train, start_from))
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
        match self.source {
            LearnsFrom::Experiment(_) => run.model(&self.folder_name()),
            LearnsFrom::Study(_) => run.of_study().model(&self.folder_name()),
        }
    }

    fn amount(&self, _shard: u32) -> Amount {
        let training = self.spec.training(self.seed).resolved();
        Amount { count: u64::from(training.config.n_steps_in_all()), of: "step" }
    }

    fn reads(&self, run: &RunDir) -> Vec<StageDir> {
        let datasets = self.experiments().into_iter().map(|pipeline| self.run_of(pipeline, run).dataset());
        datasets.chain(self.start(run)).collect()
    }

    fn looks_at(&self, run: &RunDir) -> Vec<Looked> {
        let tasks = |pipeline| Looked::Files(self.run_of(pipeline, run).tasks());
        self.experiments().into_iter().map(tasks).collect()
    }

    fn inputs(&self, run: &RunDir) -> Result<BTreeMap<String, String>, PipelineError> {
        let input = |pipeline: &Pipeline| {
            let name = match self.source {
                LearnsFrom::Experiment(_) => Stage::Convert.name().to_owned(),
                LearnsFrom::Study(_) => format!("{}: {}", pipeline.spec.name, Stage::Convert),
            };
            Ok((name, self.run_of(pipeline, run).dataset().version()?))
        };
        let start = self.start(run).map(|start| Ok((START_INPUT.to_owned(), start.version()?)));
        self.experiments().into_iter().map(input).chain(start).collect()
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
        match self.source {
            LearnsFrom::Experiment(pipeline) if self.spec.variant.sees() => {
                settings["cameras"] = json!(self.spec.camera_names(&pipeline.spec.generate));
            }
            LearnsFrom::Experiment(_) => {}
            LearnsFrom::Study(_) => settings["experiments"] = json!(self.spec.experiments),
        }
        if self.spec.core() != CoreKind::Reactive {
            settings["cell_inputs"] = json!("of all steps at once");
        }
        let learns_calls = self.spec.core() != CoreKind::Reactive && self.spec.scoping().has_scopes();
        if learns_calls && self.spec.training(self.seed).resolved().config.recovery_states > Some(0.0) {
            settings["recovery"] = json!("within calls");
        }
        settings
    }

    fn open<'j>(&'j self, job: &'j Job<'_>) -> Result<Box<dyn Worker + 'j>, PipelineError> {
        Ok(Box::new(Trainer { unit: self, job, trials: training_trials(self, job)? }))
    }
}

/// Trains a model.
struct Trainer<'j> {
    unit: &'j Model<'j>,
    job: &'j Job<'j>,
    trials: Trials,
}

/// What a model learns from.
enum Trials {
    Here(DatasetTrials),
    /// Too many for memory.
    Streamed(Box<TrialStream>),
}

impl Trials {
    fn len(&self) -> usize {
        match self {
            Self::Here(data) => data.trials.len(),
            Self::Streamed(stream) => stream.n_trials(),
        }
    }
}

impl Worker for Trainer<'_> {
    fn shard(&self, shard: u32) -> Result<Option<Made>, PipelineError> {
        let Self { unit, job, trials } = self;
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
        let start = unit.start(job.context.dir);
        let start = start.as_ref().map(StageDir::path);
        let place = Place { device: job.context.options.device, folder: job.dir.path(), start };
        let mut train = |source: Source<'_>| training::train_at(place, &training, source, &mut hooks);
        let sees = match unit.source {
            LearnsFrom::Experiment(pipeline) if unit.spec.variant.sees() => {
                Some(OfBuffers::new(unit.spec.looks_with(&pipeline.spec.generate), job.context.dir))
            }
            LearnsFrom::Experiment(_) | LearnsFrom::Study(_) => None,
        };
        let summary = match trials {
            Trials::Here(data) => {
                let gallery = sees.map(|galleries| galleries.find(data)).transpose()?;
                train(Source::Here(data, gallery.as_ref().map(|gallery| gallery as &dyn Gallery)))
            }
            Trials::Streamed(stream) => {
                train(Source::Streamed(stream, sees.as_ref().map(|galleries| galleries as &dyn Galleries)))
            }
        };
        job.context.go_on()?;
        if job.is_done(shard)? {
            training::clear_checkpoints(job.dir.path())?;
            return Ok(None);
        }
        let summary = summary?;
        let made = Made::files(&job.dir, unit.result_files())?;
        let dropped = match summary.dropped_gradients {
            0 => String::new(),
            n => format!(", {n} gradients that were no numbers left out"),
        };
        let told =
            Some(format!("{}, {}{dropped}", counted(summary.steps, "step"), counted(summary.examples, "example")));
        Ok(Some(Made { episodes: trials.len() as u64, told, ..made }))
    }
}

/// The trials a model may train on: successful ones of the first training tasks. A detector looks at all of them, and a
/// study's own model learns from several datasets at once, so that theirs are always in memory; pictures never are.
fn training_trials(unit: &Model<'_>, job: &Job<'_>) -> Result<Trials, PipelineError> {
    let run = job.context.dir;
    let of_experiment = |pipeline: &Pipeline, most_frames: u64| {
        let run = unit.run_of(pipeline, run);
        let allowed: Vec<String> = tasks::training(pipeline, &run)?.into_iter().map(|task| task.id).collect();
        let allowed: HashSet<&String> = allowed[..unit.train_tasks_of(pipeline) as usize].iter().collect();
        let is_taken = |trial: &TrialData| trial.split == Split::Seen && allowed.contains(&trial.task_id);
        let folder = job.dir.path();
        std::fs::create_dir_all(folder).map_err(IoError::system("make", folder))?;
        Ok::<_, PipelineError>(
            match dataset::read_learned_trials(run.dataset().path(), is_taken, most_frames, folder)? {
                LearnedTrials::Here(data) => Trials::Here(data),
                LearnedTrials::OnDisk(spool) => Trials::Streamed(Box::new(TrialStream::new(spool, most_frames)?)),
            },
        )
    };
    if let LearnsFrom::Experiment(pipeline) = unit.source {
        let most_frames = match (unit.spec.variant.detects(), unit.spec.training.most_frames_in_memory) {
            (true, _) => u64::MAX,
            (false, asked) => asked.unwrap_or(MOST_FRAMES),
        };
        return of_experiment(pipeline, most_frames);
    }
    let mut datasets = Vec::new();
    for pipeline in unit.experiments() {
        // Of so many frames none are left on disk.
        if let Trials::Here(data) = of_experiment(pipeline, u64::MAX)? {
            datasets.push(data);
        }
    }
    Ok(Trials::Here(DatasetTrials::together(datasets)))
}
