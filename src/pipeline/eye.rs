//! What models that see look with: the cameras that film the demonstrations.

use crate::model::Pictures;
use crate::render::CameraConfig;
use crate::rollout::{Eye, Sight};
use crate::scene::Scene;
use crate::seed::Seed;
use crate::trace::{Episode, Frame};
use crate::video::{Film, VideoError};

/// Cameras before a world. Their pictures are not encoded: PNG would change nothing, and what H.264 loses is lost only
/// where files are.
struct Eyes(Vec<Film>);

impl Eye for Eyes {
    fn look(&mut self, scene: &Scene, frame: &Frame) -> Pictures {
        let mut seen = nothing(&self.0);
        look(&mut self.0, scene, frame, &mut seen);
        seen
    }
}

/// A demonstration as cameras see it, and the cameras before a world of a scene and seed.
///
/// # Errors
///
/// When a camera sees nothing of the demonstration; its name stands with it.
pub(super) fn sight(
    cameras: &[&CameraConfig],
    demonstration: &Episode,
    scene: &Scene,
    seed: Seed,
) -> Result<Sight, (String, VideoError)> {
    let of = |camera: &CameraConfig| {
        let name = camera.name.clone();
        move |error| (name, error)
    };
    let mut films: Vec<Film> = cameras.iter().map(|camera| Film::new(camera)).collect();
    for (film, camera) in films.iter_mut().zip(cameras) {
        film.begin_episode(demonstration).map_err(of(camera))?;
    }
    let mut video = nothing(&films);
    for (_, frame) in demonstration.boundary_frames() {
        look(&mut films, &demonstration.scene, frame, &mut video);
    }
    for (film, camera) in films.iter_mut().zip(cameras) {
        film.check_sight().map_err(of(camera))?;
        film.begin(demonstration.provenance.family, scene, seed).map_err(of(camera))?;
    }
    Ok(Sight { video, eye: Box::new(Eyes(films)) })
}

/// Adds what all see of a frame, one below the other.
fn look(films: &mut [Film], scene: &Scene, frame: &Frame, into: &mut Pictures) {
    let seen: Vec<u8> = films.iter_mut().flat_map(|film| film.draw(scene, &frame.state).rgb.clone()).collect();
    into.push(&seen, frame.gripper());
}

fn nothing(films: &[Film]) -> Pictures {
    let (width, height) = Pictures::size_of(films.iter().map(|film| film.config().size_px));
    Pictures::of_size(width, height)
}
