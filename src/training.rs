//! From trials in memory to trained weights: examples, batches, learner, checkpoints.
//!
//! # Input and output
//!
//! [`DatasetTrials`] → a model's folder: `model.safetensors`, `metrics.parquet`, `config.json`, and behind a detector
//! `detector_metrics.parquet`. While it is under way the folder holds `checkpoint/`.
//!
//! # Invariants
//!
//! The same settings, seed and dataset give the same weights, bit for bit, for any number of threads, in one go or
//! resumed. Every step draws from a seed of its own.
//!
//! # Source
//!
//! Paper, section IV, "Model Training".

mod augment;
mod batch;
mod call_tree;
mod checkpoint;
mod config;
mod curriculum;
mod detector;
mod detector_config;
mod examples;
mod learner;
mod metrics;
mod recovery;
mod seen;

pub use batch::{Group, Part, draw};
pub use config::{Curriculum, LossWeights, Pairing, TrainConfig, Training};
pub use detector::DetectorMetric;
pub use detector_config::DetectorTraining;
pub use examples::{Example, Examples, Grain};
pub use learner::{Learner, Losses, losses};
pub use metrics::Metric;
pub use seen::Gallery;

use std::path::{Path, PathBuf};

use burn::module::ModuleDisplay;
use burn::tensor::Device;
use sha2::{Digest as _, Sha256};

use crate::artifact::{self, IoError};
use crate::dataset::DatasetTrials;
use crate::model::{
    Architecture, CONFIG_FILE, Detecting, Detector, EncoderKind, ModelConfig, ModelError, Network, NetworkUse, Variant,
    VggDetectorConfig, WEIGHTS_FILE, weights_to_bytes, with_network,
};
use crate::seed::Seed;
use crate::table::TableError;
use crate::trace::SpecificationForm;
use crate::training::checkpoint::{Checkpoints, Resumed, Standing};
use crate::training::curriculum::LevelErrors;
use crate::training::detector::DetectorRun;
use crate::training::learner::group_losses;

/// Name of the learning curves in a model's folder.
pub const METRICS_FILE: &str = "metrics.parquet";

/// Name of a detector's learning curve in the folder of the model behind it.
pub const DETECTOR_METRICS_FILE: &str = "detector_metrics.parquet";

/// A training that cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// A setting makes no sense.
    #[error("{key} is {found}; allowed: {allowed}")]
    Config {
        /// Its key.
        key: &'static str,
        /// As found.
        found: String,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The dataset has nothing to learn from.
    #[error("none of the dataset's {total} successful episodes is of a training task")]
    NoTrials {
        /// Successful episodes of any split.
        total: usize,
    },
    /// Trials of different families cannot be learned together.
    #[error(
        "the dataset holds more than one family: trial {trial} of task {task} is of {found}, the first of {expected}"
    )]
    MixedFamilies {
        /// The first trial that differs.
        trial: u32,
        /// Its task.
        task: String,
        /// Its family.
        found: &'static str,
        /// The family of the first trial.
        expected: &'static str,
    },
    /// A trial does not fit together.
    #[error("trial {trial} of task {task}: {problem}")]
    Trial {
        /// The task's id.
        task: String,
        /// The trial's number.
        trial: u32,
        /// What is wrong.
        problem: String,
    },
    /// A checkpoint cannot be used; removing its folder starts afresh.
    #[error("checkpoint cannot be used: {problem}: {}", path.display())]
    Checkpoint {
        /// What is wrong.
        problem: String,
        /// The file.
        path: PathBuf,
    },
    /// The learning curves could not be stored.
    #[error(transparent)]
    Metrics(#[from] TableError),
    /// The weights could not be stored.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// It was asked to stop; a checkpoint holds where it stands.
    #[error("training was stopped after step {step}")]
    Stopped {
        /// Steps done.
        step: u32,
    },
}

/// Where a training stands, for people.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Steps done.
    pub step: u32,
    /// Steps in all.
    pub steps: u32,
    /// Weighed loss of the last step, summed over levels.
    pub loss: f32,
}

/// What a training came to.
#[derive(Clone, Debug, PartialEq)]
pub struct TrainSummary {
    /// Steps done, those before a resumption included.
    pub steps: u32,
    /// Decisions learned from.
    pub examples: u64,
    /// The step it was resumed at; 0 when it began afresh.
    pub resumed_at: u32,
    /// The learning curves.
    pub metrics: Vec<Metric>,
}

/// What a training tells its caller, and asks it.
pub struct Hooks<'h> {
    /// Told after each step.
    pub on_progress: &'h mut dyn FnMut(Progress),
    /// Asked before each step; when it says yes, a checkpoint is saved and [`TrainError::Stopped`] returned.
    pub should_stop: &'h dyn Fn() -> bool,
}

/// Trains a model into a folder, or goes on where a checkpoint in it stands.
///
/// # Errors
///
/// [`TrainError`]; the folder then holds no `config.json`, at most a checkpoint.
pub fn train(
    training: &Training,
    data: &DatasetTrials,
    folder: &Path,
    hooks: &mut Hooks<'_>,
) -> Result<TrainSummary, TrainError> {
    train_seeing(training, data, None, folder, hooks)
}

/// The same with the pictures of the trials' frames, for a variant that sees.
///
/// # Errors
///
/// As [`train`]; and when there are none for such a variant.
pub fn train_seeing(
    training: &Training,
    data: &DatasetTrials,
    gallery: Option<&dyn Gallery>,
    folder: &Path,
    hooks: &mut Hooks<'_>,
) -> Result<TrainSummary, TrainError> {
    training.check()?;
    if training.variant.sees() && gallery.is_none() {
        let found = training.variant.to_string();
        return Err(TrainError::Config {
            key: "variant",
            found,
            allowed: "variants that see only with a dataset of pictures",
        });
    }
    check_pictures(training.variant, gallery)?;
    let training = training.resolved();
    let family = family(data)?;
    let written =
        serde_json::to_value(&training).map_err(|source| IoError::Json { path: folder.join(CONFIG_FILE), source })?;
    let mut model = ModelConfig::new(training.variant, training.specification, family, data.n_slots, written);
    if training.variant.architecture() == Architecture::Npi {
        model.tasks = Examples::new(data)?.task_ids();
    }
    let device = Device::flex().autodiff();
    let seed = Seed(training.seed).derive("train", &[]);
    if let Some((width, height)) = gallery.map(Gallery::size) {
        if width != height {
            let (key, found) = ("size of the pictures", format!("{width}x{height} pixels"));
            return Err(TrainError::Config { key, found, allowed: "as wide as high" });
        }
        model.network = model.network.seeing(width, data.n_slots);
        if let Some(colours) = training.config.colours {
            check_colours(training.variant, colours, data.n_slots)?;
            model.network = model.network.telling_apart(colours as usize);
        }
        if let Some(narrowed) = training.config.detector.narrowed {
            model.network = model.network.narrowed(narrowed as usize);
        }
    }
    let learning = Learning { config: &training.config, data, gallery, model: &model, folder, seed, hooks };
    with_network(&model, seed, &device, learning)
}

/// Refuses pictures that are too small for a network.
fn check_pictures(variant: Variant, gallery: Option<&dyn Gallery>) -> Result<(), TrainError> {
    let Some((width, height)) = gallery.map(Gallery::size) else { return Ok(()) };
    if variant.encoder() == EncoderKind::DetectedFlattened && width.min(height) < VggDetectorConfig::LEAST_PIXELS {
        return Err(TrainError::Config {
            key: "variant",
            found: format!("{variant} with pictures of {width}x{height} pixels"),
            allowed: "pictures of 32x32 pixels and more, which are halved five times",
        });
    }
    Ok(())
}

/// A detector gives every slot a colour of its own, also one whose thing stands aside.
fn check_colours(variant: Variant, colours: u32, n_slots: usize) -> Result<(), TrainError> {
    if variant.detects() && (colours as usize) < n_slots + 1 {
        return Err(TrainError::Config {
            key: "colours",
            found: format!("{colours} with {n_slots} slots"),
            allowed: "more colours than slots for a detector",
        });
    }
    Ok(())
}

/// A training that waits for its network.
struct Learning<'r, 'h> {
    config: &'r TrainConfig,
    data: &'r DatasetTrials,
    gallery: Option<&'r dyn Gallery>,
    model: &'r ModelConfig,
    folder: &'r Path,
    seed: Seed,
    hooks: &'r mut Hooks<'h>,
}

impl NetworkUse for Learning<'_, '_> {
    type Output = Result<TrainSummary, TrainError>;

    fn run<N: Network>(self, network: N) -> Self::Output {
        let Self { config, data, gallery, model, folder, seed, hooks } = self;
        let grain = if N::IS_RECURRENT { Grain::Call } else { Grain::Decision };
        let examples = Examples::of(data, model.network.specification(), N::DECISIONS, grain)?;
        let gallery = gallery.filter(|_| model.variant.sees());
        let run = Run { config, examples: &examples, gallery, model, folder, seed };
        let (network, trained) = run.train(network, hooks)?;
        write(folder, model, &network, &trained.standing.metrics)?;
        run.checkpoints().clear()?;
        Ok(trained.summary())
    }

    /// First the detector, then the network behind it, which learns on what the detector then finds.
    fn run_detecting<D: Detector, N: Network<Percepts = ()> + ModuleDisplay>(
        self,
        network: Detecting<D, N>,
    ) -> Self::Output {
        let Self { config, data, gallery, model, folder, seed, hooks } = self;
        let Some(gallery) = gallery else {
            return Err(TrainError::Config {
                key: "variant",
                found: model.variant.to_string(),
                allowed: "variants that see only with a dataset of pictures",
            });
        };
        let (detector, programmer) = network.into_parts();
        let (detector, standing) = DetectorRun { config, data, gallery, model, folder, seed }.train(detector, hooks)?;
        let detected = detector::detected(&detector, data, gallery)?;
        let grain = if N::IS_RECURRENT { Grain::Call } else { Grain::Decision };
        let examples = Examples::of(&detected, SpecificationForm::Trajectories, N::DECISIONS, grain)?;
        let run = Run { config, examples: &examples, gallery: None, model, folder, seed };
        let (programmer, trained) = run.train(programmer, hooks)?;
        detector::write_metrics(&folder.join(DETECTOR_METRICS_FILE), &standing.metrics)?;
        let network = Detecting::new(detector, programmer, data.n_slots);
        write(folder, model, &network, &trained.standing.metrics)?;
        run.checkpoints().clear()?;
        Ok(trained.summary())
    }
}

/// The one family of a dataset.
fn family(data: &DatasetTrials) -> Result<crate::task::Family, TrainError> {
    let first = data.trials.first().ok_or(TrainError::NoTrials { total: 0 })?;
    match data.trials.iter().find(|trial| trial.family != first.family) {
        Some(other) => Err(TrainError::MixedFamilies {
            trial: other.trial,
            task: other.task_id.clone(),
            found: other.family.name(),
            expected: first.family.name(),
        }),
        None => Ok(first.family),
    }
}

/// Hash of what is learned from: a checkpoint belongs to it.
fn dataset_hash(data: &DatasetTrials) -> String {
    let mut hasher = Sha256::new();
    for trial in &data.trials {
        hasher.update(trial.task_id.as_bytes());
        hasher.update(trial.split.name());
        hasher.update([trial.trial.to_le_bytes(), (trial.n_frames as u32).to_le_bytes()].concat());
        trial.observations.iter().for_each(|value| hasher.update(value.to_le_bytes()));
        let grippers = trial.grippers.iter().flat_map(|gripper| gripper.in_world_m);
        grippers.for_each(|value| hasher.update(value.to_le_bytes()));
        trial.instructions.iter().flat_map(|said| said.words).for_each(|word| hasher.update(word.to_le_bytes()));
    }
    artifact::hex(&hasher.finalize())
}

/// What a step with this seed draws from pictures.
fn seen_seed(step: Seed) -> Seed {
    step.derive("seen", &[])
}

/// A training with everything settled but its network.
struct Run<'r> {
    config: &'r TrainConfig,
    examples: &'r Examples<'r>,
    gallery: Option<&'r dyn Gallery>,
    model: &'r ModelConfig,
    folder: &'r Path,
    seed: Seed,
}

/// A training that has come to its end.
struct Trained {
    standing: Standing,
    resumed_at: u32,
}

impl Trained {
    fn summary(self) -> TrainSummary {
        let Standing { step, examples, metrics, errors: _ } = self.standing;
        TrainSummary { steps: step, examples, resumed_at: self.resumed_at, metrics }
    }
}

impl Run<'_> {
    fn checkpoints(&self) -> Checkpoints<'_> {
        Checkpoints::new(self.folder, self.model, dataset_hash(self.examples.data()))
    }

    fn train<N: Network>(&self, network: N, hooks: &mut Hooks<'_>) -> Result<(N, Trained), TrainError> {
        let checkpoints = self.checkpoints();
        let device = network.device();
        let fresh = Learner::new(network, device, self.config.clip_norm);
        let Resumed { mut learner, mut standing } = match checkpoints.resume(fresh)? {
            Ok(resumed) => resumed,
            Err(learner) => self.begin(learner)?,
        };
        let resumed_at = standing.step;
        let before = self.config.detector.n_steps();
        while standing.step < self.config.n_steps() {
            if (hooks.should_stop)() {
                checkpoints.save(&learner, &standing)?;
                return Err(TrainError::Stopped { step: before + standing.step });
            }
            let loss;
            (learner, loss) = self.step(learner, &mut standing)?;
            let steps = self.config.n_steps_in_all();
            (hooks.on_progress)(Progress { step: before + standing.step, steps, loss });
            if standing.step.is_multiple_of(self.config.checkpoint_every) && standing.step < self.config.n_steps() {
                checkpoints.save(&learner, &standing)?;
            }
        }
        Ok((learner.into_module(), Trained { standing, resumed_at }))
    }

    /// Before the first step.
    fn begin<N: Network>(&self, learner: Learner<N>) -> Result<Resumed<N, Standing>, TrainError> {
        let errors = LevelErrors::new(self.examples.levels().count());
        let standing = Standing { step: 0, examples: 0, errors, metrics: Vec::new() };
        let Some(gallery) = self.gallery else { return Ok(Resumed { learner, standing }) };
        let (sample, _) = seen::sample(self.examples.data(), gallery)?;
        let network = learner.module().clone().acquainted(&sample, self.seed.derive("acquainted", &[]));
        Ok(Resumed { learner: learner.with_module(network), standing })
    }

    /// One step; the learner after it and the weighed loss.
    fn step<N: Network>(&self, learner: Learner<N>, standing: &mut Standing) -> Result<(Learner<N>, f32), TrainError> {
        let step_seed = self.step_seed(standing.step);
        let learning_rate = self.config.learning_rate_at(standing.step);
        let chosen = standing.errors.levels(self.config.curriculum, step_seed.derive("levels", &[]));
        let levels: Vec<_> = self.examples.levels().collect();
        let sizes: Vec<(usize, usize)> =
            chosen.iter().map(|&level| (level, self.batch_size(levels[level].1))).collect();
        let groups = self.draw(&sizes, step_seed)?;
        self.announce(standing.step + 1);
        let weights = self.config.loss;
        let lose = |network: &N, group: &Group| group_losses(network, group, weights);
        let (learner, losses) = learner.step(&groups, learning_rate, lose);
        let losses = losses.concat();
        standing.step += 1;
        let parts: Vec<&Part> = groups.iter().flat_map(|group| &group.parts).collect();
        let mut total = 0.0;
        for (batch_idx, &level) in chosen.iter().enumerate() {
            let of_batch = || parts.iter().zip(&losses).filter(move |(part, _)| part.batch_idx == batch_idx);
            let losses = of_batch().map(|(_, losses)| *losses).fold(Losses::default(), Losses::plus);
            let size: usize = of_batch().map(|(part, _)| part.ends.len()).sum();
            total += losses.total;
            standing.examples += size as u64;
            standing.errors.update(level, losses.total);
            if standing.step.is_multiple_of(self.config.metrics_every) || standing.step == self.config.n_steps() {
                let program = levels[level].0;
                standing.metrics.push(Metric::new(standing.step, program, losses, learning_rate, size as u32));
            }
        }
        Ok((learner, total))
    }

    /// A step's mini-batches: of each level its size.
    fn draw(&self, sizes: &[(usize, usize)], seed: Seed) -> Result<Vec<Group>, TrainError> {
        if let Some(gallery) = self.gallery {
            return seen::draw_seen(self.examples, gallery, self.config, sizes, seen_seed(seed));
        }
        let batches = sizes.iter().enumerate().flat_map(|(batch_idx, &(level, size))| {
            let parts = draw(self.examples, self.config, level, size, seed.derive("batch", &[batch_idx as u64]));
            parts.into_iter().map(move |part| Group::from(Part { batch_idx, ..part }))
        });
        Ok(batches.collect())
    }

    /// Lets pictures be made ready for a step while the one before it is computed.
    fn announce(&self, step: u32) {
        if let Some(gallery) = self.gallery.filter(|_| step < self.config.n_steps()) {
            gallery.announce(&seen::trials(self.examples, seen_seed(self.step_seed(step))));
        }
    }

    fn step_seed(&self, step: u32) -> Seed {
        self.seed.derive("step", &[u64::from(step)])
    }

    fn batch_size(&self, is_root: bool) -> usize {
        let batch = self.config.batch as usize;
        if is_root { batch } else { batch.div_ceil(2) }
    }
}

/// The model's files; `config.json` last, since it says that the model is there.
fn write<N: Network>(folder: &Path, model: &ModelConfig, network: &N, metrics: &[Metric]) -> Result<(), TrainError> {
    let path = folder.join(WEIGHTS_FILE);
    artifact::write(&path, &weights_to_bytes(network, &path)?)?;
    metrics::write(&folder.join(METRICS_FILE), metrics)?;
    artifact::write_json(&folder.join(CONFIG_FILE), model)?;
    Ok(())
}
