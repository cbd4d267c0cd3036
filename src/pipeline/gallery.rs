//! The pictures that a variant that sees learns from: what the first camera filmed, from the dataset.

use std::path::PathBuf;

use crate::dataset::{DatasetError, DatasetTrials, EpisodeRows, PictureLoader, Wanted};
use crate::model::Pictures;
use crate::pipeline::{Pipeline, PipelineError, RunDir};
use crate::render::CameraConfig;
use crate::trace::GripperState;
use crate::training::{Galleries, Gallery, TrainError};

/// Decoded pictures that are kept for when they are drawn again: about 660 episodes of 33 pictures of 64 x 64 pixels.
const MOST_BYTES: usize = 1 << 28;

/// The pictures of a dataset's trials, decoded while a step is computed.
pub(super) struct Streamed {
    loader: PictureLoader,
    /// The gripper in each frame of each trial.
    grippers: Vec<Vec<GripperState>>,
}

/// Finds the pictures of trials in the dataset.
///
/// # Errors
///
/// When the dataset has no pictures of the camera, or none of a trial's frame: it was made before there was a camera.
pub(super) fn open(pipeline: &Pipeline, run: &RunDir, trials: &DatasetTrials) -> Result<Streamed, PipelineError> {
    Ok(OfBuffers::new(pipeline, run).find(trials)?)
}

/// Finds the pictures of whatever trials are in memory.
pub(super) struct OfBuffers<'p> {
    camera: Option<&'p CameraConfig>,
    dataset: PathBuf,
}

impl<'p> OfBuffers<'p> {
    pub(super) fn new(pipeline: &'p Pipeline, run: &RunDir) -> Self {
        Self { camera: pipeline.spec.generate.cameras.first(), dataset: run.dataset().path().to_owned() }
    }

    fn find(&self, trials: &DatasetTrials) -> Result<Streamed, DatasetError> {
        let camera = self.camera.map(|camera| camera.name.as_str()).unwrap_or_default();
        let rows = trials.trials.iter().map(|of| EpisodeRows { episode: of.episode, rows: of.rows.clone() });
        let loader = PictureLoader::open(&self.dataset, camera, rows.collect(), MOST_BYTES)?;
        Ok(Streamed { loader, grippers: trials.trials.iter().map(|of| of.grippers.clone()).collect() })
    }
}

impl Galleries for OfBuffers<'_> {
    fn size(&self) -> (usize, usize) {
        let [width, height] =
            self.camera.map(|camera| camera.size_px).unwrap_or_default().map(|pixels| pixels as usize);
        (width, height)
    }

    fn open(&self, trials: &DatasetTrials) -> Result<Box<dyn Gallery>, TrainError> {
        Ok(Box::new(self.find(trials)?))
    }
}

impl Gallery for Streamed {
    fn size(&self) -> (usize, usize) {
        let [width, height] = self.loader.size_px().map(|pixels| pixels as usize);
        (width, height)
    }

    fn fetch(&self, wanted: &Wanted, into: &mut Pictures) -> Result<(), String> {
        let pictures = self.loader.get(wanted).map_err(|error| error.to_string())?;
        for (&frame, picture) in wanted.frames.iter().zip(pictures) {
            let gripper = self.grippers.get(wanted.position).and_then(|grippers| grippers.get(frame));
            into.push(&picture, *gripper.ok_or_else(|| format!("frame {frame} has no gripper"))?);
        }
        Ok(())
    }

    fn announce(&self, wanted: &[Wanted]) {
        self.loader.announce(wanted);
    }
}
