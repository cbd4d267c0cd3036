//! The pictures that a variant that sees learns from: what the first camera filmed of the demonstrations, as recorded.

use std::collections::BTreeMap;

use crate::dataset::DatasetTrials;
use crate::model::Pictures;
use crate::pipeline::PipelineError;
use crate::pipeline::runner::Context;
use crate::recording::{CameraPictures, Pictured, ShardReader};
use crate::training::Gallery;
use crate::video::decode_png;

/// Pictures of trials' boundary frames, kept as PNG: a thousand tasks of six demonstrations are about 200 MB.
pub(super) struct Recorded {
    size: (usize, usize),
    /// By trial and frame.
    pictures: Vec<Vec<Vec<u8>>>,
}

/// Reads the pictures of trials.
///
/// # Errors
///
/// When a recording cannot be read, or has no pictures of a trial: it was made before there was a camera.
pub(super) fn read(context: &Context<'_>, trials: &DatasetTrials) -> Result<Recorded, PipelineError> {
    let spec = &context.pipeline.spec.generate;
    let camera = spec.cameras.first().map(|camera| camera.name.as_str()).unwrap_or_default();
    let size = spec.cameras.first().map_or([0, 0], |camera| camera.size_px).map(|pixels| pixels as usize);
    let positions = trials.trials.iter().enumerate().map(|(at, of)| ((of.task_id.as_str(), of.trial), at));
    let positions: BTreeMap<(&str, u32), usize> = positions.collect();
    let mut pictures = vec![Vec::new(); trials.trials.len()];
    let recordings = context.dir.recordings();
    for file in &recordings.finished()?.files {
        for episode in ShardReader::open(&recordings.path().join(&file.path))?.boundaries().pictured() {
            context.go_on()?;
            let Pictured { episode, cameras } = episode?;
            let provenance = &episode.episode().provenance;
            if let Some(&at) = positions.get(&(provenance.task_id.as_str(), provenance.trial)) {
                pictures[at] = of_camera(cameras, camera);
            }
        }
    }
    let counts = trials.trials.iter().zip(&pictures);
    match counts.into_iter().find(|(trial, pictures)| trial.n_frames != pictures.len()) {
        None => Ok(Recorded { size: (size[0], size[1]), pictures }),
        Some((trial, pictures)) => {
            let (found, wanted) = (pictures.len(), trial.n_frames);
            let problem = format!(
                "trial {} of task {} has {found} of {wanted} pictures of camera {camera}",
                trial.trial, trial.task_id
            );
            let (path, key) = (context.pipeline.path.clone(), "generate.cameras".to_owned());
            Err(PipelineError::Value { path, key, problem })
        }
    }
}

fn of_camera(cameras: Vec<CameraPictures>, name: &str) -> Vec<Vec<u8>> {
    let named = cameras.into_iter().find(|of| of.camera == name);
    named.map(|of| of.pictures).unwrap_or_default()
}

impl Gallery for Recorded {
    fn size(&self) -> (usize, usize) {
        self.size
    }

    fn fetch(&self, trial: usize, frames: &[usize], into: &mut Pictures) -> Result<(), String> {
        for &frame in frames {
            let png = self.pictures.get(trial).and_then(|pictures| pictures.get(frame));
            let picture = decode_png(png.ok_or_else(|| format!("frame {frame} has no picture"))?);
            let picture = picture.map_err(|error| format!("frame {frame}: {error}"))?;
            if picture.size_px.map(|pixels| pixels as usize) != [self.size.0, self.size.1] {
                return Err(format!("frame {frame}: a picture of {:?} pixels, not {:?}", picture.size_px, self.size));
            }
            into.push(&picture.bytes);
        }
        Ok(())
    }
}
