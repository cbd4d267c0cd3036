//! A trained model, as annotation uses it.

use std::path::Path;

use crate::annotate::{AnnotateError, AnnotationModel};
use crate::artifact::StageDir;
use crate::model::Decoder;
use crate::rollout::{Policy, load_policy};
use crate::task::Family;
use crate::trace::SpecificationForm;

/// A model that takes demonstrations apart.
pub struct Model {
    pub(super) about: AnnotationModel,
    pub(super) n_slots: usize,
    pub(super) policy: Box<dyn Policy + Send>,
}

impl Model {
    /// A model from its folder.
    ///
    /// # Errors
    ///
    /// When it cannot be loaded, or gives no parts of the demonstration to what it calls, or reads anything but
    /// observations.
    pub fn load(path: &Path, decoder: Decoder) -> Result<Self, AnnotateError> {
        StageDir::new("train", path).check_whole()?;
        let (config, policy) = load_policy(path, decoder)?;
        let refused = |found: String| AnnotateError::Variant { path: path.to_owned(), found };
        if !policy.scoping().has_scopes() {
            return Err(refused(format!("scoping of variant {} is {}", policy.name(), policy.scoping())));
        }
        if policy.reads() != SpecificationForm::Trajectories {
            return Err(refused(format!("variant {} reads {}", policy.name(), policy.reads())));
        }
        let name = path.canonicalize().unwrap_or_else(|_gone| path.to_owned());
        let name = name.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let version = StageDir::new("train", path).version().ok();
        Ok(Self::new(name, config.family, config.n_slots, version, policy))
    }

    /// A policy that takes demonstrations of a family apart.
    pub fn new(
        name: String,
        family: Family,
        n_slots: usize,
        version: Option<String>,
        policy: Box<dyn Policy + Send>,
    ) -> Self {
        let variant = policy.name().to_owned();
        Self { about: AnnotationModel { name, variant, family, version, episodes: 0 }, n_slots, policy }
    }

    /// The family that it knows.
    pub fn family(&self) -> Family {
        self.about.family
    }

    /// Whether its family has slots of these names.
    pub(super) fn knows(&self, slots: &[String]) -> bool {
        let names = self.family().kinds().iter().flat_map(|kind| kind.slots);
        names.copied().eq(slots.iter().map(String::as_str))
    }
}
