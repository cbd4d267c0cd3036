//! Why a training cannot go on.

use std::path::PathBuf;

use crate::artifact::IoError;
use crate::dataset::DatasetError;
use crate::model::{CONFIG_FILE, ConfigError, DeviceError, ModelError, ReadError, TensorError};
use crate::table::TableError;

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
    /// The model to begin with is of another network.
    #[error("start_from is {}, whose {field} is {found}; allowed: {allowed}", path.display())]
    Start {
        /// Its folder.
        path: PathBuf,
        /// What differs, as it stands in `config.json`.
        field: &'static str,
        /// As found.
        found: String,
        /// As in the network that is to be trained.
        allowed: String,
    },
    /// No network can be made with the settings.
    #[error("{}: {}", CONFIG_FILE, .0)]
    Network(#[from] ConfigError),
    /// It cannot be computed where it was asked to be.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The dataset has nothing to learn from.
    #[error("none of the dataset's {total} successful episodes is of a training task")]
    NoTrials {
        /// Successful episodes of any split.
        total: usize,
    },
    /// Trials of different families cannot be learned together by every variant.
    #[error(
        "variant {variant} cannot learn more than one family: trial {trial} of task {task} is of {found}, the first of \
         {expected}; allowed: variants that read positions and a demonstration of them"
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
        /// The variant, and what it reads.
        variant: String,
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
    /// What was learned from cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// A loss that is no number, from which nothing can be learned any more.
    #[error(
        "the loss of {level} is {found} in step {step}; allowed: finite numbers. A lower learning_rate or clip_norm may \
         help; the checkpoint before is kept"
    )]
    NotFinite {
        /// The step, from 1.
        step: u32,
        /// Whose decisions were learned; `detector` for a detector.
        level: &'static str,
        /// The loss.
        found: f32,
    },
    /// A checkpoint cannot be used; removing its folder starts afresh.
    #[error("checkpoint cannot be used: {problem}: {}", path.display())]
    Checkpoint {
        /// What is wrong.
        problem: String,
        /// The file.
        path: PathBuf,
    },
    /// What is learned from could not be read again.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
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

impl From<TensorError> for TrainError {
    fn from(error: TensorError) -> Self {
        Self::Read(error.into())
    }
}
