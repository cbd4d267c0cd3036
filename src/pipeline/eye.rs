//! What models that see look with: the cameras that film the demonstrations.

use crate::model::Pictures;
use crate::render::CameraConfig;
use crate::rollout::{Eye, Sight};
use crate::scene::Scene;
use crate::seed::Seed;
use crate::trace::{Episode, Frame};
use crate::video::{Film, VideoError};

/// A camera before a world. Its pictures are not encoded: PNG would change nothing, and what H.264 loses is lost only
/// where files are.
struct CameraEye(Film);

impl Eye for CameraEye {
    fn look(&mut self, scene: &Scene, frame: &Frame) -> Pictures {
        let mut seen = nothing(&self.0);
        seen.push(&self.0.draw(scene, &frame.state).rgb, frame.gripper());
        seen
    }
}

/// A demonstration as a camera sees it, and the camera before a world of a scene and seed.
///
/// # Errors
///
/// When the camera sees nothing of the demonstration.
pub(super) fn sight(
    camera: &CameraConfig,
    demonstration: &Episode,
    scene: &Scene,
    seed: Seed,
) -> Result<Sight, VideoError> {
    let mut film = Film::new(camera);
    film.begin_episode(demonstration)?;
    let mut video = nothing(&film);
    for (_, frame) in demonstration.boundary_frames() {
        video.push(&film.draw(&demonstration.scene, &frame.state).rgb, frame.gripper());
    }
    film.check_sight()?;
    film.begin(demonstration.provenance.family, scene, seed)?;
    Ok(Sight { video, eye: Box::new(CameraEye(film)) })
}

fn nothing(film: &Film) -> Pictures {
    let [width, height] = film.config().size_px.map(|pixels| pixels as usize);
    Pictures::of_size(width, height)
}
