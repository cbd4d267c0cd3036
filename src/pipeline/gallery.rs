//! The pictures that a model that sees learns from: what its cameras filmed, from the dataset.

use std::path::PathBuf;

use crate::dataset::{DatasetError, DatasetTrials, EpisodeRows, PictureLoader, Wanted};
use crate::model::Pictures;
use crate::pipeline::RunDir;
use crate::render::CameraConfig;
use crate::trace::GripperState;
use crate::training::{Galleries, Gallery, TrainError};

/// Decoded pictures that are kept for when they are drawn again: about 660 episodes of 33 pictures of 64 x 64 pixels.
const MOST_BYTES: usize = 1 << 28;

/// The pictures of a dataset's trials, decoded while a step is computed.
pub(super) struct Streamed {
    /// Of each camera, by name.
    loaders: Vec<(String, PictureLoader)>,
    /// The gripper in each frame of each trial.
    grippers: Vec<Vec<GripperState>>,
}

/// Finds the pictures of whatever trials are in memory.
pub(super) struct OfBuffers<'p> {
    cameras: Vec<&'p CameraConfig>,
    dataset: PathBuf,
}

impl<'p> OfBuffers<'p> {
    pub(super) fn new(cameras: Vec<&'p CameraConfig>, run: &RunDir) -> Self {
        Self { cameras, dataset: run.dataset().path().to_owned() }
    }

    /// Finds the pictures of trials in the dataset.
    ///
    /// # Errors
    ///
    /// When the dataset has no pictures of a camera, or none of a trial's frame: it was made before there was a camera.
    pub(super) fn find(&self, trials: &DatasetTrials) -> Result<Streamed, DatasetError> {
        let most_bytes = MOST_BYTES / self.cameras.len().max(1);
        let rows =
            || trials.trials.iter().map(|of| EpisodeRows { episode: of.episode, rows: of.rows.clone() }).collect();
        let loader = |camera: &&CameraConfig| {
            let loader = PictureLoader::open(&self.dataset, &camera.name, rows(), most_bytes)?;
            Ok::<_, DatasetError>((camera.name.clone(), loader))
        };
        Ok(Streamed {
            loaders: self.cameras.iter().map(loader).collect::<Result<_, _>>()?,
            grippers: trials.trials.iter().map(|of| of.grippers.clone()).collect(),
        })
    }
}

impl Galleries for OfBuffers<'_> {
    fn size(&self) -> (usize, usize) {
        Pictures::size_of(self.cameras.iter().map(|camera| camera.size_px))
    }

    fn cameras(&self) -> Vec<String> {
        self.cameras.iter().map(|camera| camera.name.clone()).collect()
    }

    fn open(&self, trials: &DatasetTrials) -> Result<Box<dyn Gallery>, TrainError> {
        Ok(Box::new(self.find(trials)?))
    }
}

impl Gallery for Streamed {
    fn size(&self) -> (usize, usize) {
        Pictures::size_of(self.loaders.iter().map(|(_, loader)| loader.size_px()))
    }

    fn cameras(&self) -> Vec<String> {
        self.loaders.iter().map(|(name, _)| name.clone()).collect()
    }

    fn fetch(&self, wanted: &Wanted, into: &mut Pictures) -> Result<(), String> {
        let of_camera = |(_, loader): &(String, PictureLoader)| loader.get(wanted).map_err(|error| error.to_string());
        let cameras = self.loaders.iter().map(of_camera).collect::<Result<Vec<_>, _>>()?;
        for (number, &frame) in wanted.frames.iter().enumerate() {
            let gripper = self.grippers.get(wanted.position).and_then(|grippers| grippers.get(frame));
            let gripper = *gripper.ok_or_else(|| format!("frame {frame} has no gripper"))?;
            match cameras.as_slice() {
                [pictures] => into.push(&pictures[number], gripper),
                several => {
                    let seen: Vec<u8> = several.iter().flat_map(|pictures| pictures[number].iter().copied()).collect();
                    into.push(&seen, gripper);
                }
            }
        }
        Ok(())
    }

    fn announce(&self, wanted: &[Wanted]) {
        self.loaders.iter().for_each(|(_, loader)| loader.announce(wanted));
    }
}
