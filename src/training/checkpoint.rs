//! Where a training stands, on disk.
//!
//! # Input and output
//!
//! Under the model's folder: `checkpoint/step-NNNNNNNN.safetensors` (weights), `….moments.safetensors`
//! (the optimizer's moments) and
//! `checkpoint/latest.json`, which is written last and names the two with their hashes. It alone says what counts. A
//! detector, which learns first, has its own in `checkpoint/detector/`.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use burn::module::Module;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::artifact::{self, IoError, sha256_bytes};
use crate::model::{ModelConfig, weights_from_bytes, weights_to_bytes};
use crate::training::TrainError;
use crate::training::curriculum::LevelErrors;
use crate::training::learner::Learner;
use crate::training::metrics::Metric;

/// Under the model's folder.
pub(super) const FOLDER: &str = "checkpoint";
/// How often a folder is removed in which something appears at the same time.
const ATTEMPTS: u32 = 20;
/// Under that, for a detector.
const DETECTOR_FOLDER: &str = "detector";
/// How the file of the optimizer's moments ends.
const MOMENTS: &str = "moments.safetensors";
/// What names the parts of the checkpoint that counts.
const LATEST_FILE: &str = "latest.json";

/// `latest.json`.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound = "S: Stands")]
struct Latest<S> {
    /// What is trained, and how; a checkpoint of anything else is not taken.
    model: ModelConfig,
    /// Hash of the dataset.
    dataset: String,
    standing: S,
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
pub(crate) trait Stands: Serialize + DeserializeOwned + Clone {
    /// Steps done.
    fn step(&self) -> u32;
}

/// What the training of a network is beyond its weights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Standing {
    /// Steps done.
    pub(crate) step: u32,
    /// Decisions learned from.
    pub(crate) examples: u64,
    /// Gradients that were no numbers and were left out.
    #[serde(default)]
    pub(crate) dropped_gradients: u32,
    pub(crate) errors: LevelErrors,
    pub(crate) metrics: Vec<Metric>,
}

impl Stands for Standing {
    fn step(&self) -> u32 {
        self.step
    }
}

/// The checkpoints of one training.
pub(crate) struct Checkpoints<'c> {
    folder: PathBuf,
    model: &'c ModelConfig,
    dataset: String,
}

impl<'c> Checkpoints<'c> {
    pub(crate) fn new(folder: &Path, model: &'c ModelConfig, dataset: String) -> Self {
        Self { folder: folder.join(FOLDER), model, dataset }
    }

    /// Those of the detector that is trained before the network.
    pub(crate) fn of_detector(folder: &Path, model: &'c ModelConfig, dataset: String) -> Self {
        Self { folder: folder.join(FOLDER).join(DETECTOR_FOLDER), model, dataset }
    }

    /// Saves, and then removes the checkpoint before.
    pub(crate) fn save<M: Module + Sync, S: Stands>(
        &self,
        learner: &Learner<M>,
        standing: &S,
    ) -> Result<(), TrainError> {
        let before = self.latest::<S>()?;
        let stem = format!("step-{:08}", standing.step());
        let path = self.folder.join(&stem);
        let optimizer = learner.optimizer_bytes(&path.with_extension(MOMENTS))?;
        let latest = Latest {
            model: self.model.clone(),
            dataset: self.dataset.clone(),
            standing: standing.clone(),
            weights: self.write(format!("{stem}.safetensors"), &weights_to_bytes(learner.module(), &path)?)?,
            optimizer: self.write(format!("{stem}.{MOMENTS}"), &optimizer)?,
        };
        artifact::write_json(&self.latest_path(), &latest)?;
        if let Some(before) = before.filter(|before| before.standing.step() != standing.step()) {
            for part in [before.weights, before.optimizer] {
                remove(&self.folder.join(part.file))?;
            }
        }
        Ok(())
    }

    /// Goes on where a checkpoint of the same training stands; nothing when there is none.
    pub(crate) fn resume<M: Module + Sync, S: Stands>(
        &self,
        learner: Learner<M>,
    ) -> Result<Result<Resumed<M, S>, Learner<M>>, TrainError> {
        let Some(latest) = self.latest::<S>()?.filter(|latest| self.is_of(latest)) else {
            return Ok(Err(learner));
        };
        let path = self.folder.join(&latest.weights.file);
        let module = weights_from_bytes(learner.module().clone(), self.read(&latest.weights)?, &path)?;
        let path = self.folder.join(&latest.optimizer.file);
        let learner = learner
            .with_module(module)
            .with_optimizer(self.read(&latest.optimizer)?, &path)
            .map_err(|error| TrainError::Checkpoint { problem: error.to_string(), path })?;
        Ok(Ok(Resumed { learner, standing: latest.standing }))
    }

    /// Whether a checkpoint is of this training. Those of before moments were safetensors are not taken.
    fn is_of<S: Stands>(&self, latest: &Latest<S>) -> bool {
        latest.model == *self.model && latest.dataset == self.dataset && latest.optimizer.file.ends_with(MOMENTS)
    }

    /// Removes what is left once the model itself is written; what names the parts first, so that no checkpoint is ever
    /// found without them.
    pub(crate) fn clear(&self) -> Result<(), IoError> {
        clear(&self.folder)
    }

    fn latest_path(&self) -> PathBuf {
        self.folder.join(LATEST_FILE)
    }

    fn latest<S: Stands>(&self) -> Result<Option<Latest<S>>, IoError> {
        match artifact::read_json(&self.latest_path()) {
            Ok(latest) => Ok(Some(latest)),
            Err(IoError::System { source, .. }) if source.kind() == ErrorKind::NotFound => Ok(None),
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
pub(crate) struct Resumed<M, S> {
    pub(crate) learner: Learner<M>,
    pub(crate) standing: S,
}

fn remove(path: &Path) -> Result<(), IoError> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(IoError::system("remove", path)(error)),
        _ => Ok(()),
    }
}

/// Removes a folder of checkpoints; what names the parts first. A twin on another machine may write there meanwhile: then
/// it is tried again, and in the end left to the twin, which removes it when it ends.
pub(super) fn clear(folder: &Path) -> Result<(), IoError> {
    for _attempt in 0..ATTEMPTS {
        remove(&folder.join(DETECTOR_FOLDER).join(LATEST_FILE))?;
        remove(&folder.join(LATEST_FILE))?;
        match std::fs::remove_dir_all(folder) {
            Ok(()) => return Ok(()),
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
            Err(error) if error.kind() == ErrorKind::DirectoryNotEmpty => {}
            Err(error) => return Err(IoError::system("remove", folder)(error)),
        }
    }
    Ok(())
}
