//! How much of each body a camera sees.

use crate::render::camera::Camera;
use crate::render::look::{Letters, Look, Shadows};
use crate::render::picture::Segment;
use crate::render::renderer::Renderer;
use crate::scene::{BodyIndex, Scene, SceneState};

/// Pixels are counted in pictures so much larger.
const ENLARGED: u32 = 2;
/// Where what is not to be drawn is put, in metres.
const AWAY_M: f32 = 1000.0;

/// Tells what hides what.
pub struct Visibility {
    renderer: Renderer,
}

impl Default for Visibility {
    fn default() -> Self {
        Self { renderer: Renderer::new(Look { shadows: Shadows::None, letters: Letters::None, ..Look::plain() }) }
    }
}

impl Visibility {
    /// The share of each body's outline in the picture that nothing hides, 0 to 1; 0 for one outside of the picture.
    pub fn shares(&mut self, scene: &Scene, state: &SceneState, camera: &Camera) -> Vec<f64> {
        let camera = Camera {
            width: ENLARGED * camera.width,
            height: ENLARGED * camera.height,
            focal_px: ENLARGED as f32 * camera.focal_px,
            mount: camera.mount,
        };
        let seen = self.pixels(scene, state, &camera);
        let mut alone = state.clone();
        alone.bodies_in_world.iter_mut().for_each(|pose| pose.translation.vector.x += AWAY_M);
        if matches!(camera.mount, crate::render::Mount::World(_)) {
            alone.gripper_in_world.translation.vector.x += AWAY_M;
        }
        let mut share = |body: BodyIndex| {
            let index = usize::from(body.0);
            let away = std::mem::replace(&mut alone.bodies_in_world[index], state.bodies_in_world[index]);
            let outline = self.pixels(scene, &alone, &camera)[index];
            alone.bodies_in_world[index] = away;
            if outline == 0 { 0.0 } else { (f64::from(seen[index]) / f64::from(outline)).min(1.0) }
        };
        scene.body_indices().map(&mut share).collect()
    }

    /// How many pixels show each body.
    fn pixels(&mut self, scene: &Scene, state: &SceneState, camera: &Camera) -> Vec<u32> {
        let mut pixels = vec![0; scene.bodies.len()];
        for &number in &self.renderer.draw(scene, state, camera).segments {
            if let Segment::Body(body) = Segment::from_number(number) {
                pixels[usize::from(body.0)] += 1;
            }
        }
        pixels
    }
}
