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

mod adam;
mod augment;
mod batch;
mod call_tree;
mod checkpoint;
mod config;
mod curriculum;
mod detector;
mod detector_config;
mod detector_metrics;
mod error;
mod examples;
mod facts;
mod flat;
mod learner;
mod lesson;
mod losses;
mod merged;
mod metrics;
mod recovery;
mod run;
mod seen;
mod source;
mod start;
mod stream;
mod sub_task;

pub use batch::{Group, Part, draw};
pub use config::{Curriculum, LossWeights, Pairing, TrainConfig, Training};
pub use detector_config::DetectorTraining;
pub use detector_metrics::{DetectorMetric, SCHEMA as DETECTOR_METRICS};
pub use error::TrainError;
pub use examples::{Example, Examples, Grain};
pub use learner::{Learner, Stepped};
pub use losses::{Losses, losses};
pub use metrics::{Metric, SCHEMA as METRICS};
pub use seen::{Galleries, Gallery};
pub use source::Source;
pub use stream::TrialStream;

use std::path::Path;

use burn::module::ModuleDisplay;

use crate::artifact::{self, IoError};
use crate::dataset::DatasetTrials;
use crate::model::{
    CONFIG_FILE, ComputeDevice, Detecting, Detector, EncoderKind, ModelConfig, Network, NetworkUse, ScopingKind,
    Variant, VggDetectorConfig, WEIGHTS_FILE, weights_to_bytes, with_network,
};
use crate::seed::Seed;
use crate::trace::SpecificationForm;
use crate::training::detector::DetectorRun;
use crate::training::facts::{Facts, facts_of};
use crate::training::run::Run;
use crate::training::start::Start;
use crate::words::counted;

/// Name of the learning curves in a model's folder.
pub const METRICS_FILE: &str = "metrics.parquet";

/// Name of a detector's learning curve in the folder of the model behind it.
pub const DETECTOR_METRICS_FILE: &str = "detector_metrics.parquet";

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
    /// Gradients that were no numbers and were left out.
    pub dropped_gradients: u32,
    /// The step it was resumed at; 0 when it began afresh.
    pub resumed_at: u32,
    /// The learning curves.
    pub metrics: Vec<Metric>,
}

/// Where a training happens.
#[derive(Clone, Copy, Debug)]
pub struct Place<'p> {
    /// What computes it.
    pub device: ComputeDevice,
    /// The model's folder.
    pub folder: &'p Path,
    /// The folder of the model whose weights it begins with, where [`TrainConfig::start_from`] asks for one.
    pub start: Option<&'p Path>,
}

impl<'p> Place<'p> {
    /// On the processor, from weights that are drawn.
    pub fn new(folder: &'p Path) -> Self {
        Self { device: ComputeDevice::Cpu, folder, start: None }
    }
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
    train_on_pictures(training, data, None, folder, hooks)
}

/// The same with the pictures of the trials' frames, for a variant that sees.
///
/// # Errors
///
/// As [`train`]; and when there are none for such a variant.
pub fn train_on_pictures(
    training: &Training,
    data: &DatasetTrials,
    gallery: Option<&dyn Gallery>,
    folder: &Path,
    hooks: &mut Hooks<'_>,
) -> Result<TrainSummary, TrainError> {
    train_at(Place::new(folder), training, Source::Here(data, gallery), hooks)
}

/// The same on a device, from the weights of another model, or from trials on disk. A model that was trained elsewhere
/// than on the processor says so.
///
/// # Errors
///
/// As [`train_on_pictures`]; [`TrainError::Device`] when the device cannot be used; for a detector of trials on disk; and
/// when the weights to begin with are of another network.
pub fn train_at(
    place: Place<'_>,
    training: &Training,
    source: Source<'_>,
    hooks: &mut Hooks<'_>,
) -> Result<TrainSummary, TrainError> {
    training.check()?;
    let Place { device: on, folder, start } = place;
    let size = source.picture_size();
    if training.variant.sees() && size.is_none() {
        let found = training.variant.to_string();
        return Err(TrainError::Config {
            key: "variant",
            found,
            allowed: "variants that see only with a dataset of pictures",
        });
    }
    check_pictures(training.variant, size)?;
    let training = training.resolved();
    let facts = source.facts()?;
    let model = ModelConfig { cameras: source.cameras(), ..model(&training, &facts, size, folder)? };
    if !on.is_cpu() {
        facts.check_one_family(&format!("{} on {on}", training.variant))?;
    }
    let start = start.map(|start| Start::load(start, &model)).transpose()?;
    let device = on.open()?.autodiff();
    let seed = Seed(training.seed).derive("train", &[]);
    let config = &training.config;
    let learning = Learning { on, config, source, facts: &facts, model: &model, folder, start, seed, hooks };
    with_network(&model, seed, &device, learning)?
}

/// The configuration that settings and trials ask for.
fn model(
    training: &Training,
    facts: &Facts,
    picture_size: Option<(usize, usize)>,
    folder: &Path,
) -> Result<ModelConfig, TrainError> {
    let Training { variant, config, .. } = training;
    let n_slots = facts.n_slots;
    let written =
        serde_json::to_value(training).map_err(|source| IoError::Json { path: folder.join(CONFIG_FILE), source })?;
    if !(variant.reads_any_family() && training.specification == SpecificationForm::Trajectories) {
        facts.check_one_family(&format!("{variant} with {}", training.specification))?;
    }
    let (family, other_families) = facts.first_family()?;
    let mut model = ModelConfig::new(*variant, training.specification, family, n_slots, written);
    model = ModelConfig { shared_root: config.shared_root, ..model.beside(other_families) };
    if variant.scoping() == ScopingKind::Arguments {
        model.tasks.clone_from(&facts.task_ids);
    }
    if let Some((width, height)) = picture_size {
        let cameras = cameras_of(*variant, width, height)?;
        model.network = model.network.for_pictures(width, cameras, n_slots);
        if let Some(colours) = config.colours {
            check_colours(*variant, colours, n_slots)?;
            model.network = model.network.telling_apart(colours as usize);
        }
        if let Some(narrowed) = config.detector.narrowed {
            model.network = model.network.narrowed(narrowed as usize);
        }
        if config.detector.heat_maps {
            model.network = model.network.with_heat_maps();
        }
    }
    if let Some(kernel) = config.scope_kernel {
        check_kernel(kernel, facts.longest)?;
        model.network = model.network.with_scope_kernel(kernel as usize);
    }
    if let Some(width) = config.width {
        model.network = model.network.with_width(width as usize);
    }
    if config.relations {
        model.network = model.network.with_relations();
    }
    Ok(model)
}

/// How many cameras see a picture; each sees a square of it, one below the other.
fn cameras_of(variant: Variant, width: usize, height: usize) -> Result<usize, TrainError> {
    let (key, found) = ("size of the pictures", format!("{width}x{height} pixels"));
    match height.checked_div(width) {
        Some(cameras) if cameras > 0 && cameras * width == height => {
            let allowed = "of one camera for a detector, as wide as high";
            if variant.detects() && cameras > 1 { Err(TrainError::Config { key, found, allowed }) } else { Ok(cameras) }
        }
        _ => Err(TrainError::Config { key, found, allowed: "as wide as high, of each camera" }),
    }
}

/// Refuses pictures that are too small for a network.
fn check_pictures(variant: Variant, size: Option<(usize, usize)>) -> Result<(), TrainError> {
    let Some((width, height)) = size else { return Ok(()) };
    if variant.encoder() == EncoderKind::DetectedFlattened && width.min(height) < VggDetectorConfig::LEAST_PIXELS {
        return Err(TrainError::Config {
            key: "variant",
            found: format!("{variant} with pictures of {width}x{height} pixels"),
            allowed: "pictures of 32x32 pixels and more, which are halved five times",
        });
    }
    Ok(())
}

/// A kernel longer than every demonstration sees nothing more.
fn check_kernel(kernel: u32, longest: usize) -> Result<(), TrainError> {
    if kernel as usize > longest {
        return Err(TrainError::Config {
            key: "scope_kernel",
            found: format!(
                "{kernel}, and the longest demonstration has {longest}",
                longest = counted(longest, "frame")
            ),
            allowed: "at most as many frames as a demonstration has",
        });
    }
    Ok(())
}

/// A detector gives every slot a colour of its own, also one whose thing stands aside.
fn check_colours(variant: Variant, colours: u32, n_slots: usize) -> Result<(), TrainError> {
    if variant.detects() && (colours as usize) < n_slots + 1 {
        return Err(TrainError::Config {
            key: "colours",
            found: format!("{colours} with {n_slots}", n_slots = counted(n_slots, "slot")),
            allowed: "more colours than slots for a detector",
        });
    }
    Ok(())
}

/// Removes the checkpoints of a training that another process has ended.
///
/// # Errors
///
/// When they cannot be removed.
pub fn clear_checkpoints(folder: &Path) -> Result<(), IoError> {
    checkpoint::clear(&folder.join(checkpoint::FOLDER))
}

/// A training that waits for its network.
struct Learning<'r, 'h> {
    on: ComputeDevice,
    config: &'r TrainConfig,
    source: Source<'r>,
    facts: &'r Facts,
    model: &'r ModelConfig,
    folder: &'r Path,
    start: Option<Start>,
    seed: Seed,
    hooks: &'r mut Hooks<'h>,
}

impl NetworkUse for Learning<'_, '_> {
    type Output = Result<TrainSummary, TrainError>;

    fn run<N: Network>(self, network: N) -> Self::Output {
        let Self { on, config, source, facts, model, folder, start, seed, hooks } = self;
        let has_begun = start.is_some();
        let network = match start {
            Some(start) => start.fill(network)?,
            None => network,
        };
        let grain = if N::IS_RECURRENT { Grain::Call } else { Grain::Decision };
        let source = if model.variant.sees() { source } else { source.without_pictures() };
        let (specification, scoping) = (model.network.specification(), network.scoping());
        let run = Run { on, config, source, facts, specification, scoping, grain, model, folder, has_begun, seed };
        let (network, trained) = run.train(network, hooks)?;
        write(folder, model, on, &network, &trained.standing.metrics)?;
        run.checkpoints().clear()?;
        Ok(trained.summary())
    }

    /// First the detector, then the network behind it, which learns on what the detector then finds.
    fn run_detecting<D: Detector, N: Network<Percepts = ()> + ModuleDisplay>(
        self,
        network: Detecting<D, N>,
    ) -> Self::Output {
        let Self { on, config, source, facts, model, folder, start: _, seed, hooks } = self;
        let Source::Here(data, Some(gallery)) = source else {
            return Err(TrainError::Config {
                key: "variant",
                found: model.variant.to_string(),
                allowed: "variants with a detector only with a dataset of pictures whose trials are in memory",
            });
        };
        let (detector, programmer) = network.into_parts();
        let hash = facts.hash.clone();
        let detecting = DetectorRun { on, config, data, hash, gallery, model, folder, seed };
        let (detector, standing) = detecting.train(detector, hooks)?;
        let detected = detector::detected(&detector, data, gallery)?;
        let grain = if N::IS_RECURRENT { Grain::Call } else { Grain::Decision };
        let (specification, scoping) = (SpecificationForm::Trajectories, programmer.scoping());
        let (source, facts) = (Source::Here(&detected, None), &facts_of(&detected)?);
        let has_begun = false;
        let run = Run { on, config, source, facts, specification, scoping, grain, model, folder, has_begun, seed };
        let (programmer, trained) = run.train(programmer, hooks)?;
        detector_metrics::write(&folder.join(DETECTOR_METRICS_FILE), &standing.metrics)?;
        let network = Detecting::new(detector, programmer, data.n_slots);
        write(folder, model, on, &network, &trained.standing.metrics)?;
        run.checkpoints().clear()?;
        let summary = trained.summary();
        let dropped_gradients = summary.dropped_gradients + standing.dropped_gradients;
        Ok(TrainSummary { dropped_gradients, ..summary })
    }
}

/// The model's files; `config.json` last, since it says that the model is there.
fn write<N: Network>(
    folder: &Path,
    model: &ModelConfig,
    on: ComputeDevice,
    network: &N,
    metrics: &[Metric],
) -> Result<(), TrainError> {
    let path = folder.join(WEIGHTS_FILE);
    artifact::write(&path, &weights_to_bytes(network, &path)?)?;
    metrics::write(&folder.join(METRICS_FILE), metrics)?;
    artifact::write_json(&folder.join(CONFIG_FILE), &model.clone().trained_on(on))?;
    Ok(())
}
