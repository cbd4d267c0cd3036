//! Where a training stands, on disk.
//!
//! # Input and output
//!
//! Under the model's folder: `checkpoint/step-NNNNNNNN.safetensors` (weights), `….adam` (the optimizer's moments) and
//! `checkpoint/latest.json`, which is written last and names the two with their hashes. It alone says what counts.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::artifact::{self, IoError, sha256_bytes};
use crate::model::{ModelConfig, Network, weights_from_bytes, weights_to_bytes};
use crate::training::TrainError;
use crate::training::curriculum::LevelErrors;
use crate::training::learner::Learner;
use crate::training::metrics::Metric;

/// `latest.json`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Latest {
    /// What is trained, and how; a checkpoint of anything else is not taken.
    model: ModelConfig,
    /// Hash of the dataset.
    dataset: String,
    step: u32,
    examples: u64,
    errors: Vec<f32>,
    metrics: Vec<Metric>,
    weights: Part,
    optimizer: Part,
}

/// One of the two files.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Part {
    file: String,
    sha256: String,
}

/// What a training is beyond its weights.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Standing {
    /// Steps done.
    pub(crate) step: u32,
    /// Decisions learned from.
    pub(crate) examples: u64,
    pub(crate) errors: LevelErrors,
    pub(crate) metrics: Vec<Metric>,
}

/// The checkpoints of one training.
pub(crate) struct Checkpoints<'c> {
    folder: PathBuf,
    model: &'c ModelConfig,
    dataset: String,
}

impl<'c> Checkpoints<'c> {
    pub(crate) fn new(folder: &Path, model: &'c ModelConfig, dataset: String) -> Self {
        Self { folder: folder.join("checkpoint"), model, dataset }
    }

    /// Saves, and then removes the checkpoint before.
    pub(crate) fn save<N: Network>(&self, learner: &Learner<N>, standing: &Standing) -> Result<(), TrainError> {
        let before = self.latest()?;
        let stem = format!("step-{:08}", standing.step);
        let path = self.folder.join(&stem);
        let optimizer = learner
            .optimizer_bytes()
            .map_err(|problem| TrainError::Checkpoint { problem, path: path.with_extension("adam") })?;
        let latest = Latest {
            model: self.model.clone(),
            dataset: self.dataset.clone(),
            step: standing.step,
            examples: standing.examples,
            errors: standing.errors.0.clone(),
            metrics: standing.metrics.clone(),
            weights: self.write(format!("{stem}.safetensors"), &weights_to_bytes(learner.network(), &path)?)?,
            optimizer: self.write(format!("{stem}.adam"), &optimizer)?,
        };
        artifact::write_json(&self.latest_path(), &latest)?;
        if let Some(before) = before.filter(|before| before.step != standing.step) {
            for part in [before.weights, before.optimizer] {
                remove(&self.folder.join(part.file))?;
            }
        }
        Ok(())
    }

    /// Goes on where a checkpoint of the same training stands; nothing when there is none.
    pub(crate) fn resume<N: Network>(&self, learner: Learner<N>) -> Result<Result<Resumed<N>, Learner<N>>, TrainError> {
        let Some(latest) =
            self.latest()?.filter(|latest| latest.model == *self.model && latest.dataset == self.dataset)
        else {
            return Ok(Err(learner));
        };
        let path = self.folder.join(&latest.weights.file);
        let network = weights_from_bytes(learner.network().clone(), self.read(&latest.weights)?, &path)?;
        let path = self.folder.join(&latest.optimizer.file);
        let learner = learner
            .with_network(network)
            .with_optimizer(self.read(&latest.optimizer)?)
            .map_err(|problem| TrainError::Checkpoint { problem, path })?;
        let Latest { step, examples, errors, metrics, .. } = latest;
        Ok(Ok(Resumed { learner, standing: Standing { step, examples, errors: LevelErrors(errors), metrics } }))
    }

    /// Removes what is left once the model itself is written.
    pub(crate) fn clear(&self) -> Result<(), IoError> {
        match std::fs::remove_dir_all(&self.folder) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(IoError::system("remove", &self.folder)(error))
            }
            _ => Ok(()),
        }
    }

    fn latest_path(&self) -> PathBuf {
        self.folder.join("latest.json")
    }

    fn latest(&self) -> Result<Option<Latest>, IoError> {
        match artifact::read_json(&self.latest_path()) {
            Ok(latest) => Ok(Some(latest)),
            Err(IoError::System { source, .. }) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn write(&self, file: String, bytes: &[u8]) -> Result<Part, IoError> {
        artifact::write(&self.folder.join(&file), bytes)?;
        Ok(Part { file, sha256: sha256_bytes(bytes) })
    }

    fn read(&self, part: &Part) -> Result<Vec<u8>, TrainError> {
        let path = self.folder.join(&part.file);
        let bytes = artifact::read(&path)?;
        let found = sha256_bytes(&bytes);
        if found == part.sha256 {
            return Ok(bytes);
        }
        let problem = format!("sha256 is {found}, but latest.json says {}", part.sha256);
        Err(TrainError::Checkpoint { problem, path })
    }
}

/// A training that goes on.
pub(crate) struct Resumed<N> {
    pub(crate) learner: Learner<N>,
    pub(crate) standing: Standing,
}

fn remove(path: &Path) -> Result<(), IoError> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(IoError::system("remove", path)(error)),
        _ => Ok(()),
    }
}
