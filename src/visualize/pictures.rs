//! What cameras see: from the front and from the gripper for people, and as the recording's own cameras filmed it.
//!
//! Drawn anew rather than taken from the recording, so that recordings without cameras are shown with pictures too.

use rerun::EncodedImage;
use rerun::components::MediaType;

use crate::model::Variant;
use crate::render::{CameraConfig, PictureFormat, PictureQuality, Viewpoint};
use crate::trace::{Actor, Episode, Frame};
use crate::video::Film;
use crate::visualize::store::Store;
use crate::visualize::{Replay, VisualizeError, clock};

/// Width and height of the pictures for people.
const SIZE_PX: [u32; 2] = [320, 240];
/// The cameras for people, as entities below `camera`.
const VIEWPOINTS: [Viewpoint; 2] = [Viewpoint::Front, Viewpoint::Wrist];

/// Logs pictures of all frames, and what a policy that sees looked at, when it did.
pub(super) fn put(store: &mut Store, replay: &Replay<'_>) -> Result<(), VisualizeError> {
    let episode = replay.episode;
    let all: Vec<usize> = (0..episode.frames.len()).collect();
    for view in VIEWPOINTS {
        let config = CameraConfig { quality: PictureQuality::Smooth, ..CameraConfig::new(view, SIZE_PX) };
        put_camera(store, &format!("camera/{}", config.name), &config, episode, &all)?;
    }
    let looked: Vec<usize> = episode.boundary_frames().map(|(position, _)| position).collect();
    for (at, camera) in replay.cameras.iter().enumerate() {
        let positions = if at == 0 && sees(episode) { &looked } else { &all };
        put_camera(store, &entity(camera), camera, episode, positions)?;
    }
    Ok(())
}

/// Where the pictures of a recording's own camera are.
pub(super) fn entity(camera: &CameraConfig) -> String {
    format!("filmed/{}", camera.name)
}

/// What the pictures of a recording's own camera are, in words.
pub(super) fn title(replay: &Replay<'_>, at: usize, camera: &CameraConfig) -> String {
    let CameraConfig { name, size_px: [width, height], .. } = camera;
    let what = if at == 0 && sees(replay.episode) { "All that the policy sees" } else { "As filmed" };
    format!("{what} (camera {name}, {width} x {height})")
}

/// Whether an episode was acted by a policy that is given pictures.
fn sees(episode: &Episode) -> bool {
    let Actor::Policy(name) = &episode.provenance.actor else { return false };
    name.parse().is_ok_and(Variant::sees)
}

fn put_camera(
    store: &mut Store,
    entity: &str,
    config: &CameraConfig,
    episode: &Episode,
    positions: &[usize],
) -> Result<(), VisualizeError> {
    let pictures = pictures(config, episode, positions)?;
    let types = pictures.iter().map(|_| MediaType::png());
    let images = EncodedImage::update_fields().with_many_media_type(types).with_many_blob(pictures.iter().cloned());
    store.put_rows(entity.to_owned(), clock::times(&episode.frames, positions), &images)
}

/// PNG, whatever the recording has: each picture can be shown by itself.
fn pictures(config: &CameraConfig, episode: &Episode, positions: &[usize]) -> Result<Vec<Vec<u8>>, VisualizeError> {
    let mut film = Film::new(&CameraConfig { format: PictureFormat::Png, ..config.clone() });
    film.begin_episode(episode)?;
    let picture = |frame: &Frame| Ok(film.frame(&episode.scene, &frame.state, frame.boundary)?.to_vec());
    positions.iter().filter_map(|&position| episode.frames.get(position)).map(picture).collect()
}
