//! A depth camera before the table: where a robot takes things to be.
//!
//! # Input and output
//!
//! A [`Scene`] with its true [`SceneState`] is drawn as the camera sees it, measured as a depth sensor measures it, and
//! each body is fitted to the points that it gave: its position, its turn about the vertical, and which of its sides is
//! up. Which points are a body's, its segment in the picture tells; its form is known. What too few points show keeps
//! the last place that it was seen at: a memory of the robot.
//!
//! # Units and frames
//!
//! Metres in the world's frame. The camera stands a little elsewhere than the robot takes it to, and its depths are off,
//! by as much as is drawn once a trial. Tilt and height the robot takes from the table's plane; what is left is level.
//!
//! # Invariants
//!
//! What is seen depends on the seed, the scene, its states and the number of looks alone. Nothing of a true pose reaches
//! what is seen but through a picture.
//!
//! # Source
//!
//! Xu et al., section V-D: a Kinect localises objects for a real robot. Its numbers are of the Kinect v2: 512 by 424
//! pixels, focal length 365.46 of them.

mod config;
mod locate;
mod sensor;
mod surface;

pub use config::{PerceptionConfig, PerceptionError, Sensor, Stand};

use crate::geometry::{Pose, Rotation, Vec3};
use crate::render::{Camera, Letters, Look, Mount, Renderer, Shadows};
use crate::scene::{BodyIndex, Mobility, Scene, SceneState};
use crate::seed::Seed;
use crate::task::Family;

use sensor::{Shown, normals};

/// Pixels of a picture.
const SIZE_PX: [u32; 2] = [512, 424];
/// In pixels.
const FOCAL_PX: f32 = 365.46;
/// Where robot and gripper are put to draw the table without them, in metres.
const AWAY_M: f32 = 1000.0;
/// What is hidden but for less than this part keeps its last place: the rest would be guessed.
const LEAST_SHARE: f32 = 0.4;
/// A look that shows less of the table's plane does not level the camera.
const LEAST_TABLE_POINTS: usize = 50;

/// A camera with what its robot remembers.
pub struct Perception {
    config: PerceptionConfig,
    /// Where it is.
    camera: Camera,
    /// Where the robot takes it to be.
    believed_in_world: Pose,
    /// What is added to all of its depths.
    depth_offset_m: f32,
    seed: Seed,
    n_looks: u64,
    renderer: Renderer,
    memory: Vec<Memory>,
}

/// What is remembered of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Memory {
    /// Where it was seen last; at the table's edge, out of sight, before it was ever seen.
    pub in_world: Pose,
    /// Whether it was ever seen.
    pub is_known: bool,
}

impl Perception {
    /// A camera that has not looked yet; its errors depend on the seed.
    ///
    /// # Errors
    ///
    /// As [`PerceptionConfig::check`].
    pub fn new(config: &PerceptionConfig, family: Family, scene: &Scene, seed: Seed) -> Result<Self, PerceptionError> {
        config.check()?;
        let believed_in_world = config.camera.in_world(family, family.layout_of(scene));
        let seed = seed.derive("perception", &[]);
        let mut rng = seed.derive("calibration", &[]).rng();
        let drawn: Vec<f32> = std::iter::repeat_with(|| normals(&mut rng)).take(4).flatten().collect();
        let turn = Vec3::new(drawn[0], drawn[1], drawn[2]) * config.calibration_deg.to_radians();
        let shift = Vec3::new(drawn[3], drawn[4], drawn[5]) * (config.calibration_mm / 1000.0);
        let error = Pose::from_parts(shift.into(), Rotation::from_scaled_axis(turn));
        let [width, height] = SIZE_PX;
        let mount = Mount::World(believed_in_world * error);
        let edge = Pose::translation(scene.table_half_m[0], 0.0, 0.0);
        let unseen = Memory { in_world: edge, is_known: false };
        let look = Look { shadows: Shadows::None, letters: Letters::None, ..Look::plain() };
        Ok(Self {
            config: config.clone(),
            camera: Camera { width, height, focal_px: FOCAL_PX, mount },
            believed_in_world,
            depth_offset_m: drawn[6] * config.depth_mm / 1000.0,
            seed,
            n_looks: 0,
            renderer: Renderer::new(look),
            memory: vec![unseen; scene.bodies.len()],
        })
    }

    /// What is remembered of a body.
    pub fn memory(&self, body: BodyIndex) -> &Memory {
        &self.memory[usize::from(body.0)]
    }

    /// Takes a body to be where the robot itself has moved it to.
    pub fn remember(&mut self, body: BodyIndex, in_world: Pose) {
        self.memory[usize::from(body.0)].in_world = in_world;
    }

    /// Looks at the table before anything of the robot stands in the picture.
    pub fn look_first(&mut self, scene: &Scene, state: &SceneState) {
        let mut alone = SceneState { joints_rad: None, ..state.clone() };
        alone.gripper_in_world.translation.vector.x += AWAY_M;
        self.look(scene, &alone);
    }

    /// Looks at the table as it is now. What is in the gripper the robot knows without looking, and what is fixed it looks
    /// for until it has found it.
    pub fn look(&mut self, scene: &Scene, state: &SceneState) {
        let seed = self.seed.derive("look", &[self.n_looks]);
        self.n_looks += 1;
        let picture = self.renderer.draw_depths(scene, state, &self.camera);
        let mut rng = seed.rng();
        let cloud = sensor::measure(picture, &self.camera, self.config.sensor, scene.bodies.len(), &mut rng);
        let cloud = cloud.farther_by(self.depth_offset_m);
        let camera_in_world = self.leveled(&cloud.table);
        let eye = camera_in_world.translation.vector;
        for (index, Shown { n_pixels, points }) in cloud.bodies.iter().enumerate() {
            let body = BodyIndex(index as u16);
            let is_fixed = scene.body(body).mobility == Mobility::Fixed;
            if state.held == Some(body) || is_fixed && self.memory[index].is_known {
                continue;
            }
            let in_world = |point: &Vec3| camera_in_world.transform_point(&(*point).into()).coords;
            let points: Vec<Vec3> = points.iter().map(in_world).collect();
            let shape = &scene.body(body).shape;
            let memory = &mut self.memory[index];
            let last = memory.is_known.then_some(memory.in_world);
            let Some(found) = locate::locate(shape, &points, &eye, last.as_ref()) else { continue };
            let whole = FOCAL_PX * FOCAL_PX * locate::outline(shape, &found, &eye);
            if *n_pixels as f32 >= LEAST_SHARE * whole {
                *memory = Memory { in_world: found, is_known: true };
            }
        }
    }

    /// Where the robot takes the camera to be once it has levelled it by the table, whose surface is at height 0: turned
    /// about itself, then raised.
    fn leveled(&self, table: &[Vec3]) -> Pose {
        let believed = self.believed_in_world;
        let in_world = |pose: &Pose| {
            let pose = *pose;
            table.iter().map(move |point| pose.transform_point(&(*point).into()).coords).collect::<Vec<_>>()
        };
        if table.len() < LEAST_TABLE_POINTS {
            return believed;
        }
        let Some([_, slope_x, slope_y]) = plane(&in_world(&believed)) else { return believed };
        let Some(turn) = Rotation::rotation_between(&Vec3::new(-slope_x, -slope_y, 1.0), &Vec3::z()) else {
            return believed;
        };
        let turned = Pose::from_parts(believed.translation, turn * believed.rotation);
        let heights: f32 = in_world(&turned).iter().map(|point| point.z).sum();
        let mut leveled = turned;
        leveled.translation.vector.z -= heights / table.len() as f32;
        leveled
    }
}

/// Height at the origin and slopes along x and y of the plane nearest to points; `None` where they lie on a line.
fn plane(points: &[Vec3]) -> Option<[f32; 3]> {
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for point in points {
        let row = nalgebra::Vector3::new(1.0, f64::from(point.x), f64::from(point.y));
        normal += row * row.transpose();
        right += row * f64::from(point.z);
    }
    let solved = normal.cholesky()?.solve(&right);
    Some([solved[0] as f32, solved[1] as f32, solved[2] as f32])
}

#[cfg(test)]
mod tests {
    use super::plane;
    use crate::geometry::Vec3;

    #[test]
    fn a_plane_is_found_through_its_points() {
        let points: Vec<Vec3> = [(0.0, 0.0), (1.0, 0.0), (0.0, 2.0), (3.0, 1.0)]
            .map(|(x, y)| Vec3::new(x, y, 0.5 + 0.1 * x - 0.2 * y))
            .into();
        let [height, x, y] = plane(&points).unwrap();
        assert!((height - 0.5).abs() < 1e-6 && (x - 0.1).abs() < 1e-6 && (y + 0.2).abs() < 1e-6);
        assert_eq!(plane(&[Vec3::zeros(); 3]), None);
    }
}
