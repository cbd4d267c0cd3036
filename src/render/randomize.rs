//! Domain randomisation: another light, other colours and a moved camera for each episode.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::geometry::{Point, Pose, Rotation, Vec3};
use crate::render::camera::{Camera, Mount};
use crate::render::look::{Letters, Look};
use crate::scene::{Mobility, Scene};
use crate::seed::Seed;

/// How far an episode's pictures may differ from the usual ones. All zero and false: not at all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Randomization {
    /// How far the sun moves and light changes: 0 not at all, 1 half of its strength and most of the sky.
    pub light: f32,
    /// How far the colours of table, background and bodies change: 0 not at all, 1 by up to half of the range. Blocks
    /// then bear large letters.
    pub color: f32,
    /// How far the camera moves from its place, in metres, in each direction.
    pub camera_m: f32,
    /// How far the camera turns, in radians, about each of its axes.
    pub camera_rad: f32,
    /// One colour for all that moves, drawn for the episode: only letters, which are large then, and forms tell things
    /// apart.
    pub one_color: bool,
}

/// How often a camera's pose is drawn anew when it looks past the table.
const TRIES: u32 = 100;
/// How far from the middle of the picture the table's may lie, as a share of the picture's sides.
const FARTHEST_CENTER: f32 = 0.4;
/// Where a randomised sun stands at least, over the level length of its direction.
const MIN_SUN_HEIGHT: f32 = 0.8;

impl Randomization {
    /// Whether nothing is randomised.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Checks each setting; cheap.
    ///
    /// # Errors
    ///
    /// The key, what was found and what is allowed, for the first that is not.
    pub fn check(&self) -> Result<(), (&'static str, String, &'static str)> {
        let Self { light, color, camera_m, camera_rad, one_color: _ } = *self;
        let limits = [
            ("light", light, 1.0, "0 to 1"),
            ("color", color, 1.0, "0 to 1"),
            ("camera_m", camera_m, 0.5, "0 to 0.5"),
            ("camera_rad", camera_rad, 0.5, "0 to 0.5"),
        ];
        let wrong = limits.into_iter().find(|(_, value, most, _)| !(0.0..=*most).contains(value));
        wrong.map_or(Ok(()), |(key, value, _, allowed)| Err((key, value.to_string(), allowed)))
    }

    /// The look of an episode, given the usual one.
    pub fn look(&self, usual: &Look, scene: &Scene, seed: Seed) -> Look {
        let mut rng = seed.derive("look", &[]).rng();
        let mut look = usual.clone();
        if (self.one_color || self.color > 0.0) && usual.letters != Letters::None {
            look.letters = Letters::Large;
        }
        let mut signed = |reach: f32| reach * (2.0 * rng.random::<f32>() - 1.0);
        let to_sun = Vec3::new(look.light.to_sun.x + signed(self.light), look.light.to_sun.y + signed(self.light), 0.0);
        let height = (look.light.to_sun.z + signed(0.4 * self.light)).max(MIN_SUN_HEIGHT * to_sun.norm());
        look.light.to_sun = to_sun + Vec3::z() * height;
        let (sun, sky) = (1.0 + signed(0.4 * self.light), 1.0 + signed(0.3 * self.light));
        look.light.sun = look.light.sun.map(|channel| channel * sun * (1.0 + signed(0.15 * self.light)));
        look.light.sky = look.light.sky.map(|channel| channel * sky);
        look.light.ground = look.light.ground.map(|channel| channel * sky);
        let mut recolored = |rgb: [u8; 3]| rgb.map(|channel| shifted(channel, signed(127.5 * self.color)));
        look.table_color = recolored(look.table_color);
        look.background = look.background.map(&mut recolored);
        let one = recolored([150, 150, 150]);
        let bodies = scene.bodies.iter().enumerate();
        let color = |index: usize| usual.body_colors.get(index).copied().unwrap_or(scene.bodies[index].color);
        look.body_colors = bodies
            .map(|(index, body)| match body.mobility {
                Mobility::Movable if self.one_color => one,
                Mobility::Movable | Mobility::Fixed => recolored(color(index)),
            })
            .collect();
        look
    }

    /// The camera of an episode, given the usual one. One that stands still and has the table's middle in its picture
    /// keeps it there.
    pub fn camera(&self, usual: &Camera, seed: Seed) -> Camera {
        let mut rng = seed.derive("camera", &[]).rng();
        let must_see = sees_the_middle(usual);
        let mut moved = (0..TRIES).map(|_| self.moved(usual, &mut rng));
        moved.find(|moved| !must_see || sees_the_middle(moved)).unwrap_or(*usual)
    }

    fn moved(&self, usual: &Camera, rng: &mut impl Rng) -> Camera {
        let mut anywhere = |reach: f32| Vec3::from_fn(|_, _| reach * (2.0 * rng.random::<f32>() - 1.0));
        let (shift, turn) = (anywhere(self.camera_m), Rotation::from_scaled_axis(anywhere(self.camera_rad)));
        let moved = |mut pose: Pose| {
            pose.translation.vector += shift;
            pose.rotation *= turn;
            pose
        };
        let mount = match usual.mount {
            Mount::World(in_world) => Mount::World(moved(in_world)),
            Mount::Gripper(in_gripper) => Mount::Gripper(moved(in_gripper)),
        };
        Camera { mount, ..*usual }
    }
}

/// Whether a camera stands still and has the middle of the table well in its picture.
fn sees_the_middle(camera: &Camera) -> bool {
    let Mount::World(in_world) = camera.mount else { return false };
    let middle = in_world.inverse_transform_point(&Point::origin());
    let is_within =
        |offset: f32, side: u32| (camera.focal_px * offset / middle.z).abs() <= FARTHEST_CENTER * side as f32;
    middle.z > 0.0 && is_within(middle.x, camera.width) && is_within(middle.y, camera.height)
}

fn shifted(channel: u8, by: f32) -> u8 {
    (f32::from(channel) + by).clamp(0.0, 255.0) as u8
}
