//! A trained model as a suite's actor: which it is, and what it takes to let it act.

use std::path::PathBuf;

use crate::model::{ComputeDevice, Decoder, ModelConfig, check_purpose, load_config};
use crate::pipeline::train::Model;
use crate::pipeline::unit::Unit as _;
use crate::pipeline::{ModelSpec, Pipeline, PipelineError, RunDir};
use crate::rollout::{Acted, ModelFacts, Policy, load_policy_on};

/// A trained model with a way to decode.
#[derive(Clone, Copy)]
pub(in crate::pipeline) struct ModelActor<'p> {
    pub(in crate::pipeline) model: Model<'p>,
    pub(super) decoder: Decoder,
}

/// A model with each of its decoders.
pub(super) fn decoding(model: Model<'_>) -> impl Iterator<Item = ModelActor<'_>> {
    model.spec.decoders.iter().map(move |&decoder| ModelActor { model, decoder })
}

/// Where a trained model lies and how it decodes. Each shard loads its own: a policy keeps what it has read of
/// demonstrations.
pub(super) struct Learned {
    folder: PathBuf,
    pub(super) spec: ModelSpec,
    pub(super) decoder: Decoder,
    /// Whether the decoder is the model's first.
    pub(super) is_first: bool,
    pub(super) acted: Acted,
}

impl Learned {
    pub(super) fn of(run: &RunDir, ModelActor { model, decoder }: ModelActor<'_>) -> Self {
        let spec = model.spec;
        let acted = Acted {
            training_seed: model.seed,
            train_tasks: Some(model.train_tasks()),
            specification: Some(spec.specification().name()),
            decoder: Some(decoder.name()),
            model: Some(ModelFacts::from(spec.variant)),
        };
        let folder = model.dir(run).path().to_owned();
        let is_first = spec.decoders.first() == Some(&decoder);
        Self { folder, spec: spec.clone(), decoder, is_first, acted }
    }

    /// Refuses a model that was made for another family, another number of slots, pictures of another size or of other
    /// cameras, or as another variant.
    pub(super) fn policy(&self, pipeline: &Pipeline, device: ComputeDevice) -> Result<Box<dyn Policy>, PipelineError> {
        let found = load_config(&self.folder)?;
        let family = pipeline.spec.tasks.family;
        let ModelSpec { variant, .. } = self.spec;
        let form = self.spec.specification();
        let mut wanted = ModelConfig::new(variant, form, family, family.n_slots(), found.training.clone());
        let cameras = self.spec.looks_with(&pipeline.spec.generate);
        if let Some(camera) = cameras.first() {
            wanted.network = wanted.network.for_pictures(camera.size_px[0] as usize, cameras.len(), wanted.n_slots);
            wanted.cameras = self.spec.camera_names(&pipeline.spec.generate);
        }
        check_purpose(&found, &wanted, &self.folder)?;
        Ok(load_policy_on(&device.open()?, &self.folder, self.decoder)?.1)
    }
}
