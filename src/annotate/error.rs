//! Why demonstrations could not be annotated.

use std::path::PathBuf;

use crate::artifact::{ContractError, IoError, StagingError};
use crate::dataset::DatasetError;
use crate::dataset::edit::EditError;
use crate::model::ModelError;
use crate::rollout::PolicyError;
use crate::words::counted;

/// Demonstrations could not be annotated.
#[derive(Debug, thiserror::Error)]
pub enum AnnotateError {
    /// The dataset could not be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The new dataset could not be written.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// A file could not be written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The folder could not be made.
    #[error(transparent)]
    Staging(#[from] StagingError),
    /// A model is not as it was made.
    #[error(transparent)]
    Contract(#[from] ContractError),
    /// A model could not be loaded.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A model could not decide.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// A model does not divide what it is given.
    #[error("{}: {found}; allowed: a model that scopes, and reads observations (variants ntp, ntp_paper)", path.display())]
    Variant {
        /// The model's folder.
        path: PathBuf,
        /// What it is.
        found: String,
    },
    /// No model knows such slots.
    #[error("{}: its observations have {n_slots} ({slots}), but {models}", path.display(), n_slots = counted(*n_slots, "slot"))]
    NoModel {
        /// The dataset.
        path: PathBuf,
        /// Slots of the dataset.
        n_slots: usize,
        /// Their names.
        slots: String,
        /// What the models know.
        models: String,
    },
    /// Two datasets are not of the same episodes.
    #[error("{}: {problem}", path.display())]
    Truth {
        /// The dataset with true labels.
        path: PathBuf,
        /// What differs.
        problem: String,
    },
}
