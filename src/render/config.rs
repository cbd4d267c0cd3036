//! A camera as people write it down: where it stands, how large its pictures are and how they look.

use serde::{Deserialize, Serialize};

use crate::geometry::Vec3;
use crate::render::camera::{Camera, Mount, looking_at};
use crate::render::look::Look;
use crate::render::randomize::Randomization;
use crate::scene::Scene;
use crate::seed::Seed;
use crate::task::{Family, Layout};

/// Where a camera stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Viewpoint {
    /// Third person: before the table and above it.
    #[default]
    Front,
    /// First person: on the gripper.
    Wrist,
    /// At `eye_m`, looking at `target_m`.
    Fixed,
}

/// How pictures are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PictureFormat {
    /// Each by itself, without loss.
    #[default]
    Png,
    /// As a video: smaller, with a little loss.
    H264,
}

/// How carefully pictures are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PictureQuality {
    /// One sample a pixel, sharp shadows.
    Plain,
    /// 2x2 samples a pixel: what is smaller than a pixel still moves between pixels.
    #[default]
    Smooth,
    /// For people: soft shadows and an arm besides.
    Fine,
}

/// A camera of a pipeline.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraConfig {
    /// Names its topics and features: letters, digits, `_` and `-`.
    pub name: String,
    /// Where it stands.
    #[serde(default)]
    pub view: Viewpoint,
    /// Where a `fixed` camera is, in metres in the world's frame.
    #[serde(default)]
    pub eye_m: Option<[f32; 3]>,
    /// What a `fixed` camera looks at.
    #[serde(default)]
    pub target_m: Option<[f32; 3]>,
    /// Angle of view across the shorter side of the picture, 0.05 to 2.5; left out, the viewpoint's usual one.
    #[serde(default)]
    pub fov_rad: Option<f32>,
    /// Width and height, 16 to 1920, even.
    #[serde(default = "small")]
    pub size_px: [u32; 2],
    /// How pictures are stored.
    #[serde(default)]
    pub format: PictureFormat,
    /// How carefully they are drawn.
    #[serde(default)]
    pub quality: PictureQuality,
    /// What differs from episode to episode.
    #[serde(default)]
    pub randomize: Randomization,
}

/// Angle of view of a fixed camera that does not say its own.
const FIXED_FOV_RAD: f32 = 0.8;

fn small() -> [u32; 2] {
    [64, 64]
}

/// A setting of a camera that is not allowed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("camera {camera}: {key} is {found}, allowed is {allowed}")]
pub struct CameraError {
    /// Its name.
    pub camera: String,
    /// The key.
    pub key: &'static str,
    /// What stands there.
    pub found: String,
    /// What may stand there.
    pub allowed: &'static str,
}

impl CameraConfig {
    /// A camera with a viewpoint's usual settings, named for it.
    pub fn new(view: Viewpoint, size_px: [u32; 2]) -> Self {
        let name = match view {
            Viewpoint::Front => "front",
            Viewpoint::Wrist => "wrist",
            Viewpoint::Fixed => "fixed",
        };
        Self {
            name: name.to_owned(),
            view,
            eye_m: None,
            target_m: None,
            fov_rad: None,
            size_px,
            format: PictureFormat::default(),
            quality: PictureQuality::default(),
            randomize: Randomization::default(),
        }
    }

    /// Checks every setting; cheap, so that a pipeline can ask before any work.
    ///
    /// # Errors
    ///
    /// The first setting that is not allowed.
    pub fn check(&self) -> Result<(), CameraError> {
        let wrong = |key, found: String, allowed| Err(CameraError { camera: self.name.clone(), key, found, allowed });
        let is_named = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if self.name.is_empty() || !self.name.chars().all(is_named) {
            return wrong("name", format!("{:?}", self.name), "letters, digits, _ and -");
        }
        let is_size = |size: &u32| (16..=1920).contains(size) && size.is_multiple_of(2);
        if !self.size_px.iter().all(is_size) {
            return wrong("size_px", format!("{:?}", self.size_px), "two even numbers from 16 to 1920");
        }
        if let Some(fov_rad) = self.fov_rad.filter(|fov_rad| !(0.05..=2.5).contains(fov_rad)) {
            return wrong("fov_rad", fov_rad.to_string(), "0.05 to 2.5");
        }
        let places = [("eye_m", self.eye_m), ("target_m", self.target_m)];
        for (key, place) in places {
            match place {
                None if self.view == Viewpoint::Fixed => {
                    return wrong(key, "missing".to_owned(), "x, y and z for view = \"fixed\"");
                }
                Some(place) if self.view != Viewpoint::Fixed => {
                    return wrong(key, format!("{place:?}"), "nothing, but for view = \"fixed\"");
                }
                Some(place) if !place.iter().all(|number| number.abs() <= 10.0) => {
                    return wrong(key, format!("{place:?}"), "numbers from -10 to 10");
                }
                Some(_) | None => {}
            }
        }
        if self.view == Viewpoint::Fixed && self.eye_m == self.target_m {
            return wrong("target_m", format!("{:?}", self.target_m), "another place than eye_m");
        }
        self.randomize.check().or_else(|(key, found, allowed)| wrong(key, found, allowed))
    }

    /// The camera of an episode. See [`CameraConfig::seed`].
    pub fn camera(&self, family: Family, seed: Seed) -> Camera {
        self.camera_of(family, Layout::Table, seed)
    }

    /// The same of an episode in a layout.
    pub fn camera_of(&self, family: Family, layout: Layout, seed: Seed) -> Camera {
        let usual = match self.view {
            Viewpoint::Front => Camera::front_of(family, layout, self.size_px),
            Viewpoint::Wrist => Camera::wrist(self.size_px),
            Viewpoint::Fixed => {
                let [eye, target] = [self.eye_m, self.target_m].map(|place| Vec3::from(place.unwrap_or_default()));
                Camera::new(Mount::World(looking_at(&eye, &target)), self.size_px, FIXED_FOV_RAD)
            }
        };
        let usual = self.fov_rad.map_or(usual, |fov_rad| Camera::new(usual.mount, self.size_px, fov_rad));
        self.randomize.camera(&usual, self.seed(seed))
    }

    /// The look of an episode.
    pub fn look(&self, scene: &Scene, seed: Seed) -> Look {
        let usual = match self.quality {
            PictureQuality::Plain => Look::plain(),
            PictureQuality::Smooth => Look::smooth(),
            PictureQuality::Fine => Look::fine(),
        };
        if self.randomize.is_none() { usual } else { self.randomize.look(&usual, scene, self.seed(seed)) }
    }

    /// What is random of this camera in an episode with the given seed.
    fn seed(&self, episode: Seed) -> Seed {
        episode.derive("camera", &[]).derive(&self.name, &[])
    }
}
