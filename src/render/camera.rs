//! Cameras without distortion: where they are fixed, what they see, and where a point falls in their picture.
//!
//! # Units and frames
//!
//! The camera's frame is right-handed: x right, y down, z away from the camera. Pixel coordinates are those of
//! `foxglove.CameraCalibration`: the middle of the pixel in the upper left corner is (0, 0).

use crate::geometry::{Pose, Rotation, Vec3};
use crate::scene::SceneState;
use crate::task::{Family, FrontView, Layout};

/// What a camera is fixed to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mount {
    /// The world: the camera's pose in it.
    World(Pose),
    /// The gripper: the camera's pose in the gripper's frame.
    Gripper(Pose),
}

/// A camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Width of its pictures, in pixels.
    pub width: u32,
    /// Height of its pictures, in pixels.
    pub height: u32,
    /// Focal length in pixels, the same in both directions.
    pub focal_px: f32,
    /// Where it is.
    pub mount: Mount,
}

/// Angle of view of the third-person camera, across the picture's shorter side.
const FRONT_FOV_RAD: f32 = 0.60;
/// Angle of view of the camera on the gripper.
const WRIST_FOV_RAD: f32 = 1.15;

impl Camera {
    /// A camera with the given angle of view across the shorter side of its picture.
    pub fn new(mount: Mount, [width, height]: [u32; 2], fov_rad: f32) -> Self {
        let focal_px = width.min(height) as f32 / 2.0 / (fov_rad / 2.0).tan();
        Self { width, height, focal_px, mount }
    }

    /// Third person, fixed: before the table and above it, with all that a family's programs reach in its picture.
    pub fn front(family: Family, size_px: [u32; 2]) -> Self {
        Self::front_of(family, Layout::Table, size_px)
    }

    /// The same of a layout: before an arm it is in the picture too.
    pub fn front_of(family: Family, layout: Layout, size_px: [u32; 2]) -> Self {
        let FrontView { eye_m, target_m } = family.front_view(layout);
        Self::new(Mount::World(looking_at(&eye_m.into(), &target_m.into())), size_px, FRONT_FOV_RAD)
    }

    /// First person: behind the gripper's hand, looking at what is between and below its fingers.
    pub fn wrist(size_px: [u32; 2]) -> Self {
        let pose = looking_at(&Vec3::new(-0.1, 0.0, 0.085), &Vec3::new(0.012, 0.0, -0.1));
        Self::new(Mount::Gripper(pose), size_px, WRIST_FOV_RAD)
    }

    /// Where the camera is now.
    pub fn in_world(&self, state: &SceneState) -> Pose {
        match self.mount {
            Mount::World(in_world) => in_world,
            Mount::Gripper(in_gripper) => state.gripper_in_world * in_gripper,
        }
    }

    /// The principal point, in pixels.
    pub fn center_px(&self) -> [f32; 2] {
        [(self.width as f32 - 1.0) / 2.0, (self.height as f32 - 1.0) / 2.0]
    }

    /// The matrix K of the calibration, row by row.
    pub fn matrix(&self) -> [f64; 9] {
        let focal = f64::from(self.focal_px);
        let [x, y] = self.center_px().map(f64::from);
        [focal, 0.0, x, 0.0, focal, y, 0.0, 0.0, 1.0]
    }

    /// Column, row and depth (metres along the camera's z) of a point; `None` when it is not in front of the camera.
    pub fn project(&self, state: &SceneState, point_in_world: &Vec3) -> Option<[f32; 3]> {
        let point = self.in_world(state).inverse_transform_point(&(*point_in_world).into());
        let [center_x, center_y] = self.center_px();
        let column = center_x + self.focal_px * point.x / point.z;
        (point.z > 0.0).then(|| [column, center_y + self.focal_px * point.y / point.z, point.z])
    }

    /// The point (in the world) at a pixel and a depth in metres.
    pub fn point_at(&self, state: &SceneState, [column, row]: [f32; 2], depth_m: f32) -> Vec3 {
        let [center_x, center_y] = self.center_px();
        let ray = Vec3::new((column - center_x) / self.focal_px, (row - center_y) / self.focal_px, 1.0);
        (self.in_world(state) * crate::geometry::Point::from(ray * depth_m)).coords
    }
}

/// The pose of a camera at `eye` that looks at `target` and holds its picture upright. Looking straight down or up, the
/// upper side of the picture is towards y.
pub fn looking_at(eye: &Vec3, target: &Vec3) -> Pose {
    let forward = (target - eye).try_normalize(1e-6).unwrap_or(-Vec3::z());
    let right = forward.cross(&Vec3::z()).try_normalize(1e-4).unwrap_or(Vec3::x());
    let axes = [right, forward.cross(&right), forward];
    let turned = Rotation::from_matrix(&nalgebra::Matrix3::from_columns(&axes));
    // That goes towards the axes step by step, and stays where it begins when they are half a turn away. It is kept
    // where it arrives: places of cameras in recordings of before are its, to the last bit.
    let arrives = (turned * Vec3::z() - forward).norm() + (turned * Vec3::x() - right).norm() < 1e-3;
    Pose::from_parts((*eye).into(), if arrives { turned } else { Rotation::from_basis_unchecked(&axes) })
}
