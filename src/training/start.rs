//! The weights of a trained model, which another training begins with.

use std::path::{Path, PathBuf};

use burn::module::Module;

use crate::artifact;
use crate::model::{ModelConfig, ModelError, WEIGHTS_FILE, load_config, weights_from_bytes};
use crate::training::TrainError;

/// Weights to begin with.
pub(super) struct Start {
    bytes: Vec<u8>,
    path: PathBuf,
}

impl Start {
    /// Reads those of a model that is of the same network as the one to be trained.
    ///
    /// # Errors
    ///
    /// When the model cannot be read; [`TrainError::Start`] when its network is another one.
    pub(super) fn load(folder: &Path, wanted: &ModelConfig) -> Result<Self, TrainError> {
        let found = load_config(folder)?;
        if let Some((field, found, allowed)) = difference(&found, wanted) {
            return Err(TrainError::Start { path: folder.to_owned(), field, found, allowed });
        }
        let path = folder.join(WEIGHTS_FILE);
        Ok(Self { bytes: artifact::read(&path)?, path })
    }

    /// Gives a network these weights.
    pub(super) fn fill<M: Module>(self, network: M) -> Result<M, ModelError> {
        weights_from_bytes(network, self.bytes, &self.path)
    }
}

/// The first thing that makes another network of a model; as found and as it should be.
fn difference(found: &ModelConfig, wanted: &ModelConfig) -> Option<(&'static str, String, String)> {
    let widths = |model: &ModelConfig| serde_json::to_string(&model.network).unwrap_or_default();
    let facts = |model: &ModelConfig, other: &ModelConfig| {
        [
            ("variant", model.variant.to_string()),
            ("number of cameras", model.network.cameras().to_string()),
            ("list of cameras", model.cameras_beside(other)),
            ("network", widths(model)),
            ("n_slots", model.n_slots.to_string()),
            ("vocabulary", model.vocabulary.clone()),
            ("shared_root", model.shared_root.to_string()),
            ("tasks", model.tasks.join(", ")),
        ]
    };
    let pairs = facts(found, wanted).into_iter().zip(facts(wanted, found));
    pairs.map(|((field, found), (_, wanted))| (field, found, wanted)).find(|(_, found, wanted)| found != wanted)
}
