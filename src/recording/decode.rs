//! Decodes what cameras saw, so that damaged pictures are found.

use std::path::Path;

use super::cameras::{CameraPictures, Filmed};
use super::error::RecordingError;
use crate::render::PictureFormat;
use crate::video::{H264Decoder, Rgb, VideoError, decode_png};

/// Decodes all pictures of the episode at a position and holds their sizes against the calibrations.
pub(super) fn check_pictures(path: &Path, episode: u64, cameras: &[Filmed]) -> Result<(), RecordingError> {
    cameras.iter().try_for_each(|Filmed { seen, .. }| {
        check_camera(seen).map_err(|(frame, source)| {
            let (path, camera) = (path.to_owned(), seen.camera.clone());
            RecordingError::Picture { path, episode, camera, frame, source }
        })
    })
}

/// The first frame whose picture is wrong.
fn check_camera(seen: &CameraPictures) -> Result<(), (usize, VideoError)> {
    let mut decoder = match seen.format {
        PictureFormat::Png => None,
        PictureFormat::H264 => Some(H264Decoder::new().map_err(|error| (0, error))?),
    };
    let mut picture = Rgb::default();
    for (frame, bytes) in seen.pictures.iter().enumerate() {
        let decoded = match &mut decoder {
            None => decode_png(bytes).map(|decoded| picture = decoded),
            Some(decoder) => decoder.decode(bytes, &mut picture),
        };
        decoded.and_then(|()| picture.check_size(seen.size_px)).map_err(|error| (frame, error))?;
    }
    Ok(())
}
