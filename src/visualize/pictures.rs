//! What cameras see: a picture a frame from the front and from the gripper, drawn from the recorded scene.
//!
//! Drawn anew rather than taken from the recording, so that recordings without cameras are shown with pictures too.

use rerun::EncodedImage;
use rerun::components::MediaType;

use crate::render::{CameraConfig, PictureQuality, Viewpoint};
use crate::trace::Episode;
use crate::video::Film;
use crate::visualize::store::Store;
use crate::visualize::{VisualizeError, clock};

/// Width and height of the pictures.
const SIZE_PX: [u32; 2] = [320, 240];
/// The cameras, as entities below `camera`.
const VIEWPOINTS: [Viewpoint; 2] = [Viewpoint::Front, Viewpoint::Wrist];

/// Logs pictures of all frames.
pub(super) fn put(store: &mut Store, episode: &Episode) -> Result<(), VisualizeError> {
    let positions: Vec<usize> = (0..episode.frames.len()).collect();
    for view in VIEWPOINTS {
        let config = CameraConfig { quality: PictureQuality::Smooth, ..CameraConfig::new(view, SIZE_PX) };
        let pictures = pictures(&config, episode)?;
        let types = pictures.iter().map(|_| MediaType::png());
        let images = EncodedImage::update_fields().with_many_media_type(types).with_many_blob(pictures.iter().cloned());
        store.put_rows(format!("camera/{}", config.name), clock::times(&episode.frames, &positions), &images)?;
    }
    Ok(())
}

fn pictures(config: &CameraConfig, episode: &Episode) -> Result<Vec<Vec<u8>>, VisualizeError> {
    let mut film = Film::new(config);
    film.begin_episode(episode)?;
    let picture = |frame: &crate::trace::Frame| Ok(film.frame(&episode.scene, &frame.state, frame.boundary)?.to_vec());
    episode.frames.iter().map(picture).collect()
}
