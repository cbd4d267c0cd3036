//! A camera that films episodes: it draws each frame and encodes it.

use crate::render::{Camera, CameraConfig, Picture, PictureFormat, Renderer};
use crate::scene::{Scene, SceneState};
use crate::seed::Seed;
use crate::task::Family;
use crate::trace::Episode;
use crate::video::{H264Encoder, VideoError, encode_png};

/// A camera with its renderer and encoder.
pub struct Film {
    config: CameraConfig,
    camera: Camera,
    renderer: Renderer,
    /// For videos; a fresh one for each episode.
    encoder: Option<H264Encoder>,
    bytes: Vec<u8>,
    /// Whether a body was in one of the episode's pictures.
    has_seen_a_body: bool,
}

/// What is claimed of the rate while encoding; recorded frames carry their own times.
const FPS: u32 = 10;

impl Film {
    /// A camera that has not filmed yet.
    pub fn new(config: &CameraConfig) -> Self {
        let seed = Seed(0);
        // Any family's: each episode begins with its own.
        let camera = config.camera(Family::ALL[0], seed);
        let nothing = Scene { bodies: Vec::new(), slots: Vec::new(), table_half_m: [0.0; 2] };
        let renderer = Renderer::new(config.look(&nothing, seed));
        Self { config: config.clone(), camera, renderer, encoder: None, bytes: Vec::new(), has_seen_a_body: false }
    }

    /// Its settings.
    pub fn config(&self) -> &CameraConfig {
        &self.config
    }

    /// The camera of the episode that is being filmed.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Begins an episode, given by its family, scene and seed.
    ///
    /// # Errors
    ///
    /// When the encoder cannot be made.
    pub fn begin(&mut self, family: Family, scene: &Scene, seed: Seed) -> Result<(), VideoError> {
        self.camera = self.config.camera_of(family, family.layout_of(scene), seed);
        self.has_seen_a_body = false;
        self.renderer.set_look(self.config.look(scene, seed));
        self.encoder = match self.config.format {
            PictureFormat::Png => None,
            PictureFormat::H264 => Some(H264Encoder::new(self.config.size_px, FPS)?),
        };
        Ok(())
    }

    /// Begins an episode.
    ///
    /// # Errors
    ///
    /// As [`Film::begin`].
    pub fn begin_episode(&mut self, episode: &Episode) -> Result<(), VideoError> {
        self.begin(episode.provenance.family, &episode.scene, Seed(episode.provenance.seed))
    }

    /// Draws what the camera sees, without encoding it.
    pub fn draw(&mut self, scene: &Scene, state: &SceneState) -> &Picture {
        let picture = self.renderer.draw(scene, state, &self.camera);
        self.has_seen_a_body = self.has_seen_a_body || picture.shows_a_body();
        picture
    }

    /// Makes sure that the camera has seen something since the episode began: a body, at whatever time.
    ///
    /// # Errors
    ///
    /// [`VideoError::SeesNothing`]
    pub fn check_sight(&self) -> Result<(), VideoError> {
        if self.has_seen_a_body { Ok(()) } else { Err(VideoError::SeesNothing) }
    }

    /// Films a frame: PNG, or a packet of H.264 in Annex B. `is_key` says that it must be shown without those before.
    ///
    /// # Errors
    ///
    /// When the encoder fails.
    pub fn frame(&mut self, scene: &Scene, state: &SceneState, is_key: bool) -> Result<&[u8], VideoError> {
        let picture = self.renderer.draw(scene, state, &self.camera);
        self.has_seen_a_body = self.has_seen_a_body || picture.shows_a_body();
        self.bytes.clear();
        match &mut self.encoder {
            None => encode_png(&picture.rgb, [picture.width, picture.height], &mut self.bytes)?,
            Some(encoder) => encoder.encode(&picture.rgb, is_key, &mut self.bytes)?,
        }
        Ok(&self.bytes)
    }
}
